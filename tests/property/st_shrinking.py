"""A program that shows a difference without all that it can lose while it still differs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from st_kinds import GENERIC, Node, Pou, Program


def smallest(program: Program, differs: Callable[[Program], bool]) -> Program:
    """The program without all that it can lose while it still differs."""
    while True:
        for smaller in _smaller(program):
            if differs(smaller):
                program = smaller
                break
        else:
            return program


def _smaller(program: Program) -> Iterator[Program]:
    for at, pou in enumerate(program.pous):
        for changed in _smaller_pous(pou):
            yield replace(program, pous=(*program.pous[:at], changed, *program.pous[at + 1:]))
        if pou.kind != "PROGRAM":
            yield replace(program, pous=(*program.pous[:at], *program.pous[at + 1:]))
    if program.structs:
        yield replace(program, structs=program.structs[:-1])
    if program.tasks:
        yield replace(program, tasks=program.tasks[1:])
    for at in range(len(program.variables)):
        yield replace(program, variables=(*program.variables[:at], *program.variables[at + 1:]))


def _smaller_pous(pou: Pou) -> Iterator[Pou]:
    for body in _smaller_blocks(pou.body):
        yield replace(pou, body=body)
    if pou.actions:
        name, block = pou.actions[0]
        yield replace(pou, actions=())
        for smaller in _smaller_blocks(block):
            yield replace(pou, actions=((name, smaller),))
    used = repr((pou.body, pou.actions))
    for at, row in enumerate(pou.variables):
        if f"'{row.name}'" not in used:
            yield replace(pou, variables=(*pou.variables[:at], *pou.variables[at + 1:]))
        elif row.initial is not None:
            yield replace(pou, variables=(*pou.variables[:at], replace(row, initial=None), *pou.variables[at + 1:]))


def _is_block(item: Any) -> bool:
    return isinstance(item, tuple) and all(_is_statement(part) for part in item)


def _is_statement(item: Any) -> bool:
    return isinstance(item, tuple) and len(item) > 1 and isinstance(item[0], str) and isinstance(item[1], int)


def _is_value(item: Any) -> bool:
    return isinstance(item, tuple) and len(item) > 2 and item[0] in (
        "get", "widen", "convert", "truncate", "bcd", "to_bcd",
        "binary", "compare", "unary", "call", "user", "enabled", "named", "moved", "apart")


def _smaller_blocks(block: tuple[Node, ...]) -> Iterator[tuple[Node, ...]]:
    """Blocks with fewer statements, or smaller ones; big pieces go first."""
    size = len(block) // 2
    while size > 1:
        for at in range(0, len(block), size):
            yield block[:at] + block[at + size:]
        size //= 2
    for at, statement in enumerate(block):
        yield block[:at] + block[at + 1:]
        for inner in _blocks_in(statement):
            yield block[:at] + inner + block[at + 1:]
    for at, statement in enumerate(block):
        for changed in _smaller_nodes(statement):
            yield (*block[:at], changed, *block[at + 1:])


def _blocks_in(item: Any) -> Iterator[tuple[Node, ...]]:
    for part in item:
        if part and _is_block(part):
            yield part
        elif isinstance(part, tuple):
            yield from _blocks_in(part)


def _smaller_nodes(item: Any) -> Iterator[Any]:
    """A node with one of its parts made smaller."""
    for at, part in enumerate(item):
        if not isinstance(part, tuple):
            continue
        if part and _is_block(part):
            changes: Iterator[Any] = _smaller_blocks(part)
        else:
            changes = _smaller_values(part) if _is_value(part) else _smaller_nodes(part)
        for changed in changes:
            yield (*item[:at], changed, *item[at + 1:])


def _smaller_values(node: Node) -> Iterator[Node]:
    """A literal, a part of the same type, the same operation with a smaller part."""
    kind = node[1]
    if kind not in GENERIC:
        yield "literal", kind, {"BOOL": False, "STRING": "", "WSTRING": "", "CHAR": "a", "WCHAR": "a", "REAL": 1.0, "LREAL": 1.0,
                                "DATE": 0, "LDATE": 0}.get(kind, 1)
    yield from (part for part in _values_in(node) if part[1] == kind and part is not node)
    yield from _smaller_nodes(node)


def _values_in(item: Any) -> Iterator[Node]:
    for part in item:
        if _is_value(part) or (isinstance(part, tuple) and part[:1] == ("literal",)):
            yield part
        if isinstance(part, tuple):
            yield from _values_in(part)
