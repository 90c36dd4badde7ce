"""One stop a step: of the statements that a step of a rung becomes, debuggers stop at the one that does what the step says."""

from __future__ import annotations

from collections.abc import Container

from fbvm.syntax.tree import Assign, Block, If, NameRef, Statement
from fbvm.syntax.tree.node import changed


def with_one_stop(statements: Block, temporaries: Container[str]) -> Block:
    """The statements of one step, of which one has an extent on each way through jumps and interlocks, the others none.

    That is the first one that does more than keep a value in one of `temporaries`, or the last one if all do just that.  A
    statement without extent is executed with the one before it: no debugger stops there."""
    acting = [number for number, statement in enumerate(statements) if not _keeps_value(statement, temporaries)]
    chosen = acting[0] if acting else len(statements) - 1
    return tuple(_stopping(statement, temporaries) if number == chosen else _hidden(statement)
                 for number, statement in enumerate(statements))  # fmt: skip


def _keeps_value(statement: Statement, temporaries: Container[str]) -> bool:
    """True for an assignment to a temporary, and for a guard around nothing else."""
    if isinstance(statement, Assign):
        return all(isinstance(target, NameRef) and target.text in temporaries for target in statement.targets)
    return _is_guard(statement) and all(_keeps_value(inner, temporaries) for block in _blocks(statement) for inner in block)


def _is_guard(statement: Statement) -> bool:
    """True for the IF of a jump or an interlock that covers the step, which is not in the source."""
    return isinstance(statement, If) and statement.start == statement.end


def _blocks(statement: Statement) -> list[Block]:
    return [*(block for _, block in statement.branches), statement.otherwise or ()] if isinstance(statement, If) else []


def _stopping(statement: Statement, temporaries: Container[str]) -> Statement:
    """The statement with a stop: its own, or within a guard one in each branch."""
    if not isinstance(statement, If):
        return statement
    if _is_guard(statement):
        return _with_blocks(statement, [with_one_stop(block, temporaries) for block in _blocks(statement)])
    return _with_blocks(statement, [without_stops(block) for block in _blocks(statement)])


def without_stops(statements: Block) -> Block:
    """The statements without extent, of a step at whose place its rung stops already."""
    return tuple(map(_hidden, statements))


def _hidden(statement: Statement) -> Statement:
    """The statement, and all inside, without extent."""
    if isinstance(statement, If):
        statement = _with_blocks(statement, [without_stops(block) for block in _blocks(statement)])
    return changed(statement, end=statement.start)


def _with_blocks(statement: If, blocks: list[Block]) -> If:
    *branches, otherwise = blocks
    rows = tuple((condition, block) for (condition, _), block in zip(statement.branches, branches, strict=True))
    return changed(statement, branches=rows, otherwise=otherwise if statement.otherwise is not None else None)
