"""Constants: folding of operators over known values, and values as bytes of memory."""

from __future__ import annotations

import math

from fbvm.base import arithmetic
from fbvm.base.memory import STRUCTS, reference_to_byte
from fbvm.base.strings import packed
from fbvm.base.types import BOOL, DAY_NS, ArrayType, Elementary, EnumType, StringType, SubrangeType, Type, machine
from fbvm.base.types import base as base_of
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL, Value
from fbvm.syntax.st.literals import DATE_RANGE


class NotConstant(Exception):
    """The operation has no constant result; the message says why."""


def encode(kind: Type, value: Value) -> bytes:
    """The bytes of `value` in memory as a `kind` (elementary, enumeration, subrange or STRING)."""
    if isinstance(kind, StringType):
        assert isinstance(value, bytes | str)
        cut = value[:kind.capacity]
        return (cut if isinstance(cut, bytes) else packed(cut)).ljust(kind.size, b"\0")
    form = machine(kind)
    if form == "f32" and isinstance(value, float | int):
        return STRUCTS[form].pack(arithmetic.single(float(value)))
    if form == "ref":
        return STRUCTS[form].pack(reference_to_byte(int(value)))  # CODESYS: 0 is NULL, other numbers are addresses
    return STRUCTS[form].pack(value)


def decode(kind: Type, data: bytes) -> Value:
    """The value that bytes of memory are as a `kind` (see `encode`)."""
    if isinstance(kind, StringType):
        if not kind.wide:
            return data.partition(b"\0")[0]
        units = [data[at:at + 2] for at in range(0, len(data), 2)]
        text = units[:units.index(b"\0\0")] if b"\0\0" in units else units
        return b"".join(text).decode("utf-16-le", "surrogatepass")
    value: Value = STRUCTS[machine(kind)].unpack(data)[0]
    return value


def default(kind: Type) -> bytes:
    """The bytes of a variable of `kind` without an initial value, for types without initial values of their own."""
    if isinstance(kind, SubrangeType):
        return encode(kind, kind.low)
    if isinstance(kind, EnumType):
        return encode(kind, next(iter(kind.members.values())))
    if isinstance(kind, ArrayType):
        return default(kind.element) * kind.count
    return bytes(kind.size)


def limits(kind: Type) -> tuple[int, int] | None:
    """Least and greatest value of an integer-like type, or None."""
    if isinstance(kind, SubrangeType):
        return kind.low, kind.high
    if isinstance(kind, EnumType):
        return kind.base.low, kind.base.high
    if isinstance(kind, Elementary) and kind.bits and kind.machine not in ("f32", "f64"):
        return kind.low, kind.high
    return None


def wrap(kind: Type, value: int) -> int:
    """`value` cut to the width of `kind`."""
    return arithmetic.wrap(value, machine(kind))


def _real(op: str, a: float, b: float) -> float:
    """The value by IEEE 754, as the program computes it: infinite or NAN where no other number is."""
    if op == "**":
        return arithmetic.power(a, b)
    result = a + b if op == "+" else a - b if op == "-" else a * b if op == "*" else arithmetic.divide(a, b)
    return result if result == result else arithmetic.NAN


def _integer(op: str, a: int, b: int) -> int:
    if op in ("/", "MOD"):
        if b == 0:
            raise NotConstant("it divides by zero")
        return arithmetic.quotient(a, b) if op == "/" else arithmetic.remainder(a, b)
    return {"+": a + b, "-": a - b, "*": a * b}[op] if op in "+-*" else {"AND": a & b, "OR": a | b, "XOR": a ^ b}[op]


_COMPARE = {"=": lambda a, b: a == b, "<>": lambda a, b: a != b, "<": lambda a, b: a < b, ">": lambda a, b: a > b,
            "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b}
_LOGIC = {"AND": "and", "OR": "or", "XOR": "xor", "AND_THEN": "and", "OR_ELSE": "or"}


def binary(op: str, kind: Type, a: Value, b: Value) -> Value:
    """The value of `a op b`, computed in the type `kind` of both operands.  Raises NotConstant."""
    if op in _COMPARE:
        return bool(_COMPARE[op](a, b))
    if op == "**":
        assert not isinstance(a, bytes | str) and not isinstance(b, bytes | str)
        return _finish(kind, _real(op, float(a), float(b)))
    if base_of(kind) == BOOL:
        x, y = bool(a), bool(b)
        return {"and": x and y, "or": x or y, "xor": x != y}[_LOGIC[op]]
    assert not isinstance(a, bytes | str) and not isinstance(b, bytes | str)
    if machine(kind) in ("f32", "f64") and kind is not UNTYPED_INT:
        return _finish(kind, _real(op, float(a), float(b)))
    if isinstance(b, float):  # a duration times or by a real: to the nearest ns, ties to even
        product = _real(op, float(a), b)
        if not math.isfinite(product) or wrap(kind, round(product)) != round(product):
            raise NotConstant("it divides by zero" if op == "/" and not b else "its value is too large")
        return round(product)
    value = _integer(op, int(a), int(b))
    if base_of(kind).name.endswith("TIME_OF_DAY"):
        return value % DAY_NS
    return value if kind is UNTYPED_INT else wrap(kind, value)


def is_moment(kind: Type) -> bool:
    """True for DATE and DT and their L types, whose sums and differences must stay in their range."""
    return isinstance(kind, Elementary) and kind.name.endswith(("DATE", "DATE_AND_TIME"))


def moment(op: str, a: int, b: int) -> int:
    """The value of `a + b` or `a - b` where a is a DATE or DT, in ns.  Raises NotConstant outside 1677-09-22 to 2262-04-11."""
    value = a + b if op == "+" else a - b
    if arithmetic.wrap(value, "i64") != value:
        raise NotConstant(f"it is outside the range of 64 bits of nanoseconds, for dates {DATE_RANGE}")
    return value


def _finish(kind: Type, value: float) -> float:
    return arithmetic.single(value) if machine(kind) == "f32" and kind is not UNTYPED_REAL else value


def unary(op: str, kind: Type, a: Value) -> Value:
    """The value of `-a`, `+a` or `NOT a` in the type `kind`."""
    if op == "+":
        return a
    if op == "NOT":
        if base_of(kind) == BOOL:
            return not a
        assert isinstance(a, int)
        return wrap(kind, ~a)
    assert isinstance(a, int | float)
    return -a if isinstance(a, float) or kind is UNTYPED_INT else wrap(kind, -a)


def cut(value: Value, kind: Type) -> Value:
    """A constant number as one of `kind`, which may not hold it: cut to its width, a real to the nearest that there is."""
    form = machine(kind)
    if form[0] not in "iu" or not isinstance(value, int | float):
        return convert(value, kind)
    if isinstance(value, float):
        low, high = limits(kind) or (0, 0)
        return 0 if math.isnan(value) else low if value <= low else high if value >= high else int(value)
    return arithmetic.wrap(int(value), form)


def convert(value: Value, kind: Type) -> Value:
    """A constant of one type as a constant of `kind`, to which it converts implicitly."""
    form = machine(kind)
    if form in ("f32", "f64") and isinstance(value, int | float):
        return arithmetic.single(float(value)) if form == "f32" else float(value)
    if form == "b":
        return bool(value)
    if isinstance(kind, StringType) and isinstance(value, int):  # a character
        text = chr(value) if value else ""
        return text if kind.wide else text.encode("latin-1")
    return value
