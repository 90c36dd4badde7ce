"""The standard functions: a table from the key of a function's signature to the operations that it becomes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from fbvm.base.types import StringType, machine
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.builder import characters
from fbvm.code.builder.conversions import as_count, convert, truncate
from fbvm.code.builder.emitter import Emitter
from fbvm.code.operations import SIZES, UNKNOWN_EXCEPTION, WAYS_OUT, Node

Function = Callable[[Emitter, list[Node], StandardCall, int], Node]
"""Makes the expression of a call, from the arguments in the types that the call wants, the call and its site."""
_MATH = ("SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN")
_COMPARE = {"GT": "gt", "GE": "ge", "EQ": "eq", "LE": "le", "LT": "lt", "NE": "ne"}
_TEXT = {"LEFT": "left", "RIGHT": "right", "MID": "mid", "INSERT": "insert", "DELETE": "delete", "REPLACE": "replace"}


def _form(call: StandardCall) -> str:
    return machine(call.detail[0])


def _abs(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    return ("abs", _form(call), a[0])


def _math(name: str) -> Function:
    return lambda emitter, a, call, site: ("math", _form(call), name.lower(), a[0])


def _shift(name: str) -> Function:
    def lower(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
        form = _form(call)
        count = as_count(a[1], call.arguments[1][1])
        if form != "b":
            return (name, form, a[0], count, site)
        shifted = (name, "u8", ("convert", "u8", "b", a[0]), count, site)
        if name in ("rol", "ror"):  # a single bit turns into itself, for any count that is legal
            return ("is_set", "b", "u8", emitter.to_temporary(shifted))
        return ("is_set", "b", "u8", ("and", "u8", shifted, ("const", "u8", 1)))
    return lower


def _chain(name: str) -> Function:
    """MAX, MIN and CONCAT of any number of arguments, from left to right."""
    def lower(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
        form = _form(call)
        node = a[0]
        for following in a[1:]:
            node = emitter.cut_if_deep((name, form, node, following))
        return node
    return lower


def _compare(name: str) -> Function:
    """GT(a, b, c): TRUE if each argument stands in the relation to the next one."""
    def lower(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
        if len(a) > 2:
            a = [emitter.to_temporary(node) for node in a]
        form = _form(call)
        node: Node = (name, "b", form, a[0], a[1])
        for left, right in pairwise(a[1:]):
            node = emitter.cut_if_deep(("and", "b", node, (name, "b", form, left, right)))
        return node
    return lower


def _limit(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    form = _form(call)
    return ("min", form, ("max", form, a[1], a[0]), a[2])


def _select(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    return ("select", _form(call), a[0], a[1], a[2])


def _mux(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    chooser = as_count(a[0], call.arguments[0][1])
    if emitter.dialect.last_of_mux:
        last = ("min", "u64", ("convert", "u64", "i64", chooser), ("const", "u64", len(a) - 2))
        chooser = ("convert", "i64", "u64", last)
    return ("mux", _form(call), chooser, tuple(a[1:]), site)


_LEAST = {"left": (0,), "right": (0,), "mid": (0, 1), "insert": (0,), "delete": (0, 1), "replace": (0, 1)}
"""The least length and position that a function of texts takes, in the order of its parameters."""


def _text(name: str) -> Function:
    def lower(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
        operands = [node if isinstance(kind, StringType) else as_count(node, kind)
                    for node, (_, kind) in zip(a, call.arguments, strict=True)]
        if emitter.dialect.lenient_positions:
            at_least = iter(_LEAST[name])
            operands = [node if isinstance(kind, StringType) else ("max", "i64", node, ("const", "i64", next(at_least)))
                        for node, (_, kind) in zip(operands, call.arguments, strict=True)]
        if emitter.dialect.whole_characters and _form(call) == "s16":
            operands = characters.in_units(emitter, name, operands)
        return (name, _form(call), *operands, site)
    return lower


def _length(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    whole = emitter.dialect.whole_characters and a[0][1] == "s16"
    return characters.length(a[0]) if whole else ("length", "i16", a[0])


def _find(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    whole = emitter.dialect.whole_characters and a[0][1] == "s16"
    return characters.find(emitter, a[0], a[1]) if whole else ("find", "i16", a[0], a[1])


def _finite(emitter: Emitter, a: Node, form: str) -> Node:
    """IS_VALID: neither NaN nor infinite, as only then x - x is zero."""
    value = emitter.to_temporary(a)
    return ("eq", "b", form, ("sub", form, value, value), ("const", form, 0.0))


def _valid_bcd(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    """IS_VALID_BCD: no nibble is above 9, that is, has its bit 3 set, and bit 2 or bit 1 too."""
    form = _form(call)
    wide = emitter.to_temporary(a[0] if form == "u64" else ("convert", "u64", form, a[0]))
    doubled: Node = ("mul", "u64", wide, ("const", "u64", 2))
    lower = ("or", "u64", doubled, ("mul", "u64", wide, ("const", "u64", 4)))
    above = ("and", "u64", ("and", "u64", wide, lower), ("const", "u64", 0x8888_8888_8888_8888))
    return ("eq", "b", "u64", above, ("const", "u64", 0))


_SWAPS = ((8, 0x00FF_00FF_00FF_00FF), (16, 0x0000_FFFF_0000_FFFF), (32, 0x0000_0000_FFFF_FFFF))
"""Widths of neighbouring groups of bits that are exchanged, one width after the other, each with the mask of the lower groups."""


def _swapped(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    """TO_BIG_ENDIAN and its reverse: the bytes of a number in the other order, as memory has the lowest byte first."""
    form = _form(call)
    width = SIZES[form] * 8
    if width == 8:
        return a[0]
    word = f"u{width}"
    node = a[0] if form == word else ("convert", word, form, a[0])
    for bits, mask in _SWAPS:
        if bits < width:
            node = emitter.to_temporary(node)
            lower: Node = ("const", word, mask & (1 << width) - 1)
            count = ("const", "i64", bits)
            node = ("or", word, ("and", word, ("shr", word, node, count, site), lower),
                    ("shl", word, ("and", word, node, lower), count, site))
    return node if form == word else ("convert", form, word, node)


def _stop(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    emitter.emit(("stop", "R0120", site))
    return ("const", "b", 0)


def _raise(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    """A number that says how a body was left, which is no exception of CODESYS, is told as an unknown one."""
    number = emitter.to_temporary(a[0])
    is_free = ("gt", "b", "u32", number, ("const", "u32", max(WAYS_OUT.values())))
    emitter.emit(("raise", ("select", "u32", is_free, ("const", "u32", UNKNOWN_EXCEPTION), number), site))
    return ("const", "b", 0)


def _due(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    emitter.emit(("due", a[0]))
    return ("const", "b", 0)


def _from_bcd(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    """The number of BCD digits.  A digit above 9 traps; in a dialect all is 0 then."""
    node, form = a[0], machine(call.detail[0])
    if emitter.dialect.wrong_bcd_is_zero:
        node = emitter.to_temporary(node)
        node = ("select", form, _valid_bcd(emitter, [node], call, site), ("const", form, 0), node)
    return ("from_bcd", machine(call.detail[1]), form, node, site)


def _to_bcd(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    return ("to_bcd", machine(call.detail[1]), machine(call.detail[0]), a[0], site)


FUNCTIONS: dict[str, Function] = {
    "ABS": _abs, "ATAN2": lambda emitter, a, call, site: ("atan2", _form(call), a[0], a[1]),
    "MOVE": lambda emitter, a, call, site: a[0], "SEL": _select, "MUX": _mux, "LIMIT": _limit,
    "MAX": _chain("max"), "MIN": _chain("min"), "CONCAT": _chain("concat"),
    "LEN": _length, "FIND": _find,
    **dict.fromkeys(("TIME", "LTIME"), lambda emitter, a, call, site: ("now", "i64")), "__DUE": _due, "__STOP": _stop,
    "__RAISE": _raise,
    "IS_VALID": lambda emitter, a, call, site: _finite(emitter, a[0], _form(call)),
    "IS_VALID_BCD": _valid_bcd,
    "TO_BIG_ENDIAN": _swapped, "FROM_BIG_ENDIAN": _swapped,
    "TO_LITTLE_ENDIAN": lambda emitter, a, call, site: a[0], "FROM_LITTLE_ENDIAN": lambda emitter, a, call, site: a[0],
    "TO": convert, "TRUNC": truncate, "BCD_TO": _from_bcd, "TO_BCD": _to_bcd,
    **{name: _math(name) for name in _MATH},
    **{name: _shift(name.lower()) for name in ("SHL", "SHR", "ROL", "ROR")},
    **{name: _compare(op) for name, op in _COMPARE.items()},
    **{name: _text(op) for name, op in _TEXT.items()},
}
