"""Values of the program as Python values: checked before they are written, formatted as literals to be read.

BOOL is bool, integers and bit strings are int, REAL and LREAL float, TIME and dates int nanoseconds, STRING and WSTRING
str, CHAR and WCHAR a str of one character, an enumeration its number (its member's name is taken on the way in), arrays
are lists, structures dicts by name.
"""

from __future__ import annotations

import math
import re
import struct
from datetime import date, time
from typing import TypeAlias

from fbvm.base.arithmetic import shortest
from fbvm.base.digits import MOST_DIGITS, whole_number
from fbvm.base.strings import packed
from fbvm.base.types import (
    BOOL,
    ELEMENTARY,
    REAL,
    TIME,
    ArrayType,
    Elementary,
    EnumType,
    Field,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    base,
    families,
    fold,
    followed,
    machine,
)
from fbvm.syntax.st import literals
from fbvm.syntax.st.texts import to_text

Value: TypeAlias = "bool | int | float | str | list[Value] | dict[str, Value] | None"
"""The value of a place.  A reference is None if it is null, else its 64 bits, or the text that `Names` makes of them."""

_PIECE = re.compile(r"(\d[\d_]*(?:\.\d+)?)(ms|us|ns|d|h|m|s)_?", re.I)
_PREFIX = re.compile(r"(-?)(?:TIME|LTIME|LT|T)#(?:\+(?=\d))?", re.I)
_REAL = re.compile(r"[+-]?\d[\d_]*(\.\d[\d_]*)?([eE][+-]?\d+)?")
_INTEGER = re.compile(r"([+-]?)(?:2#([01][01_]*)|8#([0-7][0-7_]*)|(?:16#|0x)([0-9A-F][0-9A-F_]*)|(\d[\d_]*))", re.I)
_RADIXES = (2, 8, 16, 10)
"""Of its groups behind the sign."""


def parse_time_ns(text: str) -> int:
    """Nanoseconds of a duration; the prefix T# may be left out.  Raises ValueError.

    >>> parse_time_ns("1.5s"), parse_time_ns("T#1m30s"), parse_time_ns("-5us")
    (1500000000, 90000000000, -5000)
    """
    rest = text.strip()
    if prefix := _PREFIX.match(rest):
        rest = prefix[1] + rest[prefix.end() :]
    sign, rest = (-1, rest[1:]) if rest.startswith("-") else (1, rest)
    total, at = 0, 0
    while piece := _PIECE.match(rest, at):
        whole, _, part = piece[1].replace("_", "").partition(".")
        if len(part) > MOST_DIGITS:
            raise ValueError(f"a time with {len(part)} digits behind its point is finer than any clock")
        unit = literals.UNITS_NS[piece[2].lower()]
        total += whole_number(whole) * unit + (int(part) * unit // 10 ** len(part) if part else 0)
        at = piece.end()
    if not at or at != len(rest):
        raise ValueError(f"{text!r} is no time; write 10ms, 1.5s or T#1m30s")
    if total >= 1 << 63:
        raise ValueError("a time has at most 64 bits of nanoseconds, about 292 years")
    return sign * total


def show_time(time_ns: int) -> str:
    """A duration in nanoseconds as a literal of a program: `T#1m30s`."""
    return to_text("TIME", time_ns).decode("ascii")


def sort_of(kind: Type) -> str:
    """The class of values that can be compared: BOOL, number, time, text, enumeration or one of DATES; "" for others."""
    plain = base(kind)
    if isinstance(plain, EnumType):
        return "enumeration"
    if isinstance(plain, StringType) or "ANY_CHAR" in families(plain):
        return "text"
    if not isinstance(plain, Elementary):
        return ""
    if plain is BOOL:
        return "BOOL"
    if "ANY_DATE" in plain.families:
        return plain.name.removeprefix("L")
    return "time" if "ANY_DURATION" in plain.families else "number"


DATES = ("DATE", "TIME_OF_DAY", "DATE_AND_TIME")
_DAYS = ("DATE", "DATE_AND_TIME")
_EXAMPLES = {
    "BOOL": "TRUE or FALSE", "time": "a time such as 10ms", "text": "a text such as 'abc'",
    "DATE": "a date such as D#2024-01-31", "TIME_OF_DAY": "a time of day such as TOD#12:30:00",
    "DATE_AND_TIME": "a date and time such as DT#2024-01-31-12:30:00",
}  # fmt: skip


class NoLiteral(ValueError):
    """A text is no literal of any type."""


def refusal(kind: Type, name: str, text: str) -> TypeError:
    """The error that variable `name` of type `kind` does not take the literal `text`, with an example of one that it takes."""
    return TypeError(f"{name} is {kind.name} and takes {_example(kind)}, not {text}")


def _example(kind: Type) -> str:
    """What a variable of a type takes."""
    number = "a number" if "ANY_REAL" in families(kind) else "a whole number"
    return "one character" if "ANY_CHAR" in families(kind) else _EXAMPLES.get(sort_of(kind), number)


def nearest_real(value: float) -> float:
    """The REAL (32 bits) that is nearest.  Raises OverflowError."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


# --- Python values for a type ---------------------------------------------------------------------------------------


def conform(kind: Type, value: object, name: str) -> Value:
    """A Python value as a place of type `kind` holds it: a REAL is rounded to 32 bits, a member's name becomes its number, the
    literal of a TIME or a date its nanoseconds.

    Raises ValueError (out of range) or TypeError (another kind of value), with the name of the variable, `name`."""
    plain = base(kind)
    if isinstance(value, str) and sort_of(plain) in ("time", *DATES):
        return conform(kind, _literal_of(kind, value, name), name)
    if isinstance(plain, EnumType):
        return _enumerated(plain, value, name)
    if isinstance(plain, StringType):
        return _text(plain, value, name)
    if "ANY_CHAR" in families(plain):
        return _character(plain, value, name)
    if not isinstance(plain, Elementary):
        raise TypeError(f"{name} is {kind.name}; write its members one by one")
    if plain is BOOL:
        if isinstance(value, bool) or (isinstance(value, int) and value in (0, 1)):
            return bool(value)
        raise refusal(kind, name, _given(value))
    if plain.machine in ("f32", "f64"):
        return _real(plain, value, name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise refusal(kind, name, _given(value))
    low, high = (kind.low, kind.high) if isinstance(kind, SubrangeType) else (plain.low, plain.high)
    if not low <= value <= high:
        limits = f"{literals.DATE_RANGE} as nanoseconds since 1970" if sort_of(plain) in _DAYS else f"{low}..{high}"
        wrong = f"{name}: {value} is out of range of {kind.name}, which holds {limits}"
        raise ValueError(wrong + _unsigned(plain, value))
    return value


def _given(value: object) -> str:
    """A Python value for a message; of a date or time, as TOML has them, the form of TOML."""
    return value.isoformat() if isinstance(value, date | time) else repr(value)


def _unsigned(kind: Elementary, value: int) -> str:
    """How to write the bits of a negative number for a bit string."""
    if "ANY_BIT" not in kind.families or not -(1 << kind.bits - 1) <= value < 0:
        return ""
    bits = value + (1 << kind.bits)
    return f"; for these bits write {bits} or 16#{bits:X}"


def _real(kind: Elementary, value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise refusal(kind, name, _given(value))
    try:
        number = float(value)
        if kind.machine == "f32" and math.isfinite(number):
            return nearest_real(number)
    except OverflowError:
        raise ValueError(f"{name}: {value} is out of range of {kind.name}") from None
    return number


def _text(kind: StringType, value: object, name: str) -> str:
    if not isinstance(value, str):
        raise refusal(kind, name, _given(value))
    size = len(packed(value)) // 2 if kind.wide else len(value)
    if size > kind.capacity:
        raise ValueError(f"{name}: {size} characters are out of range of {kind.name}")
    wrong = [c for c in value if c == "\0" or not kind.wide and ord(c) > 0xFF]
    if wrong:
        raise ValueError(f"{name}: {kind.name} cannot hold the character {wrong[0]!r}")
    return value


def _character(kind: Type, value: object, name: str) -> str:
    if not isinstance(value, str):
        raise refusal(kind, name, _given(value))
    if len(value) != 1:
        raise ValueError(f"{name} is {kind.name} and takes one character, not {len(value)}")
    if ord(value) >= 1 << 8 * kind.size:
        raise ValueError(f"{name}: {kind.name} cannot hold the character {value!r}")
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


# --- literals for a type -----------------------------------------------------------------------------------------------


def literal(text: str) -> tuple[Value, Type | None]:
    """The value that `text` writes, and its type where the text shows one: BOOL, TIME, and what stands before a #.

    Knows TRUE, ON, 16#FF, 0xFF, 12, 1.5, T#10ms, 10ms, 'text', INT#5, DT#2024-01-31-12:30:00.  Raises ValueError."""
    text = text.strip()
    if fold(text) in _BITS:
        return _BITS[fold(text)], BOOL
    if match := _INTEGER.fullmatch(text):
        digits, radix = next(row for row in zip(match.groups()[1:], _RADIXES, strict=True) if row[0])
        number = whole_number(digits.replace("_", "")) if radix == 10 else int(digits.replace("_", ""), radix)
        return (-number if match[1] == "-" else number), None
    if _REAL.fullmatch(text):
        return float(text.replace("_", "")), None
    prefix, mark, rest = text.partition("#")
    if _PIECE.match(text.lstrip("-")) or fold(prefix) in literals.TIMES:
        return parse_time_ns(text), TIME
    try:
        if mark and fold(prefix) in literals.ELEMENTARY:
            _, value, name = literals.typed(fold(prefix), rest)
            shown = ELEMENTARY.get(name or "")
            return (nearest_real(float(value)) if shown is REAL else _joined(value)), shown
        if len(text) >= 2 and text[0] == text[-1] and text[0] in "'\"":
            return _joined(literals.text_literal(text)[1]), None
    except (literals.Malformed, literals.OutOfRange) as error:
        raise ValueError(str(error.args[0])) from None
    except IndexError:
        raise ValueError(f"{text!r} ends within an escape") from None
    raise NoLiteral(f"{text!r} is no literal")


def _joined(value: Value) -> Value:
    """The same value, of a text with one character for two units of a WSTRING that make one, as `places.read` gives it."""
    return packed(value).decode("utf-16-le", "surrogatepass") if isinstance(value, str) else value


_PARTS = re.compile(r"'(?:\$.|[^'$])*'|\"(?:\$.|[^\"$])*\"|.", re.S)
_QUOTED = re.compile(r"(W?(STRING|CHAR)#)?['\"].", re.I | re.S)
_BITS = {"TRUE": True, "FALSE": False, "ON": True, "OFF": False}


def parse_value(kind: Type, text: str, name: str) -> Value:
    """The value of type `kind` that `text` writes; of an array a list, `1,2,3` or `[1, 2, 3]`.

    `name` is the variable that messages are about.  Raises ValueError (out of range, no literal) or TypeError (a literal of
    another kind).

    >>> from fbvm.base.types import TIME, WORD
    >>> parse_value(TIME, "10ms", "Main.t"), parse_value(WORD, "16#FF", "D200")
    (10000000, 255)
    """
    plain = base(kind)
    text = text.strip()
    if isinstance(plain, ArrayType):
        texts = split_list(text)
        if len(texts) != plain.count:
            raise ValueError(f"{name} is {kind.name} and takes {plain.count} values parted by commas, not {len(texts)}")
        return [parse_value(plain.element, part, f"{name}[{at}]") for at, part in enumerate(texts)]
    if isinstance(plain, EnumType) and not _INTEGER.fullmatch(text):
        front, dot, member = text.rpartition(".")
        return conform(kind, member if dot and fold(front) == fold(kind.name) else text, name)
    if sort_of(kind) == "text" and not _QUOTED.match(text):
        return conform(kind, text, name)
    return conform(kind, _literal_of(kind, text, name), name)


def _literal_of(kind: Type, text: str, name: str) -> Value:
    """The value of a literal whose kind fits a variable of type `kind`; a date may lack the name of its type."""
    wanted = sort_of(kind)
    try:
        value, shown = literal(text if wanted not in DATES or "#" in text else f"{base(kind).name}#{text}")
    except NoLiteral as error:
        raise ValueError(f"{name}: {error}; {kind.name} takes {_example(kind)}") from None
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    sort = sort_of(shown) if shown else "text" if isinstance(value, str) else "number"
    fits = sort == wanted or not wanted or wanted == "enumeration" or wanted == "BOOL" and value in (0, 1)
    if isinstance(value, float) and math.isinf(value):
        raise ValueError(f"{name}: {text} is out of range of LREAL")
    truncated = wanted == "number" and isinstance(value, float) and "ANY_REAL" not in families(kind)
    if not fits or truncated:
        raise refusal(kind, name, text)
    return value


def split_list(text: str) -> list[str]:
    """The parts of `1,2,3` or `[1, 2, 3]`: commas within brackets and quotes do not separate."""
    parts = _parted(text)
    if len(parts) == 1 and parts[0].startswith("[") and parts[0].endswith("]"):
        return _parted(parts[0][1:-1])
    return parts


def _parted(text: str) -> list[str]:
    parts, depth = [""], 0
    for piece in _PARTS.findall(text):
        depth += {"[": 1, "]": -1}.get(piece, 0)
        if piece == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += piece
    return [part.strip() for part in parts]


# --- formatting ------------------------------------------------------------------------------------------------------------


_ESCAPES = {"$": "$$", "\n": "$L", "\f": "$P", "\r": "$R", "\t": "$T"}


def _quoted(kind: Type, text: str) -> str:
    """A text as a literal: WSTRING and WCHAR in double quotes; what cannot be printed is escaped."""
    wide = isinstance(kind, StringType) and kind.wide or kind.name == "WCHAR"
    quote, digits = ('"', 4) if wide else ("'", 2)
    shown = (_ESCAPES.get(c) or (f"${c}" if c == quote else c if c.isprintable() else f"${ord(c):0{digits}X}") for c in text)
    return f"{quote}{''.join(shown)}{quote}"


_PINS = {"VAR_INPUT": 0, "VAR_IN_OUT": 1, "VAR_OUTPUT": 2}


def plain_value(kind: Type, value: Value) -> Value:
    """The same value for JSON: a REAL as its shortest decimal number, infinities and NaN as the texts "inf" and "nan"."""
    plain = base(kind)
    if isinstance(plain, ArrayType) and isinstance(value, list):
        return [plain_value(plain.element, item) for item in value]
    if isinstance(plain, StructType) and isinstance(value, dict):
        return {f.name: plain_value(f.type, value[f.name]) for f in plain.fields.values() if f.name in value}
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return shortest(value) if isinstance(value, float) and plain is REAL else value


def in_hexadecimal(kind: Type, value: int) -> str:
    """An integer of type `kind` in hexadecimal with all its digits: 16#0081."""
    size = kind.size
    return f"16#{value & (1 << 8 * size) - 1:0{2 * size}X}"


def as_read(kind: Type) -> Type:
    """The type that is read for a member of type `kind`: of a REFERENCE TO a single value the type of that value.

    Structures are not followed, since references in them may form a circle."""
    target = followed(kind)
    return target if machine(target) else kind


def _member(field: Field, value: Value, hexadecimal: bool) -> str:
    if field.hexadecimal and isinstance(value, int):
        return in_hexadecimal(field.type, value)
    return show(field.type, value, hexadecimal)


def show(kind: Type, value: Value, hexadecimal: bool = False) -> str:
    """A value as a literal of a program: TRUE, 12, T#1s500ms, 'text', [1, 2], (a := 1).

    `kind` is the declared type.  `hexadecimal` writes bit strings as 16#00FF.  Of an instance the inputs and outputs come
    first; constants and variables that the compiler has added are left out.

    >>> from fbvm.base.types import TIME, WORD
    >>> show(TIME, 1_500_000_000), show(WORD, 255, hexadecimal=True)
    ('T#1s500ms', '16#00FF')
    """
    plain = base(as_read(kind))
    if value is None:
        return "NULL"
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, list | dict):
        return _show_aggregate(plain, value, hexadecimal)
    if isinstance(value, str):
        return value if isinstance(plain, RefType) else _quoted(plain, value)
    if isinstance(value, float):
        return str(shortest(value) if plain is REAL else value)
    return _show_integer(plain, value, hexadecimal)


def _show_aggregate(plain: Type, value: list[Value] | dict[str, Value], hexadecimal: bool) -> str:
    """The elements of an array in brackets, the members of a structure or an instance in parentheses."""
    if isinstance(value, list):
        assert isinstance(plain, ArrayType)
        return "[" + ", ".join(show(plain.element, item, hexadecimal) for item in value) + "]"
    assert isinstance(plain, StructType)
    members = [f for f in plain.fields.values() if f.name in value and "$" not in f.name and not (plain.block and f.constant)]
    members.sort(key=lambda f: _PINS.get(f.kind, len(_PINS)))
    return "(" + ", ".join(f"{f.name} := {_member(f, value[f.name], hexadecimal)}" for f in members) + ")"


def _show_integer(plain: Type, value: int, hexadecimal: bool) -> str:
    """An integer as its type is written: the member of an enumeration, a duration, a date, a bit string, else a number."""
    if isinstance(plain, EnumType):
        return f"{plain.shown.get(value, '?')} ({value})"
    if plain.name in ("TIME", "LTIME"):
        return show_time(value)
    found = plain.families if isinstance(plain, Elementary) else ()
    if "ANY_DATE" in found:
        return to_text(plain.name, value).decode("ascii")
    return in_hexadecimal(plain, value) if hexadecimal and "ANY_BIT" in found else str(value)
