"""Converts values of elementary types to text and back, for the conversions to and from STRING (`to_text`, `from_text`).

The text of a value is a literal that reads back as the same value.  The standard leaves its form to the implementer; here
integers and bit strings are decimal, REAL and LREAL the shortest text with the same value, durations, dates and times of day
have their short prefix (IEC 61131-3 ed. 3 tables 5, 8, 9)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import date, timedelta

from fbvm.base.arithmetic import INF, NAN, Undefined, shortest, single
from fbvm.base.types import DAY_NS, SHORT_NAMES
from fbvm.syntax.st.literals import ELEMENTARY, NS_MAX, SECOND_NS, UNITS_NS, Malformed, OutOfRange, typed

LEADING = 64
"""How many characters may belong to a literal that a text begins with."""
_FLOATS = {"NAN": NAN, "INF": INF, "+INF": INF, "-INF": -INF}
"""What no literal can say; written and read all the same."""


def to_text(data_type: str, value: float) -> bytes:
    """The text of a value of the elementary type of that name."""
    return _WRITERS[SHORT_NAMES.get(data_type, data_type)](value).encode("ascii")


def from_text(data_type: str, text: bytes) -> float:
    """The value that a literal of the type names, with or without its prefix, spaces around it trimmed.

    Raises Undefined: R0111 for text that is no literal of the type, R0105 for a value that the type cannot hold."""
    wanted = SHORT_NAMES.get(data_type, data_type)
    prefix, mark, rest = (literal := text.decode("latin-1").strip(" ")).partition("#")
    prefix = prefix.upper()
    if not mark or prefix not in ELEMENTARY:
        prefix, rest = wanted, literal
    if wanted in ("REAL", "LREAL") and prefix == wanted and rest.upper() in _FLOATS:
        return _FLOATS[rest.upper()]
    try:
        _, value, kind = typed(prefix, rest)
    except OutOfRange:
        raise Undefined("R0105", text, data_type) from None
    except Malformed:
        raise Undefined("R0111", text, data_type) from None
    if kind != wanted or isinstance(value, str):
        raise Undefined("R0111", text, data_type)
    if kind == "LTIME" and value > NS_MAX:  # a literal may be longer, where a dialect has LTIME without a sign
        raise Undefined("R0105", text, data_type)
    return single(value) if wanted == "REAL" else value


def from_leading(data_type: str, whole: int, text: bytes) -> float:
    """The value of the longest literal of the type that a text begins with, or if `whole` that it is; 0 if there is none."""
    for end in [len(text)] if whole else range(min(len(text), LEADING), 0, -1):
        try:
            return from_text(data_type, text[:end])
        except Undefined as undefined:
            if undefined.code == "R0105":
                break
    return 0


def enum_text(names: Mapping[int, str], value: int) -> bytes:
    """The name of an enumeration's member, or the number that is none."""
    name = names.get(value)
    return str(int(value)).encode() if name is None else name.encode("latin-1", "replace")


def _bool(value: float) -> str:
    return "TRUE" if value else "FALSE"


def _integer(value: float) -> str:
    return str(int(value))


def _lreal(value: float) -> str:
    if not math.isfinite(value):
        return "NaN" if value != value else "INF" if value > 0 else "-INF"
    return repr(float(value)).upper()


def _real(value: float) -> str:
    """Fewest digits that round to the same 32 bits."""
    return _lreal(shortest(value))


def _duration(prefix: str) -> Callable[[float], str]:
    def write(value: float) -> str:
        parts, rest = [], abs(int(value))
        for unit, size_ns in UNITS_NS.items():
            count, rest = divmod(rest, size_ns)
            if count:
                parts.append(f"{count}{unit}")
        return f"{prefix}#{'-' if value < 0 else ''}{''.join(parts) or '0s'}"

    return write


def _day(value: float) -> str:
    return (date(1970, 1, 1) + timedelta(days=int(value) // DAY_NS)).isoformat()


def _clock(value: float) -> str:
    seconds, fraction_ns = divmod(int(value) % DAY_NS, SECOND_NS)
    fraction = f".{fraction_ns:09}".rstrip("0").rstrip(".")
    return f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}{fraction}"


_WRITERS: dict[str, Callable[[float], str]] = {
    "BOOL": _bool, "REAL": _real, "LREAL": _lreal, "TIME": _duration("T"), "LTIME": _duration("LT"),
    **dict.fromkeys(("SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD",
                     "LWORD"), _integer),
    "DATE": lambda value: f"D#{_day(value)}", "LDATE": lambda value: f"LD#{_day(value)}",
    "TIME_OF_DAY": lambda value: f"TOD#{_clock(value)}", "LTIME_OF_DAY": lambda value: f"LTOD#{_clock(value)}",
    "DATE_AND_TIME": lambda value: f"DT#{_day(value)}-{_clock(value)}",
    "LDATE_AND_TIME": lambda value: f"LDT#{_day(value)}-{_clock(value)}",
}
