"""Functions of WSTRING that count characters: one beyond 16#FFFF fills two units of UTF-16, and is one character.

Lengths and positions become those of units, with which the operations on texts work.  What traps there still does, with the
number that the program gave."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.code.builder.emitter import Emitter
from fbvm.code.operations import Node

MOST = 1 << 16
"""More than any WSTRING has characters: sums of what is cut to this do not overflow."""


def length(text: Node) -> Node:
    """LEN: the number of characters, as i16."""
    return ("convert", "i16", "i64", ("characters", "i64", text))


def find(emitter: Emitter, text: Node, wanted: Node) -> Node:
    """FIND: the number of the character with which the first `wanted` in a text begins; 0 if there is none."""
    text = emitter.to_temporary(text)
    found: Node = ("convert", "i64", "i16", ("find", "i16", text, wanted))
    return ("convert", "i16", "i64", ("characters", "i64", ("left", "s16", text, found, 0)))


def in_units(emitter: Emitter, name: str, operands: list[Node]) -> list[Node]:
    """The operands of an operation on texts, in units; `operands` are its texts, then its length and its position."""
    kept = [emitter.to_temporary(operand) for operand in operands]
    return _OPERANDS[name](kept)


def _left(a: list[Node]) -> list[Node]:
    return [a[0], _units(a[0], a[1])]


def _right(a: list[Node]) -> list[Node]:
    text, count = a
    front = _units(text, ("max", "i64", ("sub", "i64", ("characters", "i64", text), count), _number(0)))
    taken: Node = ("sub", "i64", ("convert", "i64", "i16", ("length", "i16", text)), front)
    return [text, _unless_less(count, 0, taken)]


def _span(a: list[Node]) -> list[Node]:
    *texts, count, position = a
    text = texts[0]
    start = _units(text, ("sub", "i64", _cut(position), _number(1)))
    end = _units(text, ("add", "i64", ("sub", "i64", _cut(position), _number(1)), _cut(count)))
    return [*texts, _unless_less(count, 0, ("sub", "i64", end, start)),
            _unless_less(position, 1, ("add", "i64", start, _number(1)))]


def _insert(a: list[Node]) -> list[Node]:
    return [*a[:2], _units(a[0], a[2])]


_OPERANDS: dict[str, Callable[[list[Node]], list[Node]]] = {
    "left": _left, "right": _right, "mid": _span, "delete": _span, "replace": _span, "insert": _insert}


def _number(value: int) -> Node:
    return ("const", "i64", value)


def _units(text: Node, count: Node) -> Node:
    return ("units_of", "i64", text, count)


def _cut(number: Node) -> Node:
    """A number from -MOST to MOST."""
    return ("max", "i64", ("min", "i64", number, _number(MOST)), _number(-MOST))


def _unless_less(given: Node, low: int, meant: Node) -> Node:
    """`meant`, but a number below `low` as it was given, at which the operation traps."""
    return ("select", "i64", ("lt", "b", "i64", given, _number(low)), meant, given)
