"""Comments of declarations, read from text alone."""

from __future__ import annotations

from rows import each_of

from fbvm.analysis.comments import declared_comments

SOURCE = """
// What the pump does
PROGRAM Main
VAR_INPUT Level : INT; // of the tank, mm
END_VAR
VAR
    Pump : BOOL;
    High AT D10 : INT := 90;    (* switches it off *)
    Low, Lowest : INT;          // mm
    a : INT; b : INT := 3;      // of both

    (* above
     * both lines *)
    Above : BOOL;
    // one
    // two
    Count : UINT;
END_VAR
Pump := Level > High; // Pump : no declaration
END_PROGRAM
TYPE Valve : STRUCT
    Open : BOOL; // the limit switch
END_STRUCT END_TYPE
VAR_GLOBAL RETAIN Alarms : INT; // counted
    Alarm : BOOL;   // for all
END_VAR
"""


@each_of(("owner", "name", "said"), [
    ("MAIN", "LEVEL", "of the tank, mm"), ("MAIN", "HIGH", "switches it off"), ("MAIN", "LOW", "mm"), ("MAIN", "LOWEST", "mm"),
    ("MAIN", "A", "of both"), ("MAIN", "B", "of both"), ("MAIN", "ABOVE", "above\nboth lines"), ("MAIN", "COUNT", "one\ntwo"),
    ("VALVE", "OPEN", "the limit switch"),
    ("", "ALARM", "for all"), ("", "ALARMS", "counted"),
])  # fmt: skip
def test_a_comment_stands_behind_or_above_what_it_belongs_to(owner: str, name: str, said: str) -> None:
    assert declared_comments([SOURCE])[owner, name] == said


def test_the_comment_of_the_line_before_and_of_a_statement_belong_to_nothing_else() -> None:
    assert ("MAIN", "PUMP") not in declared_comments([SOURCE])
