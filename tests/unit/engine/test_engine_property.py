"""Operations against Python's own numbers, and whole expressions against a second way to evaluate them."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from depth import times
from hand_image import const, image, load, power_on, store
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.base import arithmetic
from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import INTEGERS, Node, limits
from fbvm.engine.python.engine import PythonEngine

integer_types = st.sampled_from(INTEGERS)


def numbers(machine: str) -> st.SearchStrategy[int]:
    """Numbers of a type, its edges more often than others."""
    low, high = limits(machine)
    return st.one_of(st.sampled_from([low, low + 1, 0, 1, high - 1, high]), st.integers(low, high))


def cut(value: int, machine: str) -> int:
    """The low bits of a number as `struct` reads them: not the way of the product."""
    size = STRUCTS[machine].size
    raw = (value % (1 << 64)).to_bytes(8, "little")[:size]
    return int.from_bytes(raw, "little", signed=machine[0] == "i")


def evaluated(machine: str, expression: Node, before: dict[int, bytes]) -> Any:
    """What an engine stores for an expression, or the code of its trap."""
    program = image((store(machine, 1024, expression),))
    memory = power_on(program, before)
    trap = PythonEngine(program, memory).run(0)
    value = trap.code if trap else memory.read(SLOTS_OFFSET + 1024, machine)
    memory.close()
    return value


# --- trees of integer operations ---

Tree = tuple[Node, Callable[[], int]]
"""An expression, and a function that works it out in unbounded integers, cut after each operation."""


class Trap(Exception):
    """The second way found a trap."""


def _truncated(a: int, b: int) -> int:
    if b == 0:
        raise Trap
    return math.trunc(Fraction(a, b))


BINARY: dict[str, Callable[[int, int], int]] = {
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "div": _truncated,
    "mod": lambda a, b: a - b * _truncated(a, b), "min": min, "max": max,
}
BITWISE: dict[str, Callable[[int, int], int]] = {
    "and": lambda a, b: a & b, "or": lambda a, b: a | b, "xor": lambda a, b: a ^ b}
UNARY: dict[str, Callable[[int], int]] = {"neg": lambda a: -a, "abs": abs}


@st.composite
def trees(draw: st.DrawFn, machine: str, depth: int, slots: dict[int, bytes]) -> Tree:
    """A tree over loads (whose values go to `slots`) and constants."""
    kind = draw(st.sampled_from(("leaf", "binary", "binary", "unary", "convert", "shift"))) if depth else "leaf"
    if kind == "leaf":
        value = draw(numbers(machine))
        if draw(st.booleans()):
            return const(machine, value), lambda: value
        offset = 8 * len(slots)
        slots[offset] = STRUCTS[machine].pack(value)
        return load(machine, offset), lambda: value
    if kind == "binary":
        table = BINARY | (BITWISE if machine[0] == "u" else {})
        name = draw(st.sampled_from(sorted(table)))
        (a, left), (b, right) = draw(trees(machine, depth - 1, slots)), draw(trees(machine, depth - 1, slots))
        site = (3,) if name in ("div", "mod") else ()
        return (name, machine, a, b, *site), lambda: cut(table[name](left(), right()), machine)
    if kind == "unary":
        name = draw(st.sampled_from(sorted(UNARY)))
        a, inner = draw(trees(machine, depth - 1, slots))
        return (name, machine, a), lambda: cut(UNARY[name](inner()), machine)
    if kind == "convert":
        source = draw(integer_types)
        a, inner = draw(trees(source, depth - 1, slots))
        return ("convert", machine, source, a), lambda: cut(inner(), machine)
    count = draw(st.integers(0, 70))
    a, inner = draw(trees(machine, depth - 1, slots))
    left_shift = draw(st.booleans())
    bits = 8 * STRUCTS[machine].size

    def shifted() -> int:
        value = inner() % (1 << bits)
        return cut(value << count if left_shift else value >> count, machine)

    return ("shl" if left_shift else "shr", machine, a, const("i64", count), 3), shifted


@pytest.mark.slow
@given(data=st.data(), machine=integer_types)
@settings(max_examples=times(300), deadline=None)
def test_trees_of_integer_operations(data: st.DataObject, machine: str) -> None:
    slots: dict[int, bytes] = {}
    expression, second_way = data.draw(trees(machine, 4, slots))
    try:
        wanted: Any = second_way()
    except Trap:
        wanted = "R0101"
    assert evaluated(machine, expression, slots) == wanted


@pytest.mark.slow
@given(machine=integer_types, data=st.data())
@settings(max_examples=times(150), deadline=None)
def test_rotation(machine: str, data: st.DataObject) -> None:
    value, count = data.draw(numbers(machine)), data.draw(st.integers(0, 200))
    bits = 8 * STRUCTS[machine].size
    text = f"{value % (1 << bits):0{bits}b}"
    turn = count % bits
    for name, rotated in (("rol", text[turn:] + text[:turn]), ("ror", text[bits - turn:] + text[:bits - turn])):
        wanted = cut(int(rotated, 2), machine)
        assert getattr(arithmetic, {"rol": "rotate_left", "ror": "rotate_right"}[name])(value, count, machine) == wanted
        assert evaluated(machine, (name, machine, load(machine, 0), load("i64", 8), 3),
                         {0: STRUCTS[machine].pack(value), 8: STRUCTS["i64"].pack(count)}) == wanted


# --- floats ---

reals = st.floats(width=32)
long_reals = st.floats()


def rounded(value: Fraction) -> float:
    """The 32-bit float nearest to a number, ties to even, found by looking at its two neighbours."""
    try:
        guess = struct.unpack("<f", struct.pack("<f", float(value)))[0]
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    if math.isinf(guess):
        return guess  # beyond the greatest, where every way agrees
    bits = struct.unpack("<i", struct.pack("<f", guess))[0]
    near = []
    for step in (-1, 0, 1):
        candidate = struct.unpack("<f", struct.pack("<I", (bits + step) % (1 << 32)))[0]
        if math.isfinite(candidate):
            near.append((abs(Fraction(candidate) - value), bits + step & 1, candidate))
    return min(near)[2]


@pytest.mark.slow
@given(a=reals, b=reals, name=st.sampled_from(("add", "sub", "mul", "div")))
@settings(max_examples=times(300), deadline=None)
def test_real_is_rounded_once(a: float, b: float, name: str) -> None:
    before = {0: STRUCTS["f32"].pack(a), 4: STRUCTS["f32"].pack(b)}
    site = (3,) if name == "div" else ()
    seen = evaluated("f32", (name, "f32", load("f32", 0), load("f32", 4), *site), before)
    if math.isfinite(a) and math.isfinite(b) and (name != "div" or b):
        exact = {"add": lambda: Fraction(a) + Fraction(b), "sub": lambda: Fraction(a) - Fraction(b),
                 "mul": lambda: Fraction(a) * Fraction(b), "div": lambda: Fraction(a) / Fraction(b)}[name]()
        assert seen == rounded(exact)
    else:
        wide = evaluated("f64", (name, "f64", ("convert", "f64", "f32", load("f32", 0)),
                                 ("convert", "f64", "f32", load("f32", 4)), *site), before)
        assert repr(seen) == repr(wide)


@pytest.mark.slow
@given(value=st.integers(-(2**63), 2**64 - 1))
@settings(max_examples=times(300), deadline=None)
def test_an_integer_becomes_the_nearest_real(value: int) -> None:
    assert arithmetic.single_of_integer(value) == rounded(Fraction(value))


@pytest.mark.slow
@given(value=long_reals, machine=integer_types)
@settings(max_examples=times(300), deadline=None)
def test_a_float_becomes_an_integer_or_traps(value: float, machine: str) -> None:
    low, high = limits(machine)
    for name in ("nearest", "truncate"):
        seen = evaluated(machine, (name, machine, "f64", load("f64", 0), 3), {0: STRUCTS["f64"].pack(value)})
        if not math.isfinite(value):
            assert seen == "R0105"
            continue
        whole = math.trunc(value)
        rest = abs(Fraction(value) - whole)
        if name == "nearest" and (rest > Fraction(1, 2) or (rest == Fraction(1, 2) and whole % 2)):
            whole += 1 if value > 0 else -1
        assert seen == (whole if low <= whole <= high else "R0105")


@pytest.mark.slow
@given(raw=st.integers(0, 2**32 - 1), long=st.integers(0, 2**64 - 1))
@settings(max_examples=times(200), deadline=None)
def test_bits_go_there_and_back_but_for_nan(raw: int, long: int) -> None:
    for machine, bits, value, nan in (("f32", "u32", raw, 0x7FC00000), ("f64", "u64", long, 0x7FF8 << 48)):
        back = evaluated(bits, ("bits", bits, machine, ("bits", machine, bits, load(bits, 0))),
                         {0: STRUCTS[bits].pack(value)})
        float_ = STRUCTS[machine].unpack(STRUCTS[bits].pack(value))[0]
        assert back == (nan if math.isnan(float_) else value)
