"""Texts of values and values of texts: machine code writes and reads what `fbvm.syntax.st.texts` does, to the bit."""

from __future__ import annotations

import ctypes
import struct
from datetime import date, timedelta
from functools import cache
from typing import Any

import hand_image
import pytest
from depth import times
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rows import each_of

from fbvm.base.areas import BUDGET
from fbvm.base.arithmetic import Undefined, single
from fbvm.base.memory import STRUCTS
from fbvm.base.types import DAY_NS, ELEMENTARY, SHORT_NAMES
from fbvm.engine.native import engine as native
from fbvm.engine.native.library import literals, reading, routines
from fbvm.syntax.st import texts

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

TYPES = {name: kind.machine for name, kind in ELEMENTARY.items() if "ANY_CHAR" not in kind.families}
CAPACITY = 500


@cache
def reader(data_type: str) -> tuple[native.NativeEngine, str]:
    """An engine whose program reads the text of slot 8 as a value of a type into slot 0."""
    machine = TYPES[data_type]
    value = ("from_text", machine, data_type, ("load_text", "s8", hand_image.at(8), CAPACITY), 3)
    program = hand_image.image((("store", machine, hand_image.at(0), value),))
    return native.NativeEngine(program, hand_image.power_on(program), 0), machine


@cache
def writer(data_type: str) -> tuple[native.NativeEngine, str]:
    """An engine whose program writes the value of slot 0 as text to slot 8."""
    machine = TYPES[data_type]
    value = ("to_text", "s8", data_type, ("load", machine, hand_image.at(0)))
    program = hand_image.image((("store_text", hand_image.at(8), CAPACITY, value),))
    return native.NativeEngine(program, hand_image.power_on(program), 0), machine


def read(data_type: str, text: bytes) -> Any:
    """What machine code reads: a value in bytes, or (code, values) of the trap."""
    engine, machine = reader(data_type)
    engine.memory.write_text(hand_image.SLOTS_OFFSET + 8, CAPACITY, text)
    trap = engine.run(0)
    if trap:
        return trap.code, trap.values
    return STRUCTS[machine].pack(engine.memory.read(hand_image.SLOTS_OFFSET, machine))


def wanted(data_type: str, text: bytes) -> Any:
    try:
        value = texts.from_text(data_type, text)
    except Undefined as undefined:
        return undefined.code, undefined.values
    return STRUCTS[TYPES[data_type]].pack(value)


SEEDS = [
    "0", "1", "TRUE", "false", "255", "-128", "65536", "4294967296", "18446744073709551615", "18446744073709551616",
    "-9223372036854775808", "-9223372036854775809", "9223372036854775808", "16#FF", "2#1010_1010", "8#377", "16#1_0000",
    "INT#5", "SINT#-129", "WORD#16#FFFF", "LREAL#1.5e300", "1.5", "-0.0", "-0", "1e5", "1_0.2_5E-3", "3.5e38", "1e400",
    "340282356779733661637539395458142568447", "1.0e-46", "INF", "-inf", "nan", "+INF", "16#FFFFFFFFFFFFFFFFF",
    "16#8000000000000401", "16#80000000000004000000000001", "T#1d2h3m4s5ms6us7ns", "LTIME#-5us300ns", "1.5s", "-1h",
    "106751d23h47m16s854ms775us808ns", "-106751d23h47m16s854ms775us808ns", "9223372036854775807ns", "0.1us", "0.0001us",
    "-9223372036854775808ns", "1m_30s", "1ms1us", "2d0.5h", "D#2024-02-29", "DATE#1969-12-31", "2023-02-29",
    "1677-09-21", "1677-09-22", "2262-04-11", "2262-04-12", "0001-01-01", "0-01-01", "0000-02-29", "0000-02-30",
    "TOD#23:59:59.999999999", "24:00", "13:45",
    "7:5:3.25", "12:00:00.1234567891", "DT#2024-05-31-13:45:30", "2262-04-11-23:47:16.854775807",
    "2262-04-11-23:47:16.854775808", "LDT#1970-01-01-00:00", "STRING#'a'", "", " ", "#", "INT#", "INT#x", "_1", "1_",
]  # fmt: skip
MORE = """
    16#1 16#0 2#1 1. 1.e5 .5 1e 1e+ 1E-5x 1.5_0 1_ 1__0 1_.5 2.5e1_0 1e5_ +5 -5 + - +-1 --1 127 128 -129 256 32767 32768
    -32768 -32769 65535 -2147483648 2147483648 -2147483649 4294967295 -1 9223372036854775807 16#7F 16#80 16#FF_FF 16#8000
    16# 16#G 16#_F 16#F_ 2#2 2# 8#8 10#1 10#1_000 10# 10#_1 10#A 10#1.5 10#18446744073709551616 -10#5 REAL#10#5 1#0 +16#1
    -16#1 26#1 3#1 16#7FFFFFFFFFFFFFFF 16#FFFFFFFFFFFFFFFF 16#10000000000000000 2#1_1 BOOL#1 BOOL#TRUE bool#2 2 TRUEX TRU
    REAL#1.0 REAL#16#10 LREAL#INF INT#INF DINT#5 ULINT#5 3.4028235677973365e38 3.4028235677973366e38 1.7976931348623157e308
    1.7976931348623159e308 16#20000000000001 16#20000000000003 16#7FFFFFFFFFFFFC00 16#FFFFFFFFFFFFF800 0e0 00012 -0.0e5 NANX
    +NAN 1d1d 1h1d 1s500ms 1.5m2s 1m2.5s 1us1ns 1ms1ms 5 1x 1ds 1msx d _1d 1_d 1d_2h 1d__2h -_5s 1.s 1._5s 1.5_0s 0.5ns 0.5ns0
    0.1ns 0.001us 1.0000000000000001s 0.3333333333333333d 106751d 106752d 2562047h 2562048h 9223372036854775808ns
    18446744073709551616ns 9223372036854775807.5ns -9223372036854775808.5ns +5s T#5s TIME#5s LT#5s t#+5S 1M 1Ms 1Us 1NS T#
    T#- LTIME#9223372036854775807ns D#1970-1-1 1970-01-1x 1970-13-01 1970-00-01 1970-01-00 1970-01-32 2000-02-29 1900-02-29
    2100-02-28 2024-02-30 1970-04-31 1970-04-30 1970-06-31 1970-07-31 1970-08-31 1970-09-31 1970-11-31 1970-12-31
    19700-01-01 1970-001-01 1970-01-001 1970 1970- 1970-01 1970-01- -1970-01-01 1970-1-1-0:0 LD#1970-01-02 9999-12-31
    0001-01-01 1677-09-22 1677-09-20 1970-03-01 1970-02-28 1972-03-01 1969-03-01 1600-02-29 23:59 24:00:00 23:60 23:59:60
    23:59:59 0:0:0 0:0:0.0 0:0: 0: :0 0:0:0. 0:0:0._1 0:0:0.1_0 0:0:0.000000001 0:0:0.0000000001 0:0:0.0000000010 123:0
    0:123 0:0:123 0:0:5x 0:0x TOD#0:0 LTOD#12:34:56.789 DT#1970-01-01-00:00:00.5 1970-01-01- 1970-01-01-1 1970-01-01
    1970-01-01-24:00 1970-02-30-00:00 -00:00 2262-04-11-23:47:16.854775806 1677-09-22-00:00:00 DT# 9999-01-01-00:00
    1970-01-01-10:3 9999-01-01-10 9999-01-01-10: 1111111111111111111s 0.555555555555555555555555555555
    9223372036854775808us 18446744073709551615us 9223372036854775809s 1d9223372036854775808ns
    18446744073709551615ns 1s9223372036854775807ns -1us9223372036854774808ns -1us9223372036854774809ns 1us9223372036854774807ns
    1us9223372036854774808ns 1us9223372036854774809ns -9223372036854775.808us -9223372036854775.809us -9223372036854775.810us
    9223372036854775.807us 9223372036854775.808us 9223372036854775.809us
    BOOL INT REAL LREAL TIME LTIME DATE LDATE TOD LTOD DT LDT STRING TIME_OF_DAY DATE_AND_TIME T 1T
"""
SEEDS += [*MORE.split(), "CHAR#'a'", "WSTRING#\"a\"", "a" * 401, "0" * 401]
LETTERS = st.sampled_from("0123456789_.-+:#eEdhmsnuTDOLFAIR x\xff")
EDITS = st.lists(st.tuples(st.integers(0, 40), st.integers(0, 2), LETTERS), max_size=3)


def edited(seed: str, edits: list[tuple[int, int, str]]) -> bytes:
    """A text with some characters inserted, replaced or left out."""
    for place, dropped, letter in edits:
        place = min(place, len(seed))
        seed = seed[:place] + letter * (dropped < 2) + seed[place + dropped:]
    return seed.encode("latin-1")


@pytest.mark.slow
@each_of("data_type", TYPES)
def test_every_seed_is_read(data_type: str) -> None:
    seen = {seed: read(data_type, seed.encode()) for seed in SEEDS}
    assert seen == {seed: wanted(data_type, seed.encode()) for seed in SEEDS}


OUT = ctypes.create_string_buffer(reading.CLEANED + reading.LONGEST + 8)


def by_routine(routine: Any, data_type: str, text: bytes, *options: int) -> tuple[int, int]:
    """What a routine of machine code's library returns and writes to `OUT` as it runs in Python."""
    place, kind = ctypes.create_string_buffer(text), reading.KINDS[SHORT_NAMES.get(data_type, data_type)]
    status = routine(ctypes.addressof(OUT), kind, *options, ctypes.addressof(place), len(text))
    return status, int.from_bytes(OUT.raw[:8], "little")


def bits_of(data_type: str, value: float) -> int:
    """The eight bytes with which the library hands over a value: a real as a double."""
    machine = TYPES[data_type]
    if machine[0] == "f":
        return int.from_bytes(struct.pack("<d", value), "little")
    return int(value) & (1 << 64) - 1


def rounded(data_type: str, bits: int) -> int:
    """The bits of a double behind the rounding to REAL, if that is the type."""
    value: float = struct.unpack("<d", bits.to_bytes(8, "little"))[0]
    return bits_of(data_type, single(value)) if data_type == "REAL" else bits


@pytest.mark.slow
@each_of("data_type", TYPES)
def test_every_seed_is_read_by_the_routine_itself(data_type: str) -> None:
    """As Python runs it: a value, or which of both mistakes it is."""
    codes = {reading.MALFORMED: "R0111", reading.OUTSIDE: "R0105"}
    differing = []
    for seed in SEEDS:
        text, expected = seed.encode(), wanted(data_type, seed.encode())
        status, bits = by_routine(literals.read_value, data_type, text)
        good = (codes.get(status) == expected[0] if isinstance(expected, tuple) else
                status == reading.GOOD and rounded(data_type, bits) == bits_of(data_type, texts.from_text(data_type, text)))
        if not good:
            differing.append((seed, status, bits, expected))
    assert differing == []


@each_of("data_type, text, whole, value", [
    ("INT", b"12abc", 0, 12), ("INT", b"12abc", 1, 0), ("INT", b"12", 1, 12), ("INT", b" 12 x", 0, 12), ("INT", b"x12", 0, 0),
    ("INT", b"40000x", 0, 0), ("INT", b"40000", 1, 0), ("INT", b"", 0, 0), ("INT", b"", 1, 0), ("REAL", b"1.5e", 0, 1.5),
    ("TIME", b"1s5", 0, 10**9), ("TIME", b"1s5m", 0, 10**9), ("INT", b"7" + b" " * 63 + b"8", 0, 7),
    ("INT", b"7" + b" " * 64, 0, 7), ("INT", b"7" + b" " * 90, 1, 7), ("INT", b" " * 63 + b"7", 0, 7),
    ("INT", b" " * 64 + b"7", 0, 0), ("INT", b" " * 64 + b"7", 1, 7),
])
def test_a_leading_literal_is_read_by_the_routine_itself(data_type: str, text: bytes, whole: int, value: float) -> None:
    assert texts.from_leading(data_type, whole, text) == value
    assert by_routine(literals.read_leading, data_type, text, whole) == (reading.GOOD, bits_of(data_type, value))


WRITERS = {"TIME": routines.put_time, "LTIME": routines.put_ltime, "DATE": routines.put_date, "LDATE": routines.put_ldate,
           "TIME_OF_DAY": routines.put_tod, "LTIME_OF_DAY": routines.put_ltod, "DATE_AND_TIME": routines.put_dt,
           "LDATE_AND_TIME": routines.put_ldt, "LINT": routines.put_integer, "LREAL": routines.put_lreal,
           "REAL": routines.put_real}
NUMBERS = [
    0, 1, -1, 9, 10, 11, -10, 99, 100, 999_999_999, 1_000_000_000, 1_000_000_001, 60 * 10**9, 3600 * 10**9 - 1, 7200 * 10**9,
    86_399_999_999_999,
    86_400_000_000_000, -86_400_000_000_000, -86_400_000_000_001, 93_784_005_006_007, -93_784_005_006_007, 951_782_400 * 10**9,
    951_868_800 * 10**9, 5_097_600 * 10**9, 4_102_444_800 * 10**9, -2_203_891_200 * 10**9, 951_868_799 * 10**9,
    78_796_800 * 10**9, (1 << 63) - 1, -(1 << 63) + 1, 1_234_567_890_123_456_789, -8_520_336_000 * 10**9, 500_000_000, 1_000,
    1_000_000,
]  # fmt: skip
REALS = [0.0, -0.0, 1.0, -1.5, 0.1, 1 / 3, 1e15, 1e16, 1e17, 123456789.0, 1e-4, 1e-5, 1e22, 1e300, 5e-324, float("inf"),
         float("-inf"), float("nan"), 2.0**-149, 2.0**-126, 16777217.0, 3.4028234663852886e38, 9.999999e9,
         0.30000001192092896]


@each_of("data_type", WRITERS)
def test_values_are_written_by_the_routine_itself(data_type: str) -> None:
    differing = []
    for value in REALS if data_type in ("REAL", "LREAL") else NUMBERS:
        value = single(value) if data_type == "REAL" else value
        given = bits_of(data_type, value)
        signed = given - (given >> 63 << 64)
        length = WRITERS[data_type](ctypes.addressof(OUT), signed)
        if OUT.raw[:length] != texts.to_text(data_type, value):
            differing.append((value, OUT.raw[:length]))
    assert differing == []


@each_of("year", [1700, 1900, 1968, 1969, 1970, 1999, 2000, 2001, 2100, 2260])
def test_the_first_and_the_last_day_of_each_month_are_written_by_the_routine_itself(year: int) -> None:
    first = [date(year, month, 1) for month in range(1, 13)]
    for day in [*first, *(day - timedelta(1) for day in first)]:
        for behind in (0, DAY_NS - 1):
            length = routines.put_ldate(ctypes.addressof(OUT), (day - date(1970, 1, 1)).days * DAY_NS + behind)
            assert OUT.raw[:length].decode() == f"LD#{day}", (day, behind)


@pytest.mark.slow
@settings(max_examples=times(1500), deadline=None)
@given(st.sampled_from(sorted(TYPES)), st.sampled_from(SEEDS), EDITS)
def test_any_text_is_read(data_type: str, seed: str, edits: list[tuple[int, int, str]]) -> None:
    text = edited(seed, edits)
    assert read(data_type, text) == wanted(data_type, text)


@pytest.mark.slow
@settings(max_examples=times(300), deadline=None)
@given(st.sampled_from(("REAL", "LREAL", "DINT", "TIME")),
       st.from_regex(r"[+-]?[0-9]{1,20}(\.[0-9]{1,30})?([eE][+-]?[0-9]{1,3})?", fullmatch=True))
@example("LREAL", "1" * 400)
@example("LREAL", "1" * 401)
@example("LREAL", "16#" + "F" * 300)
@example("REAL", "0." + "0" * 300 + "1")
def test_numbers_are_read(data_type: str, text: str) -> None:
    assert read(data_type, text.encode()) == wanted(data_type, text.encode())


VALUES = {
    "f32": st.floats(width=32), "f64": st.floats(),
    **{f"i{bits}": st.integers(-(1 << bits - 1), (1 << bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"u{bits}": st.integers(0, (1 << bits) - 1) for bits in (8, 16, 32, 64)},
    "b": st.booleans(),
}  # fmt: skip


@pytest.mark.slow
@settings(max_examples=times(2000), deadline=None)
@given(st.sampled_from(sorted(TYPES)), st.data())
def test_any_value_is_written(data_type: str, data: st.DataObject) -> None:
    engine, machine = writer(data_type)
    value = data.draw(VALUES[machine])
    if machine == "f32":
        value = single(value)
    engine.memory.write(hand_image.SLOTS_OFFSET, machine, value)
    assert engine.run(0) is None
    written = engine.memory.read_text(hand_image.SLOTS_OFFSET + 8, CAPACITY)
    assert written == texts.to_text(data_type, value)


def test_a_real_is_written_with_fewest_digits_for_every_exponent() -> None:
    engine, _ = writer("REAL")
    differing = []
    for bits in [exponent << 23 | fraction for exponent in range(255) for fraction in (0, 1, 0x400000, 0x7FFFFF, 0x2AAAAA)]:
        value = struct.unpack("<f", struct.pack("<I", bits))[0]
        engine.memory.write(hand_image.SLOTS_OFFSET, "f32", value)
        engine.memory.write(BUDGET, "i64", 1000)
        engine.run(0)
        if engine.memory.read_text(hand_image.SLOTS_OFFSET + 8, CAPACITY) != texts.to_text("REAL", value):
            differing.append(bits)
    assert differing == []
