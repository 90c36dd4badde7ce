"""What a piece of a program charges to the step budget."""

from __future__ import annotations

from fbvm.check.symbols.statement_lists import bodies
from fbvm.syntax import tree

_LOOPS = tree.For | tree.While | tree.Repeat


def counted(statements: tree.Block) -> int:
    """Statements of a block that are not inside a loop: what it charges to the step budget."""
    total = 0
    for statement in statements:
        total += 1
        if not isinstance(statement, _LOOPS):
            total += sum(counted(inner) for inner in bodies(statement))
    return total
