"""Every expression of the table of operations with its edge values, on the plain and the observed build."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from expression_rows import NUMBERS, RUNS, STRINGS
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


@pytest.mark.slow
@each_of(("name", "machine", "a", "b", "wanted"), NUMBERS)
def test_two_operands(name: str, machine: str, a: Any, b: Any, wanted: Any) -> None:
    (left, before), (right, more) = slot(machine, a), slot(machine, b, second=True)
    if wanted is None:
        wide = yields("f64", (name, "f64", const("f64", a), const("f64", b), *sited(name)))
        wanted = struct.unpack("<f", struct.pack("<f", wide))[0]
    for x in (left, const(machine, a)):
        for y in (right, const(machine, b)):
            assert same(yields(machine, (name, machine, x, y, *sited(name)), before | more), wanted), (x, y)


@pytest.mark.slow
@each_of(("name", "machine", "a", "b", "wanted"), COMPARISONS)
def test_comparison(name: str, machine: str, a: Any, b: Any, wanted: bool) -> None:
    (left, before), (right, more) = slot(machine, a), slot(machine, b, second=True)
    for x in (left, const(machine, a)):
        for y in (right, const(machine, b)):
            assert yields("b", (name, "b", machine, x, y), before | more) is wanted


@pytest.mark.slow
@each_of(("name", "machine", "a", "wanted"), SINGLES)
def test_one_operand(name: str, machine: str, a: Any, wanted: Any) -> None:
    operand, before = slot(machine, a)
    for x in (operand, const(machine, a)):
        assert same(yields(machine, (name, machine, x), before), wanted)


@pytest.mark.slow
@each_of(("name", "machine", "a", "n", "wanted"), SHIFTS)
def test_shift(name: str, machine: str, a: int, n: int, wanted: Any) -> None:
    (operand, before), (by, more) = slot(machine, a), slot("i64", n, second=True)
    for x in (operand, const(machine, a)):
        for y in (by, const("i64", n)):
            assert yields(machine, (name, machine, x, y, 7), before | more) == wanted


@pytest.mark.slow
@each_of(("name", "machine", "source", "a", "wanted"), CONVERSIONS)
def test_conversion(name: str, machine: str, source: str, a: Any, wanted: Any) -> None:
    operand, before = slot(source, a)
    if wanted is None:
        wanted = struct.unpack("<f", struct.pack("<f", a))[0]
    for x in (operand, const(source, a)):
        assert same(yields(machine, (name, machine, source, x, *sited(name)), before), wanted)


@pytest.mark.slow
@each_of(("function", "a", "wanted"), MATH)
def test_math(function: str, a: float, wanted: float) -> None:
    operand, before = slot("f64", a)
    assert same(yields("f64", ("math", "f64", function, operand), before), wanted)
    operand, before = slot("f32", a)
    rounded = struct.unpack("<f", struct.pack("<f", wanted))[0]
    assert same(yields("f32", ("math", "f32", function, operand), before), rounded)








@pytest.mark.slow
@each_of(("machine", "expression", "before", "wanted"), RUNS)
def test_expression(machine: str, expression: Node, before: dict[int, bytes], wanted: Any) -> None:
    assert same(yields(machine, expression, before), wanted)


@pytest.mark.slow
@each_of(("expression", "wanted"), STRINGS)
def test_string_function(expression: Node, wanted: Any) -> None:
    assert yields("s8", expression) == wanted


@pytest.mark.slow
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


@pytest.mark.parametrize("sign", [1, -1])
def test_whole_numbers_beyond_24_bits_are_rounded_to_real(sign: int) -> None:
    """A mask tells the engine how large a number may be: up to 2**24 it need not be rounded."""
    for mask, number, wanted in ((0xFFFFFF, 0xFFFFFF, 0xFFFFFF), (0x1FFFFFF, 0x1FFFFFF, 0x2000000),
                                 (0x1FFFFFF, 0x1FFFFFD, 0x1FFFFFC)):  # fmt: skip
        masked: Node = ("and", "i32", load("i32", 0), const("i32", mask))
        node: Node = masked if sign > 0 else ("neg", "i32", masked)
        rounded: Node = ("convert", "f64", "f32", ("convert", "f32", "i32", node))
        assert yields("f64", rounded, {0: struct.pack("<i", number)}) == sign * wanted


def test_an_operand_that_is_not_evaluated_does_not_trap() -> None:
    trap = ("eq", "b", "i16", const("i16", 1), ("div", "i16", const("i16", 1), load("i16", 0), 3))
    assert yields("b", ("and_then", "b", const("b", 0), trap)) is False
    assert yields("b", ("or_else", "b", const("b", 1), trap)) is True
    assert yields("b", ("and", "b", const("b", 0), trap)) == "R0101"
    assert yields("b", ("or", "b", const("b", 1), trap)) == "R0101"


@pytest.mark.slow
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
