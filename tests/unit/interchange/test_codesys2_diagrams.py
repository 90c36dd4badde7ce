"""Ladder and FBD of exports of CODESYS 2.3 become rungs and statements that do what they show."""

from __future__ import annotations

import pytest
from codesys2_files import assigned, box, contact, export, instance, operand, row, rung

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.engine.native.engine import available
from fbvm.interchange.codesys2.exports import as_source
from fbvm.machine.plc import Plc

ENGINES = ("python", "native") if available() else ("python",)


def run(text: str, names: str, *scans: str) -> list[list[list[object]]]:
    """The values of variables behind each scan, on each engine; `a c` in front of a scan says which inputs are TRUE."""
    source, said = as_source(Source("a.exp", text))
    assert said == [], [d.render() for d in said]
    assert source.text.count("\n") == text.count("\n")
    compiled = compile_sources([source], runnable=True, dialect="codesys2", lint=False)
    assert compiled.image is not None, [d.render() for d in compiled.errors]
    seen = []
    for engine in ENGINES:
        plc = Plc(compiled.image, 20_000_000, engine=engine)
        rows = []
        for given in scans:
            for name in "abc":
                plc.write(f"PLC_PRG.{name}", name in given.split())
            assert plc.scan() is None
            rows.append([plc.read(f"PLC_PRG.{name}") for name in names.split()])
        seen.append(rows)
    return seen


def test_contacts_and_coils_are_rungs() -> None:
    text = export(rung(row("AND", row("OR", contact("a"), contact("p")), contact("b", "_NEGATIV")), "p", "-q"),
                  rung(contact("c"), "set m.0", "reset m.1"))
    source, _ = as_source(Source("a.exp", text))
    assert source.text.count("RUNG") == 1 and "RUNG 1 Says 0" in source.text
    assert "IF c THEN m.0 := TRUE; m.1 := FALSE; END_IF;" in source.text
    assert text.split("\n")[source.text[:source.text.index("LADDER")].count("\n")] == "_NETWORK"
    for rows in run(text, "p q m", "", "a", "", "b", "c"):
        assert rows == [[False, True, 0], [True, False, 0], [True, False, 0], [False, True, 0], [False, True, 1]]


def test_members_stand_in_rungs_and_addresses_in_statements() -> None:
    text = export(rung(row("OR", contact("t.Q"), row("AND", contact("b"), contact("a"))), "p"), rung(contact("%IX0.0"), "q"))
    source, _ = as_source(Source("a.exp", text))
    assert "RUNG 1" in source.text and "q := %IX0.0;" in source.text
    for rows in run(text, "p q", "b", "a b"):
        assert rows == [[False, False], [True, False]]


def test_blocks_in_a_row_of_contacts_take_and_pass_the_power_assumed() -> None:
    text = export(rung(row("AND", contact("a"), instance("t", "TON", ("_EMPTY", operand("t#20ms"))), contact("b")), "p"))
    for rows in run(text, "p", "a b", "a", "a b", "b"):
        assert rows == [[False], [False], [True], [False]]


def test_boxes_with_en_are_executed_while_there_is_power_and_coils_get_it_as_it_was_assumed() -> None:
    boxes = (assigned(box("ADD", operand("n"), operand("1"), enabled="_ENABLED"), "n"),
             assigned(box("GT", operand("n"), operand("1"), enabled="_ENABLED"), "a"))
    for rows in run(export(rung(contact("a"), "p", boxes=boxes)), "n p a", "a", "", "a"):
        assert rows == [[1, True, False], [1, False, False], [2, True, True]]


def test_outputs_that_store_a_value_do_not_change_it_for_each_other() -> None:
    text = export(assigned(box("AND", operand("a"), box("NOT", operand("p"))), "set p", "set q", "reset c"), language="FBD")
    for rows in run(text, "p q c", "c", "a c", "a c"):
        assert rows == [[False, False, True], [True, True, False], [True, True, True]]


def test_values_of_fbd_are_statements() -> None:
    double = instance("d", "Double", (operand("n"), operand("b")), "q")
    text = export(assigned(box("ADD", operand("n"), operand("3"), box("MUL", operand("n"), operand("2"))), "n", "m"),
                  assigned(double, "k"),
                  assigned(box("AND", operand("a"), box("NOT", operand("b")), sign="_NEGATIV"), "p", "set c"), language="FBD")
    source, _ = as_source(Source("a.exp", text))
    assert "n := n + 3 + n * 2;" in source.text and "m := n;" in source.text
    for rows in run(text, "n m k q p c", "", "a", "b"):
        assert rows == [[3, 3, 6, False, True, True], [12, 12, 24, False, False, False], [39, 39, 78, True, True, True]]


@pytest.mark.parametrize(("text", "message", "at"), [
    (export("_JUMP somewhere"), "PLC_PRG is a diagram (LD), which is not read from an export as text: `_JUMP` stands in it",
     "_JUMP"),
    (export(rung(contact("???"), "p")), "an operand is missing in it", "???"),
    (export(assigned(instance("x", "Other", ()), "p"), language="FBD"), "nothing in the file declares Other", "_FUNCTIONBLOCK"),
    (export(assigned(box("ADD", operand("n"), operand("1"), enabled="_ENABLED"), "n"), language="FBD"),
     "a box with EN stands outside of ENABLELIST", "_OPERATOR"),
    (export(assigned(box("ADD", operand("n"), "_EMPTY"), "n"), language="FBD"), "an input of a function has no operand",
     "_EMPTY"),
    (export(rung(contact("a"), boxes=(assigned(box("ABS", operand("n"), enabled="_ENABLED"), "n").replace(
        "_POSITIV _OUTPUTS", "_NEGATIV _OUTPUTS"),))), "a box without EN stands among those with EN", "_OPERATOR"),
    (export("", language="CFC"), "only ladder and FBD are read", "_CFC_BODY"),
    (export(rung(contact("a"), "p")).replace("_NETWORKS : 1", "_NETWORKS : 2"), "it ends too early", "END_PROGRAM"),
])
def test_what_is_not_known_is_refused_where_it_stands(text: str, message: str, at: str) -> None:
    source, said = as_source(Source("a.exp", text))
    error, = said
    assert error.code == "X0203" and message in error.message
    assert text[error.start:].startswith(at)
    assert "_BODY" not in source.text and source.text.count("\n") == text.count("\n")
