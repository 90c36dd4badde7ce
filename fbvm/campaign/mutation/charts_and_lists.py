"""Mutation operators of sequential function charts and of instruction lists, as changes of the source text.

Charts (Rosiak et al. 2022 name such changes): TRD a transition left out, NIO its condition negated, ASD an action left out of a
step, QUAL another qualifier of an action (table 59).  Lists: the operators of Structured Text in the words of the list (tables
68 and 69): ROR, LRO, ARO, NIO (with and without N), SRO, SDL."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TypeAlias

from fbvm.base.types import fold
from fbvm.syntax.il.instructions import Instruction, read_instructions
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.node import Node
from fbvm.syntax.tree.sfc import Association, Transition

Replacement: TypeAlias = tuple[str, int, int, str]
"""Operator, start, end, new text."""
Table: TypeAlias = dict[str, tuple[str, ...]]

_QUALIFIERS: Table = {"N": ("S", "P"), "S": ("N", "R"), "R": ("S",), "P": ("N",), "P0": ("P1",), "P1": ("P0",), "L": ("D",),
                      "D": ("L",), "SD": ("SL", "DS"), "DS": ("SD",), "SL": ("SD",)}  # fmt: skip
"""Qualifiers that are taken for one another by mistake; those with a time stay ones with a time."""
_QUALIFIER = re.compile(r"\(\s*([A-Za-z]\w?)\s*[,)]")

_RELATIONS: Table = {"GT": ("GE", "LT"), "GE": ("GT", "LE"), "LT": ("LE", "GT"), "LE": ("LT", "GE"), "EQ": ("NE",), "NE": ("EQ",)}
_ARITHMETIC: Table = {"ADD": ("SUB",), "SUB": ("ADD",), "MUL": ("DIV",), "DIV": ("MUL",), "MOD": ("DIV",)}
_LOGICAL: Table = {"AND": ("OR",), "OR": ("AND",), "XOR": ("OR",), "ANDN": ("ORN",), "ORN": ("ANDN",), "XORN": ("ORN",)}
_NEGATED: Table = {name: (f"{name}N",) for name in ("LD", "ST", "AND", "OR", "XOR", "JMPC", "CALC", "RETC")}
_OPERATORS: dict[str, Table] = {
    "ROR": _RELATIONS, "ARO": _ARITHMETIC, "LRO": _LOGICAL, "SRO": {"S": ("R",), "R": ("S",)},
    "NIO": _NEGATED | {negated: (name,) for name, (negated,) in _NEGATED.items()}}  # fmt: skip
"""What stands for an operator of the list, by the name of the mutation operator."""


def of_transition(text: str, node: Node) -> Iterator[Replacement]:
    """A transition left out, or its condition negated."""
    assert isinstance(node, Transition)
    yield "TRD", node.start, node.end, ""
    if node.body is None:
        condition = node.condition
        yield "NIO", condition.start, condition.end, f"NOT ({text[condition.start : condition.end]})"


def of_association(text: str, node: Node) -> Iterator[Replacement]:
    """An action left out of a step, or with another qualifier."""
    assert isinstance(node, Association)
    yield "ASD", node.start, node.end, ""
    written = _QUALIFIER.search(text, node.start, node.end)
    if written and fold(written[1]) == fold(node.qualifier):
        for new in _QUALIFIERS.get(node.qualifier, ()):
            yield "QUAL", written.start(1), written.end(1), new


def of_list(text: str, node: Node) -> Iterator[Replacement]:
    """The instructions of a list, each with another operator, or left out."""
    assert isinstance(node, InstructionList)
    for instruction in read_instructions(text, node.start, node.end, lambda *said: None):
        yield from _of_instruction(instruction)


def _of_instruction(instruction: Instruction) -> Iterator[Replacement]:
    word = instruction.word
    if word is None:
        return
    for operator, table in _OPERATORS.items():
        for new in table.get(instruction.name.upper(), ()):
            if fold(word.text) == fold(instruction.name):
                yield operator, word.start, word.end, new
    if not instruction.opens and instruction.name != ")":
        yield "SDL", word.start, instruction.end, ""
