"""How deep an expression may be, to the operator; what a POU's parser keeps of the one before: nothing; texts at pins."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.syntax.il import lowering
from fbvm.syntax.ladder import context
from fbvm.syntax.parser import parse
from fbvm.syntax.st import builder
from fbvm.syntax.st.automaton import STACK_LIMIT
from fbvm.syntax.tree import Pou
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.outline import dump


def codes(statement: str) -> list[str]:
    return [d.code for d in parse(Source("x", f"PROGRAM p\n{statement}\nEND_PROGRAM"))[1]]


@each_of(("head", "part", "tail", "deepest"), (
    ("a := b", ".c", ";", 19), ("a := b", ".C#D", ";", 9), ("a := b", "[1]", ";", 19), ("a := b", "^", ";", 19),
    ("a := b", "(1)", ";", 19), ("a := b", " + 1", ";", 19), ("a := ", "NOT ", "b;", 19), ("a := b", ".1", ".2;", 18),
    ("a := b", "(c := d)", ";", 19), ("a := b", " ** 2", ";", 19)))  # fmt: skip
def test_an_expression_is_as_deep_as_it_may_be(head: str, part: str, tail: str, deepest: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(builder, "CHAIN_LIMIT", 20)
        assert codes(head + part * deepest + tail) == []
        assert codes(head + part * (deepest + 1) + tail) == ["S0106"]


@each_of(("step", "deepest"), (
    ("AND b", 18), ("OR b", 18), ("ANDNOT b", 17), ("NOT", 18), ("UP", 9), ("LD b\nLD c\nANDLD\nORLD", 17)))
def test_a_rung_joins_as_many_conditions_as_it_may(step: str, deepest: int) -> None:
    """The first and the last of what is allowed are the contact of LD and the coil."""

    def said(count: int) -> list[str]:
        steps = "\n".join(["LD a", *[step] * count, "OUT a"])
        text = f"PROGRAM p\nVAR a, b, c : BOOL; END_VAR\nLADDER\n{steps}\nEND_LADDER\nEND_PROGRAM"
        return [found.message for found in parse(Source("x", text))[1]]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(context, "CHAIN_LIMIT", 20)
        assert said(deepest) == []
        assert said(deepest + 1) == ["more than 20 conditions are joined"]


def test_a_list_does_not_know_the_instances_of_the_pou_before() -> None:
    text = "PROGRAM {0}\nVAR f : {1}; x : BOOL; END_VAR\nLD x\nS f\nEND_PROGRAM\n"
    tree, errors = parse(Source("x", text.format("A", "RS") + text.format("B", "BOOL")))
    assert not errors
    made = []
    for pou in tree.declarations:
        assert isinstance(pou, Pou) and isinstance(pou.body[0], InstructionList)
        made.append(type(pou.body[0].body[-1]).__name__)
    assert made == ["CallStatement", "Assign"]


DEEP, NO_OPERAND = "this is nested too deep", "an operand is a variable or a constant, not an expression"


@each_of(("operand", "said"), (
    ("-" * 19 + "n", NO_OPERAND), ("-" * 20 + "n", DEEP), ("n" + ".a" * 19, ""), ("n" + ".a" * 20, DEEP),
    ("a[" * 201 + "1", DEEP)))
def test_an_operand_of_a_list_is_as_deep_as_it_may_be(operand: str, said: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(builder, "CHAIN_LIMIT", 20)
        found = parse(Source("x", f"PROGRAM p\nLD {operand}\nST n\nEND_PROGRAM\n"))[1]
    assert [(each.code, each.message) for each in found] == ([("S0114", said)] if said else [])


def test_signs_without_end_are_nested_too_deep() -> None:
    assert codes(f"a := {'-' * (STACK_LIMIT + 1)}(1);") == ["S0106"]


def test_a_long_current_result_of_a_list_is_kept_in_a_temporary() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lowering, "LONGEST", 3)
        tree, errors = parse(Source("x", "PROGRAM p\nLD 1\n" + "ADD 2\n" * 6 + "ST n\nEND_PROGRAM\n"))
    assert not errors and isinstance(tree.declarations[0], Pou)
    made = " ".join(dump(tree.declarations[0].body[0]).partition("temporaries")[0].split())
    assert made == ("InstructionList body: - Assign targets=[$CR1] op=:= value: Binary + int:2 left: Binary + int:2 left: "
                    "Binary + int:1 int:2 Assign targets=[n] op=:= value: Binary + int:2 left: Binary + int:2 left: "
                    "Binary + $CR1 int:2")


def test_a_pin_of_a_block_in_a_rung_may_be_a_text_a_truth_value_or_a_literal_with_its_type() -> None:
    pins = "IN:='one' T:=\"two\" On:=TRUE Off:=False N:=INT#5 Q=>b"
    tree, errors = parse(Source("x", f"PROGRAM p\nLADDER\nLD a\nFBCALL Shown s {pins}\nEND_LADDER\nEND_PROGRAM\n"))
    assert not errors
    assert [" ".join(line.split()[2:]) for line in dump(tree).split("\n") if "Argument" in line][1:6] == [
        "name=IN value=string:'one'", "name=T value=wstring:'two'", "name=On value=bool:True", "name=Off value=bool:False",
        "name=N value=INT#int:5"]
