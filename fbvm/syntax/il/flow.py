"""Where the current result of an instruction list is still needed: behind each instruction, on any way that goes on from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fbvm.base.types import fold
from fbvm.syntax.il.instructions import Instruction
from fbvm.syntax.il.operators import OPERATORS

_PASSES = {"call", "jump", "return", ""}
"""Kinds of instructions that neither need the current result nor replace it, if they have no condition."""


class Needs(NamedTuple):
    """For each instruction, whether the current result is needed in front of it, and behind it."""

    front: list[bool]
    behind: list[bool]


def needs(instructions: Sequence[Instruction], at_end: bool, calls_replace: bool = True) -> Needs:
    """Where the current result is needed: where some way on leads to an instruction that uses it before one replaces it, or to
    the end of the list, if it is needed `at_end`.

    A formal call replaces it if the function has a result, which only the checker knows: with `calls_replace` all do."""
    labels = {fold(each.label.text): at for at, each in enumerate(instructions) if each.label is not None}
    front = [False] * len(instructions) + [at_end]
    while True:
        before = list(front)
        behind = [_behind(at, each, front, labels) for at, each in enumerate(instructions)]
        for at in reversed(range(len(instructions))):
            front[at] = _needs(instructions[at]) or not _replaces(instructions[at], calls_replace) and behind[at]
        if front == before:
            return Needs(front, behind)


def _behind(at: int, instruction: Instruction, front: Sequence[bool], labels: Mapping[str, int]) -> bool:
    operator = OPERATORS.get(instruction.name)
    goes_on = operator is None or operator.kind not in ("jump", "return") or bool(operator.condition)
    jumps = operator is not None and operator.kind == "jump" and bool(instruction.operands)
    target = labels.get(fold(instruction.operands[0].text)) if jumps else None
    return goes_on and front[at + 1] or target is not None and front[target]


def _needs(instruction: Instruction) -> bool:
    if not instruction.name or is_formal(instruction):
        return False
    operator = OPERATORS.get(instruction.name)
    if operator is None:
        return True
    return bool(operator.condition) or operator.kind != "load" and operator.kind not in _PASSES


def _replaces(instruction: Instruction, calls_replace: bool) -> bool:
    operator = OPERATORS.get(instruction.name)
    return operator.kind == "load" if operator is not None else calls_replace and is_formal(instruction)


def is_formal(instruction: Instruction) -> bool:
    """Whether an instruction calls a function, or a method, with all its arguments in brackets: the current result is none of
    these."""
    called = 0
    while [token.text for token in instruction.operands[called:called + 1]] == ["."]:
        called += 2
    behind = instruction.operands[called:]
    return instruction.name not in OPERATORS and bool(behind) and behind[0].text == "("
