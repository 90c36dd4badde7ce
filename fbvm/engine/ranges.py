"""Value ranges of integer expressions, and whether an expression can trap.

A back end leaves out wraps that a range shows to be needless, and evaluates in any order what cannot trap."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fbvm.base.arithmetic import limits, quotient, width, wrap
from fbvm.code.operations import EXPRESSIONS, INTEGERS, Block, Node
from fbvm.code.shapes import is_address, is_expression, statements

Range = tuple[int, int]
RangeOf = Callable[[Node], Range]


def is_float(machine: str) -> bool:
    return machine[0] == "f"


def may_trap(item: Any) -> bool:
    """True if evaluating an operand could end the run.  `item` is an operand of an operation: an expression, an address, a
    tuple of these, or a constant."""
    if not isinstance(item, tuple) or not item:
        return False
    if is_address(item):
        return isinstance(item[0], tuple) or any(may_trap(term) for _, term in item[2])
    if is_expression(item):
        return _traps_itself(item) or any(may_trap(operand) for operand in item[2:])
    return any(may_trap(part) for part in item)


def constant_integer(node: Node) -> int | None:
    """The value of an integer expression that is a constant or a conversion of one; else None.

    >>> constant_integer(("convert", "u8", "i16", ("const", "i16", -1)))
    255
    """
    if node[0] == "const" and not is_float(node[1]):
        return int(node[2])
    if node[0] == "convert" and not is_float(node[1]) and not is_float(node[2]):
        value = constant_integer(node[3])
        return None if value is None else wrap(value, node[1])
    return None


def _traps_itself(node: Node) -> bool:
    name = node[0]
    if name in ("div", "mod"):
        return not is_float(node[1]) and not constant_integer(node[3])
    if name in ("shl", "shr", "rol", "ror"):
        count = constant_integer(node[3])
        return count is None or count < 0
    if name == "load_flag":
        return False  # by its address
    return bool(EXPRESSIONS[name].traps)


def unwrapped_range(node: Node, of: RangeOf | None = None) -> Range:
    """The least and greatest number that an integer operation can yield before the number is wrapped into its type.

    `of` says what its operands can be: `value_range`, unless more is known."""
    row = _UNWRAPPED.get(node[0])
    return row(node, of or value_range) if row and node[1] in INTEGERS else limits(node[1])


def never_wraps(node: Node, of: RangeOf | None = None) -> bool:
    """True if the number that an integer operation yields always fits its type."""
    return _within(unwrapped_range(node, of), limits(node[1]))


def value_range(node: Node, of: RangeOf | None = None) -> Range:
    """The least and greatest value of an integer expression.

    >>> value_range(("add", "i32", ("convert", "i32", "u8", ("load", "u8", ("abs", 0, ()))), ("const", "i32", 1)))
    (1, 256)
    """
    whole, range_ = limits(node[1]), unwrapped_range(node, of)
    return range_ if _within(range_, whole) else whole


def with_temporaries(code: Block) -> RangeOf:
    """`value_range` for a body with this code, which knows of temporaries what their `let`s say.

    >>> index = ("check", "i64", ("load", "i64", ("abs", 4096, ())), 0, 9, "R0102", 1)
    >>> with_temporaries((("let", 1, "i64", index),))(("tmp", "i64", 1))
    (0, 9)
    """
    lets: dict[int, list[Node]] = {}
    given: set[int] = set()
    for node in statements(code):
        if node[0] == "let" and node[2] in INTEGERS:
            lets.setdefault(node[1], []).append(node[3])
        elif node[0] == "attempt":
            given.add(node[3])
    for number in given & lets.keys():
        del lets[number]  # an attempt gives it any number
    known: dict[int, Range] = {}

    def of(node: Node) -> Range:
        if node[0] != "tmp" or node[2] not in lets:
            return value_range(node, of)
        number = node[2]
        if number not in known:
            known[number] = limits(node[1])  # if it is made of itself
            known[number] = _union(of, *lets[number])
        return known[number]

    for number in sorted(lets):  # those that others are made of come first
        of(("tmp", lets[number][0][1], number))
    return of


def _within(inner: Range, outer: Range) -> bool:
    return outer[0] <= inner[0] and inner[1] <= outer[1]


def _sum(node: Node, of: RangeOf) -> Range:
    (low, high), (least, greatest) = of(node[2]), of(node[3])
    return low + least, high + greatest


def _difference(node: Node, of: RangeOf) -> Range:
    (low, high), (least, greatest) = of(node[2]), of(node[3])
    return low - greatest, high - least


def _product(node: Node, of: RangeOf) -> Range:
    left, right = of(node[2]), of(node[3])
    corners = [a * b for a in left for b in right]
    return min(corners), max(corners)


def _quotient(node: Node, of: RangeOf) -> Range:
    divisor = constant_integer(node[3])
    if divisor is not None and divisor > 0:
        low, high = of(node[2])
        return quotient(low, divisor), quotient(high, divisor)
    low, high = limits(node[1])
    return low, high + (low < 0)


def _remainder(node: Node, of: RangeOf) -> Range:
    low, high = of(node[2])
    if divisor := constant_integer(node[3]):
        most = abs(divisor) - 1
        low, high = max(low, -most), min(high, most)
    return min(low, 0), max(high, 0)


def _negative(node: Node, of: RangeOf) -> Range:
    low, high = of(node[2])
    return -high, -low


def _magnitude(node: Node, of: RangeOf) -> Range:
    return 0, max(map(abs, of(node[2])))


def _union(of: RangeOf, *nodes: Node) -> Range:
    ranges = [of(node) for node in nodes]
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def _masked(node: Node, of: RangeOf) -> Range:
    return 0, min(of(node[2])[1], of(node[3])[1])


def _bitwise(node: Node, of: RangeOf) -> Range:
    high = max(of(node[2])[1], of(node[3])[1])
    return 0, (1 << high.bit_length()) - 1


def _shifted(node: Node, of: RangeOf) -> Range:
    low, high = of(node[2])
    count = constant_integer(node[3])
    return (0, high >> min(count, 64)) if low >= 0 and count is not None and count >= 0 else limits(node[1])


def _converted(node: Node, of: RangeOf) -> Range:
    return limits(node[1]) if is_float(node[2]) else of(node[3])


def _checked(node: Node, of: RangeOf) -> Range:
    low, high = of(node[2])
    return max(low, node[3]), min(high, node[4])


def _floored(node: Node, of: RangeOf) -> Range:
    (low, high), divisor = of(node[2]), constant_integer(node[3])
    return (low // divisor, high // divisor) if divisor else limits(node[1])


_LENGTH = (0, (1 << 31) - 1)

_UNWRAPPED: dict[str, Callable[[Node, RangeOf], Range]] = {
    "const": lambda node, of: (node[2], node[2]),
    "add": _sum, "sub": _difference, "mul": _product, "div": _quotient, "mod": _remainder, "neg": _negative,
    "abs": _magnitude, "and": _masked, "or": _bitwise, "xor": _bitwise, "shr": _shifted, "convert": _converted,
    "check": _checked, "floor_div": _floored,
    "select": lambda node, of: _union(of, node[3], node[4]), "mux": lambda node, of: _union(of, *node[3]),
    "min": lambda node, of: _union(of, node[2], node[3]), "max": lambda node, of: _union(of, node[2], node[3]),
    "length": lambda node, of: _LENGTH, "find": lambda node, of: _LENGTH,
    "characters": lambda node, of: _LENGTH,
}


def mask(machine: str) -> int:
    """All bits of a type set."""
    return (1 << width(machine)) - 1
