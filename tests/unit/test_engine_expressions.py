"""Every expression of the table of operations with its edge values, on the plain and the observed build."""

from __future__ import annotations

import math
import struct
from typing import Any

from hand_image import at, behind, const, execute, load, operations_in, store, yields
from rows import each_of

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.arithmetic import INF, NAN
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import EXPRESSIONS, Node

WHERE = {"b": 0, "i8": 8, "u8": 16, "i16": 24, "u16": 32, "i32": 40, "u32": 48, "i64": 56, "u64": 64, "f32": 72,
         "f64": 80, "ref": 88}
OTHER = 400
"""Distance of the second operand's slot from the first's."""


def slot(machine: str, value: Any, second: bool = False) -> tuple[Node, dict[int, bytes]]:
    """A value that the emitter cannot know: a load, and what memory holds before."""
    offset = WHERE[machine] + (OTHER if second else 0)
    return load(machine, offset), {offset: STRUCTS[machine].pack(value)}


# operation, type, operands (constants, and sites where the row has one), what it yields or the code of its trap
NUMBERS = [
    ("add", "i8", 127, 1, -128), ("add", "u8", 255, 1, 0), ("add", "i16", 32767, 1, -32768),
    ("add", "u16", 65535, 2, 1), ("add", "i32", 2**31 - 1, 1, -(2**31)), ("add", "u32", 2**32 - 1, 1, 0),
    ("add", "i64", 2**63 - 1, 1, -(2**63)), ("add", "u64", 2**64 - 1, 1, 0), ("add", "i16", 2, 3, 5),
    ("add", "f32", 16777216.0, 1.0, 16777216.0), ("add", "f64", 0.1, 0.2, 0.1 + 0.2), ("add", "f64", INF, -INF, NAN),
    ("add", "f32", 3e38, 3e38, INF),
    ("sub", "i8", -128, 1, 127), ("sub", "u16", 0, 1, 65535), ("sub", "u64", 0, 1, 2**64 - 1),
    ("sub", "i64", -(2**63), 1, 2**63 - 1), ("sub", "f32", 1.5, 0.25, 1.25),
    ("mul", "i16", 300, 300, 90000 - 65536), ("mul", "u8", 16, 16, 0), ("mul", "i64", 2**62, 2, -(2**63)),
    ("mul", "u64", 2**63, 3, 2**63), ("mul", "i32", 65536, 65536, 0), ("mul", "f32", 1e30, 1e30, INF),
    ("mul", "f32", 1e-30, 1e-30, 0.0), ("mul", "f64", INF, 0.0, NAN),
    ("div", "i16", 7, 2, 3), ("div", "i16", -7, 2, -3), ("div", "i16", 7, -2, -3), ("div", "i16", -7, -2, 3),
    ("div", "i8", -128, -1, -128), ("div", "i64", -(2**63), -1, -(2**63)), ("div", "u16", 65535, 2, 32767),
    ("div", "i16", 1, 0, "R0101"), ("div", "u64", 0, 0, "R0101"), ("div", "f64", 1.0, 0.0, INF),
    ("div", "f64", 1.0, -0.0, -INF), ("div", "f64", -1.0, 0.0, -INF), ("div", "f64", 0.0, 0.0, NAN),
    ("div", "f64", NAN, 0.0, NAN), ("div", "f32", 1.0, 3.0, struct.unpack("f", struct.pack("f", 1 / 3))[0]),
    ("mod", "i16", 7, 3, 1), ("mod", "i16", -7, 3, -1), ("mod", "i16", 7, -3, 1), ("mod", "i16", -7, -3, -1),
    ("mod", "i8", -128, -1, 0), ("mod", "u8", 255, 16, 15), ("mod", "i32", 5, 0, "R0101"),
    ("pow", "f64", 2.0, 10.0, 1024.0), ("pow", "f64", NAN, 0.0, 1.0), ("pow", "f64", 0.0, 0.0, 1.0),
    ("pow", "f64", 0.0, -1.0, INF), ("pow", "f64", -0.0, -3.0, -INF), ("pow", "f64", -8.0, 0.5, NAN),
    ("pow", "f64", -10.0, 400.0, INF), ("pow", "f64", -10.0, 401.0, -INF), ("pow", "f32", 10.0, 30.0, None),
    ("pow", "f32", 10.0, 60.0, INF), ("pow", "f64", -2.0, 3.0, -8.0), ("pow", "f64", 1.0, NAN, 1.0),
    ("and", "u16", 0xFF0F, 0x0FFF, 0x0F0F), ("or", "u8", 0xA0, 0x05, 0xA5), ("xor", "u32", 0xFFFFFFFF, 1, 0xFFFFFFFE),
    ("and", "b", True, False, False), ("and", "b", True, True, True), ("or", "b", False, False, False),
    ("or", "b", False, True, True), ("xor", "b", True, True, False), ("xor", "b", True, False, True),
    ("and_then", "b", True, True, True), ("and_then", "b", False, True, False), ("or_else", "b", False, True, True),
    ("or_else", "b", False, False, False),
    ("min", "i16", -1, 1, -1), ("min", "u16", 65535, 1, 1), ("max", "i64", -5, -6, -5), ("max", "u8", 3, 3, 3),
    ("min", "f64", 1.0, NAN, NAN), ("min", "f64", NAN, 1.0, NAN), ("max", "f32", NAN, 1.0, NAN),
    ("max", "f64", 2.0, 3.0, 3.0),
    ("min", "f64", 2.0, 1.0, 1.0), ("max", "f64", 0.0, -0.0, 0.0), ("min", "f64", -0.0, 0.0, -0.0),
    ("min", "b", True, False, False),
    ("atan2", "f64", 0.0, -1.0, math.pi), ("atan2", "f64", 0.0, -0.0, 0.0), ("atan2", "f64", -0.0, 0.0, 0.0),
    ("atan2", "f64", 1.0, 0.0, math.pi / 2), ("atan2", "f32", 1.0, 1.0, None),
]
COMPARISONS = [
    ("eq", "i16", -1, -1, True), ("eq", "u16", 1, 2, False), ("eq", "f64", NAN, NAN, False),
    ("ne", "f64", NAN, NAN, True),
    ("eq", "f64", 0.0, -0.0, True), ("ne", "i64", 1, 2, True), ("lt", "i8", -1, 0, True), ("lt", "u8", 255, 0, False),
    ("lt", "f32", NAN, 1.0, False), ("le", "u32", 5, 5, True), ("le", "f64", NAN, NAN, False),
    ("gt", "i32", 3, 2, True),
    ("gt", "f64", INF, NAN, False), ("ge", "i16", -5, -5, True), ("ge", "f64", NAN, 0.0, False),
    ("eq", "b", True, True, True),
    ("eq", "ref", 5 << 40, 5 << 40, True), ("ne", "ref", 0, 1 << 40, True), ("lt", "b", False, True, True),
]
SINGLES = [
    ("neg", "i8", -128, -128), ("neg", "i16", 5, -5), ("neg", "f64", 0.0, -0.0), ("neg", "u8", 1, 255),
    ("abs", "i8", -128, -128), ("abs", "i32", -7, 7), ("abs", "f64", -0.0, 0.0), ("abs", "u8", 200, 200),
    ("abs", "f32", -1.5, 1.5), ("not", "b", True, False), ("not", "b", False, True), ("not", "u8", 0xF0, 0x0F),
    ("not", "u64", 0, 2**64 - 1),
]
SHIFTS = [
    ("shl", "u8", 0x81, 1, 0x02), ("shl", "i8", 0x40, 1, -128), ("shl", "u16", 1, 15, 0x8000), ("shl", "u16", 1, 16, 0),
    ("shl", "u64", 1, 2**40, 0), ("shl", "i16", -1, 0, -1), ("shl", "u8", 1, -1, "R0106"), ("shl", "u64", 3, 63, 2**63),
    ("shr", "u8", 0x81, 1, 0x40), ("shr", "i8", -1, 1, 127), ("shr", "i8", -1, 0, -1), ("shr", "u32", 2**31, 31, 1),
    ("shr", "u32", 2**31, 32, 0), ("shr", "i64", -1, 2**50, 0), ("shr", "u8", 1, -1, "R0106"),
    ("shr", "i16", 100, 2, 25),
    ("rol", "u8", 0x81, 1, 0x03), ("rol", "u8", 0x81, 8, 0x81), ("rol", "i16", -32768, 1, 1), ("rol", "u8", 1, 9, 2),
    ("rol", "u8", 1, -1, "R0106"), ("ror", "u8", 0x81, 1, 0xC0), ("ror", "u16", 1, 1, 0x8000), ("ror", "u8", 1, 16, 1),
    ("ror", "i8", 1, 1, -128), ("ror", "u32", 1, -2, "R0106"),
]
# operation, type, from, operand, what it yields
CONVERSIONS = [
    ("convert", "i8", "i16", 300, 44), ("convert", "i8", "u8", 200, -56), ("convert", "u16", "i8", -1, 65535),
    ("convert", "u64", "i64", -1, 2**64 - 1), ("convert", "i64", "u32", 2**32 - 1, 2**32 - 1),
    ("convert", "u8", "b", True, 1),
    ("convert", "b", "u8", 2, False), ("convert", "b", "i16", -1, True), ("convert", "i16", "i16", -5, -5),
    ("convert", "f32", "i32", 16777217, 16777216.0), ("convert", "f32", "i64", 2**53 + 2**29 + 1, float(2**53 + 2**30)),
    ("convert", "f32", "u64", 2**64 - 1, float(2**64)), ("convert", "f64", "u64", 2**64 - 1, float(2**64)),
    ("convert", "f64", "i64", 2**53 + 1, float(2**53)), ("convert", "f32", "f64", 0.1, None),
    ("convert", "f32", "f64", 1e39, INF),
    ("convert", "f64", "f32", 1.5, 1.5), ("convert", "f64", "b", True, 1.0), ("convert", "f32", "i16", -7, -7.0),
    ("convert", "f32", "f64", NAN, NAN),
    ("nearest", "i16", "f64", 2.5, 2), ("nearest", "i16", "f64", 3.5, 4), ("nearest", "i16", "f64", -2.5, -2),
    ("nearest", "i16", "f64", 32767.4, 32767), ("nearest", "i16", "f64", 32767.5, "R0105"),
    ("nearest", "i16", "f64", NAN, "R0105"),
    ("nearest", "u8", "f32", -0.5, 0), ("nearest", "u8", "f32", -0.75, "R0105"),
    ("nearest", "i64", "f64", 2.0**63, "R0105"),
    ("nearest", "u64", "f64", 2.0**63, 2**63), ("nearest", "i32", "f32", INF, "R0105"),
    ("nearest", "i64", "f64", -(2.0**63), -(2**63)),
    ("truncate", "i16", "f64", 2.9, 2), ("truncate", "i16", "f64", -2.9, -2), ("truncate", "u8", "f64", -0.9, 0),
    ("truncate", "u8", "f64", 256.0, "R0105"), ("truncate", "i8", "f32", NAN, "R0105"),
    ("truncate", "i8", "f64", -128.9, -128),
    ("bits", "u32", "f32", 1.0, 0x3F800000), ("bits", "f32", "u32", 0x3F800000, 1.0),
    ("bits", "u64", "f64", NAN, 0x7FF8 << 48),
    ("bits", "u32", "f32", NAN, 0x7FC00000), ("bits", "f32", "u32", 0xFFC00001, NAN),
    ("bits", "f64", "u64", 0x7FF0000000000001, NAN),
    ("bits", "i16", "u16", 65535, -1), ("bits", "u8", "i8", -1, 255), ("bits", "i32", "f32", -0.0, -(2**31)),
    ("bits", "ref", "u64", 7, 7), ("bits", "u16", "u16", 9, 9),
    ("is_set", "b", "i16", -1, True), ("is_set", "b", "u8", 0, False), ("is_set", "b", "f64", NAN, True),
    ("is_set", "b", "f32", -0.0, False),
    ("from_bcd", "u8", "u8", 0x99, 99), ("from_bcd", "u16", "u16", 0x1234, 1234),
    ("from_bcd", "u8", "u8", 0x9A, "R0105"),
    ("from_bcd", "u8", "u16", 0x0256, "R0105"), ("from_bcd", "u64", "u64", 0x9999999999999999, 9999999999999999),
    ("from_bcd", "u16", "u32", 0xE5, "R0105"),
    ("to_bcd", "u8", "u8", 99, 0x99), ("to_bcd", "u8", "u8", 100, "R0105"), ("to_bcd", "u16", "i16", -1, "R0105"),
    ("to_bcd", "u32", "u32", 12345678, 0x12345678), ("to_bcd", "u16", "u16", 9999, 0x9999),
]
MATH = [
    ("sqrt", 4.0, 2.0), ("sqrt", -1.0, NAN), ("sqrt", -0.0, -0.0), ("sqrt", INF, INF), ("ln", 1.0, 0.0),
    ("ln", 0.0, -INF),
    ("ln", -1.0, NAN), ("ln", INF, INF), ("log", 1000.0, 3.0), ("log", 0.0, -INF), ("log", -5.0, NAN),
    ("exp", 0.0, 1.0), ("exp", 1e6, INF),
    ("exp", -INF, 0.0), ("exp", NAN, NAN), ("sin", 0.0, 0.0), ("sin", INF, NAN), ("cos", 0.0, 1.0), ("cos", -INF, NAN),
    ("tan", 0.0, 0.0),
    ("tan", INF, NAN), ("asin", 2.0, NAN), ("asin", 1.0, math.pi / 2), ("acos", 1.0, 0.0), ("acos", -1.5, NAN),
    ("atan", INF, math.pi / 2),
    ("atan", 1.0, math.pi / 4), ("ln", NAN, NAN),
]


def same(seen: Any, wanted: Any) -> bool:
    """Equal to the bit: repr tells -0.0 from 0.0 and says nan for nan."""
    return repr(seen) == repr(wanted)


def sited(name: str) -> tuple[int, ...]:
    """The site that ends the operands of a row that has one."""
    return (7,) if "site" in EXPRESSIONS[name].operands.split() else ()


@each_of(("name", "machine", "a", "b", "wanted"), NUMBERS)
def test_two_operands(name: str, machine: str, a: Any, b: Any, wanted: Any) -> None:
    (left, before), (right, more) = slot(machine, a), slot(machine, b, second=True)
    if wanted is None:
        wide = yields("f64", (name, "f64", const("f64", a), const("f64", b), *sited(name)))
        wanted = struct.unpack("<f", struct.pack("<f", wide))[0]
    for x in (left, const(machine, a)):
        for y in (right, const(machine, b)):
            assert same(yields(machine, (name, machine, x, y, *sited(name)), before | more), wanted), (x, y)


@each_of(("name", "machine", "a", "b", "wanted"), COMPARISONS)
def test_comparison(name: str, machine: str, a: Any, b: Any, wanted: bool) -> None:
    (left, before), (right, more) = slot(machine, a), slot(machine, b, second=True)
    for x in (left, const(machine, a)):
        for y in (right, const(machine, b)):
            assert yields("b", (name, "b", machine, x, y), before | more) is wanted


@each_of(("name", "machine", "a", "wanted"), SINGLES)
def test_one_operand(name: str, machine: str, a: Any, wanted: Any) -> None:
    operand, before = slot(machine, a)
    for x in (operand, const(machine, a)):
        assert same(yields(machine, (name, machine, x), before), wanted)


@each_of(("name", "machine", "a", "n", "wanted"), SHIFTS)
def test_shift(name: str, machine: str, a: int, n: int, wanted: Any) -> None:
    (operand, before), (by, more) = slot(machine, a), slot("i64", n, second=True)
    for x in (operand, const(machine, a)):
        for y in (by, const("i64", n)):
            assert yields(machine, (name, machine, x, y, 7), before | more) == wanted


@each_of(("name", "machine", "source", "a", "wanted"), CONVERSIONS)
def test_conversion(name: str, machine: str, source: str, a: Any, wanted: Any) -> None:
    operand, before = slot(source, a)
    if wanted is None:
        wanted = struct.unpack("<f", struct.pack("<f", a))[0]
    for x in (operand, const(source, a)):
        assert same(yields(machine, (name, machine, source, x, *sited(name)), before), wanted)


@each_of(("function", "a", "wanted"), MATH)
def test_math(function: str, a: float, wanted: float) -> None:
    operand, before = slot("f64", a)
    assert same(yields("f64", ("math", "f64", function, operand), before), wanted)
    operand, before = slot("f32", a)
    rounded = struct.unpack("<f", struct.pack("<f", wanted))[0]
    assert same(yields("f32", ("math", "f32", function, operand), before), rounded)


RUNS: list[tuple[str, Node, dict[int, bytes], Any]] = [
    ("i16", ("load_raw", "i16", at(3)), {3: b"\xfe\xff"}, -2),
    ("f32", ("load_raw", "f32", at(3)), {3: struct.pack("<f", 2.5)}, 2.5),
    ("b", ("load_raw", "b", at(3)), {3: b"\2"}, True),
    ("b", ("load", "b", at(3)), {3: b"\x80"}, True),
    ("f32", ("load", "f32", at(0)), {0: b"\1\0\xc0\xff"}, NAN),
    ("b", ("load_bit", "b", at(2), 7), {2: b"\x80"}, True),
    ("b", ("load_bit", "b", at(2), 0), {2: b"\xfe"}, False),
    ("b", ("not", "b", ("load_bit", "b", at(2), 3)), {2: b"\x08"}, False),
    ("s8", ("load_text", "s8", at(0), 4), {0: b"abcdef"}, b"abcd"),
    ("s8", ("load_text", "s8", at(0), 9), {0: b"ab\0cdef"}, b"ab"),
    ("i16", ("load", "i16", at(2, (4, load("i16", 60)), (2, const("i16", -1)))), {60: b"\2\0", 8: b"\x39\5"}, 1337),
    ("u8", ("load", "u8", at(-5, (1, load("u8", 60)))), {60: b"\x0a", 5: b"\x77"}, 0x77),
    ("i32", ("select", "i32", load("b", 0), const("i32", 5), const("i32", 6)), {0: b"\1"}, 6),
    ("i32", ("select", "i32", load("b", 0), const("i32", 5), const("i32", 6)), {}, 5),
    ("i32", ("select", "i32", load("b", 0), const("i32", 5), ("div", "i32", const("i32", 1), load("i32", 4), 3)), {},
     "R0101"),
    ("i32", ("select", "i32", load("b", 0), const("i32", 5), ("div", "i32", const("i32", 8), load("i32", 4), 3)),
     {0: b"\1", 4: b"\2"}, 4),
    ("i16", ("mux", "i16", load("i64", 0), (const("i16", 5), const("i16", 6)), 3), {0: b"\1"}, 6),
    ("i16", ("mux", "i16", load("i64", 0), (const("i16", 5),), 3), {0: b"\1"}, "R0107"),
    ("i16", ("mux", "i16", const("i64", -1), (const("i16", 5),), 3), {}, "R0107"),
    ("i64", ("check", "i64", load("i64", 0), 0, 9, "R0102", 3), {0: b"\x09"}, 9),
    ("i64", ("check", "i64", load("i64", 0), 0, 9, "R0102", 3), {0: b"\x0a"}, "R0102"),
    ("i16", ("check", "i16", load("i16", 0), -5, 5, "R0103", 3), {0: b"\xfa\xff"}, "R0103"),
    ("i16", ("check", "i16", const("i16", 4), -5, 5, "R0103", 3), {}, 4),
    ("i64", ("within", "i64", load("i64", 0), const("i64", -1), load("i64", 8), "R0102", 3), {0: b"\x02", 8: b"\x02"}, 2),
    ("i64", ("within", "i64", load("i64", 0), const("i64", 1), load("i64", 8), "R0102", 3), {8: b"\x02"}, "R0102"),
    ("i64", ("within", "i64", load("i64", 0), const("i64", 1), load("i64", 8), "R0102", 3), {0: b"\3", 8: b"\2"}, "R0102"),
    ("i64", ("floor_div", "i64", const("i64", -1), const("i64", 1000)), {}, -1),
    ("i64", ("floor_div", "i64", load("i64", 0), const("i64", 1000)), {0: b"\xd0\x07"}, 2),
    ("i64", ("now", "i64"), {}, 5_000_000),
    ("i16", ("length", "i16", ("load_text", "s8", at(0), 9)), {0: b"four"}, 4),
    ("i16", ("find", "i16", const("s8", b"abcabc"), const("s8", b"ca")), {}, 3),
    ("i16", ("find", "i16", const("s8", b"abc"), const("s8", b"x")), {}, 0),
    ("i16", ("find", "i16", const("s8", b"abc"), const("s8", b"")), {}, 0),
    ("ref", ("reference", "ref", at(8), 255), {}, 1 << 40 | SLOTS_OFFSET + 8 << 8 | 255),
    ("ref", ("reference", "ref", at(8, (2, load("u8", 0))), 3), {0: b"\2"}, 1 << 40 | SLOTS_OFFSET + 12 << 8 | 3),
    ("ref", ("reference", "ref", behind(const("ref", 1 << 40 | 80 << 8 | 255), 4), 255), {}, 1 << 40 | 84 << 8 | 255),
    ("ref", ("reference", "ref", behind(load("ref", 0)), 255), {}, "R0110"),
    ("ref", ("bit_behind", "ref", load("ref", 0), const("i64", 13)), {0: STRUCTS["ref"].pack(1 << 40 | 80 << 8 | 255)},
     1 << 40 | 81 << 8 | 5),
    ("ref", ("bit_behind", "ref", const("ref", 3 << 40 | 80 << 8 | 6), load("i64", 0)), {0: b"\4"}, 3 << 40 | 81 << 8 | 2),
    ("ref", ("bit_behind", "ref", const("ref", 3 << 40 | 255), const("i64", -1)), {}, 3 << 40 | 0xFFFFFFFF << 8 | 7),
    ("i64", ("from_text", "i64", "LINT", const("s8", b" 16#ff "), 3), {}, 255),
    ("f32", ("from_text", "f32", "REAL", const("s8", b"0.1"), 3), {}, struct.unpack("f", struct.pack("f", 0.1))[0]),
    ("b", ("from_text", "b", "BOOL", const("s8", b"true"), 3), {}, True),
    ("i16", ("from_text", "i16", "INT", const("s8", b"32768"), 3), {}, "R0105"),
    ("i16", ("from_text", "i16", "INT", const("s8", b"one"), 3), {}, "R0111"),
    ("i64", ("from_leading", "i64", "LINT", 0, const("s8", b" -12.5 pcs")), {}, -12),
    ("i16", ("from_leading", "i16", "INT", 1, const("s8", b"12 pcs")), {}, 0),
    ("i16", ("from_leading", "i16", "INT", 1, const("s8", b" 16#7f ")), {}, 127),
    ("f64", ("from_leading", "f64", "LREAL", 0, const("s8", b"2.5e1e")), {}, 25.0),
    ("b", ("from_leading", "b", "BOOL", 0, const("s8", b"no")), {}, False),
    ("s8", ("to_text", "s8", "INT", const("i16", -5)), {}, b"-5"),
    ("s8", ("to_text", "s8", "BOOL", load("b", 0)), {0: b"\1"}, b"TRUE"),
    ("s8", ("to_text", "s8", "USINT", ("convert", "u8", "b", load("b", 0))), {0: b"\1"}, b"1"),
    ("s8", ("enum_text", "s8", ((1, "Red"), (2, "Green")), load("i16", 0)), {0: b"\2"}, b"Green"),
    ("s8", ("enum_text", "s8", ((1, "Red"), (2, "Green")), load("i16", 0)), {0: b"\3"}, b"3"),
    ("b", ("lt", "b", "s8", const("s8", b"ab"), const("s8", b"abc")), {}, True),
    ("b", ("gt", "b", "s8", const("s8", b"\xe4"), const("s8", b"z")), {}, True),
    ("s8", ("min", "s8", const("s8", b"b"), const("s8", b"a")), {}, b"a"),
    ("s8", ("select", "s8", const("b", 1), const("s8", b"b"), const("s8", b"a")), {}, b"a"),
    ("s16", ("load_text", "s16", at(1), 2), {1: b"a\0\xac\x20c\0"}, "a\u20ac"),
    ("s16", ("load_text", "s16", at(0), 9), {0: b"a\0b\1\0\0c\0"}, "a\u0162"),
    ("i16", ("length", "i16", ("load_text", "s16", at(0), 9)), {0: b"\0\1\1\0"}, 2),
    ("i16", ("find", "i16", const("s16", "abcab\u0163"), const("s16", "b\u0163")), {}, 5),
    ("i16", ("find", "i16", const("s16", "\u6161b"), const("s16", "ab")), {}, 0),
    ("b", ("lt", "b", "s16", const("s16", "\u00ff"), const("s16", "\u0100")), {}, True),
    ("b", ("eq", "b", "s16", ("load_text", "s16", at(0), 3), const("s16", "\u1234")), {0: b"\x34\x12"}, True),
    ("s16", ("max", "s16", const("s16", "\uff00"), const("s16", "\ud83d")), {}, "\uff00"),
    ("s8", ("character", "s8", load("u8", 0)), {0: b"\xe4"}, b"\xe4"), ("s8", ("character", "s8", load("u8", 0)), {}, b""),
    ("s16", ("character", "s16", load("u16", 0)), {0: b"\xac\x20"}, "\u20ac"),
    ("s16", ("character", "s16", load("u16", 0)), {}, ""),
    ("u8", ("first", "u8", ("load_text", "s8", at(0), 3)), {0: b"xyz"}, ord("x")),
    ("u8", ("first", "u8", ("load_text", "s8", at(0), 3)), {}, 0), ("u8", ("first", "u8", const("s8", b"")), {}, 0),
    ("u16", ("first", "u16", ("load_text", "s16", at(0), 3)), {0: b"\xac\x20x\0"}, 0x20AC),
    ("u16", ("first", "u16", ("mid", "s16", const("s16", "ab"), const("i64", 1), const("i64", 3), 3)), {}, 0),
    ("s16", ("recode", "s16", ("load_text", "s8", at(0), 9)), {0: b"\xe4b"}, "\u00e4b"),
    ("s8", ("recode", "s8", ("load_text", "s16", at(0), 9)), {0: b"\xe4\0\xac\x20b\0"}, b"\xe4?b"),
]
TEXT = const("s8", b"ABCDE")


def n(value: int) -> Node:
    return const("i64", value)


STRINGS: list[tuple[Node, Any]] = [
    (("left", "s8", TEXT, n(2), 3), b"AB"), (("left", "s8", TEXT, n(9), 3), b"ABCDE"),
    (("left", "s8", TEXT, n(0), 3), b""),
    (("left", "s8", TEXT, n(-1), 3), "R0108"), (("right", "s8", TEXT, n(2), 3), b"DE"),
    (("right", "s8", TEXT, n(9), 3), b"ABCDE"),
    (("right", "s8", TEXT, n(0), 3), b""), (("right", "s8", TEXT, n(-1), 3), "R0108"),
    (("mid", "s8", TEXT, n(2), n(3), 3), b"CD"), (("mid", "s8", TEXT, n(9), n(3), 3), b"CDE"),
    (("mid", "s8", TEXT, n(2), n(6), 3), b""),
    (("mid", "s8", TEXT, n(2), n(0), 3), "R0108"), (("mid", "s8", TEXT, n(-1), n(1), 3), "R0108"),
    (("concat", "s8", TEXT, TEXT), b"ABCDEABCDE"),
    (("insert", "s8", TEXT, const("s8", b"xy"), n(2), 3), b"ABxyCDE"),
    (("insert", "s8", TEXT, const("s8", b"xy"), n(0), 3), b"xyABCDE"),
    (("insert", "s8", TEXT, const("s8", b"xy"), n(7), 3), b"ABCDExy"),
    (("insert", "s8", TEXT, TEXT, n(-1), 3), "R0108"),
    (("delete", "s8", TEXT, n(2), n(3), 3), b"ABE"), (("delete", "s8", TEXT, n(2), n(6), 3), b"ABCDE"),
    (("delete", "s8", TEXT, n(99), n(2), 3), b"A"), (("delete", "s8", TEXT, n(2), n(0), 3), "R0108"),
    (("delete", "s8", TEXT, n(-2), n(1), 3), "R0108"),
    (("replace", "s8", TEXT, const("s8", b"xyz"), n(2), n(2), 3), b"AxyzDE"),
    (("replace", "s8", TEXT, const("s8", b"xyz"), n(0), n(2), 3), b"AxyzBCDE"),
    (("replace", "s8", TEXT, const("s8", b"xyz"), n(2), n(9), 3), b"ABCDExyz"),
    (("replace", "s8", TEXT, TEXT, n(1), n(0), 3), "R0108"),
]


@each_of(("machine", "expression", "before", "wanted"), RUNS)
def test_expression(machine: str, expression: Node, before: dict[int, bytes], wanted: Any) -> None:
    assert same(yields(machine, expression, before), wanted)


@each_of(("expression", "wanted"), STRINGS)
def test_string_function(expression: Node, wanted: Any) -> None:
    assert yields("s8", expression) == wanted


@each_of(("expression", "wanted"), STRINGS)
def test_wide_string_function(expression: Node, wanted: Any) -> None:
    assert yields("s16", wide(expression)) == wide(wanted)


def wide(item: Any) -> Any:
    """Code over STRING as code over WSTRING, whose characters take both bytes."""
    if isinstance(item, tuple):
        return tuple(map(wide, item))
    return "s16" if item == "s8" else "".join(chr(byte * 257) for byte in item) if isinstance(item, bytes) else item


@each_of(("bit", "byte", "wanted"),
 [(255, 2, True), (255, 0, False), (0, 2, False), (1, 2, True), (7, 128, True)])
def test_load_flag_takes_the_bit_that_the_reference_names(bit: int, byte: int, wanted: bool) -> None:
    before = {0: STRUCTS["ref"].pack(1 << 40 | SLOTS_OFFSET + 40 << 8 | bit), 40: bytes([byte])}
    assert yields("b", ("load_flag", "b", behind(load("ref", 0))), before) is wanted


@each_of("reference", [0, 2 << 40 | SLOTS_OFFSET << 8, 1 << 40 | 0xFFFFFFFF << 8, 255 << 40])
def test_a_reference_to_nowhere_traps(reference: int) -> None:
    before = {0: STRUCTS["ref"].pack(reference)}
    for machine, name in (("i32", "load"), ("i32", "load_raw"), ("b", "load_flag")):
        assert yields(machine, (name, machine, behind(load("ref", 0))), before) == "R0110"


def test_loads_behind_a_reference_work_at_any_place() -> None:
    before = {0: STRUCTS["ref"].pack(1 << 40 | SLOTS_OFFSET + 41 << 8 | 255), 47: b"\x34\x12"}
    for name in ("load", "load_raw"):
        assert yields("i16", (name, "i16", behind(load("ref", 0), 2, (2, const("i64", 2)))), before) == 0x1234


def test_nan_is_stored_canonical() -> None:
    nan = ("sub", "f32", const("f32", INF), load("f32", 0))
    rig = execute((store("f32", 8, nan), ("store_raw", "f32", at(13), nan), store("f32", 20, load("f32", 4))),
                  before={0: struct.pack("<f", INF), 4: b"\1\0\xc0\xff"})
    assert [rig.slot("u32", 8), rig.memory.read(SLOTS_OFFSET + 13, "u32"), rig.slot("u32", 20)] == [0x7FC00000] * 3


def test_an_operand_that_is_not_evaluated_does_not_trap() -> None:
    trap = ("eq", "b", "i16", const("i16", 1), ("div", "i16", const("i16", 1), load("i16", 0), 3))
    assert yields("b", ("and_then", "b", const("b", 0), trap)) is False
    assert yields("b", ("or_else", "b", const("b", 1), trap)) is True
    assert yields("b", ("and", "b", const("b", 0), trap)) == "R0101"
    assert yields("b", ("or", "b", const("b", 1), trap)) == "R0101"


def test_operands_trap_from_left_to_right() -> None:
    first = ("div", "i16", const("i16", 1), load("i16", 0), 3)
    second = ("check", "i16", load("i16", 0), 1, 2, "R0103", 4)
    for name in ("add", "min", "mul"):
        assert yields("i16", (name, "i16", first, second)) == "R0101"
        assert yields("i16", (name, "i16", second, first)) == "R0103"
    assert yields("i16", ("select", "i16", ("is_set", "b", "i16", second), first, first)) == "R0103"


def all_examples() -> set[str]:
    """Names of the expressions that the tables of this file execute."""
    named = {row[0] for table in (NUMBERS, COMPARISONS, SINGLES, SHIFTS, CONVERSIONS) for row in table}
    named |= {"const", "tmp", "load", "math", "load_flag"}  # by every test, test_math and the tests of references
    return named.union(*(operations_in(row[1]) for row in RUNS), *(operations_in(row[0]) for row in STRINGS))


def test_every_expression_has_an_example() -> None:
    assert all_examples() >= set(EXPRESSIONS)
