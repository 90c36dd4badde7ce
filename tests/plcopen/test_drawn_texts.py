"""Drawings beside the sources that come of them, in the order of a network and in that of a generator, word for word.
`FBVM_REWRITE=1 pytest` of this file writes the texts anew; read the difference before you keep it."""

from __future__ import annotations

import pytest
from drawings import RAIL, block, coil, contact, document, pou, result, value, variable, wires
from test_whole_texts import HERE, check, whole

from fbvm.interchange.plcopen.read.importing import import_xml


def integers(*names: str) -> str:
    return "".join(variable(name, "INT") for name in names)


def bits(names: str) -> str:
    return "".join(variable(name) for name in names.split())


def element(name: str, number: int, sources: str, inside: str = "", marks: str = "", at: str = "0,0") -> str:
    x, y = at.split(",")
    return f'<{name} localId="{number}" {marks}><position x="{x}" y="{y}"/>{wires(sources) if sources else ""}{inside}</{name}>'


def both(number: int, sources: str, name: str, marks: str = "", at: str = "0,0") -> str:
    """An inOutVariable."""
    return element("inOutVariable", number, sources, f"<connectionPointOut/><expression>{name}</expression>", marks, at)


def comment(number: int, text: str, at: str = "0,0") -> str:
    return element("comment", number, "", f"<content><xhtml:p>{text}</xhtml:p></content>", at=at)


def edge(drawn: str, word: str = "rising", number: int = 1) -> str:
    """The same with an edge at the pin of that number."""
    parts = drawn.split("<variable ", number)
    return "<variable ".join([*parts[:-1], f'edge="{word}" {parts[-1]}'])


def typed(drawn: str, pin: str, text: str) -> str:
    """The same with an operand that is typed at a pin."""
    before, found, behind = drawn.partition(f'formalParameter="{pin}"')
    inner, end, rest = behind.partition("</variable>")
    point = "connectionPointOut" if "connectionPointOut" in inner else "connectionPointIn"
    return f"{before}{found}><{point}><expression>{text}</expression></{point}>{end}{rest}"


PART = """<pou name="Part" pouType="functionBlock"><interface><inputVars><variable name="u"><type><BOOL/></type></variable>
</inputVars><outputVars><variable name="done"><type><BOOL/></type></variable><variable name="count"><type><INT/></type></variable>
</outputVars><inOutVars><variable name="io"><type><INT/></type></variable></inOutVars><externalVars><variable name="shared">
<type><INT/></type></variable></externalVars></interface><actions><action name="Stop"><body><ST><xhtml:p>done := FALSE;</xhtml:p>
</ST></body></action></actions><body><ST><xhtml:p>shared := io; done := u;</xhtml:p></ST></body></pou>"""
SPLIT = """<pou name="Split" pouType="function"><interface><returnType><INT/></returnType><inputVars>
<variable name="v"><type><INT/></type></variable></inputVars><outputVars><variable name="rest"><type><INT/></type></variable>
</outputVars></interface><body><ST><xhtml:p>Split := v / 10; rest := v MOD 10;</xhtml:p></ST></body></pou>"""
MEMORY = integers("n", "m", "k") + bits("a b c d x y z") + variable("t", "TON") + variable("s", "CTU") + variable("p", "Part") \
    + variable("time", "TIME") + variable("r", "REAL") + variable("q", "REAL")
WAYS = RAIL + contact(2, "1", "a") + contact(3, "2", "b") + contact(4, "2", "c", 'negated="true"')
DRAWINGS: dict[str, str] = {
    "series and parallel": WAYS + contact(5, "3 4", "d", 'edge="rising"') + coil(6, "5", "x"),
    "a parallel behind a parallel": RAIL + contact(2, "1", "a") + contact(3, "1", "b") + contact(4, "2 3", "c")
        + contact(5, "2 3", "d") + contact(7, "3", "y") + coil(6, "4 5", "x") + coil(8, "7", "z"),
    "branches of branches": WAYS + coil(5, "3", "x") + contact(6, "3", "d") + coil(7, "6", "y") + coil(8, "4", "z")
        + coil(9, "2", "m"),
    "a branch behind a coil": RAIL + contact(2, "1", "a") + coil(3, "2", "x") + coil(4, "3", "y", 'negated="true"')
        + contact(5, "3", "b") + coil(6, "5", "z"),
    "coils of all kinds": RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'storage="set"')
        + coil(4, "2", "y", 'storage="reset"')
        + coil(5, "2", "z", 'edge="rising"') + coil(6, "2", "b", 'edge="falling"')
        + coil(7, "2", "c", 'edge="rising" storage="set"')
        + coil(8, "2", "d", 'edge="falling" storage="reset"'),
    "a coil that is negated and set": RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'negated="true" storage="set"'),
    "a coil with another storage": RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'storage="retain"'),
    "a coil with a negated edge": RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'negated="true" edge="rising"'),
    "a contact with a negated edge": RAIL + contact(2, "1", "a", 'negated="true" edge="falling"') + coil(3, "2", "x"),
    "an edge that there is not": RAIL + contact(2, "1", "a", 'edge="both"') + coil(3, "2", "x"),
    "a contact with a storage": RAIL + contact(2, "1", "a", 'storage="set"') + coil(3, "2", "x"),
    "nothing in front": contact(2, "", "a") + coil(3, "2", "x"), "the rail alone": RAIL + coil(3, "1", "x"),
    "beside the rail": RAIL + contact(2, "1", "a") + coil(3, "1 2", "x"), "a coil without a wire": RAIL + coil(3, "", "x"),
    "coils without a variable": RAIL + contact(2, "1", "a") + coil(3, "2", ""), "a contact for nothing": RAIL
        + contact(2, "1", "a"),
    "names that are addresses": RAIL + contact(2, "1", "W0.01") + contact(3, "2", "%IX0.3") + coil(4, "3", "%QX1.2")
        + coil(5, "3", "T5"),
    "names that are no addresses": RAIL + contact(2, "1", "TR1") + contact(3, "2", "p.done") + coil(4, "3", "list[2]"),
    "a value and its negation": value(2, "a", 'negated="true"') + result(3, "2", "x") + value(4, "n + 1") + result(5, "4", "m")
        + result(6, "2", "y", 'negated="true"'),
    "an edge of a value": value(2, "a", 'edge="rising"') + result(3, "2", "x") + value(4, "b", 'edge="falling"')
        + result(5, "4", "y"),
    "a value for nothing": value(2, "n") + value(3, "m") + result(4, "3", "k"),
    "functions in one another": value(2, "n") + value(3, "2") + block(4, "ADD", "IN1=2 IN2=3", "OUT")
        + block(5, "MUL", "IN1=4 IN2=4", "OUT") + block(6, "SUB", "IN1=5 IN2=2", "OUT") + result(7, "6", "m"),
    "a chain of three": value(2, "n") + value(3, "2") + value(4, "m") + block(5, "ADD", "IN1=2 IN2=3 IN3=4", "OUT")
        + block(6, "GT", "IN1=5 IN2=4 IN3=3", "OUT") + result(7, "6", "x"),
    "comparisons and NOT": value(2, "n") + value(3, "2") + block(4, "LT", "IN1=2 IN2=3", "OUT") + block(5, "NOT", "IN=4", "OUT")
        + block(6, "AND", "IN1=5 !IN2=4", "OUT") + result(7, "6", "x") + result(8, "4", "y"),
    "a choice": value(2, "a") + value(3, "n") + value(4, "T#1s") + block(5, "SEL", "G=2 IN0=3 IN1=3", "OUT")
        + result(6, "5", "m")
        + result(7, "5", "k") + block(8, "MOVE", "IN=4", "OUT") + result(9, "8", "time"),
    "conversions": value(2, "n") + block(3, "INT_TO_REAL", "IN=2", "OUT") + block(4, "SQRT", "IN=3", "OUT")
        + result(5, "4", "r")
        + result(6, "4", "q") + block(7, "ADD_TIME", "IN1=8 IN2=8", "OUT") + value(8, "time") + result(9, "7", "time"),
    "an input that is not connected": value(2, "n") + block(3, "ADD", "IN1=2 IN2= IN3=2", "OUT") + result(4, "3", "m"),
    "last inputs that are not connected": value(2, "n") + block(3, "MAX", "IN1=2 IN2=2 IN3= IN4=", "OUT") + result(4, "3", "m"),
    "a function for nothing": value(2, "n") + block(3, "ADD", "IN1=2 IN2=2", "OUT"),
    "a function that is enabled": value(2, "a") + value(3, "n") + block(4, "ADD", "EN=2 IN1=3 IN2=3", "ENO,OUT")
        + result(5, "4.OUT", "m"),
    "one that two variables take": value(2, "a") + value(3, "n") + block(4, "ADD", "EN=2 IN1=3 IN2=3", "ENO,OUT")
        + result(5, "4.OUT", "m") + result(6, "4.OUT", "k") + result(7, "4.ENO", "x"),
    "one whose ENO alone is taken": value(2, "a") + value(3, "n") + block(4, "ADD", "EN=2 IN1=3 IN2=3", "ENO,OUT")
        + result(7, "4.ENO", "x")
        + result(8, "4.ENO", "y"),
    "one that is always enabled": RAIL + value(3, "n") + block(4, "ADD", "EN=1 IN1=3 IN2=3", "ENO,OUT")
        + result(5, "4.OUT", "m")
        + coil(6, "4.ENO", "x"),
    "a timer": value(2, "a") + value(3, "T#1s") + block(4, "TON", "IN=2 PT=3", "Q,ET", "t") + result(5, "4.Q", "x")
        + result(6, "4.ET", "time"),
    "edges and negations at pins": value(2, "a") + value(3, "5") + edge(block(4, "CTU", "CU=2 !R=2 PV=3", "Q,CV", "s"))
        + result(5, "4.Q", "x") + result(6, "4.CV", "n"),
    "a falling edge at a pin": value(2, "a") + edge(block(4, "CTU", "CU=2", "Q,CV", "s"), "falling") + result(6, "4.CV", "n"),
    "a block that is enabled": value(2, "a") + value(3, "b") + block(4, "CTU", "EN=2 CU=3", "ENO,Q,CV", "s")
        + result(5, "4.Q", "x")
        + result(6, "4.CV", "n") + result(7, "4.ENO", "y"),
    "one whose results are taken negated": value(2, "a") + value(3, "b") + block(4, "CTU", "EN=2 CU=3", "ENO,Q,CV", "s")
        + result(5, "4.Q", "x", 'negated="true"') + result(6, "4.Q", "y", 'edge="rising"') + result(7, "4.CV", "n"),
    "one whose result is set": value(2, "a") + value(3, "b") + block(4, "CTU", "EN=2 CU=3", "ENO,Q,CV", "s")
        + result(5, "4.Q", "x", 'storage="set"') + result(6, "4.Q", "y"),
    "an address that is written between": value(2, "%QX0.0", 'negated="true"') + result(3, "2", "%QX0.0") + result(4, "2", "x"),
    "an address that another one reads": value(2, "%MW1") + block(3, "ADD", "IN1=2 IN2=2", "OUT") + result(4, "3", "%MW2")
        + result(5, "3", "m"),
    "a block that writes what is read in front of it and behind": value(2, "shared") + result(3, "2", "n") + value(8, "m")
        + value(9, "a") + block(4, "Part", "u=9", "done", "p", in_outs="io=8") + result(5, "4.done", "x") + result(7, "2", "k"),
    "one whose results go further": value(2, "a") + value(3, "b") + block(4, "CTU", "EN=2 CU=3", "ENO,Q,CV", "s")
        + block(5, "ADD", "IN1=4.CV IN2=4.CV", "OUT") + result(6, "5", "n") + coil(7, "4.Q", "x") + result(8, "4.Q", "y"),
    "a call between contacts": RAIL + contact(2, "1", "a") + value(3, "T#1s") + block(4, "TON", "EN=2 PT=3", "ENO,Q", "t")
        + contact(5, "4.ENO", "b") + coil(6, "5", "x") + result(7, "4.Q", "y"),
    "a call at the end": RAIL + contact(2, "1", "a") + value(3, "5") + block(4, "CTU", "EN=2 PV=3", "ENO,CV", "s")
        + result(7, "4.CV", "n"),
    "operands that are typed": typed(typed(block(4, "TON", "IN= PT=", "Q,ET", "t"), "IN", "a AND b"), "Q", "x"),
    "typed ones of an enabled block": RAIL + contact(2, "1", "a")
        + typed(typed(block(4, "CTU", "EN=2 PV=", "ENO,CV", "s"), "PV", "5"), "CV", "n"),
    "an in-out": value(2, "a") + value(3, "n") + block(4, "Part", "u=2", "done,count", "p", in_outs="io=3")
        + result(5, "4.done", "x")
        + result(6, "4.count", "m") + result(7, "4.io", "k"),
    "an in-out through two blocks": value(2, "a") + value(3, "n") + block(4, "Part", "u=2", "done", "p", in_outs="io=3")
        + block(5, "Part", "u=4.done", "done", "p", in_outs="io=4.io") + result(6, "5.io", "m"),
    "an in-out of nothing": value(2, "a") + block(4, "Part", "u=2", "done", "p", in_outs="io="),
    "an in-out that is an output, too": value(2, "n") + block(4, "Part", "io=2", "done,io", "p") + result(5, "4.done", "x"),
    "a function of two results": value(2, "n") + block(3, "Split", "v=2", "Split,rest") + result(4, "3.Split", "m")
        + result(5, "3.rest", "k"),
    "one of them alone": value(2, "n") + block(3, "Split", "v=2", "Split,rest")
        + block(4, "ADD", "IN1=3.rest IN2=3.rest", "OUT")
        + result(5, "4", "k"),
    "a function as a value": value(2, "n") + block(3, "Split", "v=2", "Split,rest")
        + block(4, "ADD", "IN1=3.Split IN2=2", "OUT") + result(5, "4", "k"),
    "a function that is called if": value(1, "a") + value(2, "n") + block(3, "Split", "EN=1 v=2", "ENO,Split,rest")
        + result(4, "3.Split", "m")
        + result(5, "3.rest", "k") + result(6, "3.ENO", "x"),
    "a function that nobody knows": value(2, "n") + block(3, "Unknown", "v=2", "OUT") + result(4, "3", "m")
        + result(5, "3", "k"),
    "a loop over a block": value(2, "T#1s") + block(3, "TON", "IN=4 PT=2", "Q", "t") + block(4, "NOT", "IN=3.Q", "OUT")
        + result(5, "4", "x"),
    "a loop over a variable": value(2, "1") + both(3, "4", "n") + block(4, "ADD", "IN1=3 IN2=2", "OUT") + result(5, "3", "m"),
    "a loop over functions": value(2, "1") + block(3, "ADD", "IN1=2 IN2=4", "OUT") + block(4, "MUL", "IN1=3 IN2=2", "OUT")
        + result(5, "4", "n"),
    "a loop of unknown type": block(3, "Unknown", "v=4", "OUT") + block(4, "Unknown", "v=3", "OUT"),
    "what is written between": RAIL + contact(2, "1", "a") + coil(3, "2", "a", 'storage="reset"') + coil(4, "2", "x")
        + contact(5, "2", "b")
        + coil(6, "5", "y"),
    "a value that is written between": value(2, "n") + block(3, "ADD", "IN1=2 IN2=2", "OUT", at="50,0")
        + result(4, "3", "n", at="90,0")
        + block(5, "MUL", "IN1=3 IN2=2", "OUT", at="50,50") + result(6, "5", "m", at="90,50"),
    "several wires": value(2, "a") + value(3, "b") + result(4, "2 3", "x"), "several numbers": value(2, "n")
        + value(3, "m") + result(4, "2 3", "k"),
    "a jump": element("label", 2, "", marks='label="again"') + RAIL + contact(3, "1", "a") + coil(4, "3", "x")
        + element("jump", 5, "3", marks='label="again"'),
    "a negated return": RAIL + contact(3, "1", "a") + element("return", 4, "3", marks='negated="true"'),
    "a jump to nothing": RAIL + contact(3, "1", "a") + element("jump", 4, "3", marks='label="lost"'),
    "a jump without a name": RAIL + contact(3, "1", "a") + element("jump", 4, "3"),
    "connectors": RAIL + contact(2, "1", "a") + element("connector", 3, "2", marks='name="One"')
        + element("continuation", 4, "", marks='name="one"')
        + coil(5, "4", "x"),
    "two connectors": RAIL + contact(2, "1", "a") + element("connector", 3, "2", marks='name="One"')
        + element("connector", 6, "2", marks='name="ONE"')
        + element("continuation", 4, "", marks='name="one"') + coil(5, "4", "x"),
    "a continuation of nothing": element("continuation", 4, "", marks='name="one"') + coil(5, "4", "x"),
    "two of one number": RAIL + contact(2, "1", "a") + contact(2, "1", "b") + coil(3, "2", "x"),
    "a number that is none": RAIL
        + element("contact", 2, "1", "<connectionPointOut/><variable>a</variable>").replace('"2"', '"two"') + coil(3, "1", "x"),
    "a block without a type": block(2, "", "IN=", "OUT") + result(3, "2", "x"), "a wire from nowhere": coil(3, "9", "x"),
    "a wire from no output": value(2, "a") + block(3, "TON", "IN=2", "Q,ET", "t") + result(4, "3.Z", "x"),
    "a wire from the first output": value(2, "a") + block(3, "TON", "IN=2", "ENO,Q", "t") + result(4, "3", "x"),
    "a strange element": element("cloud", 2, "")
        + coil(3, "2", "x"), "a step in a ladder": element("step", 2, "", marks='name="s"') + coil(3, "2", "x"),
    "comments": comment(8, "above", "0,10") + RAIL + contact(2, "1", "a", at="50,20") + coil(3, "2", "x", at="90,20")
        + comment(9, "between\n  two lines", "0,50")
        + value(4, "n", at="50,90") + result(5, "4", "m", at="90,90") + comment(10, "behind", "0,200")
        + comment(11, "", "0,60"),
    "networks by their numbers": value(2, "x", at="0,0") + result(3, "2", "y", 'executionOrderId="2"', "50,0")
        + value(4, "a", at="0,50")
        + result(5, "4", "x", 'executionOrderId="1"', "50,50"),
    "networks that mix their numbers": value(2, "x") + result(3, "2", "y", 'executionOrderId="1"', "50,0")
        + result(6, "2", "z", 'executionOrderId="3"', "50,20")
        + value(4, "a") + result(5, "4", "x", 'executionOrderId="2"', "50,50"),
    "a program in a box": element("block", 2, "", "<inputVariables/><inOutVariables/><outputVariables/><addData><data><STCode>"
                                  "n := 1;\n  m := n;\n</STCode></data></addData>", 'typeName="EXECUTE"'),
    "a program in an enabled box": value(3, "a")
        + element("block", 2, "", f'<inputVariables><variable formalParameter="EN">{wires("3")}</variable>'
        '</inputVariables><inOutVariables/><outputVariables><variable formalParameter="ENO"><connectionPointOut/></variable>'
        "</outputVariables>"
        "<addData><data><STCode>n := 1;\nm := n;</STCode></data></addData>", 'typeName="EXECUTE"') + result(4, "2.ENO", "x"),
}  # fmt: skip
"""What is drawn, in a program with some variables; blocks Part and Split stand beside it."""
DATES = variable("day", "DATE") + variable("one", "DT") + variable("two", "DT") + variable("time", "TIME")
OTHERS: dict[str, tuple[str, str]] = {
    "differences of dates": (value(2, "one") + value(3, "two") + value(6, "DATE#2020-01-01")
        + block(4, "SUB", "IN1=2 IN2=3", "OUT")
        + result(5, "4", "time") + result(7, "4", "late") + block(8, "SUB", "IN1=9 IN2=6", "OUT") + value(9, "day")
        + result(10, "8", "time")
        + result(11, "8", "late") + block(12, "SUB", "IN1=2 IN2=13", "OUT") + value(13, "T#1h") + result(14, "12", "two")
        + result(15, "12", "one"),
        DATES + variable("late", "TIME")),
    "names that are taken": (value(2, "n") + value(3, "a") + block(4, "ADD", "EN=3 IN1=2 IN2=2", "OUT")
        + result(5, "4", "m") + result(6, "4", "k")
        + value(7, "a", 'edge="falling"') + result(8, "7", "x"),
        integers("n", "m", "k", "Result_4", "enabled_4", "Enabled_4_2") + bits("a x Was_7 Edge_7")),
}  # fmt: skip
FUNCTIONS = {
    "an edge in a rung of a function": RAIL + contact(2, "1", "a", 'edge="rising"') + coil(3, "2", "F"),
    "an edge in a function": value(2, "a", 'edge="rising"') + result(3, "2", "F"),
    "a loop in a function": block(3, "NOT", "IN=4", "OUT") + block(4, "NOT", "IN=3", "OUT") + result(5, "4", "F"),
    "what a function keeps": value(2, "a") + value(3, "n") + block(4, "GT", "EN=2 IN1=3 IN2=3", "ENO,OUT")
        + result(5, "4.OUT", "F")
        + result(6, "4.OUT", "b"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("order", ["network", "document"])
def test_what_drawings_become(order: str) -> None:
    made = []
    for name, (drawn, declared) in {**{name: (drawn, MEMORY) for name, drawn in DRAWINGS.items()}, **OTHERS}.items():
        text = whole(import_xml(document(pou(drawn, declared), PART, SPLIT), order=order))
        main = text[text.index("=== Main.st") :].partition("\n=== Split.st")[0]
        kept = main.partition("\n=== Part.st")[0].splitlines()[1:]
        said = text.partition("=== messages\n")[2].splitlines()
        made += [f"=== {name}", *(line for line in kept if line not in KNOWN), *said]
    for name, drawn in FUNCTIONS.items():
        function = pou(drawn, bits("a b") + integers("n"), "function", "F")
        made += [f"=== {name}", whole(import_xml(document(function), order=order)).rstrip()]
    check(HERE / "texts" / f"drawings.{order}.txt", "\n".join([*made, ""]))


KNOWN = whole(import_xml(document(pou("", MEMORY)))).splitlines()
"""The lines of a program in which nothing is drawn."""


