"""Arithmetic of the operations by example, where the engine's tests do not reach."""

from __future__ import annotations

import math
import struct

import pytest
from rows import each_of

from fbvm.base import arithmetic, strings
from fbvm.base.arithmetic import INF, NAN, Undefined, power


def test_nan_is_the_canonical_one() -> None:
    assert struct.pack("<d", NAN).hex() == "000000000000f87f"
    assert struct.pack("<f", NAN).hex() == "0000c07f"


@each_of(("machine", "low", "high"),
 [("b", 0, 1), ("i8", -128, 127), ("u64", 0, 2**64 - 1), ("ref", 0, 2**64 - 1)])
def test_limits(machine: str, low: int, high: int) -> None:
    assert arithmetic.limits(machine) == (low, high)
    assert arithmetic.wrap(high + 1, machine) == low
    assert arithmetic.wrap(low - 1, machine) == high


@each_of(("value", "rounded"), [
    (2**24 + 1, 2.0**24), (2**24 + 3, 2.0**24 + 4), (2**53 + 2**29 + 1, 2.0**53 + 2**30), (2**53 + 2**29, 2.0**53),
    (-(2**53) - 2**29 - 1, -(2.0**53) - 2**30), (2**64 - 1, 2.0**64), (0, 0.0), (2**63 - 1, 2.0**63),
])
def test_an_integer_becomes_the_nearest_real(value: int, rounded: float) -> None:
    assert arithmetic.single_of_integer(value) == rounded


def test_single_overflows_to_infinity_and_keeps_small_numbers() -> None:
    assert arithmetic.single(3.5e38) == math.inf
    assert arithmetic.single(-1e300) == -math.inf
    assert arithmetic.single(1e-45) == 2.0**-149


@each_of(("call", "code", "values"), [
    (lambda: arithmetic.quotient(5, 0), "R0101", (5, 0)),
    (lambda: arithmetic.remainder(5, 0), "R0101", (5, 0)),
    (lambda: arithmetic.nearest(1e9, "i16"), "R0105", (1e9, -32768, 32767)),
    (lambda: arithmetic.truncate(-1.0, "u8"), "R0105", (-1.0, 0, 255)),
    (lambda: arithmetic.shift_left(1, -1, "u8"), "R0106", (-1,)),
    (lambda: arithmetic.from_bcd(0x1A, "u8"), "R0105", (0x1A,)),
    (lambda: arithmetic.to_bcd(100, "u8"), "R0105", (100,)),
    (lambda: strings.mid(b"", 1, 0), "R0108", (0,)),
])
def test_no_answer_says_why(call, code: str, values: tuple[object, ...]) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(Undefined) as caught:
        call()
    assert (caught.value.code, caught.value.values) == (code, values)


@each_of("a, b, expected", [
    (-1e200, 3.0, -INF), (-1e200, 5.0, -INF), (-1e200, 2.0, INF), (-1e200, 4.0, INF), (1e200, 3.0, INF), (0.0, -3.0, INF),
    (-0.0, -3.0, -INF), (-0.0, -5.0, -INF), (-0.0, -2.0, INF), (-0.0, -0.5, INF), (-8.0, 0.5, NAN), (-2.0, 3.0, -8.0),
    (1e-200, 3.0, 0.0),
])
def test_power_beyond_the_range_and_at_zero(a: float, b: float, expected: float) -> None:
    assert repr(power(a, b)) == repr(expected)


@each_of("how, value, kind, expected", [
    ("nearest", -32768.4, "i16", -32768), ("nearest", 32767.4, "i16", 32767), ("nearest", 32767.5, "i16", None),
    ("nearest", -32768.5, "i16", -32768), ("nearest", -32769.5, "i16", None), ("nearest", 254.5, "u8", 254),
    ("nearest", -0.5, "u8", 0), ("nearest", -0.6, "u8", None), ("truncate", -128.9, "i8", -128), ("truncate", -129.0, "i8", None),
    ("truncate", 127.9, "i8", 127), ("truncate", 128.0, "i8", None), ("truncate", -0.9, "u8", 0), ("truncate", 255.9, "u8", 255),
    ("nearest", NAN, "i16", None), ("truncate", INF, "i64", None), ("truncate", -(2.0**63), "i64", -(2**63)),
])
def test_a_real_becomes_an_integer_up_to_both_ends_of_its_range(how: str, value: float, kind: str, expected: int | None) -> None:
    try:
        found: int | None = getattr(arithmetic, how)(value, kind)
    except Undefined as error:
        assert error.code == "R0105"
        found = None
    assert found == expected
