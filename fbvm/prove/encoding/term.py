"""One node of the graph of terms, and what can be seen of it alone."""

from __future__ import annotations

from typing import Any

TEXT = -1
FEW_LEAVES = 64
"""Constants at the ends of nested `ite` through which a comparison is carried."""

FEW_CHOICES = 16
"""Such constants through which arithmetic is carried."""


class Term:
    """An operation (`op`) of operands (`args`); `value` is the number of a constant, the name of a variable, the lowest bit of an
    `extract`.  `low` and `high` bound the value, read as an unsigned number."""

    __slots__ = ("args", "high", "low", "number", "op", "value", "width")

    def __init__(self, op: str, width: int, args: tuple[Term, ...], value: Any, number: int, low: int, high: int) -> None:
        self.op, self.width, self.args, self.value, self.number = op, width, args, value, number
        self.low, self.high = low, high

    @property
    def is_constant(self) -> bool:
        return self.op == "const"

    def __repr__(self) -> str:
        if self.op in ("const", "var"):
            return f"{self.value}"
        mark = f":{self.value}" if self.value is not None else ""
        return f"({self.op}{mark} {' '.join(map(repr, self.args))})"


def signed(value: int, width: int) -> int:
    """An unsigned number of some bits read as a signed one."""
    return value - (1 << width) if value >> (width - 1) else value


def bounds(a: Term, is_signed: bool, depth: int = 4) -> tuple[int, int]:
    """The least and the greatest number that a bit-vector can be; `depth` operations of it are looked at."""
    if not is_signed:
        return a.low, a.high
    sign = 1 << (a.width - 1)
    if a.high < sign:
        return a.low, a.high
    if a.low >= sign:
        return a.low - 2 * sign, a.high - 2 * sign
    if a.op == "sext":
        return bounds(a.args[0], True, depth)
    if a.op == "ite" and depth:
        (al, ah), (bl, bh) = (bounds(way, True, depth - 1) for way in a.args[1:])
        return min(al, bl), max(ah, bh)
    return -sign, sign - 1


def opposite(a: Term, b: Term) -> bool:
    return (a.op == "not" and a.args[0] is b) or (b.op == "not" and b.args[0] is a)


def constants_of(term: Term, most: int) -> set[int] | None:
    """The constants at the ends of nested `ite`; None if others stand there, or more than `most` of them."""
    found: set[int] = set()
    waiting, seen = [term], {term}
    while waiting:
        at = waiting.pop()
        if at.op == "const":
            found.add(at.value)
        elif at.op != "ite":
            return None
        else:
            fresh = [way for way in at.args[1:] if way not in seen]
            seen.update(fresh)
            waiting += fresh
        if len(found) > most:
            return None
    return found


def is_choice(term: Term) -> bool:
    """True for one of a few constants, through which operations with another constant are carried."""
    return term.op == "ite" and leaf_count(term, FEW_CHOICES) is not None


def leaf_count(term: Term, most: int) -> int | None:
    """How many constants stand at the ends of nested `ite`; None if others do, or more than `most`."""
    if term.op == "const":
        return 1
    if term.op != "ite" or most < 2:
        return None
    left = leaf_count(term.args[1], most - 1)
    right = None if left is None else leaf_count(term.args[2], most - left)
    return None if left is None or right is None else left + right
