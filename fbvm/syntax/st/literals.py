"""Converts the text of a literal to its exact value: numbers, strings, durations, dates and times of day.

A text that is no literal raises Malformed, a value that its type cannot hold OutOfRange; the exception's text is the message
of the diagnostic.  A duration has the units d h m s ms us ns in this order and a fraction in the last one only (IEC 61131-3
ed. 3 table 8); dates are of the proleptic Gregorian calendar (table 9).
"""

from __future__ import annotations

import re

from fbvm.base.types import DAY_NS

Value = int | float | bool | str
Decoded = tuple[str, Value, str | None]
"""kind, value and type name of a Literal."""


WRONG = "wrong"
"""Kind of a literal whose text has no value, which was said."""


class Malformed(ValueError):
    """The text is no literal; `args` are message and hint."""


class OutOfRange(ValueError):
    """The literal's value does not fit its type; `args` are message and hint."""


SIGNED = {"SINT": 8, "INT": 16, "DINT": 32, "LINT": 64}
UNSIGNED = {"USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64, "BYTE": 8, "WORD": 16, "DWORD": 32, "LWORD": 64}
REALS = {"REAL": 3.4028235677973366e38, "LREAL": float("inf")}
"""First magnitude that rounds to infinity."""

TEXTS = {"STRING": "string", "CHAR": "string", "WSTRING": "wstring", "WCHAR": "wstring"}
TIMES = {"T": "TIME", "TIME": "TIME", "LT": "LTIME", "LTIME": "LTIME"}
DATES = {"D": "DATE", "DATE": "DATE", "LD": "LDATE", "LDATE": "LDATE"}
CLOCKS = {"TOD": "TIME_OF_DAY", "TIME_OF_DAY": "TIME_OF_DAY", "LTOD": "LTIME_OF_DAY", "LTIME_OF_DAY": "LTIME_OF_DAY"}
MOMENTS = {"DT": "DATE_AND_TIME", "DATE_AND_TIME": "DATE_AND_TIME", "LDT": "LDATE_AND_TIME",
           "LDATE_AND_TIME": "LDATE_AND_TIME"}
ELEMENTARY = {"BOOL", *SIGNED, *UNSIGNED, *REALS, *TEXTS, *TIMES, *DATES, *CLOCKS, *MOMENTS}

SECOND_NS = 1_000_000_000
UNSIGNED_NS_MAX = (1 << 64) - 1
"""The longest LTIME where a dialect has it without a sign; the check says whether it has."""
UNITS_NS = {"d": DAY_NS, "h": 3600 * SECOND_NS, "m": 60 * SECOND_NS, "s": SECOND_NS, "ms": 1_000_000, "us": 1000,
            "ns": 1}
DAYS_1970 = 719_163
"""Number of the day 1970-01-01, counted from 0001-01-01 as 1."""

NS_MAX = 2**63 - 1
INTEGER_MAX = 2**64 - 1
LONGEST = 400
"""Digits of a number beyond which nobody meant it; Python's own conversion is slow for millions of them."""

_INTEGER = r"[0-9]+(?:_[0-9]+)*"
_REAL = r"[0-9]+(?:_[0-9]+)*(?:\.[0-9]+(?:_[0-9]+)*)?(?:[eE][+-]?[0-9]+)?"
_DURATION_PART = r"(?i:_?([0-9]+(?:_[0-9]+)*)(?:\.([0-9]+(?:_[0-9]+)*))?(ms|us|ns|d|h|m|s))"
_DATE = r"([0-9]{1,4})-([0-9]{1,2})-([0-9]{1,2})"
_CLOCK = r"([0-9]{1,2}):([0-9]{1,2})(?::([0-9]{1,2})(?:\.([0-9]+(?:_[0-9]+)*))?)?"


def number(text: str) -> Decoded:
    """An untyped integer or real without sign."""
    kind, value = _number(text)
    if kind == "int" and value > INTEGER_MAX:
        raise OutOfRange(f"`{_short(text)}` is greater than the largest integer, {INTEGER_MAX}", "")
    if kind == "real" and value == float("inf"):
        raise OutOfRange(f"`{_short(text)}` is greater than the largest LREAL", "")
    return kind, value, None


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."


def _number(text: str) -> tuple[str, int | float]:
    if len(text) > LONGEST:
        raise OutOfRange(f"a number of {len(text)} characters fits no type", "")
    if "#" in text:
        return "int", _based(text)
    if re.fullmatch(_INTEGER, text):
        return "int", int(text.replace("_", ""))
    if re.fullmatch(_REAL, text):
        return "real", float(text.replace("_", ""))
    raise Malformed(f"`{text}` is no number", _meant(text))


_ELSEWHERE = (
    (r"0[xX]([0-9A-Fa-f_]+)[uUlL]*", r"hexadecimal digits are written 16#\1"),
    (r"0[bB]([01_]+)", r"binary digits are written 2#\1"),
    (r"0[oO]([0-7_]+)", r"octal digits are written 8#\1"),
    (r"([0-9.]+)[hH]", r"a duration is written T#\1h, hexadecimal digits 16#\1"),
    (r"([0-9][0-9A-Fa-f]*)[hH]", r"hexadecimal digits are written 16#\1"),
    (r"((?:[0-9.]+(?:d|h|m|s|ms|us|ns))+)", r"a duration is written T#\1"),
    (r"([0-9.]+)[fFuUlL]+", r"write \1, without a letter behind it"),
)
"""Numbers as other languages write them, and what to write here."""


def _meant(text: str) -> str:
    """Advice for what is no number."""
    for shape, advice in _ELSEWHERE:
        if (match := re.fullmatch(shape, text)):
            return match.expand(advice)
    return "digits with single `_` between them, a point with digits on both sides, an exponent"


def _based(text: str) -> int:
    base, digits = text.split("#", 1)
    if base not in ("2", "8", "10", "16"):  # CODESYS writes 10#5 too
        raise Malformed(f"`{text}` has the base {base}", "write 2#, 8# or 16#")
    if not re.fullmatch(r"[0-9A-Za-z]+(?:_[0-9A-Za-z]+)*", digits):
        raise Malformed(f"`{text}` needs digits behind `#`, with single `_` between them", "")
    known = "0123456789ABCDEF"[:int(base)]
    wrong = [d for d in digits.upper() if d not in known and d != "_"]
    if wrong:
        raise Malformed(f"`{text}` has the digit `{wrong[0]}`, which base {base} does not know", "")
    return int(digits.replace("_", ""), int(base))


def typed(prefix: str, rest: str) -> Decoded:
    """`prefix#rest` of an elementary type (`prefix` in capitals, one of ELEMENTARY)."""
    if prefix in TIMES:
        return "time", duration(rest, NS_MAX if TIMES[prefix] == "TIME" else UNSIGNED_NS_MAX), TIMES[prefix]
    if prefix in DATES:
        return "date", _day(rest) * DAY_NS, DATES[prefix]
    if prefix in CLOCKS:
        return "tod", _clock(rest), CLOCKS[prefix]
    if prefix in MOMENTS:
        return "dt", _moment(rest), MOMENTS[prefix]
    if prefix in TEXTS:
        return _typed_text(prefix, rest)
    if prefix == "BOOL":
        if rest.upper() in ("0", "FALSE", "1", "TRUE"):
            return "bool", rest.upper() in ("1", "TRUE"), "BOOL"
        raise Malformed(f"`BOOL#{rest}` is neither 0, 1, FALSE nor TRUE", "")
    return _typed_number(prefix, rest)


def _typed_number(prefix: str, rest: str) -> Decoded:
    negative = rest.startswith("-")
    digits = rest[1:] if rest[:1] in ("-", "+") else rest
    if not digits:
        raise Malformed(f"a value is missing behind `{prefix}#`", "no space may stand around `#`")
    if "#" in digits and digits != rest:
        raise Malformed(f"`{prefix}#{rest}`: a number with a base has no sign", "")
    kind, value = _number(digits)
    if negative:
        value = -value
    if prefix in REALS:
        real = _float(value)
        if abs(real) >= REALS[prefix]:
            raise OutOfRange(f"`{prefix}#{rest}` is out of the range of {prefix}", "")
        return "real", real, prefix
    if kind != "int":
        raise Malformed(f"`{prefix}#{rest}`: {prefix} takes whole numbers only", "")
    bits = SIGNED.get(prefix) or UNSIGNED[prefix]
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if prefix in SIGNED else (0, (1 << bits) - 1)
    if not low <= value <= high:
        raise OutOfRange(f"`{prefix}#{rest}` is out of the range of {prefix}, {low} to {high}", "")
    return "int", value, prefix


def _float(value: float) -> float:
    """The nearest float; infinite beyond the range."""
    try:
        return float(value)
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")


# --- strings ---

_ESCAPES = {"$": "$", "L": "\n", "N": "\n", "P": "\f", "R": "\r", "T": "\t"}
_HEX = r"[0-9A-Fa-f]+"


def text_literal(text: str) -> Decoded:
    """`'..'` or `".."` with its quotes: one character per STRING byte or WSTRING unit."""
    wide = text[0] == '"'
    return ("wstring" if wide else "string"), unescape(text, wide), None


def _typed_text(prefix: str, rest: str) -> Decoded:
    if rest[:1] not in ("'", '"'):
        raise Malformed(f"`{prefix}#` wants a text in quotes", "")
    kind = TEXTS[prefix]
    if kind == "string" and rest[0] == '"':
        raise Malformed(f"{prefix} literals stand in single quotes", "")
    value = unescape(rest, kind == "wstring")
    if prefix in ("CHAR", "WCHAR") and len(value) != 1:
        raise Malformed(f"{prefix} is exactly one character, here are {len(value)}", "")
    return kind, value, prefix


def unescape(text: str, wide: bool) -> str:
    """Contents of a literal in its quotes, `$` escapes replaced; characters beyond the type's become several."""
    quote, inner = text[0], text[1:-1]
    if "$" in inner:
        inner = _without_escapes(inner, quote, 4 if wide else 2)
    if wide:
        return "".join(c if ord(c) < 0x10000 else _surrogates(c) for c in inner)
    return "".join(c if ord(c) < 0x100 else c.encode("utf-8", "replace").decode("latin-1") for c in inner)


def _surrogates(character: str) -> str:
    offset = ord(character) - 0x10000
    return chr(0xD800 + (offset >> 10)) + chr(0xDC00 + (offset & 0x3FF))


def _without_escapes(inner: str, quote: str, digits: int) -> str:
    parts, at = [], 0
    while True:
        mark = inner.find("$", at)
        if mark < 0:
            parts.append(inner[at:])
            return "".join(parts)
        parts.append(inner[at:mark])
        letter = inner[mark + 1]
        code = inner[mark + 1:mark + 1 + digits]
        if letter == quote or letter.upper() in _ESCAPES:
            parts.append(quote if letter == quote else _ESCAPES[letter.upper()])
            at = mark + 2
        elif len(code) == digits and re.fullmatch(_HEX, code):
            parts.append(chr(int(code, 16)))
            at = mark + 1 + digits
        else:
            raise Malformed(f"`${letter}` is no escape", f"$$ $' $L $N $P $R $T, or $ and {digits} hexadecimal digits")


# --- times and dates ---


def _without_fractions(text: str) -> str:
    """Advice for a duration with several fractions: the same one without any, or "" if there is none."""
    if len(text) > LONGEST:
        return ""
    parts = re.findall(_DURATION_PART, text)
    try:
        rest, written = sum(_scaled(whole, fraction, UNITS_NS[unit.lower()], text) for whole, fraction, unit in parts), ""
    except OutOfRange:
        return ""
    for unit, size_ns in UNITS_NS.items():
        count, rest = divmod(rest, size_ns)
        written += f"{count}{unit}" if count else ""
    return f"write T#{'-' if text.startswith('-') else ''}{written or '0s'}"


def duration(text: str, most_ns: int = NS_MAX) -> int:
    """`1d2h3.5s` or `-5us300ns` as whole nanoseconds; a rest below one nanosecond is an error, not rounded away."""
    negative = text.startswith("-")
    rest = text[1:] if text[:1] in ("-", "+") else text
    units, total, last = list(UNITS_NS), 0, -1
    if "," in rest:
        raise Malformed(f"`{_short(rest)}` has a comma", f"the decimal sign is a point: T#{_short(rest.replace(',', '.'))}")
    if not rest:
        raise Malformed("a duration needs a number and a unit, as in `T#1s500ms`", "")
    while rest:
        part = re.match(_DURATION_PART, rest)
        if not part or len(part[0]) > LONGEST:
            known = "units are d h m s ms us ns, as in `T#1d2h3m4s5ms`"
            raise Malformed(f"`{_short(rest)}` is no part of a duration",
                            f"write its unit: `T#{_short(rest)}ms`" if rest.isdecimal() else known)
        unit = units.index(part[3].lower())
        if unit <= last:
            raise Malformed(f"unit `{part[3]}` stands too late or twice in the duration",
                            "the order is d h m s ms us ns")
        if part[2] and part[0] != rest:
            raise Malformed("only the last unit of a duration may have a fraction", _without_fractions(text))
        total += _scaled(part[1], part[2] or "", UNITS_NS[units[unit]], text)
        last, rest = unit, rest[part.end():]
    total = -total if negative else total
    if not -NS_MAX - 1 <= total <= most_ns:
        raise OutOfRange(f"`{_short(text)}` does not fit 64 bits of nanoseconds, about 292 years", "")
    return total


def _scaled(whole: str, fraction: str, unit_ns: int, text: str) -> int:
    """`whole.fraction` units as nanoseconds, exactly."""
    fraction = fraction.replace("_", "")
    value, rest = divmod(int(whole.replace("_", "") + fraction) * unit_ns, int("1" + "0" * len(fraction)))
    if rest:
        raise OutOfRange(f"`{_short(text)}` is finer than one nanosecond", "")
    return value


MONTH_DAYS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


DATE_RANGE = "1677-09-22 to 2262-04-11"
"""The days that 64 bits of nanoseconds have whole, or up to 23:47:16."""


def _day(text: str) -> int:
    """Days since 1970-01-01."""
    found = re.fullmatch(_DATE, text)
    if not found:
        raise Malformed(f"`{_short(text)}` is no date", "write it as 2024-05-31")
    year, month, day = int(found[1]), int(found[2]), int(found[3])
    leap = year % 4 == 0 and (year % 100 != 0 or year % 400 == 0)
    if not 1 <= month <= 12 or not 1 <= day <= MONTH_DAYS[month - 1] + (leap and month == 2):
        raise Malformed(f"there is no date {text}", "")
    before = year - 1
    days = before * 365 + before // 4 - before // 100 + before // 400 - DAYS_1970
    days += sum(MONTH_DAYS[:month - 1]) + (leap and month > 2) + day
    if not -NS_MAX <= days * DAY_NS <= NS_MAX:
        raise OutOfRange(f"the date {text} is outside {DATE_RANGE}", "")
    return days


def _clock(text: str) -> int:
    """Nanoseconds since midnight."""
    found = re.fullmatch(_CLOCK, text)
    if not found or len(text) > LONGEST:
        raise Malformed(f"`{_short(text)}` is no time of day", "write it as 13:45:30 or 13:45:30.250")
    hour, minute, second = int(found[1]), int(found[2]), found[3] or "0"
    if hour > 23 or minute > 59 or int(second) > 59:
        raise Malformed(f"there is no time of day {_short(text)}", "")
    return (hour * 3600 + minute * 60) * SECOND_NS + _scaled(second, found[4] or "", SECOND_NS, text)


def _moment(text: str) -> int:
    day, mark, clock = text.rpartition("-")
    if not mark or ":" not in clock:
        raise Malformed(f"`{_short(text)}` is no date with time", "write it as 2024-05-31-13:45:30")
    moment = _day(day) * DAY_NS + _clock(clock)
    if moment > NS_MAX:
        raise OutOfRange(f"the moment {text} is outside {DATE_RANGE}", "")
    return moment
