"""What is said of names, calls and words, where nothing is known too."""

from __future__ import annotations

from functools import cache

import pytest
from editing import MARK, at_mark
from rows import each_of

from fbvm.analysis import describe
from fbvm.analysis.calls import signature
from fbvm.analysis.completion import complete
from fbvm.analysis.fixes import applied, fixes
from fbvm.analysis.hover import hover, hover_of_word, located
from fbvm.analysis.program import Program
from fbvm.analysis.references import Refusal, called, callers, declared_at, references, rename
from fbvm.analysis.tokens import address_hints, tokens
from fbvm.base.areas import parse_address

PLANT = """\
TYPE
    (* how it works *)
    Mode : (Off, Filling := 4); Tank : STRUCT Level : INT := 3; END_STRUCT;
END_TYPE
VAR_GLOBAL Total AT D100 : INT; END_VAR
FUNCTION_BLOCK Pump
VAR_INPUT Level : INT; END_VAR
METHOD Turn : INT
VAR_INST turns : INT; END_VAR
    turns := turns + 1; Turn := turns;
END_METHOD
ACTION Stop: Level := 0; END_ACTION
END_FUNCTION_BLOCK
PROGRAM Main
VAR P1 : Pump; T1 : Tank; t : TON; m : Mode; i : INT; w AT D10 : ARRAY [0..3] OF WORD; END_VAR
VAR CONSTANT deep : INT := 4; END_VAR
    P1(); P1.Stop(); i := P1.Turn(); t(IN := TRUE); m := Filling; i := T1.Level + deep + Total; w[1] := 0;
{line}
LADDER
LD P_On
MOV #1 D200
END_LADDER
END_PROGRAM
"""


@cache
def at(line: str) -> tuple[Program, int]:
    """The plant with a line in which the mark stands."""
    return at_mark(PLANT.replace("{line}", line))


@each_of("name, said", [
    ("ABS", "ABS(IN : T) : T  (T: ANY_NUM)"), ("INT_TO_REAL", "INT_TO_REAL(IN : INT) : REAL"),
    ("TO_REAL", "TO_REAL(IN : ANY) : REAL"),
    ("ADD_TIME", "ADD_TIME(IN1 : TIME, IN2 : TIME)"), ("ADD", "ADD(IN1, IN2)"), ("NOBODY", "NOBODY(...)"),
    ("LEN", "LEN(IN : ANY_STRING) : ANY_INT"),
])
def test_how_a_standard_function_is_called(name: str, said: str) -> None:
    shown = describe.signature(name)
    assert shown == said or name == "LEN" and shown.startswith("LEN(IN : ")
    assert describe.standard(name) == f"```st\n{shown}\n```\n\nStandard function (IEC 61131-3)."


def test_a_function_with_any_number_of_inputs_says_so() -> None:
    assert [", ..)" in describe.signature(name) for name in ("MUX", "MAX", "SEL")] == [True, True, False]


@pytest.mark.slow
@each_of("line, shown", [
    ("T1.Level := i‸;", "VAR i : INT"), ("P1.Turn‸();", "METHOD Pump.Turn : INT"), ("P1.Stop‸();", "ACTION Pump.Stop"),
    ("T1.Level‸ := 1;", "Tank.Level : INT"), ("m := Filling‸;", "Mode#Filling = 4"),
    ("i := deep‸;", "VAR CONSTANT deep : INT := 4"),
    ("Total‸ := 1;", "VAR_GLOBAL Total AT D100 : INT"), ("t.Q‸;", "VAR_OUTPUT Q : BOOL"),
    ("m := Mode‸#Off;", "TYPE Mode : (Off, Filling := 4)"),
    ("w[deep‸] := 1;", "VAR CONSTANT deep : INT := 4"),
])
def test_the_declaration_of_a_name_is_shown(line: str, shown: str) -> None:
    program, offset = at(line)
    found = hover(program, "pump.st", offset)
    assert found is not None and f"```st\n{shown}" in found.markdown, found and found.markdown


def test_library_pins_name_their_library_and_places_their_area() -> None:
    program, offset = at("t.Q‸;")
    found = hover(program, "pump.st", offset)
    assert found is not None and found.markdown.endswith("\n\nLibrary iec")
    program, offset = at("Total‸ := 1;")
    found = hover(program, "pump.st", offset)
    assert found is not None and found.markdown.endswith("\n\nAt D100: data words.")
    program, offset = at("‸;")
    assert hover(program, "pump.st", offset) is None


@each_of("text, word, shown", [
    ("level at D100 here", "D100", "**D100**: data words\n\n`VAR_GLOBAL Total AT D100 : INT`"),
    ("D10", "D10", "**D10**: data words\n\n`VAR w AT D10"),
    ("CIO 5", "", ""), ("the Total of", "Total", "```st\nVAR_GLOBAL Total"), ("a Pump", "Pump", "```st\nFUNCTION_BLOCK Pump"),
    ("a Mode", "Mode", "TYPE Mode"), ("then MOV it", "MOV", "```\nMOV(021)"), ("TON", "TON", "TON"), ("nobody here", "", ""),
])
def test_words_of_other_texts(text: str, word: str, shown: str) -> None:
    program, _ = at(MARK)
    found = hover_of_word(program, text, text.index(word) + 1)
    if not word:
        assert hover_of_word(program, text, len(text) - 1) is None or text == "CIO 5"
    else:
        assert found is not None and (text[found.start:found.end], shown in found.markdown) == (word, True), found


@pytest.mark.slow
@each_of("line, label, active", [
    ("i := 1; ‸", None, None), ("w[‸", None, None), ("P1(Level := w[1‸", None, None),
    ("P1(Level := ABS(‸", "ABS(IN : T) : T  (T: ANY_NUM)", 0),
    ("P1(Level := ABS(1), ‸", "Pump(Level := INT)", None), ("P1((1 + 2) * (3‸", None, None), ("nobody(‸", None, None),
    ("t(IN := (1 > 2), PT := ‸", "TON(IN := BOOL, PT := TIME, Q => BOOL, ET => TIME)", 1),
    ("i := ABS(IN := ‸", "ABS(IN : T) : T  (T: ANY_NUM)", 0),
    ("i := MAX(1, 2, 3, ‸", describe.signature("MAX"), 1), ("i := SEL(IN1 := ‸", describe.signature("SEL"), 2),
    ("P1.Turn(‸", "Pump.Turn() : INT", None), ("P1.Stop(‸", None, None),
    ("ADD_TIME(T#1s, ‸", "ADD_TIME(IN1 : TIME, IN2 : TIME)", 1),
    ("P1('a(', \"b(\", (* c( *) ‸", "Pump(Level := INT)", None), ("i := 1; // P1(\n‸", None, None),
])
def test_the_call_that_is_open(line: str, label: str | None, active: int | None) -> None:
    program, offset = at(line)
    found = signature(program, "pump.st", offset)
    assert (found and found.label, found and found.active) == (label, active)


def test_operands_are_offered_behind_an_instruction() -> None:
    program, offset = at_mark(PLANT.replace("{line}", "").replace("LD P_On", f"LD P1{MARK}"))
    offered = {(item.label, item.kind) for item in complete(program, "pump.st", offset)}
    assert {("i", "variable"), ("P1", "variable"),
    ("Total", "variable")} <= offered and {kind for _, kind in offered} == {"variable"}


def test_before_the_first_check_nothing_is_known() -> None:
    program = Program()
    program.replace("pump.st", PLANT)
    at_name = PLANT.index("P1 : Pump")
    file = program.files["pump.st"]
    assert complete(program, "pump.st", at_name) == [] and signature(program, "pump.st", at_name) is None
    assert hover(program, "pump.st", at_name) is None and hover_of_word(program, "Total", 1) is None
    assert declared_at(program, "pump.st", at_name) is None and references(program, ("pou", "", "PUMP")) == []
    assert tokens(program, file) == [] and address_hints(program, file, 0, len(PLANT)) == [] and located(program, "D100") == []
    key = ("pou", "", "PUMP")
    assert list(callers(program, key)) == [] and list(called(program, key)) == []


def test_who_calls_what_is_no_pou_or_is_gone() -> None:
    program, _ = at(MARK)
    for key in (("global", "", "TOTAL"), ("pou", "", "GONE"), ("variable", "", "MAIN", "P1")):
        assert list(callers(program, key)) == []
    assert list(called(program, ("pou", "", "GONE"))) == []
    assert located(program, "nonsense") == [] and hover_of_word(program, "nonsense", 1) is None
    assert describe.address(parse_address("D5"), ["VAR a", "VAR b"]) == "**D5**: data words\n\n`VAR a`\n\n`VAR b`"


@each_of("dialect, shown, other, offered", [
    ("standard", "**%QW3**: outputs of portable programs", "**%QX6.2**: outputs of portable programs", ("%QW4", "%Q")),
    ("matiec", "**%QW3**: outputs of portable programs, words", "**%QW3.2**: outputs of portable programs, words",
     ("%QW4", "%QW")),
])
def test_an_address_is_described_as_its_plc_has_it(dialect: str, shown: str, other: str, offered: tuple[str, ...]) -> None:
    text = "PROGRAM Main\nVAR lamp AT %QX6.2 : BOOL; speed AT %QW3 : INT; END_VAR\nlamp := %QW3.2;\nEND_PROGRAM\n"
    program = Program(dialect=dialect)
    program.replace("plc.st", text)
    program.check_all()
    found = hover(program, "plc.st", text.index("speed AT %QW3") + len("speed AT %"))
    assert found is not None and found.markdown.split("\n\n")[0] == shown
    found = hover(program, "plc.st", text.index("%QW3.2") + 1)
    assert found is not None and found.markdown.split("\n\n")[0] == other
    assert [each.location is not None and str(each.location) for each in located(program, "%QX6.2")] == ["%QX6.2"]
    assert bool(located(program, "%QW3.2")) == (dialect == "standard")
    half = text.replace("END_VAR", "new AT %")
    program.replace("plc.st", half)
    program.check_all()
    labels = [item.label for item in complete(program, "plc.st", half.index("new AT %") + len("new AT %"))]
    assert set(offered) <= set(labels) and ("%Q" in labels) == (dialect == "standard")


@each_of("text, said", [
    ("PROGRAM Main\n‸;\nEND_PROGRAM\n", "there is no name here that the program declares"),
    ("PROGRAM Main VAR t : TON; END_VAR t(I‸N := TRUE); END_PROGRAM", "IN belongs to the library iec"),
    ("PROGRAM Main\nINITIAL_STEP Wa‸it: END_STEP\nSTEP Go: END_STEP\nTRANSITION FROM Wait TO Go := TRUE; END_TRANSITION\n"
     "TRANSITION FROM Go TO Wait := TRUE; END_TRANSITION\nEND_PROGRAM", "Wait belongs to a chart"),
])
def test_what_cannot_be_renamed(text: str, said: str) -> None:
    program, offset = at_mark(text)
    with pytest.raises(Refusal) as refused:
        rename(program, "pump.st", offset, "Other")
    assert str(refused.value) == said


@each_of("text, titles, made", [
    ("PROGRAM Main\n    ‸n := 2;\nEND_PROGRAM\n", ["Declare n : INT"], "PROGRAM Main\nVAR\n    n : INT;\nEND_VAR\n"),
    ("FUNCTION F : INT\nVAR_INPUT a : INT; END_VAR\n    F := ‸b + a;\nEND_FUNCTION\n", ["Declare b : INT"],
     "VAR_INPUT a : INT; END_VAR\nVAR\n    b : INT;\nEND_VAR\n"),
    ("FUNCTION F : INT\n    F := ‸b;\nEND_FUNCTION\n", ["Declare b : INT"], "FUNCTION F : INT\nVAR\n    b : INT;\nEND_VAR\n"),
    ("VAR_GLOBAL a : INT := ‸b; END_VAR\n", [], ""), ("PROGRAM Main VAR p : TON; END_VAR p := ‸n; END_PROGRAM\n", [], ""),
    ("PROGRAM Main VAR CONSTANT c : INT := 1; END_VAR VAR x : INT; END_VAR x := ‸n + c; END_PROGRAM\n", ["Declare n : INT"],
     "VAR x : INT; n : INT; END_VAR"),
])
def test_where_an_unknown_name_is_declared(text: str, titles: list[str], made: str) -> None:
    program, offset = at_mark(text)
    found = fixes(program, "pump.st", offset, offset)
    assert [fix.title for fix in found] == titles
    assert all(made in applied(program.files["pump.st"].text, fix.edits) for fix in found)


def test_fixes_are_those_of_the_place_that_is_asked_about() -> None:
    text = "PROGRAM Main\nVAR a : INT; END_VAR\n    aa := 1;\n    ab := 2;\nEND_PROGRAM\n"
    program, _ = at_mark(text + MARK)
    first, second = text.index("aa"), text.index("ab")

    def asked(start: int, end: int) -> list[str]:
        return [fix.title for fix in fixes(program, "pump.st", start, end) if "Declare" in fix.title or "Write" in fix.title]

    for start, end in ((first, first), (first + 1, first + 1), (first + 2, first + 2), (0, first)):
        assert len(asked(start, end)) == 1, (start, end)
    assert asked(0, first - 1) == [] == asked(first + 3, second - 1) and len(asked(0, len(text))) == 2


def test_a_variable_that_is_called_like_a_list_of_globals_has_no_names_of_it() -> None:
    for declared, expected in (("n", True), ("pump", False)):
        program, offset = at_mark("VAR_GLOBAL Total : INT; END_VAR\n"
                                  f"PROGRAM Main\nVAR {declared} : INT; END_VAR\n    pump.{MARK}\nEND_PROGRAM\n", "codesys")
        assert ("Total" in [item.label for item in complete(program, "pump.st", offset)]) is expected
