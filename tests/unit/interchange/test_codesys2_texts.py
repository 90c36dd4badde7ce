"""Networks of CODESYS 2.3 beside the rungs and statements that they become, and those that are refused."""

from __future__ import annotations

import pytest
from codesys2_files import assigned, box, contact, export, instance, operand, row, rung
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.interchange.codesys2.diagrams import MOST_DEEP
from fbvm.interchange.codesys2.exports import as_source
from fbvm.interchange.codesys2.importing import import_codesys2, read_export
from fbvm.interchange.codesys2.objects import _name_before, _named
from fbvm.interchange.cx.write.markers import renumbered

EN = "_ENABLED"
GREATER = box("GT", operand("n"), operand("1"))
NETWORKS = {
    # networks: what stands in place of them, without their comments
    (assigned(box("ABS", operand("n")), "m"),): "m := ABS(n);",
    (assigned(box("NOT", operand("a")), "p"),): "p := NOT a;",
    (assigned(box("NOT", operand("a"), operand("b")), "p"),): "p := NOT(a, b);",
    (assigned(box("AND", operand("a"), operand("b"), operand("c")), "p"),): "p := a AND b AND c;",
    (assigned(box("SUB", operand("n"), operand("m")), "k"),): "k := n - m;",
    (assigned(box("SUB", operand("n"), operand("m"), operand("1")), "k"),): "k := SUB(n, m, 1);",
    (assigned(box("GT", operand("n"), operand("m"), sign="_NEGATIV"), "p"),): "p := NOT (n > m);",
    (assigned(operand("TRUE"), "p", "set q", "reset c"),):
        "p := TRUE; IF p THEN q := TRUE; c := FALSE; END_IF;",
    (assigned(operand("TRUE"), "set q", "reset c"),): "q := TRUE; c := FALSE;",
    (assigned(operand("a"), "p", "-q", "set c"),): "p := a; q := NOT p; IF NOT q THEN c := TRUE; END_IF;",
    (assigned(operand("FALSE"), "p"),): "p := FALSE;",
    (assigned("_EMPTY", "p"),): "p := TRUE;",
    (rung(row("OR", contact("a"), GREATER), "p"),): "p := a OR n > 1;",
    (rung(row("AND", contact("a", "_NEGATIV"), row("OR", contact("b"), GREATER)), "p"),): "p := NOT a AND (b OR n > 1);",
    (rung(row("AND", contact("a"), contact("TRUE")), "p"),): "p := a;",
    (assigned(operand("a"), "p").replace(f"{operand('a')} _EXPRESSION _POSITIV", f"{operand('a')} _EXPRESSION _NEGATIV"),):
        "p := NOT a;",
    (assigned(box("GT", operand("n"), operand("1")), "p").replace("_POSITIV _OUTPUTS", "_NEGATIV _OUTPUTS"),):
        "p := NOT (n > 1);",
    (rung(row("OR", contact("a"), row("AND", contact("b"), contact("c", "_NEGATIV"))), "p", "reset q"),):
        "LADDER RUNG 1 Says 0 LD a LD b ANDNOT c OR LD OUT p RSET q END_LADDER",
    (rung(row("AND", row("OR", contact("a"), contact("b")), row("OR", contact("c"), contact("p"))), "set q", "-p"),):
        "LADDER RUNG 1 Says 0 LD a OR b LD c OR p AND LD SET q OUTNOT p END_LADDER",
    (rung(row("AND", row("OR", contact("a"))), "p"),): "LADDER RUNG 1 Says 0 LD a OUT p END_LADDER",
    (rung(contact("a"), boxes=(assigned(box("ADD", operand("n"), operand("1"), enabled=EN), "n"),)),):
        "IF a THEN n := n + 1; END_IF;",
    (rung("_EMPTY", boxes=(assigned(box("ADD", operand("n"), operand("1"), enabled=EN), "n"),)),): "n := n + 1;",
    (rung(row("OR", contact("a"), contact("b")), "p", boxes=(assigned(box("ABS", operand("n"), enabled=EN), "n", "m"),)),):
        "Power_1 := a OR b; IF Power_1 THEN n := ABS(n); m := n; END_IF; p := Power_1;",
    (assigned(instance("d", "Double", (operand("n"),), "q"), "k"),): "d(x := n); q := d.odd; k := d.y;",
    (assigned(instance("d", "Double", (operand("n"), operand("a")), "m", "q"), "k"),):
        "d(x := n, more := a); m := d.y; q := d.odd; k := d.y;",
    (rung(row("AND", contact("a"), instance("t", "TON", ("_EMPTY", operand("t#1s")))), "p"),):
        "t(IN := a, PT := t#1s); p := t.Q;",
    (assigned(instance("t", "TON", ("_EMPTY", operand("t#1s"))), "p"),): "t(IN := TRUE, PT := t#1s); p := t.Q;",
    (rung(row("AND", contact("a"), instance("t", "TON", ("_EMPTY", operand("t#1s"))))),): "t(IN := a, PT := t#1s);",
    (rung(row("OR", contact("a"), instance("t", "TON", ("_EMPTY",)))),): "t(IN := TRUE);",
    (assigned(operand("%IX0.1"), "set q", "_EMPTY", "p", "reset c"),): "p := %IX0.1; IF p THEN q := TRUE; c := FALSE; END_IF;",
    (instance("d", "Double", (operand("n"),)).join(["_ASSIGN ", " _EXPRESSION _POSITIV _OUTPUTS:0 "]),): "d(x := n);",
}  # fmt: skip


def statements(*networks: str) -> str:
    source, said = as_source(Source("a.exp", export(*networks)))
    assert said == [], [found.render() for found in said]
    lines = source.text.partition("END_DECLARATION")[2].partition("\n")[2].partition("END_PROGRAM")[0].split("\n")
    kept = [" ".join(line.split()) for line in lines if line.strip() and not line.startswith(("// Says", "VAR_TEMP"))]
    return " ".join(kept)


@each_of("networks", NETWORKS, ids=lambda networks: NETWORKS[networks])
def test_a_network_becomes_rungs_or_statements(networks: tuple[str, ...]) -> None:
    assert statements(*networks) == NETWORKS[networks]


@each_of("name", ["A1", "D5", "T1", "c5", "H3", "CIO1", "DR0", "TR0", "tr15", "P_On", "%IX0.0", "n.0", "list[i]", "a.b[1].2"])
def test_a_name_that_a_rung_reads_otherwise_stands_in_statements(name: str) -> None:
    assert statements(rung(contact(name), "p")) == f"p := {name};" and statements(rung(contact("a"), name)) == f"{name} := a;"
    assert statements(rung(row("AND", contact("a"), contact(name, "_NEGATIV")), "p")) == f"p := a AND NOT {name};"


@each_of("name", ["A", "TR", "TRUE1", "P_On_1", "t.Q", "list[3].on", "D5_on"])
def test_other_names_stand_in_rungs(name: str) -> None:
    assert statements(rung(contact(name), name)) == f"LADDER RUNG 1 Says 0 LD {name} OUT {name} END_LADDER"


REFUSED = {
    "an input of a function has no operand": assigned(box("ADD", "_EMPTY", operand("n")), "m"),
    "nothing comes of a network": assigned(operand("n")),
    "a box without EN stands among those with EN": rung(contact("a"), boxes=(assigned(box("ABS", operand("n")), "n"),)),
    "Double has other inputs or outputs than its box": assigned(
        instance("d", "Double", (operand("n"), operand("a"), operand("b"))), "k"),
    "TON has other inputs or outputs than its box": assigned(instance("t", "TON", (operand("a"),), "p", "n", "q"), "p"),
    "a box with EN stands outside of ENABLELIST": assigned(box("ABS", operand("n"), enabled=EN), "m"),
    "`_END_PROGRAM` stands in it": "_END_PROGRAM",
    "`_OUTPUTS` stands in it": assigned(operand("a"), "p").replace("_OUTPUTS:1", "_OUTPUTS"),
    "`n` stands in it": assigned(operand("a"), "p") + " n",
    "it ends too early": assigned(operand("a")).replace("_OUTPUTS:0", ""),
    "`END_OF` stands in it": assigned(operand("a")).replace("_OUTPUTS:0", "_OUTPUTS:" + "9" * 5000) + " END_OF",
    "`_MAYBE` stands in it": assigned(box("ABS", operand("n"), sign="_MAYBE"), "m"),
}  # fmt: skip


@pytest.mark.parametrize("said", REFUSED)
def test_a_network_without_a_meaning_is_refused(said: str) -> None:
    _, found = as_source(Source("a.exp", export(REFUSED[said])))
    assert [said in each.message for each in found] == [True], [each.message for each in found]


@each_of("kind", ["NOT", "AND", "OR"])
def test_boxes_and_branches_that_stand_too_deep_in_one_another_are_refused(kind: str) -> None:
    def said(depth: int) -> list[str]:
        made = contact("a")
        for _ in range(depth - 1):
            made = box("NOT", made) if kind == "NOT" else row(kind, made)
        return [each.message.rpartition(": ")[2] for each in as_source(Source("a.exp", export(rung(made, "p"))))[1]]

    assert (said(MOST_DEEP), said(MOST_DEEP + 1), said(5000)) == ([], *[[f"a network is deeper than {MOST_DEEP}"]] * 2)


def test_an_action_has_no_variable_for_the_power_of_its_boxes() -> None:
    text = export(rung(contact("a"), "p", boxes=(assigned(box("ABS", operand("n"), enabled=EN), "n"),)))
    body = text.partition("_LD_BODY")[2]
    action = f"END_PROGRAM\nACTION Act:\n_LD_BODY{body}".replace("END_PROGRAM\n", "END_ACTION\n")
    source, said = as_source(Source("a.exp", text + action.partition("END_ACTION\n")[2]))
    assert ["an action has no variables" in found.message for found in said] == [True], [found.message for found in said]
    assert "Power_1" in source.text.partition("ACTION Act")[0] and "Power_1" not in source.text.partition("ACTION Act")[2]


def test_an_export_that_is_no_text_is_refused() -> None:
    for read in (read_export, import_codesys2):
        made = read(b"\xef\xbb\xbfPROGRAM \xff", "a.exp")
        assert made.files == {} and ["begins as UTF-8" in found.message for found in made.errors] == [True]


# --- names in projects ------------------------------------------------------------------------------------------------


def test_an_object_is_called_as_its_declaration_says() -> None:
    names = {b"PROGRAM PLC_PRG\nVAR": "PLC_PRG", b"TYPE Colour:(red, green);": "Colour", b"VAR_GLOBAL\na : INT;": "Globals",
             b"FUNCTION F: INT": "F", b"FUNCTION_BLOCK B;": "B", b"PROGRAM": "Globals"}  # fmt: skip
    assert {declared: _named(declared) for declared in names} == names
    for name in (b"PLC_PRG", b"a", b"Two words-1"):
        data = b"\0\1" + len(name).to_bytes(4, "little") + name
        assert _name_before(data + b"behind", len(data)) == name.decode()
        assert _name_before(data[3:], len(data) - 3) == ""
    wrong = (3).to_bytes(4, "little") + b"a/b"
    assert _name_before(wrong, len(wrong)) == ""


# --- markers of CX-Programmer -----------------------------------------------------------------------------------------


def text(*numbers: int) -> str:
    """Texts of CX-Programmer with these numbers: each marker stands in front of its text and behind it."""
    return "\n".join(f"Name:=$?St$Bk?_#[{number}]some text {at}$?St$Bk?_#[{number}]" for at, number in enumerate(numbers))


@pytest.mark.parametrize(("before", "made", "after"), [
    ((5, 6, 7), (5, 6, 7), (5, 6, 7)), ((5, 6, 7), (5, 6, 6, 7), (5, 6, 7, 8)), ((5, 6, 7), (5, 7), (5, 6)),
    ((5, 9, 7), (5, 9, 99, 7), (5, 9, 10, 7)), ((5, 9, 7), (5, 7), (5, 7)), ((), (4, 9), (1, 2)),
    ((5, 9, 7), (20, 5, 30, 7), (10, 5, 11, 7)),
])  # fmt: skip
def test_markers_go_on_as_those_that_were_there(before: tuple[int, ...], made: tuple[int, ...], after: tuple[int, ...]) -> None:
    assert renumbered(text(*made), text(*before)) == text(*after)


def test_the_number_of_a_marker_has_any_length() -> None:
    numbers = "9" * 5000
    saved = (f"Name:=$?St$Bk?_#[{numbers}]some text$?St$Bk?_#[{numbers}]\nBEGIN_LIST_$#[{numbers}]\nEND_LIST_$#[{numbers}];\n"
             f"END_LIST_$#[1{numbers}];")
    assert renumbered(saved, saved) == saved


def test_a_list_has_its_number_at_both_ends() -> None:
    def listed(first: int, inner: int, last: int) -> str:
        return f"BEGIN_LIST_$#[{first}]\n{text(inner)}\nEND_LIST_$#[{first}]\n{text(last)}"

    assert renumbered(listed(7, 8, 9), listed(3, 4, 5)) == listed(3, 4, 5)
    assert renumbered(f"{listed(3, 4, 9)}\n{text(9)}", listed(3, 4, 5)) == f"{listed(3, 4, 5)}\n{text(6)}"
