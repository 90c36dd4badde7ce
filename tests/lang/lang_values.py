"""What expectations of the corpus write, as Python values: read apart from the compiler, as a second opinion."""

from __future__ import annotations

import datetime
import math
import re
import struct

from fbvm.base.types import ArrayType, Elementary, EnumType, StringType, Type, base

_NS = {"d": 86_400_000_000_000, "h": 3_600_000_000_000, "m": 60_000_000_000, "s": 1_000_000_000, "ms": 1_000_000,
       "us": 1_000, "ns": 1}  # fmt: skip
_REALS = {"INF": math.inf, "-INF": -math.inf, "NAN": math.nan}
_ESCAPES = {"T": "\t", "L": "\n", "N": "\n", "R": "\r", "P": "\f", "$": "$", "'": "'", '"': '"'}
_EPOCH = datetime.datetime(1970, 1, 1)


def value(kind: Type, text: str) -> object:
    """The value of type `kind` that `text` writes.  Raises ValueError, or KeyError for a member that there is not."""
    kind = base(kind)
    if isinstance(kind, ArrayType):
        if not (text.startswith("[") and text.endswith("]")):
            raise ValueError(f"{text} is no list")
        return [value(kind.element, part.strip()) for part in parts(text[1:-1])]
    if isinstance(kind, EnumType):
        return kind.members[text.upper()]
    if isinstance(kind, StringType):
        return _string(text, '"' if kind.wide else "'")
    assert isinstance(kind, Elementary), f"{kind.name} is looked at member by member"
    if kind.name in ("CHAR", "WCHAR"):
        return _string(text, '"' if kind.name == "WCHAR" else "'")
    if kind.machine == "b":
        return {"TRUE": True, "FALSE": False}[text]
    if kind.machine in ("f32", "f64"):
        return _real(text, kind.machine)
    if "#" in text and not text.lstrip("-").startswith("16#"):
        return _time(text)
    return int(text[3:], 16) if text.startswith("16#") else int(text)


def same(got: object, want: object) -> bool:
    """True if two values are the same in type and bits; one NaN is as good as another."""
    if isinstance(want, list):
        return isinstance(got, list) and len(got) == len(want) and all(map(same, got, want))
    if isinstance(want, float) and isinstance(got, float):
        return struct.pack("<d", got) == struct.pack("<d", want) or (math.isnan(got) and math.isnan(want))
    return type(got) is type(want) and got == want


def parts(text: str) -> list[str]:
    """The items of a list."""
    return re.findall(r"""'(?:\$.|[^'$])*'|"(?:\$.|[^"$])*"|[^,]+""", text)


def _real(text: str, machine: str) -> float:
    number = _REALS[text] if text in _REALS else float(text)
    return float(struct.unpack("<f", struct.pack("<f", number))[0]) if machine == "f32" else number


def _string(text: str, quote: str) -> str:
    if not re.fullmatch(rf"{quote}(\$.|[^{quote}$])*{quote}", text):
        raise ValueError(f"{text} is no text in {quote}")
    digits = 2 if quote == "'" else 4
    return re.sub(rf"\$([0-9A-F]{{{digits}}}|.)", lambda m: _ESCAPES.get(m[1]) or chr(int(m[1], 16)), text[1:-1])


def _time(text: str) -> int:
    """Nanoseconds of `T#1s500ms`, `D#2024-02-29`, `TOD#10:20:30.5` and `DT#2024-02-29-10:20:30.5`, and their L forms."""
    prefix, _, rest = text.partition("#")
    prefix = prefix.removeprefix("L")
    if prefix == "T":
        total = sum(int(n) * _NS[unit] for n, unit in re.findall(r"(\d+)(ms|us|ns|[dhms])", rest))
        return -total if rest.startswith("-") else total
    if prefix == "TOD":
        return _of_day(rest)
    date, clock = rest[:10], rest[11:]
    days = (datetime.datetime.strptime(date, "%Y-%m-%d") - _EPOCH).days
    return days * _NS["d"] + (_of_day(clock) if prefix == "DT" else 0)


def _of_day(text: str) -> int:
    hours, minutes, seconds = text.split(":")
    whole, _, part = seconds.partition(".")
    return int(hours) * _NS["h"] + int(minutes) * _NS["m"] + int(whole) * _NS["s"] + int(part.ljust(9, "0") or 0)
