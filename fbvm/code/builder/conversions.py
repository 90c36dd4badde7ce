"""Conversions of values: implicit ones, and the standard's *_TO_* functions and TRUNC.

A *form* is a machine type as in `code.operations` ("i16", "f64", "s8" ...)."""

from __future__ import annotations

import math

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.arithmetic import limits
from fbvm.base.types import DAY_NS, DINT, EnumType, StringType, Type, base, machine
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.builder.emitter import Emitter
from fbvm.code.operations import BUFFER_OBJECT, FLOATS, OBJECT_SHIFT, OFFSET_SHIFT, SIZES, TEXT_UNITS, WHOLE_BYTES, Node

_TICKS = {"TIME": 1_000_000, "TIME_OF_DAY": 1_000_000, "DATE": 1_000_000_000, "DATE_AND_TIME": 1_000_000_000}
"""Nanoseconds of the unit in which a time or date is converted to and from numbers: ms for TIME and TOD, s for DATE and DT,
ns for L types (as CODESYS; the standard has no such conversion)."""


def implicit(emitter: Emitter, node: Node, kind: Type, target: Type) -> Node:
    """A value of the type `kind` as one of `target`, to which the language converts it without a function."""
    source, wanted = machine(kind), machine(target)
    if wanted == "ref" and source in ("u32", "u64"):
        return _at_byte(emitter, node, source)
    if source == wanted or wanted in ("ref", ""):
        return node
    if wanted in TEXT_UNITS:
        return ("character", wanted, node)
    if source == "ref":
        return ("bits", wanted, "ref", node) if SIZES[wanted] == SIZES["ref"] else _byte_number(node, wanted)
    if wanted == "b":  # a number as the condition of a statement
        return ("ne", "b", source, node, ("const", source, 0))
    if source in FLOATS and wanted not in FLOATS:
        return saturated(emitter, "truncate", node, wanted)
    return ("convert", wanted, source, node)


def _byte_number(reference: Node, form: str) -> Node:
    """The number of the byte in the buffer to which a reference points."""
    place = ("shr", "u64", ("bits", "u64", "ref", reference), ("const", "i64", OFFSET_SHIFT), 0)
    return ("convert", form, "u64", place)


def _at_byte(emitter: Emitter, number: Node, form: str) -> Node:
    """What `reference_to_byte` makes of a number that the program computes."""
    at = emitter.to_temporary(("convert", "u64", form, number))
    whole = ("const", "u64", BUFFER_OBJECT << OBJECT_SHIFT | WHOLE_BYTES)
    is_outside = ("lt", "b", "u64", at, ("const", "u64", PAGE_BYTES))
    place = ("mul", "u64", at, ("const", "u64", 1 << OFFSET_SHIFT))
    return ("bits", "ref", "u64", ("or", "u64", place, ("select", "u64", is_outside, whole, ("const", "u64", 0))))


def to_float(node: Node, kind: Type, form: str) -> Node:
    """A number of the type `kind` as a float of a form."""
    source = machine(kind)
    return node if source == form else ("convert", form, source, node)


def as_count(node: Node, kind: Type) -> Node:
    """A length, count or position as i64.  A u64 that does not fit becomes 2**32, more than any text or word has."""
    form = machine(kind)
    if form == "u64":
        node = ("min", "u64", node, ("const", "u64", 1 << 32))
    return node if form == "i64" else ("convert", "i64", form, node)


def day_start(moment: Node) -> Node:
    """The midnight before a moment, both ns as i64."""
    return ("mul", "i64", ("floor_div", "i64", moment, ("const", "i64", DAY_NS)), ("const", "i64", DAY_NS))


# --- functions of the standard ----------------------------------------------------------------------------------------


def convert(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    """X_TO_Y and TO_Y (IEC 61131-3 ed. 3, tables 22 to 27)."""
    source, target = call.detail[0], base(call.detail[1])
    node = a[0]
    if isinstance(target, StringType):
        return in_width(_to_text(emitter, source, node), machine(target))
    if isinstance(source, StringType):
        if is_any(target, "ANY_CHAR"):
            return ("first", machine(target), in_width(node, "s16" if target.name == "WCHAR" else "s8"))
        name = target.base.name if isinstance(target, EnumType) else target.name
        return _from_text(emitter, in_width(node, "s8"), machine(target), name, site)
    if source.name == "WCHAR" and target.name == "CHAR":
        return _wide_to_char(emitter, node)
    is_time = is_any(source, "ANY_DURATION", "ANY_DATE"), is_any(target, "ANY_DURATION", "ANY_DATE")
    if all(is_time):
        return _date_part(emitter, node, source, target)
    if is_time[0]:
        return _from_time(node, target, site, _tick(emitter, source))
    if is_time[1]:
        return _to_time(node, source, target, site, _tick(emitter, target))
    return _number(emitter, node, source, target, site)


def truncate(emitter: Emitter, a: list[Node], call: StandardCall, site: int) -> Node:
    """TRUNC and X_TRUNC_Y: a real without its fraction, as DINT if no other type is named."""
    target = call.detail[1] if len(call.detail) > 1 else DINT
    return _real_to_integer(emitter, "truncate", a[0], machine(target), site)


# --- texts ------------------------------------------------------------------------------------------------------------


def in_width(node: Node, form: str) -> Node:
    """A text as one of the form s8 or s16."""
    return node if node[1] == form else ("recode", form, node)


def _from_text(emitter: Emitter, node: Node, form: str, name: str, site: int) -> Node:
    """The value that a text of the form s8 names; a dialect may take the literal that it begins with, or else 0."""
    lenient = emitter.dialect.lenient_texts
    if not lenient:
        return ("from_text", form, name, node, site)
    if lenient == "whole" and name in _NUMBERS:
        return _from_whole(emitter, node, form, name, site)
    if lenient == "whole" or form in ("b", "i64", "u64", "f64"):
        return ("from_leading", form, name, int(lenient == "whole"), node)
    if form == "f32":
        return ("convert", form, "f64", ("from_leading", "f64", "LREAL", 0, node))
    return ("convert", form, "i64", ("from_leading", "i64", "LINT", 0, node))


_NUMBERS = frozenset(("SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD"))


def _from_whole(emitter: Emitter, node: Node, form: str, name: str, site: int) -> Node:
    """The integer that a whole text names: a literal of it, or one of a real without its fraction; 0 if it does not fit."""
    text = emitter.to_temporary(node)
    value = emitter.to_temporary(("from_leading", form, name, 1, text))
    real = emitter.to_temporary(("from_leading", "f64", "LREAL", 1, text))
    low, high = limits(form)
    fits: Node = ("and", "b", ("gt", "b", "f64", real, ("const", "f64", low - 1.0)),
                  ("lt", "b", "f64", real, ("const", "f64", high + 1.0)))
    cut: Node = ("truncate", form, "f64", ("select", "f64", fits, ("const", "f64", 0.0), real), site)
    return ("select", form, ("eq", "b", form, value, ("const", form, 0)), value, cut)


def _to_text(emitter: Emitter, source: Type, node: Node) -> Node:
    """A value as text, s8 or s16, whichever its type gives without recoding."""
    if emitter.dialect.hexadecimal_bits and is_any(source, "ANY_BIT") and machine(source) != "b":
        return _hexadecimal(emitter, node)
    if isinstance(source, StringType):
        return node
    if is_any(source, "ANY_CHAR"):
        return ("character", "s16" if source.name == "WCHAR" else "s8", node)
    if isinstance(source, EnumType) and emitter.dialect.members_as_numbers and "to_string" not in source.attributes:
        return ("to_text", "s8", source.base.name, node)
    if isinstance(source, EnumType):
        return ("enum_text", "s8", tuple(sorted(source.shown.items())), ("convert", "i64", source.base.machine, node))
    return ("to_text", "s8", source.name, node)


def _hexadecimal(emitter: Emitter, node: Node) -> Node:
    """A bit string as `16#ff`, as matiec writes it (iec_std_lib.h): a digit for each four bits, without leading zeros."""
    form = node[1]
    value = emitter.to_temporary(node if form == "u64" else ("convert", "u64", form, node))
    digits: list[Node] = []
    significant: Node = ("const", "i64", 1)
    for shift in range(SIZES[form] * 8 - 4, -1, -4):
        nibble = ("and", "u64", ("shr", "u64", value, ("const", "i64", shift), 0), ("const", "u64", 15))
        position = ("add", "i64", ("convert", "i64", "u64", nibble), ("const", "i64", 1))
        digits.append(("mid", "s8", ("const", "s8", b"0123456789abcdef"), ("const", "i64", 1), position, 0))
        if shift:
            more = ("convert", "i64", "b", ("ge", "b", "u64", value, ("const", "u64", 1 << shift)))
            significant = ("add", "i64", significant, more)
    text = digits[0]
    for digit in digits[1:]:
        text = emitter.cut_if_deep(("concat", "s8", text, digit))
    return ("concat", "s8", ("const", "s8", b"16#"), ("right", "s8", text, significant, 0))


def _wide_to_char(emitter: Emitter, node: Node) -> Node:
    """A WCHAR as CHAR, `?` above 255."""
    code = emitter.to_temporary(node)
    return ("select", "u8", ("gt", "b", "u16", code, ("const", "u16", 0xFF)), ("convert", "u8", "u16", code),
            ("const", "u8", ord("?")))


# --- numbers ----------------------------------------------------------------------------------------------------------


def _number(emitter: Emitter, node: Node, source: Type, target: Type, site: int) -> Node:
    """Among BOOL, integers, bit strings, enumerations and reals.  Between reals and bit strings of their width the bits stay
    the same, or in a dialect the value; a dialect that takes other widths converts the value."""
    a, b = machine(source), machine(target)
    by_value = emitter.dialect.real_bits_by_value or source.size != target.size
    if a == b:
        return node
    if b == "b":
        return ("is_set", "b", a, node)
    if a in FLOATS and b not in FLOATS:
        if is_any(target, "ANY_BIT") and not by_value:
            return ("bits", b, a, node)
        wraps = emitter.dialect.ties_away and is_any(target, "ANY_BIT")
        return _wrapped(emitter, "nearest", node, b) if wraps else _real_to_integer(emitter, "nearest", node, b, site)
    if b in FLOATS and is_any(source, "ANY_BIT") and a != "b" and not by_value:
        return ("bits", b, a, node)
    return ("convert", b, a, node)


def _real_to_integer(emitter: Emitter, rounding: str, node: Node, form: str, site: int) -> Node:
    """A real as an integer by the operation `rounding` (nearest or truncate).  One that does not fit traps, or in a dialect
    saturates or wraps."""
    if emitter.dialect.reals_saturate:
        return saturated(emitter, rounding, node, form)
    if emitter.dialect.negative_is_zero and form[0] == "u":
        real, nought = emitter.to_temporary(node), ("const", node[1], 0.0)
        node = ("select", node[1], ("lt", "b", node[1], real, nought), real, nought)
    if emitter.dialect.reals_wrap:
        return _wrapped(emitter, rounding, node, form)
    if rounding == "nearest" and emitter.dialect.ties_away:
        node = _without_tie(emitter, node)
    return (rounding, form, node[1], node, site)


def _without_tie(emitter: Emitter, node: Node) -> Node:
    """A real as an f64; one in the middle of two integers is moved away from 0, so that it is nearest to the outer one."""
    real = emitter.to_temporary(node if node[1] == "f64" else ("convert", "f64", "f32", node))
    low, high, nought = ("const", "f64", -2.0 ** 52), ("const", "f64", 2.0 ** 52), ("const", "f64", 0.0)
    inside = ("and", "b", ("gt", "b", "f64", real, low), ("lt", "b", "f64", real, high))  # no other f64 has a fraction
    small = emitter.to_temporary(("select", "f64", inside, nought, real))
    rest = emitter.to_temporary(("sub", "f64", small, ("convert", "f64", "i64", ("nearest", "i64", "f64", small, 0))))
    tie = ("or", "b", ("eq", "b", "f64", rest, ("const", "f64", 0.5)), ("eq", "b", "f64", rest, ("const", "f64", -0.5)))
    step = ("select", "f64", ("gt", "b", "f64", small, nought), ("const", "f64", -0.25), ("const", "f64", 0.25))
    return ("add", "f64", real, ("select", "f64", tie, nought, step))


def _wrapped(emitter: Emitter, rounding: str, node: Node, form: str) -> Node:
    """A real as an integer of 64 bits, the least one where it does not fit, of which the low bits remain (assumed)."""
    value = emitter.to_temporary(node if node[1] == "f64" else ("convert", "f64", "f32", node))
    low, high = ("const", "f64", -2.0 ** 63), ("const", "f64", 2.0 ** 63)
    fits = ("and", "b", ("ge", "b", "f64", value, low), ("lt", "b", "f64", value, high))
    number = _rounded(emitter, rounding, ("select", "f64", fits, low, value), "i64")
    if form != "u64":
        return number if form == "i64" else ("convert", form, "i64", number)
    above = ("and", "b", ("ge", "b", "f64", value, high), ("lt", "b", "f64", value, ("const", "f64", 2.0 ** 64)))
    large = ("truncate", "u64", "f64", ("select", "f64", above, ("const", "f64", 0.0), value), 0)
    return ("select", "u64", above, ("convert", "u64", "i64", number), large)


def _rounded(emitter: Emitter, rounding: str, node: Node, form: str) -> Node:
    """An f64 that fits as an integer by `rounding`; ties away from 0 where the dialect has them so."""
    if rounding != "nearest" or not emitter.dialect.ties_away:
        return (rounding, form, "f64", node, 0)
    real = emitter.to_temporary(node)
    number = emitter.to_temporary(("nearest", form, "f64", real, 0))
    rest = emitter.to_temporary(("sub", "f64", real, ("convert", "f64", form, number)))
    nought = ("const", "f64", 0.0)
    up = ("and", "b", ("eq", "b", "f64", rest, ("const", "f64", 0.5)), ("gt", "b", "f64", real, nought))
    down = ("and", "b", ("eq", "b", "f64", rest, ("const", "f64", -0.5)), ("lt", "b", "f64", real, nought))
    return ("sub", form, ("add", form, number, ("convert", form, "b", up)), ("convert", form, "b", down))


def saturated(emitter: Emitter, rounding: str, node: Node, form: str) -> Node:
    """A real as an integer by `rounding`: the nearest integer of the form where it does not fit, 0 for NaN."""
    bits = SIZES[form] * 8
    low, high = (-2.0 ** (bits - 1), 2.0 ** (bits - 1)) if form[0] == "i" else (0.0, 2.0 ** bits)
    value = emitter.to_temporary(node if node[1] == "f64" else ("convert", "f64", "f32", node))
    last = high - 1 if bits < 64 else math.nextafter(high, 0)
    inside = ("min", "f64", ("max", "f64", value, ("const", "f64", low)), ("const", "f64", last))
    defined = ("select", "f64", ("eq", "b", "f64", value, value), ("const", "f64", 0.0), inside)
    number = _rounded(emitter, rounding, defined, form)
    if bits < 64:
        return number
    most = ("const", form, int(high) - 1)
    return ("select", form, ("ge", "b", "f64", value, ("const", "f64", high)), number, most)


# --- times ------------------------------------------------------------------------------------------------------------


def _tick(emitter: Emitter, kind: Type) -> int:
    """Nanoseconds of the unit in which a time of a type is converted to and from numbers."""
    if emitter.dialect.dates_in_nanoseconds and kind.name != "TIME":
        return 1
    return 1_000_000_000 if emitter.dialect.seconds and kind.name == "TIME" else _TICKS.get(kind.name, 1)


def _from_time(node: Node, target: Type, site: int, tick: int) -> Node:
    """A time as a number of ticks."""
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
    """A number of ticks as a time; traps (R0105) outside the range of the type.  The bits of an LWORD are those of an L type."""
    form = machine(source)
    is_time_of_day = target.name.endswith("TIME_OF_DAY")
    low, high = (0, DAY_NS - 1) if is_time_of_day else limits("i64")
    if form in FLOATS:
        wide = node if form == "f64" else ("convert", "f64", "f32", node)
        nearest = ("nearest", "i64", "f64", ("mul", "f64", wide, ("const", "f64", float(tick))), site)
        return ("check", "i64", nearest, low, high, "R0105", site) if is_time_of_day else nearest
    low, high = -(-low // tick), high // tick
    if form == "u64" and tick == 1 and is_any(source, "ANY_BIT"):
        node, form = ("convert", "i64", form, node), "i64"
    least, most = limits(form)
    if least < low or high < most:
        node = ("check", form, node, max(low, least), high, "R0105", site)
    wide = node if form == "i64" else ("convert", "i64", form, node)
    return wide if tick == 1 else ("mul", "i64", wide, ("const", "i64", tick))


def _date_part(emitter: Emitter, node: Node, source: Type, target: Type) -> Node:
    """Among times and dates: the same moment, or the date or the time of day of a date and time."""
    if source.name.removeprefix("L") == target.name.removeprefix("L") or source.name.endswith("DATE") or \
            is_any(target, "ANY_DURATION"):
        return node  # a date as a moment is its midnight, a time of day the duration since midnight
    moment = emitter.to_temporary(node)
    midnight = day_start(moment)
    return midnight if target.name.endswith("DATE") else ("sub", "i64", moment, midnight)
