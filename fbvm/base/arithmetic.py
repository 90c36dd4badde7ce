"""The results of operations for given values; the engine and constant folding use the same functions.

Integers are Python integers until `wrap` reduces them to a machine type; a REAL is a Python float whose value fits 32
bits (`single` rounds).  A function without a result raises Undefined with the code of the trap.
Source: IEC 61131-3 ed. 3 tables 22 to 30, IEEE 754-2008; edges as the table of operations states them."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from functools import cache

NAN: float = struct.unpack("<d", b"\0\0\0\0\0\0\xf8\x7f")[0]
"""The canonical NaN: quiet, positive, no payload (7FF8000000000000; as REAL 7FC00000)."""
INF = math.inf
_SINGLE = memoryview(bytearray(4)).cast("B").cast("f")
_CODES = {"f32": "<f", "f64": "<d"}


class Undefined(ArithmeticError):
    """An operation has no result: `code` is that of the trap, `values` are the operands that cause it."""

    def __init__(self, code: str, *values: object) -> None:
        super().__init__(code, *values)
        self.code, self.values = code, values


# --- widths ---------------------------------------------------------------------------------------------------------


@cache
def limits(machine: str) -> tuple[int, int]:
    """Smallest and greatest value of an integer machine type ("b" counts as one bit, "ref" as 64)."""
    if machine == "b":
        return 0, 1
    if machine == "ref":
        return 0, (1 << 64) - 1
    bits = int(machine[1:])
    return (0, (1 << bits) - 1) if machine[0] == "u" else (-(1 << bits - 1), (1 << bits - 1) - 1)


def width(machine: str) -> int:
    """Bits of an integer machine type."""
    return {"b": 1, "ref": 64}.get(machine) or int(machine[1:])


def wrap(value: int, machine: str) -> int:
    """A number reduced to a machine type: its low bits, as a signed or unsigned number.

    >>> wrap(32768, "i16"), wrap(-1, "u8")
    (-32768, 255)
    """
    low, high = limits(machine)
    return value if low <= value <= high else (value - low & high - low) + low


def single(value: float) -> float:
    """The nearest 32-bit float; infinite if it is too large."""
    _SINGLE[0] = value
    return _SINGLE[0]


def shortest(value: float) -> float:
    """The number with the shortest text of those that round to the same 32-bit float.

    >>> shortest(single(0.1))
    0.1
    """
    if not math.isfinite(value):
        return value
    for digits in range(1, 10):
        short = float(f"{value:.{digits}g}")
        if single(short) == value:
            return short
    return value


def single_of_integer(value: int) -> float:
    """The 32-bit float nearest to an integer, rounded once (by way of 64 bits would round twice)."""
    if -(1 << 53) <= value <= 1 << 53:
        return single(float(value))
    size = abs(value)
    rest = size.bit_length() - 53
    sticky = 1 if size & (1 << rest) - 1 else 0
    return single(math.copysign(math.ldexp(float(size >> rest | sticky), rest), value))


def convert(value: float, source: str, target: str) -> float:
    """Between number types: to an integer the low bits, to a float the nearest."""
    if target == "f64":
        return float(value)
    if target == "f32":
        return single_of_integer(int(value)) if source[0] != "f" else single(value)
    return wrap(int(value), target)


def bits(value: float, source: str, target: str) -> float:
    """The same bits read as another type of the same width; NaN is canonical on either side."""
    if source in _CODES:
        raw = int.from_bytes(struct.pack(_CODES[source], value if value == value else NAN), "little")
    else:
        raw = int(value)
    if target not in _CODES:
        return wrap(raw, target)
    size = width(target) // 8
    answer: float = struct.unpack(_CODES[target], (raw & (1 << width(target)) - 1).to_bytes(size, "little"))[0]
    return answer if answer == answer else NAN


# --- numbers --------------------------------------------------------------------------------------------------------


def quotient(a: int, b: int) -> int:
    """a / b toward zero."""
    if b == 0:
        raise Undefined("R0101", a, b)
    return a // b if (a < 0) == (b < 0) else -(-a // b)


def remainder(a: int, b: int) -> int:
    """The remainder of `quotient`, with the sign of a."""
    if b == 0:
        raise Undefined("R0101", a, b)
    return a - b * quotient(a, b)


def divide(a: float, b: float) -> float:
    """a / b by IEEE 754: infinite or NaN where b is 0."""
    if b:
        return a / b
    if a != a or not a:
        return NAN
    return math.copysign(INF, math.copysign(1.0, a) * math.copysign(1.0, b))


def power(a: float, b: float) -> float:
    """a to the b as IEEE 754 `pow`."""
    try:
        return math.pow(a, b)
    except OverflowError:
        return -INF if a < 0 and b % 2 == 1 else INF
    except ValueError:  # 0 to a negative power, a negative number to a fraction
        if a:
            return NAN
        return math.copysign(INF, a) if b % 2 == 1 else INF


def lesser(a: float, b: float) -> float:
    """The lesser of two floats, a if they are equal, NaN if one is NaN."""
    return a if a <= b else b if b < a else NAN


def greater(a: float, b: float) -> float:
    """The greater of two floats, a if they are equal, NaN if one is NaN."""
    return a if a >= b else b if b > a else NAN


def nearest(value: float, machine: str) -> int:
    """A float as an integer, ties to even."""
    return _fit(value, round, machine)


def truncate(value: float, machine: str) -> int:
    """A float as an integer, toward zero."""
    return _fit(value, int, machine)


def _fit(value: float, how: Callable[[float], int], machine: str) -> int:
    low, high = limits(machine)
    if math.isfinite(value):
        number = how(value)
        if low <= number <= high:
            return number
    raise Undefined("R0105", value, low, high)


def _guarded(function: Callable[[float], float]) -> Callable[[float], float]:
    """The same function as IEEE 754 has it: NaN outside the domain, infinite beyond the range."""

    def answer(a: float) -> float:
        try:
            return function(a)
        except ValueError:
            return NAN
        except OverflowError:
            return INF

    return answer


def _logarithm(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda a: function(a) if a > 0 else -INF if a == 0 else NAN


FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sqrt": _guarded(math.sqrt), "ln": _logarithm(math.log), "log": _logarithm(math.log10), "exp": _guarded(math.exp),
    "sin": _guarded(math.sin), "cos": _guarded(math.cos), "tan": _guarded(math.tan), "asin": _guarded(math.asin),
    "acos": _guarded(math.acos), "atan": math.atan,
}
"""Functions of one float by the names that `math` gives them, for 64 bits (IEC 61131-3 table 28)."""


def arctangent(y: float, x: float) -> float:
    """The angle of the point (x, y); 0 if both are 0."""
    return math.atan2(y, x) if y or x else 0.0


# --- bits -----------------------------------------------------------------------------------------------------------


def _count(n: int) -> int:
    if n < 0:
        raise Undefined("R0106", n)
    return n


def shift_left(a: int, n: int, machine: str) -> int:
    """Zeros enter at the right; n of the width or more gives 0."""
    size = width(machine)
    return wrap(a << n, machine) if _count(n) < size else 0


def shift_right(a: int, n: int, machine: str) -> int:
    """Zeros enter at the left, also for signed types."""
    return wrap((a & (1 << width(machine)) - 1) >> min(_count(n), 64), machine)


def rotate_left(a: int, n: int, machine: str) -> int:
    """Bits that leave at the left enter at the right."""
    size = width(machine)
    n = _count(n) % size
    a &= (1 << size) - 1
    return wrap(a << n | a >> size - n, machine)


def rotate_right(a: int, n: int, machine: str) -> int:
    """Bits that leave at the right enter at the left."""
    return rotate_left(a, -_count(n) % width(machine), machine)


def from_bcd(a: int, machine: str) -> int:
    """The number that the decimal digits in the nibbles of a form."""
    try:
        number = int(f"{a:x}")
    except ValueError:
        raise Undefined("R0105", a) from None
    if number > limits(machine)[1]:
        raise Undefined("R0105", a)
    return number


def to_bcd(a: int, machine: str) -> int:
    """The decimal digits of a in nibbles of a bit string."""
    if a < 0 or a >= 10 ** (width(machine) // 4):
        raise Undefined("R0105", a)
    return int(str(int(a)), 16)
