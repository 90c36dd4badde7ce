"""Tells the pieces of code from each other: an address, an expression, the operands of a row by their words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from fbvm.code.operations import EXPRESSIONS, STATEMENTS, Block, Node


def is_address(item: Any) -> bool:
    """True for `(base, offset, terms)`; an expression has a machine type where an address has its offset."""
    return isinstance(item, tuple) and len(item) == 3 and isinstance(item[1], int) and (
        item[0] in ("abs", "self") or (isinstance(item[0], tuple) and item[0][:1] == ("ref",)))


def is_expression(item: Any) -> bool:
    """True for `(name, type, *operands)`."""
    return isinstance(item, tuple) and len(item) > 1 and item[0] in EXPRESSIONS and isinstance(item[1], str)


@cache
def operand_words(name: str) -> tuple[str, ...]:
    """The words of the table for the operands of an operation, `(a, ...)` as one."""
    row = EXPRESSIONS.get(name) or STATEMENTS[name]
    return tuple(re.findall(r"\([^ ]*, \.\.\.\)|\S+", row.operands))


def blocks(node: Node) -> tuple[Block, ...]:
    """The blocks that a statement holds."""
    if node[0] == "if":
        return (*(block for _, block in node[1]), node[2])
    if node[0] == "case":
        return (*(block for _, block in node[3]), node[4])
    return node[1:] if node[0] == "loop" else ()


def statements(code: Block) -> Iterator[Node]:
    """All statements of a body, those inside others too, in no order that matters."""
    rest = [code]
    while rest:
        for node in rest.pop():
            yield node
            rest += blocks(node)
