"""What the outline has of actions, properties and rungs, with their places; which lines can be folded; subroutines of rungs."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from editing import at_mark
from rows import each_of

from fbvm.analysis.completion import complete
from fbvm.analysis.outline import Symbol, folds, outline
from fbvm.analysis.parts import File

SUBROUTINE = """\
LADDER
RUNG
SBN 3
RUNG opens it
LD a
OUT a
RUNG
RET
RUNG
LD a
SBS 3
END_LADDER
"""


def shown(text: str, symbols: list[Symbol], indent: str = "") -> Iterator[str]:
    """A line for each symbol: kind and name, the first and last line from 1, and what stands at the place of its name."""
    for each in symbols:
        assert each.start <= each.name_start <= each.name_end <= each.end
        first, last = (text.count("\n", 0, at) + 1 for at in (each.start, each.end))
        yield f"{indent}{each.kind} {each.name}, {first} to {last}, {text[each.name_start:each.name_end]}"
        yield from shown(text, each.children, indent + "  ")


@each_of("text, lines", [
    ("PROGRAM Main\nVAR a : BOOL; END_VAR\n" + SUBROUTINE + "END_PROGRAM\n", [
        "PROGRAM Main, 1 to 15, Main", "  variable a, 2 to 2, a", "  rung rung 1, 4 to 5, RUNG",
        "  rung rung 2 opens it, 6 to 8, RUNG opens it", "  rung rung 3, 9 to 10, RUNG", "  rung rung 4, 11 to 13, RUNG"]),
    ("PROGRAM Main\nVAR a : BOOL; END_VAR\n;\nACTION Work:\nLADDER\nRUNG\nLD a\nOUT a\nEND_LADDER\nEND_ACTION\n"
     "END_PROGRAM\n", [
        "PROGRAM Main, 1 to 11, Main", "  variable a, 2 to 2, a", "  ACTION Work, 4 to 10, Work",
        "    rung rung 1, 6 to 8, RUNG"]),
    ("PROGRAM Main\n;\nACTION Work:\nINITIAL_STEP One: END_STEP\nEND_ACTION\nEND_PROGRAM\n", [
        "PROGRAM Main, 1 to 6, Main", "  ACTION Work, 3 to 5, Work", "    step One, 4 to 4, One"]),
    ("FUNCTION_BLOCK B\nPROPERTY Speed : INT\nGET\nVAR now : INT; END_VAR\nEND_GET\nSET\nVAR old : INT; END_VAR\nEND_SET\n"
     "END_PROPERTY\nEND_FUNCTION_BLOCK\n", [
         "FUNCTION_BLOCK B, 1 to 10, B", "  PROPERTY Speed, 2 to 8, Speed", "    variable now, 4 to 4, now",
         "    variable old, 7 to 7, old"]),
    ("PROGRAM Main\nACTION", ["PROGRAM Main, 1 to 2, Main"]),
    ("PROGRAM Main\nACTION Work:\n;", ["PROGRAM Main, 1 to 3, Main", "  ACTION Work, 2 to 3, Work"]),
], ids=lambda case: case[1][-1])  # fmt: skip
def test_the_outline_has_what_stands_in_actions_and_accessors(text: str, lines: list[str]) -> None:
    """A subroutine of rungs is no action that anybody wrote: its rungs stand among those of the LADDER."""
    assert list(shown(text, outline(File("x.st", text)))) == lines


@each_of("text, lines", [
    ("TYPE A : (One,\nTwo)\n;\nEND_TYPE\n", [(0, 2, "")]), ("TYPE A : (One, Two);\nEND_TYPE\n", []),
    ("{region}\n{endregion\n}\n", [(0, 2, "region")]), ("{region}{endregion}\n", []),
    ("// a\n// b\n;", [(0, 1, "comment")]), ("// a\n//\n\n// c\n", [(0, 1, "comment")]), ("//\n", []),
    ("(* a\n*)", [(0, 1, "comment")]), ("/* a\n\n*/ (*\n*)", [(0, 2, "comment"), (2, 3, "comment")]), ("", []),
])  # fmt: skip
def test_a_fold_ends_at_the_line_of_the_last_character(text: str, lines: list[tuple[int, int, str]]) -> None:
    assert [(each.first, each.last, each.kind) for each in folds(File("x.st", text))] == lines


@pytest.mark.slow
@each_of("text", [
    "PROGRAM Main\nVAR a : BOOL; END_VAR\n" + SUBROUTINE + "‸\nACTION Stop: ; END_ACTION\nEND_PROGRAM\n",
    "FUNCTION_BLOCK B\nVAR a : BOOL; END_VAR\n" + SUBROUTINE + "ACTION Stop: ; END_ACTION\nEND_FUNCTION_BLOCK\n"
    "PROGRAM Main\nVAR b1 : B; END_VAR\n    b1.‸\nEND_PROGRAM\n"])
def test_subroutines_of_rungs_are_not_offered_as_actions(text: str) -> None:
    program, offset = at_mark(text)
    assert [each.label for each in complete(program, "pump.st", offset) if each.kind == "action"] == ["Stop"]
