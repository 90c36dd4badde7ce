"""Floats in machine code whose bits are no ordinary number: any NaN has the bits of the canonical one, all others their own."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from hand_image import execute, image, load, power_on, store
from rows import each_of

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.engine.native import engine as native

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

from fbvm.engine.native.engine import NativeEngine

BITS = {
    "f32": (0x7F800001, 0x7FC00000, 0x7FC00001, 0x7FFFFFFF, 0xFF800001, 0xFFC00000, 0xFFFFFFFF, 0x7F800000, 0xFF800000,
            0x7F7FFFFF, 0xFF7FFFFF, 0x00000001, 0x80000000, 0x3F800000),
    "f64": (0x7FF0000000000001, 0x7FF8000000000000, 0x7FF8000000000001, 0x7FFFFFFFFFFFFFFF, 0xFFF0000000000001,
            0xFFF8000000000000,
            0x7FF0000000000000, 0xFFF0000000000000, 0x7FEFFFFFFFFFFFFF, 1, 0x8000000000000000, 0x3FF0000000000000),
}  # fmt: skip
"""The bits of numbers: NaNs first, by payload and sign, then infinity, the largest, the smallest, -0 and 1."""
NANS = {"f32": 7, "f64": 6}
WORDS = {"f32": "u32", "f64": "u64"}


def canonical(form: str, bits: int) -> int:
    """The bits that a program sees, by the canonical NaN of Python's engine."""
    from fbvm.base.arithmetic import NAN

    size = 8 * struct.calcsize({"f32": "f", "f64": "d"}[form])
    mask, infinite = (1 << size - 1) - 1, {"f32": 0x7F800000, "f64": 0x7FF0000000000000}[form]
    pattern = {"f32": ("<f", "<I"), "f64": ("<d", "<Q")}[form]
    return bits if bits & mask <= infinite else struct.unpack(pattern[1], struct.pack(pattern[0], NAN))[0]  # type: ignore[no-any-return]


@pytest.mark.slow
@each_of("form", ["f32", "f64"])
def test_the_bits_of_any_nan_are_those_of_the_canonical_one(form: str) -> None:
    word, size = WORDS[form], struct.calcsize({"f32": "f", "f64": "d"}[form])
    count = len(BITS[form])
    code = []
    for number in range(count):
        seen = ("bits", word, form, load(form, 8 * number))
        back = ("bits", form, word, load(word, 8 * number))
        code += [store(word, 400 + 8 * number, seen), store(form, 800 + 8 * number, back)]
    before = {8 * number: bits.to_bytes(size, "little") for number, bits in enumerate(BITS[form])}
    wanted = [canonical(form, bits) for bits in BITS[form]]
    assert sum(made != bits for made, bits in zip(wanted, BITS[form], strict=True)) >= NANS[form] - 2
    program = image(tuple(code))
    python = execute(tuple(code), before=before).memory
    for level in (0, 2):
        memory = power_on(program, before)
        made = NativeEngine(program, memory, level)
        assert made.run(0) is None
        for first in (400, 800):
            found: list[Any] = [memory.read(SLOTS_OFFSET + first + 8 * number, word) for number in range(count)]
            assert found == wanted, (level, first, [hex(each) for each in found])
            assert found == [python.read(SLOTS_OFFSET + first + 8 * number, word) for number in range(count)]
