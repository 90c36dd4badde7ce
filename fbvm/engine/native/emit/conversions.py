"""Conversions between numbers as instructions of LLVM, and the bits of floats."""

from __future__ import annotations

from fbvm.base.arithmetic import limits, width
from fbvm.base.host import is_x86_64
from fbvm.code.operations import Node
from fbvm.engine.native.emit.writer import Writer, ir, literal, signed
from fbvm.engine.ranges import is_float

ONE_STEP = is_x86_64()
"""True if the processor has an instruction that rounds a float and reports what does not fit (CVTSS2SI of x86-64)."""


def convert(w: Writer, machine: str, source: str, a: Node) -> str:
    value, kind, from_kind = w.value(a), ir(machine), ir(source)
    if kind == from_kind:
        return value
    if is_float(source):
        how = "fpext" if machine == "f64" else "fptrunc"
    elif is_float(machine):
        how = "sitofp" if signed(source) else "uitofp"
    elif width(machine) < width(source):
        how = "trunc"
    else:
        how = "sext" if signed(source) else "zext"
    return w.new(f"{how} {from_kind} {value} to {kind}")


def nearest(w: Writer, machine: str, source: str, a: Node, site: int) -> str:
    """Rounds a float to the nearest integer, a tie to the even one; traps (R0105) what does not fit.

    Half below the least integer still fits, because that is even; half above the greatest does not, because that is odd."""
    value, kind = w.value(a), ir(source)
    if ONE_STEP and width(machine) < 64:
        return _in_one_step(w, machine, source, value, "cvt", site)
    low, high = limits(machine)
    _must_fit(w, source, value, (_exactly(source, low, -0.5), True), _exactly(source, high, 0.5), machine, site)
    if machine == "u64":
        return _whole(w, machine, kind, w.new(f"call {kind} @llvm.rint.{source}({kind} {value})"))
    form = "i32" if high < 1 << 31 else "i64"
    number = w.new(f"call {form} @llvm.lrint.{form}.{source}({kind} {value})")
    return number if form == ir(machine) else w.new(f"trunc {form} {number} to {ir(machine)}")


def truncate(w: Writer, machine: str, source: str, a: Node, site: int) -> str:
    value, (low, high) = w.value(a), limits(machine)
    if ONE_STEP and width(machine) < 64:
        return _in_one_step(w, machine, source, value, "cvtt", site)
    least = _exactly(source, low, -1.0)
    _must_fit(w, source, value, (least, least == low), float(high + 1), machine, site)
    return _whole(w, machine, ir(source), value)


def _in_one_step(w: Writer, machine: str, source: str, value: str, how: str, site: int) -> str:
    """Rounds by one instruction of x86-64, which yields its least integer for NaN and for what does not fit; both trap."""
    form = "i32" if width(machine) < 32 else "i64"
    count, extension, letter = {"f32": (4, "sse", "s"), "f64": (2, "sse2", "d")}[source]
    lanes = f"<{count} x {ir(source)}>"
    lane = w.new(f"insertelement {lanes} poison, {ir(source)} {value}, i64 0")
    suffix = "64" if form == "i64" else ""
    number = w.new(f"call {form} @llvm.x86.{extension}.{how}s{letter}2si{suffix}({lanes} {lane})")
    cut = w.new(f"trunc {form} {number} to {ir(machine)}")
    again = w.new(f"{'sext' if signed(machine) else 'zext'} {ir(machine)} {cut} to {form}")
    low, high = limits(machine)
    w.trap_if(w.new(f"icmp ne {form} {again}, {number}"), "R0105", site, (source, value), ("const", low), ("const", high))
    return cut


def _whole(w: Writer, machine: str, kind: str, value: str) -> str:
    """Converts a float that fits to an integer, toward zero.

    Never by `fptoui`: up to 22.1.0 at least, LLVM aborts the process on the lesser of its result and 0 at level 0."""
    if signed(machine):
        return w.new(f"fptosi {kind} {value} to {ir(machine)}")
    if machine != "u64":
        return w.new(f"trunc i64 {w.new(f'fptosi {kind} {value} to i64')} to {ir(machine)}")
    half = literal("f64", float(1 << 63))
    large = w.new(f"fcmp oge {kind} {value}, {half}")
    rest = w.new(f"select i1 {large}, {kind} {w.new(f'fsub {kind} {value}, {half}')}, {kind} {value}")
    top = w.new(f"shl i64 {w.new(f'zext i1 {large} to i64')}, 63")
    return w.new(f"xor i64 {w.new(f'fptosi {kind} {rest} to i64')}, {top}")


def _exactly(source: str, limit: int, more: float) -> float:
    """The float `more` beyond a limit of integers.

    Where there is none, floats are whole numbers: then the limit itself, or above it the next number."""
    bits = 24 if source == "f32" else 53
    if abs(limit) < 1 << bits - 1 or (more == -1.0 and limit == 0):
        return limit + more
    return float(limit if more < 0 else limit + 1)


def _must_fit(w: Writer, source: str, value: str, least: tuple[float, bool], above: float, machine: str, site: int) -> None:
    """Trap (R0105) if a float is not between the least one, which may belong to it, and the first one above."""
    kind, (low, high) = ir(source), limits(machine)
    over = w.new(f"fcmp o{'ge' if least[1] else 'gt'} {kind} {value}, {literal('f64', least[0])}")
    under = w.new(f"fcmp olt {kind} {value}, {literal('f64', above)}")
    outside = w.new(f"xor i1 {w.new(f'and i1 {over}, {under}')}, true")
    w.trap_if(outside, "R0105", site, (source, value), ("const", low), ("const", high))


def bits(w: Writer, machine: str, source: str, a: Node) -> str:
    value = w.value(a)
    if is_float(source):
        value = canonical_bits(w, value, source)
    if is_float(machine):
        kind = ir(machine)
        number = w.new(f"bitcast i{width(source)} {value} to {kind}")
        return w.new(f"bitcast i{width(machine)} {canonical_bits(w, number, machine)} to {kind}")
    return value


def canonical_bits(w: Writer, value: str, machine: str) -> str:
    """The bits of a float, with those of the canonical NaN for every NaN.

    The choice is made on integers: on floats LLVM takes any NaN for as good as another and would leave it out."""
    kind, (magnitude, infinite, nan) = f"i{width(machine)}", PATTERNS[machine]
    bits = w.new(f"bitcast {ir(machine)} {value} to {kind}")
    above = w.new(f"icmp ugt {kind} {w.new(f'and {kind} {bits}, {magnitude}')}, {infinite}")
    return w.new(f"select i1 {above}, {kind} {nan}, {kind} {bits}")


PATTERNS = {"f32": ((1 << 31) - 1, 0xFF << 23, 0x1FF << 22), "f64": ((1 << 63) - 1, 0x7FF << 52, 0xFFF << 51)}
"""Of each float the bits of its magnitude, of infinity, of the canonical NaN."""
