"""Step costs: how much of the step budget a piece of a program charges."""

from __future__ import annotations

from fbvm.check.symbols.statement_lists import bodies
from fbvm.syntax import tree

_LOOPS = tree.For | tree.While | tree.Repeat


def step_cost(statements: tree.Block) -> int:
    """What a block charges at its start: the number of its statements, without those inside loops."""
    total = 0
    for statement in statements:
        total += 1
        if not isinstance(statement, _LOOPS):
            total += sum(step_cost(inner) for inner in bodies(statement))
    return total
