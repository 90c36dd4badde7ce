"""Small documents with something unusual in them, each beside the statements or rungs that it becomes, and what is said of it.

`FBVM_REWRITE=1 pytest` of this file writes them anew; each was read once beside its drawing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from drawings import RAIL, block, coil, contact, document, imported, pou, result, value, variable, wires
from test_charts import actions, chart, does, inline, jump, step, transition
from test_whole_texts import check

from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml

TIMER = variable("t", "TON") + "".join(map(variable, ("a", "b", "x", "y")))
NUMBERS = variable("n", "INT") + variable("m", "INT") + variable("a") + variable("x")
STORED = ('<block localId="4" typeName="NOT"><position x="0" y="0"/><inputVariables><variable formalParameter="IN" storage="set">'
          f'{wires("2")}</variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT">'
          "<connectionPointOut/></variable></outputVariables></block>")  # fmt: skip
RUNGS = {
    "a contact that is not connected": (contact(2, "", "a") + coil(3, "2", "x"), "a x"),
    "two ways, one of which is read twice": (
        contact(2, "1", "a") + contact(3, "1", "b") + coil(4, "2 3", "x") + coil(5, "2", "y"), "a b x y"),
    "the rail beside a contact": (contact(2, "1", "a") + coil(3, "1 2", "x"), "a x"),
    "a contact that is a literal": (contact(2, "1", "TRUE") + coil(3, "2", "x"), "x"),
    "a name as that of a TR bit": (contact(2, "1", "TR5") + coil(3, "2", "x"), "TR5 x"),
    "an address": (contact(2, "1", "D5.3") + coil(3, "2", "x"), "x"),
    "names as those of timers and words": (contact(2, "1", "T1") + coil(3, "2", "W0"), "T1 W0"),
    "an expression at a pin": (block(2, "TON", "EN=1 IN=4 PT=5", "Q,ENO", "t") + value(4, "a") + value(5, "T#1s + T#2s")
                               + coil(3, "2.ENO", "x"), TIMER),
    "a timer with power through it": (contact(6, "1", "b") + block(2, "TON", "EN=6 IN=4 PT=5", "Q,ENO", "t") + value(4, "a")
                                      + value(5, "T#1s") + coil(3, "2.ENO", "x"), TIMER),
    "a timer behind which nothing comes": (contact(6, "1", "b") + block(2, "TON", "EN=6 IN=4 PT=5", "Q,ENO", "t")
                                           + value(4, "a") + value(5, "T#1s") + result(7, "2.Q", "y"), TIMER),
    "an edge and a coil that stores": (contact(2, "1", "a", 'edge="rising"') + coil(3, "2", "x", 'storage="set"'), "a x"),
    "a falling edge and a coil that resets": (
        contact(2, "1", "a", 'edge="falling"') + coil(3, "2", "x", 'storage="reset"'), "a x"),
    "a coil with an edge, a negated one": (contact(2, "1", "a") + coil(3, "2", "x", 'edge="rising"')
                                           + coil(4, "2", "y", 'negated="true"'), "a x y"),
    "a negated edge and a negated coil that stores": (
        contact(2, "1", "a", 'edge="rising" negated="true"') + coil(3, "2", "x", 'storage="set" negated="true"'), "a x"),
    "a coil on the rail": (coil(3, "1", "x"), "x"), "two coils on the rail": (coil(3, "1", "x") + coil(4, "1", "y"), "x y"),
    "a comparison behind a contact": (
        contact(2, "1", "a") + block(4, "GT", "IN1=5 IN2=6", "OUT") + value(5, "n") + value(6, "5")
        + block(7, "AND", "IN1=2 IN2=4.OUT", "OUT") + coil(3, "7.OUT", "x"), NUMBERS),
    "a sum of two differences": (
        block(2, "SUB", "IN1=5 IN2=6", "OUT") + value(5, "n") + value(6, "m") + block(7, "ADD", "IN1=2.OUT IN2=2.OUT", "OUT")
        + result(3, "7.OUT", "n") + result(8, "2.OUT", "m"), NUMBERS),
    "storage at a pin": (value(2, "a") + STORED + result(5, "4.OUT", "x"), "a x"),
    "an output that there is not": (value(2, "a") + block(4, "TON", "IN=2", "Q", "t") + result(5, "4.NO", "x"), TIMER),
    "branches in branches": (
        contact(2, "1", "a") + contact(3, "2", "b") + contact(4, "2", "c") + contact(5, "4", "d") + contact(6, "4", "e")
        + contact(7, "5 6", "f") + coil(8, "3 7", "x"), "a b c d e f x"),
    "outputs between branches": (
        contact(2, "1", "a") + coil(3, "2", "x") + contact(4, "2", "b") + coil(5, "4", "y") + contact(6, "2", "c")
        + coil(7, "6", "z") + coil(8, "2", "v"), "a b c v x y z"),
}  # fmt: skip
LOOP = jump(3, "2", "s")
CONDITION = transition(2, "1", inline("a"))
CHARTS = {
    "a step without a name": (step(1, "", first=True), CONDITION, jump(3, "2", "")),
    "an action without a name": (step(1, "s", first=True), actions(9, "1", '<reference name=""/>|'), CONDITION, LOOP),
    "a qualifier that is none": (step(1, "s", first=True), actions(9, "1", f'{does("a")}|qualifier="X"'), CONDITION, LOOP),
    "actions with times": (step(1, "s", first=True), actions(9, "1", f'{does("a")}|qualifier="L" duration="T#1s"',
                           f'{does("b")}|qualifier="D" duration="T#2s" indicator="c"', f'{does("c")}|qualifier="SD"'),
                           CONDITION, LOOP),
    "no condition": (step(1, "s", first=True), CONDITION.replace(f"<condition>{inline('a')}</condition>", ""), LOOP),
    "an empty condition": (step(1, "s", first=True), transition(2, "1", '<inline name=""></inline>'), LOOP),
    "a jump to nowhere": (step(1, "s", first=True), CONDITION, jump(3, "2", "t")),
    "priorities": (step(1, "s", first=True), transition(2, "1", inline("a"), 'priority="2"'),
                   transition(4, "1", inline("b"), 'priority="0"'), jump(3, "2", "s"), jump(5, "4", "s")),
    "a negated condition": (step(1, "s", first=True), CONDITION.replace("<condition>", '<condition negated="true">'), LOOP),
}  # fmt: skip
XML = {
    "a variable without a name": document(pou(RAIL + coil(3, "1", "x"), '<variable name=""><type><BOOL/></type></variable>'
                                              + variable("1x") + variable("x"))),
    "a POU that is none": document(pou(RAIL + coil(3, "1", "x"), "x", kind="thing"), pou("", "", name="")),
    "access variables of a POU": document(pou(RAIL + coil(3, "1", "x"), "x").replace(
        "</interface>", f"<accessVars>{variable('x')}</accessVars></interface>")),
    "transitions without a chart": document(pou(RAIL + coil(3, "1", "x"), "x").replace(
        "</interface>", '</interface><transitions><transition name="T"><body><ST><xhtml:p>TRUE</xhtml:p></ST></body>'
                        '</transition></transitions>')),
    "a task without a name, and one with a strange interval": document(pou(RAIL + coil(3, "1", "x"), "x")).replace(
        b"</project>", b'<instances><configurations><configuration name="c"><resource name="r"><task name="" priority="1">'
        b'<pouInstance name="i" typeName="Main"/></task><task name="slow" interval="soon" priority="1"><pouInstance name="j" '
        b'typeName="Main"/></task></resource></configuration></configurations></instances></project>'),
}  # fmt: skip


def made() -> Iterator[tuple[str, Imported]]:
    yield from ((name, imported(pou(RAIL + body, declared))) for name, (body, declared) in RUNGS.items())
    yield from ((name, chart(*parts, declared="a b c")) for name, parts in CHARTS.items())
    yield from ((name, import_xml(text)) for name, text in XML.items())


def told(found: Imported) -> Iterator[str]:
    """The text without the declarations that every case has, and the messages with the elements that they mark."""
    for text in found.files.values():
        yield from text.rstrip("\n").split("\n")
    for each in found.diagnostics:
        marked = each.source.text[each.start : each.end]
        yield f">>> {each.code} {marked}> ! {each.message} ! {each.hint}".rstrip(" !")


@pytest.mark.slow
def test_a_document_with_something_unusual_becomes_this() -> None:
    lines = [line for name, found in made() for line in (f"--- {name}", *told(found))]
    check(Path(__file__).parent / "texts" / "unusual.txt", "\n".join([*lines, ""]))
