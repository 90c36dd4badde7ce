"""CFC in TwinCAT's files: what it becomes, in which order, and what is refused."""

from __future__ import annotations

import pytest
from archives import pou
from charts import box, chart, operand, pin, result, wired

from fbvm.code.compiler import compile_sources
from fbvm.interchange.twincat.objects import read_object
from fbvm.machine.plc import Plc

HEAD = "PROGRAM Main\nVAR\na, b, p : BOOL; n, m : INT; t : TON; on : SR; pt : TIME := T#40ms;\nEND_VAR\n"
AND = box("AND", "Operator", ":1 :2", ":3")
TIMER = box("TON", "FunctionBlock", "IN:11 PT:12", "Q:13 ET:14", "t")


def made(*entries: str) -> tuple[list[str], list[str]]:
    """The lines behind the declaration, each with one blank between words, and the messages."""
    found = read_object(pou(HEAD, chart(*entries)).encode(), "Main.TcPOU")
    assert found.source is not None
    lines = [" ".join(line.split()) for line in found.source.text.splitlines() if line.strip()]
    return lines[lines.index("END_VAR") + 1:-1], [one.message for one in found.diagnostics]


FORMS = {
    "operators, and an operand that is negated": (
        [AND, result("p", "4"), operand("a", "5"), operand("b", "-6"), wired("5", "1"), wired("6", "2"), wired("3", "4")],
        ["p := a AND NOT b;"]),
    "an operand that is led on": ([operand("n", "1"), result("m", "2"), wired("1", "2")], ["m := n;"]),
    "a pin that is negated": ([operand("a", "1"), result("p", "-2"), wired("1", "2")], ["p := NOT a;"]),
    "a block with a pin to which nothing is wired": (
        [operand("a", "1"), TIMER, result("pt", "2"), result("p", "3"), wired("1", "11"), wired("14", "2"), wired("13", "3")],
        ["t(IN := a);", "pt := t.ET;", "p := t.Q;"]),
    "a call of a program, and a comment": ([box("Other", "Program", "", ""), '<o t="CFCCommentElement"></o>'], ["Other();"]),
}


@pytest.mark.parametrize("name", FORMS)
def test_what_a_chart_becomes(name: str) -> None:
    entries, lines = FORMS[name]
    found, said = made(*entries)
    assert ([line for line in found if not line.startswith("//")], said) == (lines, [])


REFUSED = {
    "nobody knows what CFCComposerElement does": ['<o t="CFCComposerElement"></o>'],
    "nobody knows what a box X of the kind wonder does": [box("X", "Wonder", "", "")],
    "the box TON has no instance": [box("TON", "FunctionBlock", "", "")],
    "the box ADD has one too many": [box("ADD", "Operator", "", "", "n")],
    "the box TON has EN": [box("TON", "FunctionBlock", "", "", "t", more="EnEno=true")],
    "the box TON has parameters": [box("TON", "FunctionBlock", "", "", "t", parameters=['<o><v n="Value">1</v></o>'])],
    "the names of the pins of a box are not all there": [box("AND", "Operator", ":1", "", texts=["AND"])],
    "two wires end at one pin": [operand("a", "1"), operand("b", "2"), result("p", "3"), wired("1", "3"), wired("2", "3")],
    "nothing is wired to p": [result("p", "3")],
    "a wire begins nowhere": [result("p", "3"), wired("9", "3")],
    "a pin has something that is not known": [operand("a", "1"), result("p", "3", "SetReset=Set"), wired("1", "3")],
    "an operand is missing": [operand("???", "1"), result("p", "3"), wired("1", "3")],
    "a pin is missing": ['<o t="CFCInputElement"></o>'],
    "the order in which it is executed is not told": [
        result("p", "4"), box("NOT", "Operator", ":1", ":2"), operand("a", "5"), wired("5", "1"), wired("2", "4")],
}  # fmt: skip
REFUSED["the order in which it is executed is not told"][0] = result("p", "4").replace(
    '<o t="CFCOutputElement">', '<o t="CFCOutputElement"><v n="IsFeedbackStart">false</v>')


@pytest.mark.parametrize("why", REFUSED)
def test_what_is_not_understood_refuses_the_chart(why: str) -> None:
    assert made(*REFUSED[why]) == ([], [f"the function chart of Main is not read: {why}"])


def test_a_chart_without_an_archive_is_named() -> None:
    found = read_object(pou(HEAD, "<Implementation><CFC/></Implementation>").encode(), "Main.TcPOU")
    assert [one.message for one in found.diagnostics] == ["the function chart of Main is empty or damaged"]
    assert pin("1")


@pytest.mark.slow
def test_elements_are_executed_in_the_order_of_the_list_assumed() -> None:
    """What comes back from a later element is what that gave in the scan before."""
    late = [box("ADD", "Operator", ":1 :2", ":3"), result("n", "4"), operand("n", "5"), operand("1", "6"), result("m", "7"),
            box("SR", "FunctionBlock", "SET1:11 RESET:12", "Q1:13", "on"), result("p", "8"), operand("a", "9"),
            operand("b", "10"), wired("5", "1", "7"), wired("6", "2"), wired("3", "4"), wired("9", "11"), wired("10", "12"),
            wired("13", "8")]
    orders = {"m behind": late, "m first": [late[4], *late[:4], *late[5:]]}
    seen = {}
    for name, entries in orders.items():
        found = read_object(pou(HEAD, chart(*entries)).encode(), "Main.TcPOU")
        assert found.source is not None
        compiled = compile_sources([found.source], runnable=True, dialect="twincat")
        assert compiled.image is not None, compiled.errors
        plc = Plc(compiled.image)
        rows = []
        for a, b in ((0, 0), (1, 0), (0, 0), (0, 1)):
            plc.write("Main.a", bool(a))
            plc.write("Main.b", bool(b))
            assert plc.scan() is None
            rows.append((plc.read("Main.n"), plc.read("Main.m"), plc.read("Main.p")))
        seen[name] = rows
    assert seen == {"m behind": [(1, 1, False), (2, 2, True), (3, 3, True), (4, 4, False)],
                    "m first": [(1, 0, False), (2, 1, True), (3, 2, True), (4, 3, False)]}
