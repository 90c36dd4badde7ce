"""What the standard functions do: one row each, from the key of its signature to operations."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

from fbvm.base.types import DAY_NS, DINT, EnumType, StringType, Type, base, machine
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.lowering import plc_addresses
from fbvm.code.operations import FLOATS, SIZES, Node

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering

Lowering = Callable[["BodyLowering", list[Node], StandardCall, int], Node]
_MATH = ("SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN")
_COMPARE = {"GT": "gt", "GE": "ge", "EQ": "eq", "LE": "le", "LT": "lt", "NE": "ne"}
_TEXT = {"LEFT": "left", "RIGHT": "right", "MID": "mid", "INSERT": "insert", "DELETE": "delete", "REPLACE": "replace"}


def _form(call: StandardCall) -> str:
    return machine(call.detail[0])


def _abs(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    return ("abs", _form(call), a[0])


def _math(name: str) -> Lowering:
    return lambda body, a, call, site: ("math", _form(call), name.lower(), a[0])


def _shift(name: str) -> Lowering:
    def lower(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
        form = _form(call)
        count = as_count(a[1], call.arguments[1][1])
        if form != "b":
            return (name, form, a[0], count, site)
        shifted = (name, "u8", ("convert", "u8", "b", a[0]), count, site)
        if name in ("rol", "ror"):  # a single bit turns into itself, for any count that is legal
            kept = body.keep(shifted)
            return ("is_set", "b", "u8", kept)
        return ("is_set", "b", "u8", ("and", "u8", shifted, ("const", "u8", 1)))
    return lower


def as_count(node: Node, kind: Type) -> Node:
    """A length, count or position as i64; more than any text or word has stays more."""
    form = machine(kind)
    if form == "u64":
        node = ("min", "u64", node, ("const", "u64", 1 << 32))
    return node if form == "i64" else ("convert", "i64", form, node)


def _chain(name: str) -> Lowering:
    """min, max, concat: from left to right."""
    def lower(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
        form = _form(call)
        node = a[0]
        for following in a[1:]:
            node = body.measured((name, form, node, following))
        return node
    return lower


def _compare(name: str) -> Lowering:
    """GT(a, b, c) holds for every neighbour pair."""
    def lower(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
        if len(a) > 2:
            a = [body.keep(node) for node in a]
        form = _form(call)
        node: Node = (name, "b", form, a[0], a[1])
        for left, right in pairwise(a[1:]):
            node = body.measured(("and", "b", node, (name, "b", form, left, right)))
        return node
    return lower


def _limit(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    form = _form(call)
    return ("min", form, ("max", form, a[1], a[0]), a[2])


def _select(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    return ("select", _form(call), a[0], a[1], a[2])


def _mux(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    chooser = as_count(a[0], call.arguments[0][1])
    if body.dialect.last_of_mux:
        last = ("min", "u64", ("convert", "u64", "i64", chooser), ("const", "u64", len(a) - 2))
        chooser = ("convert", "i64", "u64", last)
    return ("mux", _form(call), chooser, tuple(a[1:]), site)


_LEAST = {"left": (0,), "right": (0,), "mid": (0, 1), "insert": (0,), "delete": (0, 1), "replace": (0, 1)}
"""The least length and position that a function of texts takes, in the order of its parameters."""


def _text(name: str) -> Lowering:
    def lower(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
        operands = [node if isinstance(kind, StringType) else as_count(node, kind)
                    for node, (_, kind) in zip(a, call.arguments, strict=True)]
        if body.dialect.lenient_positions:
            at_least = iter(_LEAST[name])
            operands = [node if isinstance(kind, StringType) else ("max", "i64", node, ("const", "i64", next(at_least)))
                        for node, (_, kind) in zip(operands, call.arguments, strict=True)]
        return (name, _form(call), *operands, site)
    return lower


def _finite(body: BodyLowering, a: Node, form: str) -> Node:
    """Neither NaN nor infinite: then only is x - x zero."""
    kept = body.keep(a)
    return ("eq", "b", form, ("sub", form, kept, kept), ("const", form, 0.0))


def _valid_bcd(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    """A nibble is above 9 if its bit 3 is set, and bit 2 or bit 1 too."""
    form = _form(call)
    wide = body.keep(a[0] if form == "u64" else ("convert", "u64", form, a[0]))
    doubled: Node = ("mul", "u64", wide, ("const", "u64", 2))
    lower = ("or", "u64", doubled, ("mul", "u64", wide, ("const", "u64", 4)))
    above = ("and", "u64", ("and", "u64", wide, lower), ("const", "u64", 0x8888_8888_8888_8888))
    return ("eq", "b", "u64", above, ("const", "u64", 0))


_SWAPS = ((8, 0x00FF_00FF_00FF_00FF), (16, 0x0000_FFFF_0000_FFFF), (32, 0x0000_0000_FFFF_FFFF))
"""Neighbours of so many bits change places; the mask has the lower ones."""


def _swapped(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    """The bytes of a number in the other order: values lie in memory with the lowest byte first."""
    form = _form(call)
    width = SIZES[form] * 8
    if width == 8:
        return a[0]
    word = f"u{width}"
    node = a[0] if form == word else ("convert", word, form, a[0])
    for bits, mask in _SWAPS:
        if bits < width:
            node = body.keep(node)
            lower: Node = ("const", word, mask & (1 << width) - 1)
            count = ("const", "i64", bits)
            node = ("or", word, ("and", word, ("shr", word, node, count, site), lower),
                    ("shl", word, ("and", word, node, lower), count, site))
    return node if form == word else ("convert", form, word, node)


def _stop(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    body.out.append(("stop", "R0120", site))
    return ("const", "b", 0)


def _due(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    body.out.append(("due", a[0]))
    return ("const", "b", 0)


# --- conversions ----------------------------------------------------------------------------------------------------

_TICKS = {"TIME": 1_000_000, "TIME_OF_DAY": 1_000_000, "DATE": 1_000_000_000, "DATE_AND_TIME": 1_000_000_000}
"""Nanoseconds of the unit in which a time or date meets numbers: ms for TIME and TOD, s for DATE and DT, ns for L types
(as CODESYS; the standard has no such conversion)."""


def _convert(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    source, target = call.detail[0], base(call.detail[1])
    node = a[0]
    if isinstance(target, StringType):
        return in_width(to_text(source, node, body), machine(target))
    if isinstance(source, StringType):
        if is_any(target, "ANY_CHAR"):
            return ("first", machine(target), in_width(node, "s16" if target.name == "WCHAR" else "s8"))
        name = target.base.name if isinstance(target, EnumType) else target.name
        return _number_of_text(body, in_width(node, "s8"), machine(target), name, site)
    if source.name == "WCHAR" and target.name == "CHAR":
        return _narrow(body, node)
    timed = is_any(source, "ANY_DURATION", "ANY_DATE"), is_any(target, "ANY_DURATION", "ANY_DATE")
    if all(timed):
        return _date_part(body, node, source, target)
    if timed[0]:
        return _from_time(node, source, target, site, _tick(body, source))
    if timed[1]:
        return _to_time(node, source, target, site, _tick(body, target))
    return number(body, node, source, target, site)


def _number_of_text(body: BodyLowering, node: Node, form: str, name: str, site: int) -> Node:
    """The value that a text names; dialects take what they find at its beginning, or 0."""
    lenient = body.dialect.lenient_texts
    if not lenient:
        return ("from_text", form, name, node, site)
    if lenient == "whole" or form in ("b", "i64", "u64", "f64"):
        return ("from_leading", form, name, int(lenient == "whole"), node)
    if form == "f32":
        return ("convert", form, "f64", ("from_leading", "f64", "LREAL", 0, node))
    return ("convert", form, "i64", ("from_leading", "i64", "LINT", 0, node))


def to_text(source: Type, node: Node, body: BodyLowering) -> Node:
    """A value as text, of the width that comes first to it."""
    if body.dialect.hexadecimal_bits and is_any(source, "ANY_BIT") and machine(source) != "b":
        return _hexadecimal(body, node)
    if isinstance(source, StringType):
        return node
    if is_any(source, "ANY_CHAR"):
        return ("character", "s16" if source.name == "WCHAR" else "s8", node)
    if isinstance(source, EnumType):
        return ("enum_text", "s8", tuple(sorted(source.shown.items())), ("convert", "i64", source.base.machine, node))
    return ("to_text", "s8", source.name, node)


def _hexadecimal(body: BodyLowering, node: Node) -> Node:
    """`16#FF`: a digit for each four bits, without zeros in front."""
    form = node[1]
    kept = body.keep(node if form == "u64" else ("convert", "u64", form, node))
    digits: list[Node] = []
    significant: Node = ("const", "i64", 1)
    for shift in range(SIZES[form] * 8 - 4, -1, -4):
        nibble = ("and", "u64", ("shr", "u64", kept, ("const", "i64", shift), 0), ("const", "u64", 15))
        place = ("add", "i64", ("convert", "i64", "u64", nibble), ("const", "i64", 1))
        digits.append(("mid", "s8", ("const", "s8", b"0123456789ABCDEF"), ("const", "i64", 1), place, 0))
        if shift:
            more = ("convert", "i64", "b", ("ge", "b", "u64", kept, ("const", "u64", 1 << shift)))
            significant = ("add", "i64", significant, more)
    text = digits[0]
    for digit in digits[1:]:
        text = body.measured(("concat", "s8", text, digit))
    return ("concat", "s8", ("const", "s8", b"16#"), ("right", "s8", text, significant, 0))


def in_width(node: Node, form: str) -> Node:
    """A text as one of the form s8 or s16."""
    return node if node[1] == form else ("recode", form, node)


def _narrow(body: BodyLowering, node: Node) -> Node:
    """A WCHAR as CHAR, `?` above 255."""
    code = body.keep(node)
    return ("select", "u8", ("gt", "b", "u16", code, ("const", "u16", 0xFF)), ("convert", "u8", "u16", code),
            ("const", "u8", ord("?")))


def number(body: BodyLowering, node: Node, source: Type, target: Type, site: int) -> Node:
    """Among BOOL, integers, bit strings, enumerations and reals; the latter give bit strings their bits or their value."""
    a, b = machine(source), machine(target)
    by_value = body.dialect.real_bits_by_value
    if a == b:
        return node
    if b == "b":
        return ("is_set", "b", a, node)
    if a in FLOATS and b not in FLOATS:
        if is_any(target, "ANY_BIT") and not by_value:
            return ("bits", b, a, node)
        wraps = body.dialect.ties_away and is_any(target, "ANY_BIT")
        return _cut(body, "nearest", node, b) if wraps else _integer(body, "nearest", node, b, site)
    if b in FLOATS and is_any(source, "ANY_BIT") and a != "b" and not by_value:
        return ("bits", b, a, node)
    return ("convert", b, a, node)


def _integer(body: BodyLowering, name: str, node: Node, form: str, site: int) -> Node:
    """A real as an integer by `nearest` or `truncate`, and what becomes of one that does not fit."""
    if body.dialect.reals_saturate:
        return saturated(body, name, node, form)
    return _cut(body, name, node, form) if body.dialect.reals_wrap else (name, form, node[1], node, site)


def _cut(body: BodyLowering, name: str, node: Node, form: str) -> Node:
    """A real as an integer of 64 bits, the least one where it does not fit, of which the low bits remain (assumed)."""
    kept = body.keep(node if node[1] == "f64" else ("convert", "f64", "f32", node))
    low, high = ("const", "f64", -2.0 ** 63), ("const", "f64", 2.0 ** 63)
    fits = ("and", "b", ("ge", "b", "f64", kept, low), ("lt", "b", "f64", kept, high))
    number = _whole(body, name, ("select", "f64", fits, low, kept), "i64")
    if form != "u64":
        return number if form == "i64" else ("convert", form, "i64", number)
    above = ("and", "b", ("ge", "b", "f64", kept, high), ("lt", "b", "f64", kept, ("const", "f64", 2.0 ** 64)))
    large = ("truncate", "u64", "f64", ("select", "f64", above, ("const", "f64", 0.0), kept), 0)
    return ("select", "u64", above, ("convert", "u64", "i64", number), large)


def _whole(body: BodyLowering, name: str, node: Node, form: str) -> Node:
    """A real that fits as an integer by `nearest` or `truncate`; ties away from 0 where the dialect has them so."""
    if name != "nearest" or not body.dialect.ties_away:
        return (name, form, "f64", node, 0)
    real = body.keep(node)
    number = body.keep(("nearest", form, "f64", real, 0))
    rest = body.keep(("sub", "f64", real, ("convert", "f64", form, number)))
    zero = ("const", "f64", 0.0)
    up = ("and", "b", ("eq", "b", "f64", rest, ("const", "f64", 0.5)), ("gt", "b", "f64", real, zero))
    down = ("and", "b", ("eq", "b", "f64", rest, ("const", "f64", -0.5)), ("lt", "b", "f64", real, zero))
    return ("sub", form, ("add", form, number, ("convert", form, "b", up)), ("convert", form, "b", down))


def saturated(body: BodyLowering, name: str, node: Node, form: str) -> Node:
    """A real as an integer by `nearest` or `truncate`: the nearest that there is where it does not fit, 0 for NaN."""
    bits = SIZES[form] * 8
    low, high = (-2.0 ** (bits - 1), 2.0 ** (bits - 1)) if form[0] == "i" else (0.0, 2.0 ** bits)
    kept = body.keep(node if node[1] == "f64" else ("convert", "f64", "f32", node))
    last = high - 1 if bits < 64 else math.nextafter(high, 0)
    inside = ("min", "f64", ("max", "f64", kept, ("const", "f64", low)), ("const", "f64", last))
    there = ("select", "f64", ("eq", "b", "f64", kept, kept), ("const", "f64", 0.0), inside)
    number = _whole(body, name, there, form)
    if bits < 64:
        return number
    most = ("const", form, int(high) - 1)
    return ("select", form, ("ge", "b", "f64", kept, ("const", "f64", high)), number, most)


def _tick(body: BodyLowering, kind: Type) -> int:
    """Nanoseconds of the unit in which a time meets numbers."""
    return 1_000_000_000 if body.dialect.seconds and kind.name == "TIME" else _TICKS.get(kind.name, 1)


def _from_time(node: Node, source: Type, target: Type, site: int, tick: int) -> Node:
    form = machine(target)
    if form == "b":
        return ("is_set", "b", "i64", node)
    if form in FLOATS:
        real = ("div", "f64", ("convert", "f64", "i64", node), ("const", "f64", float(tick)), site)
        return real if form == "f64" else ("convert", "f32", "f64", real)
    if tick != 1:
        node = ("div", "i64", node, ("const", "i64", tick), site)
    return node if form == "i64" else ("convert", form, "i64", node)


def _to_time(node: Node, source: Type, target: Type, site: int, tick: int) -> Node:
    form = machine(source)
    if form in FLOATS:
        wide = node if form == "f64" else ("convert", "f64", "f32", node)
        return ("nearest", "i64", "f64", ("mul", "f64", wide, ("const", "f64", float(tick))), site)
    wide = node if form == "i64" else ("convert", "i64", form, node)
    return wide if tick == 1 else ("mul", "i64", wide, ("const", "i64", tick))


def _date_part(body: BodyLowering, node: Node, source: Type, target: Type) -> Node:
    """Among times; a date or a time of day out of a date and time."""
    if source.name.removeprefix("L") == target.name.removeprefix("L") or source.name.endswith("DATE"):
        return node  # a date as a moment is its midnight
    kept = body.keep(node)
    midnight = ("mul", "i64", ("floor_div", "i64", kept, ("const", "i64", DAY_NS)), ("const", "i64", DAY_NS))
    return midnight if target.name.endswith("DATE") else ("sub", "i64", kept, midnight)


def _truncate(body: BodyLowering, a: list[Node], call: StandardCall, site: int) -> Node:
    target = call.detail[1] if len(call.detail) > 1 else DINT
    return _integer(body, "truncate", a[0], machine(target), site)


def _bcd(name: str) -> Lowering:
    return lambda body, a, call, site: (name, machine(call.detail[1]), machine(call.detail[0]), a[0], site)


FUNCTIONS: dict[str, Lowering] = {
    "ABS": _abs, "ATAN2": lambda body, a, call, site: ("atan2", _form(call), a[0], a[1]),
    "MOVE": lambda body, a, call, site: a[0], "SEL": _select, "MUX": _mux, "LIMIT": _limit,
    "MAX": _chain("max"), "MIN": _chain("min"), "CONCAT": _chain("concat"),
    "LEN": lambda body, a, call, site: ("length", "i16", a[0]),
    "FIND": lambda body, a, call, site: ("find", "i16", a[0], a[1]),
    **dict.fromkeys(("TIME", "LTIME"), lambda body, a, call, site: ("now", "i64")), "__DUE": _due, "__STOP": _stop,
    "__PLC_WORDS": lambda body, a, call, site: plc_addresses.words_from(body, a[0]),
    "IS_VALID": lambda body, a, call, site: _finite(body, a[0], _form(call)),
    "IS_VALID_BCD": _valid_bcd,
    "TO_BIG_ENDIAN": _swapped, "FROM_BIG_ENDIAN": _swapped,
    "TO_LITTLE_ENDIAN": lambda body, a, call, site: a[0], "FROM_LITTLE_ENDIAN": lambda body, a, call, site: a[0],
    "TO": _convert, "TRUNC": _truncate, "BCD_TO": _bcd("from_bcd"), "TO_BCD": _bcd("to_bcd"),
    **{name: _math(name) for name in _MATH},
    **{name: _shift(name.lower()) for name in ("SHL", "SHR", "ROL", "ROR")},
    **{name: _compare(op) for name, op in _COMPARE.items()},
    **{name: _text(op) for name, op in _TEXT.items()},
}
