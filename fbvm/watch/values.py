"""Values of the program as Python values: checked on the way in, shown readably on the way out.

BOOL is bool, integers and bit strings are int, REAL and LREAL float, TIME and dates int nanoseconds, STRING str, an
enumeration its number (its member's name is taken on the way in), arrays are lists, structures dicts by name.
"""

from __future__ import annotations

import math
import re
import struct
from typing import TypeAlias

from fbvm.base.types import (
    BOOL,
    LREAL,
    TIME,
    ArrayType,
    Elementary,
    EnumType,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    base,
    fold,
)

Value: TypeAlias = "bool | int | float | str | list[Value] | dict[str, Value] | None"
"""What a place holds, as a Python value; None is a null reference."""

UNITS_NS = {
    "d": 86_400_000_000_000, "h": 3_600_000_000_000, "m": 60_000_000_000, "s": 1_000_000_000, "ms": 1_000_000,
    "us": 1_000, "ns": 1,
}
_PIECE = re.compile(r"(\d[\d_]*(?:\.\d+)?)(ms|us|ns|d|h|m|s)_?", re.I)
_PREFIX = re.compile(r"(?:TIME|LTIME|LT|T)#", re.I)
_REAL = re.compile(r"[+-]?\d[\d_]*(\.\d[\d_]*)?([eE][+-]?\d+)?")
_INTEGER = re.compile(r"([+-]?)(?:(2|8|16)#([0-9A-F_]+)|0x([0-9A-F_]+)|(\d[\d_]*))", re.I)


def parse_time_ns(text: str) -> int:
    """Nanoseconds of `10ms`, `1.5s`, `1m30s`, `T#10ms`, `-5s`.  Raises ValueError."""
    rest = _PREFIX.sub("", text.strip(), count=1)
    sign, rest = (-1, rest[1:]) if rest.startswith("-") else (1, rest)
    total, at = 0, 0
    while piece := _PIECE.match(rest, at):
        whole, _, part = piece[1].replace("_", "").partition(".")
        unit = UNITS_NS[piece[2].lower()]
        total += int(whole) * unit + (int(part) * unit // 10 ** len(part) if part else 0)
        at = piece.end()
    if not at or at != len(rest):
        raise ValueError(f"{text!r} is no time; write 10ms, 1.5s or T#1m30s")
    return sign * total


def show_time(time_ns: int) -> str:
    """`T#1m30s`, the way it is written in a program."""
    if time_ns == 0:
        return "T#0s"
    rest, pieces = abs(time_ns), []
    for unit, size_ns in UNITS_NS.items():
        count, rest = divmod(rest, size_ns)
        if count:
            pieces.append(f"{count}{unit}")
    return "T#" + ("-" if time_ns < 0 else "") + "".join(pieces)


# --- in: a Python value for a type ------------------------------------------------------------------------------------


def conform(kind: Type, value: object, name: str) -> Value:
    """`value` as a place of type `kind` holds it.  Raises ValueError (out of range) or TypeError, both with `name`."""
    low, high = (kind.low, kind.high) if isinstance(kind, SubrangeType) else (None, None)
    plain = base(kind)
    if isinstance(plain, EnumType):
        return _enumerated(plain, value, name)
    if isinstance(plain, StringType):
        return _text(plain, value, name)
    if not isinstance(plain, Elementary):
        raise TypeError(f"{name} is {kind.name}; write its members one by one")
    if plain is BOOL:
        if isinstance(value, bool) or (isinstance(value, int) and value in (0, 1)):
            return bool(value)
        raise _wrong(name, kind, value, "TRUE or FALSE")
    if plain.machine in ("f32", "f64"):
        return _real(plain, value, name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise _wrong(name, kind, value, "a whole number")
    if not (plain.low if low is None else low) <= value <= (plain.high if high is None else high):
        limits = f"{plain.low if low is None else low}..{plain.high if high is None else high}"
        raise ValueError(f"{name}: {value} is out of range of {kind.name}, which holds {limits}")
    return value


def _wrong(name: str, kind: Type, value: object, wanted: str) -> TypeError:
    return TypeError(f"{name} is {kind.name} and takes {wanted}, not {value!r}")


def _real(kind: Elementary, value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(name, kind, value, "a number")
    try:
        number = float(value)
        if kind.machine == "f32" and math.isfinite(number):
            struct.pack("<f", number)
    except OverflowError:
        raise ValueError(f"{name}: {value} is out of range of {kind.name}") from None
    return number


def _text(kind: StringType, value: object, name: str) -> str:
    if not isinstance(value, str):
        raise _wrong(name, kind, value, "text")
    if len(value) > kind.capacity:
        raise ValueError(f"{name}: {len(value)} characters are out of range of {kind.name}")
    highest = 0xFFFF if kind.wide else 0xFF
    wrong = [c for c in value if not 0 < ord(c) <= highest]
    if wrong:
        raise ValueError(f"{name}: {kind.name} cannot hold the character {wrong[0]!r}")
    return value


def _enumerated(kind: EnumType, value: object, name: str) -> int:
    if isinstance(value, str):
        short = fold(value.rpartition("#")[2])
        if short not in kind.members:
            raise ValueError(f"{name}: {kind.name} has no member {value}; it has {', '.join(kind.shown.values())}")
        return kind.members[short]
    if isinstance(value, bool) or not isinstance(value, int) or value not in kind.shown:
        members = ", ".join(f"{text} ({number})" for number, text in kind.shown.items())
        raise ValueError(f"{name}: {value!r} is no member of {kind.name}; it has {members}")
    return value


# --- in: text for a type ----------------------------------------------------------------------------------------------


def literal(text: str) -> tuple[Value, Type | None]:
    """The value that `text` writes, and its type where the text shows one (BOOL, TIME, LREAL; None for the others).

    Knows TRUE, 16#FF, 0xFF, 12, 1.5, T#10ms, 10ms, 'text', also with a type in front (INT#5).  Raises ValueError."""
    text = text.strip()
    if fold(text) in ("TRUE", "FALSE"):
        return fold(text) == "TRUE", BOOL
    if len(text) >= 2 and text[0] == text[-1] and text[0] in "'\"":
        return text[1:-1], None
    if match := _INTEGER.fullmatch(text):
        digits, radix = (match[3], int(match[2])) if match[2] else (match[4], 16) if match[4] else (match[5], 10)
        number = int(digits.replace("_", ""), radix)
        return (-number if match[1] == "-" else number), None
    if _REAL.fullmatch(text):
        return float(text.replace("_", "")), LREAL
    if _PREFIX.match(text) or _PIECE.match(text.lstrip("-")):
        return parse_time_ns(text), TIME
    prefix, mark, rest = text.partition("#")
    if mark and prefix.isalpha():
        return literal(rest)
    raise ValueError(f"{text!r} is no literal")


def parse_value(kind: Type, text: str, name: str) -> Value:
    """The value of type `kind` that `text` writes.  Raises ValueError or TypeError with `name` in the message."""
    plain = base(kind)
    if isinstance(plain, EnumType) and not _INTEGER.fullmatch(text.strip()):
        return conform(kind, text.strip(), name)
    if isinstance(plain, StringType) and text[:1] not in ("'", '"'):
        return conform(kind, text, name)
    try:
        value, shown = literal(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    duration = isinstance(plain, Elementary) and "ANY_DURATION" in plain.families
    if duration != (shown is TIME) and plain is not BOOL:
        wanted = "a time such as 10ms" if duration else "no time"
        raise ValueError(f"{name} is {kind.name} and takes {wanted}, not {text}")
    return conform(kind, value, name)


# --- out --------------------------------------------------------------------------------------------------------------


def show(kind: Type, value: Value, hexadecimal: bool = False) -> str:
    """A value for people: TRUE, 12, 16#00FF, T#1s500ms, 'text', [1, 2], (a := 1)."""
    plain = base(kind)
    if value is None:
        return "NULL"
    if isinstance(plain, ArrayType) and isinstance(value, list):
        return "[" + ", ".join(show(plain.element, item, hexadecimal) for item in value) + "]"
    if isinstance(plain, StructType) and isinstance(value, dict):
        members = [f for f in plain.fields.values() if f.name in value]
        return "(" + ", ".join(f"{f.name} := {show(f.type, value[f.name], hexadecimal)}" for f in members) + ")"
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(plain, EnumType) and isinstance(value, int):
        return f"{plain.shown.get(value, '?')} ({value})"
    if isinstance(value, str):
        return f"'{value}'"
    if isinstance(plain, RefType):
        return f"reference {value}"
    if isinstance(value, int) and plain.name in ("TIME", "LTIME"):
        return show_time(value)
    if hexadecimal and isinstance(value, int) and isinstance(plain, Elementary) and "ANY_BIT" in plain.families:
        return f"16#{value:0{plain.size * 2}X}"
    return str(value)
