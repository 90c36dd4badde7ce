"""What values and standard functions of a program that `st_making` makes are: written from the tables of the language, not from
an engine.

BOOL is a bool, integers, bit strings, times and dates are int (times in ns), reals float, texts and characters str."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable
from typing import Any

from st_kinds import (
    BIT_STRINGS,
    BITS,
    CHARACTERS,
    DATES,
    DAY_NS,
    DAYS,
    DAYTIMES,
    DURATIONS,
    MOMENTS,
    NUMBERS,
    REALS,
    TEXTS,
    limits,
)
from st_text import moment


class Trapped(Exception):
    """The program stops with a code at a line."""

    def __init__(self, code: str, line: int = 0) -> None:
        super().__init__(code, line)
        self.code, self.line = code, line


# --- values -----------------------------------------------------------------------------------------------------------


def single(number: float) -> float:
    """The nearest REAL."""
    try:
        answer: float = struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        return math.copysign(math.inf, number)
    return answer


def rounded(kind: str, number: float) -> float:
    return single(number) if kind == "REAL" else number


def wrapped(kind: str, number: int) -> int:
    """The low bits, read in the type."""
    number &= (1 << BITS[kind]) - 1
    return number - (1 << BITS[kind]) if limits(kind)[0] and number >> BITS[kind] - 1 else number


def of_integer(kind: str, number: int) -> float:
    """The nearest REAL or LREAL, ties to even, without rounding twice."""
    spare = max(0, abs(number).bit_length() - (24 if kind == "REAL" else 53))
    whole, rest = divmod(abs(number), 1 << spare)
    half = (1 << spare) / 2
    whole += spare > 0 and (rest > half or (rest == half and whole % 2 == 1))
    return math.copysign(float(whole << spare), number)


def truncated(a: int, b: int) -> int:
    """The quotient toward zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def divided(a: float, b: float) -> float:
    if b != 0:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1, b)


def power(a: float, b: float) -> float:
    if b == 0:
        return 1.0
    if a == 0 and b < 0:
        return math.inf
    try:
        return math.pow(a, b)
    except ValueError:
        return math.nan
    except OverflowError:
        return -math.inf if a < 0 and b % 2 == 1 else math.inf


def mathematical(name: str, a: float) -> float:
    """A function of an LREAL; NaN outside its domain."""
    try:
        if name in ("LN", "LOG") and a == 0:
            return -math.inf
        return {"SQRT": math.sqrt, "LN": math.log, "LOG": math.log10, "EXP": math.exp, "SIN": math.sin, "COS": math.cos,
                "TAN": math.tan, "ASIN": math.asin, "ACOS": math.acos, "ATAN": math.atan}[name](a)
    except ValueError:
        return math.nan
    except OverflowError:
        return math.inf


def lesser(a: Any, b: Any) -> Any:
    if a != a or b != b:
        return math.nan
    return b if b < a else a


def greater(a: Any, b: Any) -> Any:
    if a != a or b != b:
        return math.nan
    return b if b > a else a


def to_integer(kind: str, number: float, nearest: bool) -> int:
    if number != number or math.isinf(number):
        raise Trapped("R0105")
    whole = round(number) if nearest else math.trunc(number)
    low, high = limits(kind)
    if not low <= whole <= high:
        raise Trapped("R0105")
    return whole


def converted(source: str, kind: str, value: Any) -> Any:
    """X_TO_Y of different types."""
    source = source.split()[0]
    if kind in (*TEXTS, *CHARACTERS):
        return to_text(source, kind, value)
    if source in TEXTS:
        return read(kind, value)
    if source in CHARACTERS:
        return wrapped(kind, ord(value))
    if source in DATES or kind in DATES:
        return of_date(source, kind, value)
    if kind == "BOOL":
        return value != 0
    if source in REALS:
        if kind in BIT_STRINGS:
            return raw(source, value)
        return rounded(kind, value) if kind in REALS else to_integer(kind, value, True)
    if kind in REALS:
        return of_raw(kind, value) if source in BIT_STRINGS else of_integer(kind, int(value))
    if source == "TIME" and kind in NUMBERS:
        return wrapped(kind, truncated(value, 10**6))
    if kind == "TIME" and source in NUMBERS:
        return within(kind, value * 10**6)
    return wrapped(kind, int(value))


PATTERNS = {"REAL": ("<f", "<I", 0x7FC00000), "LREAL": ("<d", "<Q", 0x7FF8 << 48)}
"""Of each float its format, that of its bits, the one NaN that is stored."""


def raw(kind: str, number: float) -> int:
    """The bits of a float."""
    form, bits, nan = PATTERNS[kind]
    return nan if number != number else int(struct.unpack(bits, struct.pack(form, number))[0])


def of_raw(kind: str, number: int) -> float:
    """The float of these bits."""
    form, bits, _ = PATTERNS[kind]
    answer: float = struct.unpack(form, struct.pack(bits, number))[0]
    return answer


def of_date(source: str, kind: str, value: int) -> int:
    """Parts of moments, and days as moments at midnight; long ones alike."""
    if kind in DAYS:
        return value - value % DAY_NS
    return value % DAY_NS if kind in DAYTIMES and source in MOMENTS else value


def moved(kind: str, sign: str, value: int, step: int) -> int:
    """A moment or a time of day and a duration: the latter modulo 24 hours, the former in its range."""
    value += step if sign == "+" else -step
    return value % DAY_NS if kind in DAYTIMES else within(kind, value)


def within(kind: str, value: int) -> int:
    """The value, if a time or a date can hold it."""
    low, high = limits(kind)
    if not low <= value <= high:
        raise Trapped("R0105")
    return value


def to_text(source: str, kind: str, value: Any) -> str:
    """Anything as a text or a character."""
    if source == "BOOL":
        return "TRUE" if value else "FALSE"
    if source in REALS:
        return real_text(source, value)
    if source in DURATIONS:
        return duration_text(source, value)
    if source in DATES:
        return f"{source.replace('DATE', 'D')}#{moment(source, value)}"
    if source == "BYTE" and kind == "CHAR":
        return chr(value)
    if source not in (*TEXTS, *CHARACTERS):
        return str(value)
    narrow = kind in ("STRING", "CHAR")
    text = "".join("?" if narrow and ord(unit) > 255 else unit for unit in value)
    return (text[:1] or "\0") if kind in CHARACTERS else text.partition("\0")[0]


def real_text(kind: str, value: float) -> str:
    """The shortest text that reads back."""
    if value != value or math.isinf(value):
        return "NaN" if value != value else "INF" if value > 0 else "-INF"
    digits = next(text for count in range(17) if float(text := f"{value:.{count}e}") == value
                  or (kind == "REAL" and single(float(text)) == value))
    whole, _, exponent = digits.partition("e")
    if -5 < int(exponent) < 16:
        number = whole.replace(".", "").lstrip("-")
        point = int(exponent) + 1
        number = "0" * (1 - point) + number if point < 1 else number + "0" * (point - len(number))
        point = max(point, 1)
        return f"{'-' if whole[0] == '-' else ''}{number[:point]}.{number[point:] or '0'}"
    return f"{whole}E{int(exponent):+03}"


UNITS_NS = (DAY_NS, 3600 * 10**9, 60 * 10**9, 10**9, 10**6, 1000, 1)


def duration_text(kind: str, value: int) -> str:
    """As a literal, in the units that there are."""
    prefix, rest, out = "LT#" if kind == "LTIME" else "T#", abs(value), ""
    for unit, size in zip(("d", "h", "m", "s", "ms", "us", "ns"), UNITS_NS, strict=True):
        count, rest = divmod(rest, size)
        out += f"{count}{unit}" if count else ""
    return f"{prefix}{'-' if value < 0 else ''}{out or '0s'}"


_INTEGER = re.compile(r"(?:([A-Z]+)#)?([+-]?)(?:(2|8|16)#)?([0-9A-F]+(?:_[0-9A-F]+)*)$", re.IGNORECASE)


def read(kind: str, text: str) -> Any:
    """The number that a text is, with a type in front or without one."""
    found = _INTEGER.match(text.strip(" "))
    if not found or (found[1] and found[1] != kind):
        raise Trapped("R0111")
    base = int(found[3] or 10)
    if (found[3] and found[2]) or any(int(digit, 16) >= base for digit in found[4].replace("_", "")):
        raise Trapped("R0111")
    number = int(found[4].replace("_", ""), base) * (-1 if found[2] == "-" else 1)
    low, high = limits(kind)
    if not low <= number <= high:
        raise Trapped("R0105")
    return number


def of_bcd(kind: str, value: int) -> int:
    digits = f"{value:x}"
    if not digits.isdecimal() or int(digits) > limits(kind)[1]:
        raise Trapped("R0105")
    return int(digits)


def to_bcd(kind: str, value: int) -> int:
    if len(str(value)) > BITS[kind] // 4:
        raise Trapped("R0105")
    return int(str(value), 16)


COMPARED: dict[str, Callable[[Any, Any], bool]] = {
    "=": lambda a, b: a == b, "<>": lambda a, b: a != b, "<": lambda a, b: a < b, "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
}  # fmt: skip


def binary(kind: str, sign: str, a: Any, b: Any) -> Any:
    if kind in REALS:
        if sign == "**":
            return rounded(kind, power(a, b))
        if sign == "/":
            return rounded(kind, divided(a, b))
        return rounded(kind, a + b if sign == "+" else a - b if sign == "-" else a * b)
    if sign in ("AND", "&", "AND_THEN"):
        return a & b
    if sign in ("OR", "OR_ELSE"):
        return a | b
    if sign == "XOR":
        return a ^ b
    if sign in "+-*":
        return wrapped(kind, a + b if sign == "+" else a - b if sign == "-" else a * b)
    if b == 0:
        raise Trapped("R0101")
    return wrapped(kind, truncated(a, b) if sign == "/" else a - b * truncated(a, b))


# --- functions --------------------------------------------------------------------------------------------------------


def shifted(name: str, kind: str, a: int, count: int) -> int:
    width = BITS[kind]
    if count < 0:
        raise Trapped("R0106")
    if name in ("SHL", "SHR"):
        return wrapped(kind, a << count if name == "SHL" else a >> count) if count < width else 0
    count = count % width if name == "ROL" else -count % width
    return wrapped(kind, a << count | a >> width - count)


def position(number: int, least: int) -> int:
    if number < least:
        raise Trapped("R0108")
    return number


def of_text(name: str, values: list[Any]) -> Any:
    """A function of strings."""
    text = values[0]
    if name == "CONCAT":
        return "".join(values)
    if name == "FIND":
        return text.find(values[1]) + 1 if values[1] else 0
    if name == "LEFT":
        return text[:position(values[1], 0)]
    if name == "RIGHT":
        return text[max(0, len(text) - position(values[1], 0)):]
    if name == "INSERT":
        at = position(values[2], 0)
        return text[:at] + values[1] + text[at:]
    length, at = position(values[-2], 0), position(values[-1], 1) - 1
    if name == "MID":
        return text[at:at + length]
    if name == "DELETE":
        return text[:at] + text[at + length:]
    return text[:at] + values[1] + text[at + length:]


def standard(name: str, kind: str, values: list[Any]) -> Any:
    """A standard function."""
    if name == "SEL":
        return values[2] if values[0] else values[1]
    if name == "MUX":
        if not 0 <= values[0] < len(values) - 1:
            raise Trapped("R0107")
        return values[1 + values[0]]
    if name in ("MIN", "MAX"):
        answer = values[0]
        for other in values[1:]:
            answer = (lesser if name == "MIN" else greater)(answer, other)
        return answer
    if name == "LIMIT":
        return lesser(greater(values[1], values[0]), values[2])
    if name == "ABS":
        return abs(values[0]) if kind in REALS else wrapped(kind, abs(values[0]))
    if name == "LEN":
        return len(values[0])
    if name in ("SHL", "SHR", "ROL", "ROR"):
        return shifted(name, kind, *values)
    if name.startswith("CONCAT_DATE"):
        return sum(values)
    if name == "DAY_OF_WEEK":
        return (values[0] // DAY_NS + 4) % 7
    if name == "ATAN2":
        return rounded(kind, 0.0 if values[0] == 0 and values[1] == 0 else math.atan2(*values))
    if kind in TEXTS or name == "FIND":
        return of_text(name, values)
    return rounded(kind, mathematical(name, values[0]))
