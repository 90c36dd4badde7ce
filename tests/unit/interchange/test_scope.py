"""What is known of names in a diagram: types of variables, literals, pins and results, and which memory a name stands for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from fbvm.interchange.plcopen.read.document import Variable, VarList
from fbvm.interchange.plcopen.read.scope import SHARED, Scope, _standard_type, library_block


def pou(name: str, kind: str, result: str = "", **sections: str) -> Any:
    """A POU whose sections are written `name : type @address; ...`."""
    lists = []
    for section, text in sections.items():
        variables = []
        for row in filter(None, (part.strip() for part in text.split(";"))):
            declared, _, address = row.partition("@")
            first, _, second = declared.partition(":")
            variables.append(Variable(first.strip(), second.strip(), "", address.strip(), ""))
        lists.append(VarList(section, (), tuple(variables)))
    return SimpleNamespace(name=name, kind=kind, result=result, lists=tuple(lists), actions=(("Act", None),),
            transitions=(("Way", None),),
                           variable=lambda pin: next((each for listed in lists for each in listed.variables
                                                      if each.name.upper() == pin.upper()), None))  # fmt: skip


DOUBLE = pou("Double", "FUNCTION_BLOCK", VAR_INPUT="x : INT", VAR_OUTPUT="y : DINT; inner : Triple",
             VAR_EXTERNAL="Shared : INT", VAR="more : Triple")
TRIPLE = pou("Triple", "FUNCTION_BLOCK", VAR_OUTPUT="z : REAL; at : WORD @%MW5")
SUM = pou("Sum", "FUNCTION", "LREAL", VAR_INPUT="a : INT", VAR_OUTPUT="rest : SINT")
MAIN = pou("Main", "PROGRAM", VAR="n : INT; d : Double; t : TON; b : BOOL; p : POINTER TO INT; at : INT @%IW3; w : DATE_AND_TIME",
           VAR_IN_OUT="io : INT", VAR_EXTERNAL="Shared : INT", VAR_TEMP="temp : INT", VAR_INPUT="in1 : INT")
GLOBALS = {"SHARED": Variable("Shared", "INT", "", "%MW7", ""), "PLAIN": Variable("Plain", "TOD", "", "", "")}


def scope(main: Any = MAIN) -> Scope:
    pous = {each.name.upper(): each for each in (DOUBLE, TRIPLE, SUM, main)}
    return Scope(SimpleNamespace(pous_by_name=pous, globals_by_name=GLOBALS), main)  # type: ignore[arg-type]


TYPES = {
    "TRUE": "BOOL", " false ": "BOOL", "n": "INT", "N": "INT", "plain": "TOD", "d": "Double", "d.y": "DINT", "d.Y": "DINT",
    "d.nothing": "", "t.Q": "BOOL", "t.ET": "TIME", "d.inner.z": "", "nothing": "", "Main": "", "INT#5": "INT", "uint#5": "UINT",
    "T#5s": "TIME", "TIME#5s": "TIME", "LTIME#5s": "LTIME", "D#2024-01-01": "DATE", "tod#1:2:3": "TOD", "DT#x": "DT",
    "LREAL#1.5": "LREAL",
    "DWORD#5": "DWORD", "BYTE#5": "BYTE", "STRING#'a'": "STRING", "5": "", "'text'": "", "n + 1": "", "UDINT#5": "UDINT",
    "LINT#1": "LINT",
}  # fmt: skip


def test_the_type_of_a_name_or_a_literal() -> None:
    assert {text: scope().type_of(text) for text in TYPES} == TYPES
    assert scope(SUM).type_of("sum") == "LREAL" and scope(SUM).type_of("Sum.x") == "", "a function has its result under its name"


def test_the_type_of_a_pin_is_that_of_the_document_or_of_a_library() -> None:
    pins = {("Double", "x"): "INT", ("DOUBLE", "Y"): "DINT", ("double", "no"): "", ("TON", "pt"): "TIME", ("ton", "ET"): "TIME",
            ("CTU", "CV"): "INT", ("TON", "no"): "", ("Nobody", "x"): "", ("Sum", "rest"): "SINT"}  # fmt: skip
    assert {pin: scope().output_type(*pin) for pin in pins} == pins
    assert [scope().is_block(kind) for kind in ("Double", "Sum", "ton", "INT")] == [True, False, True, False]
    found = library_block("TON")
    assert found is not None and found[1].name.text == "TON" and library_block("NOBODY") is None


def test_a_dotted_name_may_end_in_an_action() -> None:
    names = {"d.Act": True, "d.y": False, "d.inner.z": False, "d.inner.Go": True, "nothing.x": True, "t.Q": True}
    assert {name: scope().names_action(name) for name in names} == names


ROOTS = {
    "n": "N", "n.x": "N", "d.y": "D", "in1": "IN1", "temp": "TEMP", "io": SHARED, "Shared": SHARED, "plain": "PLAIN", "p": SHARED,
    "at": SHARED, "nothing": SHARED, "Double": SHARED, "%MW5": SHARED, "": SHARED, "Act": "ACT",
}  # fmt: skip


def test_a_name_stands_for_memory_of_its_own_or_for_shared_one() -> None:
    assert {name: scope().root(name) for name in ROOTS} == ROOTS
    assert scope().roots("n + d.y * INT#5 > %MW3 AND NOT b OR 'n'") == {"N", "D", "B", SHARED}
    assert scope().roots("TRUE AND 5 MOD 3") == frozenset()
    assert scope().keys("Shared + at + n.x + %mw9 + INT#7") == {"%MW7", "%IW3", "N", "%MW9"}
    assert [scope().key(name) for name in ("shared", "at", "n.x", "%mw1", "5")] == ["%MW7", "%IW3", "N", "%MW1", "5"]
    assert scope().shared("double") == {"%MW7", "%MW5"} and scope().shared("nothing") == frozenset()


def test_new_names_are_free_ones() -> None:
    made = scope()
    assert [made.new("n", "INT", True), made.new("n", "INT", False), made.new("Act", "BOOL", False), made.new("Double", "BOOL",
            False),
            made.new("Plain", "BOOL", True), made.new("free", "BOOL", True)] == ["n_2", "n_3", "Act_2", "Double_2", "Plain_2",
                    "free"]
    assert made.made == {("VAR", "INT"): ["n_2"], ("VAR_TEMP", "INT"): ["n_3"], ("VAR_TEMP", "BOOL"): ["Act_2", "Double_2"],
                         ("VAR", "BOOL"): ["Plain_2", "free"]}  # fmt: skip
    assert [made.is_taken(name) for name in ("FREE", "way", "sum", "shared", "other")] == [True, True, True, True, False]
    function = scope(SUM)
    assert function.new("x", "INT", False) == "x" and function.made == {("VAR", "INT"): ["x"]}
    assert [made.declares(text) for text in ("n", "n.x + 1", "nothing", "5", "")] == [True, True, False, False, False]


BITS = {"W0.00": "%W0.00", "0.05": "%CIO0.05", "n": "n", "P_On": "P_On", "T5": "%TF5", "b": "b", "D0": "D0"}


def test_an_address_of_a_rung_gets_its_sign_unless_it_is_declared() -> None:
    found = {text: scope().bit(text) for text in BITS}
    assert found["n"] == "n" and found["b"] == "b" and found["W0.00"].startswith("%W0")
    assert scope(pou("Main", "PROGRAM", VAR="T5 : BOOL")).bit("T5") == "T5" != found["T5"]


RESULTS = {
    "GT": "BOOL", "NE": "BOOL", "LEN": "INT", "FIND": "INT", "INT_TO_REAL": "REAL", "TO_DINT": "DINT", "REAL_TO_STRING": "STRING",
    "ADD_TIME": "TIME", "ADD_LTIME": "LTIME", "SUB_DATE_DATE": "TIME", "SUB_LDATE_LDATE": "LTIME", "ADD_TOD_TIME": "TOD",
    "SUB_DT_TIME": "DT",
    "ADD": "", "SEL": "", "MOVE": "", "ABS": "", "Nothing": "", "ADD_INT": "INT", "GT_INT": "BOOL",
}  # fmt: skip


def test_the_type_of_a_result_is_said_by_the_name_of_the_function() -> None:
    assert {name: _standard_type(name) for name in RESULTS} == RESULTS


def item(text: str, *inputs: Any, kind: str = "block", instance: str = "", negated: bool = False) -> Any:
    return SimpleNamespace(kind=kind, text=text, instance=instance, negated=negated, inputs=list(inputs))


def pin(name: str, expression: str = "", *wires: Any) -> Any:
    return SimpleNamespace(name=name, expression=expression, wires=list(wires))


def wire(source: Any, name: str = "") -> Any:
    return SimpleNamespace(source=source, pin=name)


def test_the_type_on_a_wire_is_that_of_its_source() -> None:
    n, moment = (item(text, kind="inVariable") for text in ("n", "w"))
    add = item("ADD", pin("EN", "TRUE"), pin("IN1", "", wire(n)), pin("IN2", "5"))
    between, since = (item("SUB", pin("IN1", "", wire(moment)), other) for other in (pin("IN2", "", wire(moment)), pin("IN2",
            "T#1s")))
    cases = [
        ("BOOL", wire(item("", kind="leftPowerRail"))), ("BOOL", wire(item("a", kind="contact"))), ("BOOL", wire(item("",
        kind="jump"))),
        ("INT", wire(n)), ("INT", wire(item("n", kind="inOutVariable"))), ("INT", wire(item("n", kind="inVariable",
        negated=True))),
        ("BOOL", wire(item("x > y", kind="inVariable", negated=True))), ("", wire(item("x > y", kind="inVariable"))),
        ("", wire(item("n", kind="outVariable"))), ("BOOL", wire(add, "eno")), ("INT", wire(add, "OUT")), ("BOOL",
        wire(item("GT"), "OUT")),
        ("DINT", wire(item("Double", instance="d"), "y")), ("TIME", wire(item("TON", instance="t"), "ET")),
        ("LREAL", wire(item("sum"), "OUT")), ("SINT", wire(item("Sum"), "rest")), ("", wire(item("Nobody"), "OUT")),
        ("TIME", wire(between, "OUT")), ("DATE_AND_TIME", wire(since, "OUT")), ("", wire(item("ADD", pin("IN1", "5")), "OUT")),
        ("TIME", wire(item("SUB", pin("IN1", "w"), pin("IN2", "w")), "OUT")),
    ]  # fmt: skip
    for number, (kind, made) in enumerate(cases):
        assert scope().wire_type(made) == kind, number
    deep = add
    for _ in range(11):
        deep = item("ADD", pin("IN1", "", wire(deep, "OUT")), pin("IN2", "5"))
    assert scope().wire_type(wire(deep, "OUT")) == "INT"
    deeper = item("ADD", pin("IN1", "", wire(item("ADD", pin("IN1", "", wire(deep, "OUT"))), "OUT")))
    assert scope().wire_type(wire(deeper, "OUT")) == "", "so far nobody looks"


@pytest.mark.parametrize(("made", "said"), [
    (item("ADD"), True), (item("SEL"), True), (item("GT"), False), (item("Sum"), False), (item("TON", instance="t"), False),
    (item("Nobody"), False), (item("LEN"), False)])  # fmt: skip
def test_a_standard_function_may_have_the_type_of_its_operands(made: Any, said: bool) -> None:
    assert scope().has_type_of_operands(made) is said
