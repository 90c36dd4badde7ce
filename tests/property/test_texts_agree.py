"""Texts of values and values of texts: machine code writes and reads what `fbvm.syntax.st.texts` does, to the bit."""

from __future__ import annotations

import struct
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
from fbvm.base.types import ELEMENTARY
from fbvm.engine.native import engine as native
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
