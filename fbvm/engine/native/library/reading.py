"""Routines of native code that read numbers from text, in the subset that `library.subset` translates.

They accept the texts that `syntax.st.literals` accepts, and report the same mistake first.  A routine `read_...` returns GOOD,
MALFORMED or OUTSIDE (the type cannot hold the value), and writes the value to the address `out`: an integer, or the bits of a
double."""

from __future__ import annotations

import struct

from fbvm.base.types import SHORT_NAMES
from fbvm.engine.native.library.routines import INFINITE
from fbvm.engine.native.library.subset import data, float_bits, peek, peek_all, poke, poke_all, text_float
from fbvm.syntax.st.literals import LONGEST, REALS

GOOD, MALFORMED, OUTSIDE = 0, 1, 2
KINDS = {name: number for number, name in enumerate((
    "BOOL", "SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD", "REAL",
    "LREAL", "TIME", "LTIME", "DATE", "LDATE", "TIME_OF_DAY", "LTIME_OF_DAY", "DATE_AND_TIME", "LDATE_AND_TIME",
    "STRING"))}
"""Data types by number; STRING stands for every kind of text."""
NAMES = b"".join(name.encode() + bytes((0, number)) for name, number in (
    KINDS | {short: KINDS[name] for short, name in SHORT_NAMES.items()}
    | dict.fromkeys(("WSTRING", "CHAR", "WCHAR"), KINDS["STRING"])).items()) + b"\0"
"""Names of types, each followed by 0 and its number; an empty one ends them."""
BITS = b"\0\x08\x10\x20\x40\x08\x10\x20\x40\x08\x10\x20\x40"
"""Widths of the integer types by number."""
LINT, REAL, LREAL, TIME = KINDS["LINT"], KINDS["REAL"], KINDS["LREAL"], KINDS["TIME"]
DATE, TOD, DT, STRING = KINDS["DATE"], KINDS["TIME_OF_DAY"], KINDS["DATE_AND_TIME"], KINDS["STRING"]
CANONICAL_NAN, SIGN = 0x7FF8000000000000, -(1 << 63)
REAL_LIMIT = struct.unpack("<q", struct.pack("<d", REALS["REAL"]))[0]
CLEANED = 32
"""How many bytes behind `out` the text of a number is written without its `_`; the caller has LONGEST + 1 bytes there."""
TENTH = ((1 << 64) - 1) // 10


# --- characters -----------------------------------------------------------------------------------------------------


def upper(letter: int) -> int:
    if ord("a") <= letter <= ord("z"):
        return letter - 32
    return letter


def is_digit(at: int) -> int:
    return ord("0") <= peek(at) <= ord("9")


def says(at: int, n: int, word: int) -> int:
    """Whether a text is a word (in capitals, ended by 0), whatever its case."""
    i = 0
    while i < n:
        if upper(peek(at + i)) != peek(word + i) or peek(word + i) == 0:
            return 0
        i += 1
    return peek(word + n) == 0


def place_of(letter: int, at: int, n: int) -> int:
    """Where a character stands first; n if nowhere."""
    i = 0
    while i < n and peek(at + i) != letter:
        i += 1
    return i


def kind_of(at: int, n: int) -> int:
    """The number of the type of that name; -1 if there is none."""
    name = data(NAMES)
    while peek(name) != 0:
        end = name + place_of(0, name, 64)
        if says(at, n, name):
            return peek(end + 1)
        name = end + 2
    return -1


def run_of_digits(at: int, n: int) -> int:
    """How many characters digits take, with single `_` between them."""
    i = 0
    while i < n and is_digit(at + i):
        i += 1
        if i + 1 < n and peek(at + i) == ord("_") and is_digit(at + i + 1):
            i += 1
    return i


def count_digits(at: int, n: int) -> int:
    i = 0
    while i < n and is_digit(at + i):
        i += 1
    return i


def number_at(at: int, n: int) -> int:
    """The number that few digits write; `_` is passed over."""
    number = 0
    i = 0
    while i < n:
        if peek(at + i) != ord("_"):
            number = number * 10 + peek(at + i) - ord("0")
        i += 1
    return number


# --- numbers --------------------------------------------------------------------------------------------------------


def is_real(at: int, n: int) -> int:
    """Whether a text is digits with a point or an exponent."""
    i = run_of_digits(at, n)
    if i == 0:
        return 0
    if i < n and peek(at + i) == ord("."):
        more = run_of_digits(at + i + 1, n - i - 1)
        if more == 0:
            return 0
        i += 1 + more
    if i < n and upper(peek(at + i)) == ord("E"):
        i += 1
        if i < n and (peek(at + i) == ord("+") or peek(at + i) == ord("-")):
            i += 1
        more = count_digits(at + i, n - i)
        if more == 0:
            return 0
        i += more
    return i == n


def float_at(out: int, at: int, n: int) -> int:
    """The bits of the double that a decimal number is nearest to."""
    clean = out + CLEANED
    i = 0
    while i < n:
        if peek(at + i) != ord("_"):
            poke(clean, peek(at + i))
            clean += 1
        i += 1
    poke(clean, 0)
    return text_float(out + CLEANED)


def read_decimal(out: int, at: int, n: int) -> int:
    """A whole number below 2**64."""
    number = 0
    i = 0
    while i < n:
        if peek(at + i) != ord("_"):
            digit = peek(at + i) - ord("0")
            if number < 0 or number > TENTH or (number == TENTH and digit > 5):
                return OUTSIDE
            number = number * 10 + digit
        i += 1
    poke_all(out, number)
    return GOOD


def digit_bits(at: int, n: int) -> int:
    """Bits of a digit of the base that is written before `#`; 0 if there is no such base."""
    if n == 1 and peek(at) == ord("2"):
        return 1
    if n == 1 and peek(at) == ord("8"):
        return 3
    if n == 2 and peek(at) == ord("1") and peek(at + 1) == ord("6"):
        return 4
    return 0


def digit_value(letter: int) -> int:
    """Value of a digit of any base; 99 for another character."""
    if ord("0") <= letter <= ord("9"):
        return letter - ord("0")
    letter = upper(letter)
    if ord("A") <= letter <= ord("Z"):
        return letter - 55
    return 99


def is_based(at: int, n: int, bits: int) -> int:
    """Whether a text is digits of a base, with single `_` between them."""
    after_digit = 0
    i = 0
    while i < n:
        if peek(at + i) == ord("_"):
            if not after_digit:
                return 0
            after_digit = 0
        elif digit_value(peek(at + i)) >> bits:
            return 0
        else:
            after_digit = 1
        i += 1
    return after_digit


def read_based(out: int, at: int, n: int, real: int) -> int:
    """A number such as 16#FF, below 2**64, or the double nearest to it."""
    mark = place_of(ord("#"), at, n)
    bits = digit_bits(at, mark)
    if bits == 0 or not is_based(at + mark + 1, n - mark - 1, bits):
        return MALFORMED
    number = 0
    left_out = 0
    sticky = 0
    i = mark + 1
    while i < n:
        digit = digit_value(peek(at + i))
        if digit == 99:
            i += 1
            continue
        if real and number >> 58:
            left_out += bits
            sticky = sticky | (digit != 0)
        elif number >> (64 - bits):
            return OUTSIDE
        else:
            number = number << bits | digit
        i += 1
    if real and number != 0:
        number = float_bits(number | sticky)
        if (number >> 52) + left_out > 2046:
            return OUTSIDE
        number += left_out << 52
    poke_all(out, number)
    return GOOD


def read_number(out: int, kind: int, at: int, n: int) -> int:
    """A number of an integer or real type, with a sign if it has no base."""
    sign = 0
    if n > 0 and (peek(at) == ord("-") or peek(at) == ord("+")):
        sign = peek(at)
        at += 1
        n -= 1
    based = place_of(ord("#"), at, n) < n
    if n == 0 or (based and sign != 0):
        return MALFORMED
    if n > LONGEST:
        return OUTSIDE
    if based and n > 3 and says(at, 3, data(b"10#")) and run_of_digits(at + 3, n - 3) == n - 3:
        at += 3
        n -= 3
        based = place_of(ord("#"), at, n) < n
    whole = run_of_digits(at, n) == n
    if not based and not whole and not is_real(at, n):
        return MALFORMED
    if kind >= REAL:
        return read_real(out, kind, at, n, sign, based, whole)
    if not based and not whole:
        return MALFORMED
    if based:
        status = read_based(out, at, n, 0)
    else:
        status = read_decimal(out, at, n)
    if status != GOOD:
        return status
    return within(out, kind, sign == ord("-"))


def within(out: int, kind: int, negative: int) -> int:
    """Whether an integer type holds the number in `out`, which gets its sign."""
    number = peek_all(out)
    bits = peek(data(BITS) + kind)
    if negative:
        poke_all(out, -number)
        if kind > LINT:
            if number != 0:
                return OUTSIDE
        elif bits == 64:
            if number < 0 and number != SIGN:
                return OUTSIDE
        elif number < 0 or number > 1 << (bits - 1):
            return OUTSIDE
        return GOOD
    if kind <= LINT:
        bits -= 1
    if bits < 64 and number >> bits != 0:
        return OUTSIDE
    return GOOD


def read_real(out: int, kind: int, at: int, n: int, sign: int, based: int, whole: int) -> int:
    if based:
        status = read_based(out, at, n, 1)
        if status != GOOD:
            return status
        bits = peek_all(out)
    else:
        bits = float_at(out, at, n)
    if bits >= INFINITE or (kind == REAL and bits >= REAL_LIMIT):
        return OUTSIDE
    if sign == ord("-") and (bits != 0 or not whole):
        bits = bits | SIGN
    poke_all(out, bits)
    return GOOD
