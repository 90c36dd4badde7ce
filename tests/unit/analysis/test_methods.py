"""Methods, properties, interfaces, THIS and SUPER in an editor."""

from __future__ import annotations

import pytest
from editing import MARK, at_mark
from rows import each_of

from fbvm.analysis.calls import signature
from fbvm.analysis.completion import complete
from fbvm.analysis.hover import hover
from fbvm.analysis.outline import outline
from fbvm.analysis.program import Program
from fbvm.analysis.references import Refusal, applied, called, callers, declared_at, references, rename, use_at
from fbvm.analysis.tokens import tokens

PLANT = """\
INTERFACE Motor
METHOD Turn : INT
VAR_INPUT amount : INT; END_VAR
END_METHOD
END_INTERFACE

FUNCTION_BLOCK Base IMPLEMENTS Motor
VAR held : INT; END_VAR
METHOD Turn : INT
VAR_INPUT amount : INT; END_VAR
VAR_INST calls : INT; END_VAR
    calls := calls + 1;
    held := held + amount;
    Turn := held;
END_METHOD
PROPERTY Level : INT
GET
    Level := held;
END_GET
SET
    held := Level;
END_SET
END_PROPERTY
METHOD PRIVATE Secret
    held := THIS.Turn(1);
END_METHOD
END_FUNCTION_BLOCK

FUNCTION_BLOCK Fast EXTENDS Base
METHOD OVERRIDE Turn : INT
VAR_INPUT amount : INT; END_VAR
    Turn := SUPER.Turn(2 * amount) + held;
END_METHOD
END_FUNCTION_BLOCK

PROGRAM Main
VAR quick : Fast; some : Motor; n : INT; END_VAR
    some := quick;
    n := quick.Turn(amount := 3) + some.Turn(1);
    quick.Level := n;
    n := quick.Level;
END_PROGRAM
"""


def plant(before: str, word: str) -> tuple[Program, int]:
    """The plant, and the place of a word that stands in or behind a piece of its text."""
    at = PLANT.index(before)
    at += PLANT[at:].index(word)
    return at_mark(PLANT[:at] + MARK + PLANT[at:])


def at_line(line: str) -> tuple[Program, int]:
    """The plant with a line more at the end of Main, in which the mark stands."""
    return at_mark(PLANT.replace("    n := quick.Level;\n", f"    n := quick.Level;\n    {line}\n"))


@pytest.mark.slow
@each_of("before, word, line, count", [
    ("quick.Turn", "Turn", 30, 9),
    ("some.Turn", "Turn", 2, 9),
    ("SUPER.Turn", "Turn", 9, 9),
    ("THIS.Turn", "Turn", 9, 9),
    ("Turn := held", "Turn", 9, 9),
    ("quick.Level := n", "Level", 16, 5),
    ("held := Level", "Level", 16, 5),
    ("* amount) + held", "held", 8, 8),
    ("calls + 1", "calls", 11, 3),
    ("(amount := 3", "amount", 31, 3),
    ("EXTENDS Base", "Base", 7, 2),
    ("IMPLEMENTS Motor", "Motor", 1, 3),
])
def test_where_it_is_declared_and_where_it_stands(before: str, word: str, line: int, count: int) -> None:
    program, offset = plant(before, word)
    declared = declared_at(program, "pump.st", offset)
    used = use_at(program, "pump.st", offset)
    assert declared is not None and used is not None
    place = program.place(declared.source)
    assert place is not None
    assert PLANT[:place[1] + declared.node.start].count("\n") + 1 == line
    assert len(references(program, used[1].key)) == count


@pytest.mark.slow
def test_a_method_is_renamed_with_its_overrides_and_its_interface() -> None:
    program, offset = plant("quick.Turn", "Turn")
    made = applied(rename(program, "pump.st", offset, "Rotate"), "Rotate")["pump.st"]
    assert made == PLANT.replace("Turn", "Rotate")
    with pytest.raises(Refusal):
        rename(program, "pump.st", offset, "held")


def test_a_property_is_renamed_with_both_accessors() -> None:
    program, offset = plant("quick.Level", "Level")
    assert applied(rename(program, "pump.st", offset, "Height"), "Height")["pump.st"] == PLANT.replace("Level", "Height")


def test_what_an_instance_has_behind_a_point() -> None:
    program, offset = at_line(f"quick.{MARK};")
    found = {each.label: (each.kind, each.detail) for each in complete(program, "pump.st", offset)}
    assert found["Turn"] == ("method", "INT") and found["Level"] == ("property", "INT")
    assert "Secret" not in found
    program, offset = at_line(f"some.{MARK};")
    assert [each.label for each in complete(program, "pump.st", offset)] == ["Turn"]


def test_a_method_without_a_result_has_nothing_behind_a_point() -> None:
    program, offset = at_line(f"quick.Secret.{MARK};")
    assert complete(program, "pump.st", offset) == []


@pytest.mark.slow
def test_what_can_be_named_in_a_method() -> None:
    program, offset = plant("held := held + amount", "held")
    labels = [each.label for each in complete(program, "pump.st", offset)]
    assert {"amount", "held", "Turn", "Level", "Secret"} <= set(labels)
    program, offset = at_mark(PLANT.replace("THIS.Turn(1)", f"THIS.{MARK}"))
    assert {"Turn", "Level", "Secret"} <= {each.label for each in complete(program, "pump.st", offset)}


@each_of("line, label", [
    (f"n := quick.Turn({MARK});", "Fast.Turn(amount := INT) : INT"),
    (f"n := some.Turn(amount := {MARK});", "Motor.Turn(amount := INT) : INT"),
])
def test_how_a_method_is_called(line: str, label: str) -> None:
    program, offset = at_line(line)
    found = signature(program, "pump.st", offset)
    assert found is not None
    assert (found.label, found.active) == (label, 0)


def test_what_is_shown_of_a_method() -> None:
    program, offset = plant("quick.Turn", "Turn")
    shown = hover(program, "pump.st", offset)
    assert shown is not None
    assert "METHOD Fast.Turn : INT\n    VAR_INPUT amount : INT;" in shown.markdown
    program, offset = plant("n := quick.Level", "Level")
    shown = hover(program, "pump.st", offset)
    assert shown is not None
    assert "PROPERTY Base.Level : INT" in shown.markdown


def test_methods_and_properties_stand_in_the_outline() -> None:
    program, _ = plant("quick.Turn", "Turn")
    base = next(each for each in outline(program.files["pump.st"]) if each.name == "Base")
    assert [(each.kind, each.name, each.detail) for each in base.children] == [
        ("variable", "held", "INT (VAR)"), ("METHOD", "Turn", "INT"), ("METHOD", "Secret", ""), ("PROPERTY", "Level", "INT")]
    assert [each.name for each in base.children[1].children] == ["amount", "calls"]


def test_methods_have_a_colour_of_their_own() -> None:
    program, offset = plant("quick.Turn", "Turn")
    assert next(each.type for each in tokens(program, program.files["pump.st"]) if each.start == offset) == "method"


def test_who_calls_a_method() -> None:
    program, offset = plant("METHOD OVERRIDE Turn", "Turn")
    used = use_at(program, "pump.st", offset)
    assert used is not None
    assert [key for key, _ in callers(program, used[1].key)] == [("pou", "", "MAIN")]
    assert ("method", "", "BASE", "TURN") in [key for key, _ in called(program, used[1].key)]
