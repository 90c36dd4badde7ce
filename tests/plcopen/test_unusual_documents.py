"""Small documents with something unusual in them, each beside the statements or rungs that it becomes, and what is said of it.

`FBVM_REWRITE=1 pytest` of this file writes them anew; each was read once beside its drawing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from drawings import RAIL, block, coil, contact, document, imported, pou, result, value, variable, wires
from test_charts import STEP_ACTIONS, actions, chart, does, inline, jump, step, transition
from test_whole_texts import check

from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.schema import MNEMONIC

TIMER = variable("t", "TON") + "".join(map(variable, ("a", "b", "x", "y")))
NUMBERS = variable("n", "INT") + variable("m", "INT") + variable("a") + variable("x")
STORED = ('<block localId="4" typeName="NOT"><position x="0" y="0"/><inputVariables><variable formalParameter="IN" storage="set">'
          f'{wires("2")}</variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT">'
          "<connectionPointOut/></variable></outputVariables></block>")  # fmt: skip


def ours(number: int, kind: str, mnemonic: str, inputs: str) -> str:
    """A block that fbvm has drawn for an instruction."""
    data = f'<addData><data name="{MNEMONIC}" handleUnknown="discard"><text>{mnemonic}</text></data></addData>'
    return block(number, kind, inputs, "ENO" if "EN=" in inputs else "OUT").replace("</block>", f"{data}</block>")


MOVED = value(15, "#1") + value(16, "D0")
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
    "a block with power through it behind a negated pin": (
        contact(2, "1", "a") + block(3, "TON", "EN=2 !IN=4", "ENO,Q", "t") + value(4, "b") + coil(5, "3.ENO", "x"), TIMER),
    "a comparison with a pin that is not wired": (
        ours(2, "GT", ">", "IN1=5 IN2=") + value(5, "n") + coil(3, "2.OUT", "x"), NUMBERS),
    "a contact that is negated and has an edge, in front of a branch": (
        contact(2, "1", "a", 'negated="true" edge="rising"') + coil(3, "2", "x") + contact(4, "2", "b") + coil(5, "4", "y"),
        "a b x y"),
    "a value with blanks at a pin of a block with power through it": (
        contact(2, "1", "a") + block(3, "TON", "EN=2 IN=4 PT=6", "ENO,Q", "t") + value(4, "b") + value(6, "T#1s + T#2s")
        + coil(5, "3.ENO", "x"), TIMER),
    "an instruction beside a block that is not of ladder": (
        contact(2, "1", "a") + ours(3, "MOV", "MOV", "EN=2 OP1=15 OP2=16") + MOVED
        + block(7, "GT", "IN1=8 IN2=8", "OUT") + value(8, "n") + coil(9, "3.ENO 7.OUT", "x"), NUMBERS),
    "an instruction with two conditions behind one contact": (
        contact(2, "1", "a") + ours(3, "CNT", "CNT", "EN=2 C2=2 OP1=15 OP2=16") + MOVED + coil(9, "2", "x"), "a x"),
    "an instruction whose second condition is the rail": (
        contact(2, "1", "a") + ours(3, "CNT", "CNT", "EN=2 C2=1 OP1=15 OP2=16") + MOVED, "a x"),
    "an instruction whose second condition is missing": (
        contact(2, "1", "a") + ours(3, "CNT", "CNT", "EN=2 C2= OP1=15 OP2=16") + MOVED, "a x"),
    "an instruction behind an edge that is negated": (
        contact(2, "1", "a", 'negated="true" edge="falling"') + ours(3, "MOV", "MOV", "EN=2 OP1=15 OP2=16") + MOVED, "a"),
    "a result of which nobody knows the type": (
        contact(2, "1", "a") + block(3, "Strange", "EN=2 IN=4", "ENO,OUT") + value(4, "b") + block(5, "Other",
        "IN1=3.OUT IN2=3.OUT", "OUT") + coil(6, "5.OUT", "x"), "a b x"),
    "more branch points than there are bits for them": (
        contact(2, "1", "a") + "".join(contact(at, str(at - 2), "b") + coil(at + 1, str(at), f"c{at}") for at in range(4, 42, 2)),
        "a b " + " ".join(f"c{at}" for at in range(4, 42, 2))),
    "blocks that feed one another": (
        block(2, "AND", "IN1=3.OUT IN2=4", "OUT") + block(3, "OR", "IN1=2.OUT IN2=4", "OUT") + value(4, "a")
        + coil(5, "3.OUT", "x"), "a x"),
    "a sum that feeds itself through another": (
        block(2, "ADD", "IN1=3.OUT IN2=4", "OUT") + block(3, "ADD", "IN1=2.OUT IN2=4", "OUT") + value(4, "1")
        + result(5, "3.OUT", "n"), NUMBERS),
    "outputs in another order than their conditions": (
        contact(2, "1", "a", at="0,40") + coil(3, "2", "b", at="90,40") + contact(4, "1", "b", at="0,0")
        + coil(5, "4 2", "x", at="90,0"), "a b x"),
    "a wire from the right rail": (
        RAIL.replace("localId=\"1\"", 'localId="7"').replace("left", "right") + coil(3, "7", "x"), "x"),
}  # fmt: skip
LOOP = jump(3, "2", "s")
DATA = ('<addData><data name="http://www.3s-software.com/plcopenxml/sfc/element"><attributes><attribute guid="{}">{}</attribute>'
        "</attributes></data></addData></step>")
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
    "a condition behind a block that is not understood": (
        step(1, "s", first=True), transition(2, "1", wires("8.OUT")), LOOP, block(8, "Strange", "IN=9.NO", "OUT"),
        block(9, "TON", "IN=7", "Q", "t"), value(7, "a")),
    "a condition that cannot be executed": (
        step(1, "s", first=True), transition(2, "1", wires("8.OUT")), LOOP, block(8, "ADD", "IN1=9.OUT IN2=7", "OUT"),
        block(9, "SUB", "IN1=8.OUT IN2=7", "OUT"), value(7, "n + 1")),
    "an action of a step without a name": (
        step(1, "s", first=True).replace("</step>", DATA.format(next(iter(STEP_ACTIONS)), "")), CONDITION, LOOP),
    "an action of a step that is not known": (
        step(1, "s", first=True).replace("</step>", DATA.format("f00", "Act")), CONDITION, LOOP),
    "an action of a step": (
        step(1, "s", first=True).replace("</step>", DATA.format(next(iter(STEP_ACTIONS)), "Act")), CONDITION, LOOP),
    "a negated condition": (step(1, "s", first=True), CONDITION.replace("<condition>", '<condition negated="true">'), LOOP),
}  # fmt: skip
XML = {
    "a variable without a name": document(pou(RAIL + coil(3, "1", "x"), '<variable name=""><type><BOOL/></type></variable>'
                                              + variable("1x") + variable("x"))),
    "a POU that is none": document(pou(RAIL + coil(3, "1", "x"), "x", kind="thing"), pou("", "", name="")),
    "access variables of a POU": document(pou(RAIL + coil(3, "1", "x"), "x").replace(
        "</interface>", f"<accessVars>{variable('x')}</accessVars></interface>")),
    "a transition whose diagram does not assign to its name": document(pou(
        step(1, "s", first=True) + transition(2, "1", '<reference name="T"/>') + LOOP, "x", language="SFC").replace(
        "</interface>", '</interface><transitions><transition name="T"><body><FBD>' + value(7, "x") + result(8, "7", "x")
                        + "</FBD></body></transition></transitions>")),
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
