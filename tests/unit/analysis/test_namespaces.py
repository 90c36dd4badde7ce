"""Names of namespaces in a program that is edited: definitions, places, renaming, what can be written, changes."""

from __future__ import annotations

from editing import MARK, at_mark, at_word, check_declaration
from rows import each_of

from fbvm.analysis.completion import complete
from fbvm.analysis.outline import outline
from fbvm.analysis.program import Program
from fbvm.analysis.references import rename

OPENED = """\
NAMESPACE Plant
TYPE Mode : (Idle, Busy); END_TYPE
FUNCTION Twice : INT
VAR_INPUT x : INT; END_VAR
    Twice := 2 * x;
END_FUNCTION
"""
PLANT = f"""\
USING Plant;
{OPENED}NAMESPACE Pumps
FUNCTION_BLOCK Pump
VAR_OUTPUT q : INT; m : Mode; END_VAR
    q := q + Twice(1);
    Run();
METHOD Run
VAR_INPUT y : INT; END_VAR
    m := Mode#Busy;
END_METHOD
END_FUNCTION_BLOCK
END_NAMESPACE
END_NAMESPACE
FUNCTION_BLOCK Pump
VAR_OUTPUT q : INT; END_VAR
    q := Plant.Twice(3);
END_FUNCTION_BLOCK
PROGRAM Main
VAR p : Plant.Pumps.Pump; o : Pump; n : INT; END_VAR
    p(); o(); n := Twice(x := p.q); p.Run(y := n);
END_PROGRAM
"""


def plant(before: str, word: str) -> tuple[Program, int]:
    """The plant, and the place of a word that stands behind a piece of its text."""
    return at_word(PLANT, before, word)


@each_of("before, word, line, count", [
    ("p : Plant.Pumps", "Pump;", 9, 2),
    ("o : Pump", "Pump", 20, 2),
    ("Plant.Twice", "Twice", 4, 5),
    ("n := Twice", "Twice", 4, 5),
    ("Twice(x", "x", 5, 3),
    ("p.q", "q", 10, 4),
    ("Mode#Busy", "Mode", 3, 3),
    ("Mode#Busy", "Busy", 3, 2),
    ("p.Run", "Run", 13, 3),
    ("p.Run", "y", 14, 2),
])
def test_a_name_leads_to_its_declaration_in_its_namespace(before: str, word: str, line: int, count: int) -> None:
    check_declaration(PLANT, before, word, line, count)


def test_what_is_renamed_is_what_the_namespace_declares() -> None:
    program, offset = plant("p : Plant.Pumps", "Pump;")
    places = rename(program, "pump.st", offset, "Motor")
    assert [PLANT[:place.start].count("\n") + 1 for place in places] == [9, 25]


def test_the_outline_has_what_stands_in_namespaces() -> None:
    program, _ = plant("p()", "p")
    spaces = [symbol for symbol in outline(program.files["pump.st"]) if symbol.kind == "NAMESPACE"]
    assert [(each.name, [child.name for child in each.children]) for each in spaces] == [("Plant", ["Mode", "Twice", "Pumps"])]


def test_what_can_be_written_inside_of_a_namespace() -> None:
    program, offset = at_mark(PLANT.replace("m := Mode#Busy", f"{MARK}m := Mode#Busy"))
    assert {"y", "q", "m", "Run"} <= {each.label for each in complete(program, "pump.st", offset)}


SECRET = PLANT.replace("TYPE Mode", "FUNCTION INTERNAL Hidden : INT\n    Hidden := 1;\nEND_FUNCTION\nTYPE Mode")


@each_of("before, written, offered", [
    ("p(); o()", "n := Plant.", {"Twice": "function", "Mode": "type", "Pumps": "namespace"}),
    ("p(); o()", "n := plant.pumps.", {}), ("p(); o()", "n := Plant.Pumps.", {}), ("p(); o()", "n := Plant.Nothing.", {}),
    ("n : INT; END_VAR\n    p", "z : Plant.", {"Mode": "type", "Pumps": "namespace"}),
    ("n : INT; END_VAR\n    p", "z : ARRAY [0..1] OF Plant.Pumps.", {"Pump": "block"}),
    ("n : INT; END_VAR\n    p", "z : INT := Plant.", {"Twice": "function", "Mode": "type", "Pumps": "namespace"}),
    ("m := Mode#Busy", "Plant.", {"Twice": "function", "Hidden": "function", "Mode": "type", "Pumps": "namespace"}),
    ("m := Mode#Busy", "Pumps.", {}),
])
def test_what_can_be_written_behind_a_namespace(before: str, written: str, offered: dict[str, str]) -> None:
    program, offset = at_mark(SECRET.replace(before, f"{MARK}{before}"))
    program.replace("pump.st", SECRET[:offset] + written + SECRET[offset:])
    found = complete(program, "pump.st", offset + len(written))
    assert {each.label: each.kind for each in found} == offered
    assert all(each.insert == ("Twice($0)" if each.label == "Twice" else each.insert) for each in found)


def test_types_are_offered_with_their_namespace() -> None:
    program, offset = at_mark(PLANT.replace("n : INT; END_VAR", f"n : {MARK}INT; END_VAR"))
    labels = {each.label for each in complete(program, "pump.st", offset)}
    assert {"Plant.Mode", "Plant.Pumps.Pump", "Pump"} <= labels and "Mode" not in labels


def test_names_are_looked_up_anew_when_a_using_changes() -> None:
    program, _ = plant("p()", "p")
    assert program.diagnostics("pump.st") == []
    program.replace("pump.st", PLANT.replace("USING Plant;", ""))
    assert not program.check_changes()
    program.check_all()
    assert [each.code for each in program.diagnostics("pump.st")] == ["S0401"]


OWN = f"""\
{OPENED}END_NAMESPACE
FUNCTION_BLOCK Pump USING Plant;
VAR_OUTPUT q : Mode; n : INT; END_VAR
    q := Mode#Busy; n := Twice(x := 1);
END_FUNCTION_BLOCK
CLASS Motor
METHOD PUBLIC Run : INT USING Plant;
    Run := Twice(x := 2);
END_METHOD
END_CLASS
"""


@each_of("before, word, line, count", [
    ("q : Mode", "Mode", 2, 3), ("Mode#Busy", "Mode", 2, 3), ("Mode#Busy", "Busy", 2, 2), ("n := Twice", "Twice", 3, 4),
    ("Run := Twice", "Twice", 3, 4), ("Twice(x := 2)", "x", 4, 4),
])
def test_a_using_of_a_pou_or_of_a_method_counts_in_it(before: str, word: str, line: int, count: int) -> None:
    check_declaration(OWN, before, word, line, count)
