"""Routines of machine code that work on bytes and write values as text, in the subset that `library.subset` translates.

A text is given as the address of its first byte and its length.  A routine `put_...` writes a text to the address `out` and
returns its length."""

from __future__ import annotations

import struct

from fbvm.base.types import DAY_NS
from fbvm.engine.native.library.subset import data, float_text, free_text, peek, poke, single_bits, text_float
from fbvm.syntax.st.literals import SECOND_NS, UNITS_NS

UNITS = b"".join(unit.encode().ljust(2, b"\0") for unit in UNITS_NS)
SIZES = b"".join(struct.pack("<Q", size) for size in UNITS_NS.values())
MAGNITUDE, INFINITE = 0x7FFFFFFFFFFFFFFF, 0x7FF0000000000000


# --- bytes ----------------------------------------------------------------------------------------------------------


def text_length(at: int, capacity: int) -> int:
    """Bytes up to the first 0, at most the capacity."""
    n = 0
    while n < capacity and peek(at + n) != 0:
        n += 1
    return n


def text_order(a: int, m: int, b: int, n: int) -> int:
    """Below 0, 0 or above: how text a stands to text b."""
    i = 0
    while i < m and i < n:
        if peek(a + i) != peek(b + i):
            return peek(a + i) - peek(b + i)
        i += 1
    return m - n


def reverse_items(at: int, count: int, stride: int, size: int) -> int:
    """The bytes of each of `count` items backwards."""
    while count > 0:
        low = at
        high = at + size - 1
        while low < high:
            byte = peek(low)
            poke(low, peek(high))
            poke(high, byte)
            low += 1
            high -= 1
        at += stride
        count -= 1
    return 0


# --- characters of two bytes ----------------------------------------------------------------------------------------


def wide(at: int, i: int) -> int:
    """The code of character i of a WSTRING."""
    return peek(at + 2 * i) + 256 * peek(at + 2 * i + 1)


def wide_length(at: int, capacity: int) -> int:
    """Characters up to the first 0, at most the capacity."""
    n = 0
    while n < capacity and wide(at, n) != 0:
        n += 1
    return n


def wide_characters(at: int, m: int) -> int:
    """Characters of a WSTRING of m units: two units that are a pair of surrogates are one."""
    i = 0
    n = 0
    while i < m:
        i += wide_size(at, m, i)
        n += 1
    return n


def wide_units(at: int, m: int, n: int) -> int:
    """Units of the first n characters of a WSTRING of m units; n itself if it is negative."""
    if n < 0:
        return n
    i = 0
    while i < m and n > 0:
        i += wide_size(at, m, i)
        n -= 1
    return i


def wide_size(at: int, m: int, i: int) -> int:
    """Units of the character that begins at unit i of m: 2 for a pair of surrogates."""
    if i + 1 < m and wide(at, i) & 0xFC00 == 0xD800 and wide(at, i + 1) & 0xFC00 == 0xDC00:
        return 2
    return 1


def wide_order(a: int, m: int, b: int, n: int) -> int:
    """Below 0, 0 or above: how text a stands to text b."""
    i = 0
    while i < m and i < n:
        if wide(a, i) != wide(b, i):
            return wide(a, i) - wide(b, i)
        i += 1
    return m - n


def widen(out: int, at: int, n: int) -> int:
    """n characters of one byte as characters of two."""
    i = 0
    while i < n:
        poke(out + 2 * i, peek(at + i))
        poke(out + 2 * i + 1, 0)
        i += 1
    return n


def narrow(out: int, at: int, n: int) -> int:
    """n characters of two bytes as characters of one; `?` for those above 255."""
    i = 0
    while i < n:
        if peek(at + 2 * i + 1) == 0:
            poke(out + i, peek(at + 2 * i))
        else:
            poke(out + i, ord("?"))
        i += 1
    return n


# --- search ---------------------------------------------------------------------------------------------------------


def code_at(at: int, i: int, width: int) -> int:
    """The code of character i of a text whose characters have `width` bytes, 1 or 2."""
    if width == 1:
        return peek(at + i)
    return wide(at, i)


def text_find(a: int, m: int, b: int, n: int, width: int) -> int:
    """Position of the first b in a; 0 if there is none or b is empty.

    The two-way algorithm of Crochemore and Perrin ("Two-way string-matching", J. ACM 38, 1991): for texts of m and n characters
    it takes a time proportional to m + n, whatever they are, and no memory.  b is cut at a critical place.  What lies behind
    the cut is compared first, forwards, then what lies in front of it, backwards."""
    if n == 0 or n > m:
        return 0
    cut = critical_cut(b, n, width)
    period = cut >> 32
    cut &= 0xFFFFFFFF
    repeats = 1
    i = 0
    while i < cut and repeats != 0:
        if code_at(b, i, width) != code_at(b, period + i, width):
            repeats = 0
        i += 1
    if repeats == 0:
        period = cut + 1
        if n - cut > cut:
            period = n - cut + 1
    at = 0
    known = 0
    while at + n <= m:
        i = cut
        if known > i:
            i = known
        while i < n and code_at(b, i, width) == code_at(a, at + i, width):
            i += 1
        if i < n:
            at += i - cut + 1
            known = 0
            continue
        i = cut
        while i > known and code_at(b, i - 1, width) == code_at(a, at + i - 1, width):
            i -= 1
        if i <= known:
            return at + 1
        at += period
        known = 0
        if repeats != 0:
            known = n - period
    return 0


def critical_cut(b: int, n: int, width: int) -> int:
    """Where a text is cut for a search, and from bit 32 on the period of what lies behind the cut."""
    least = last_suffix(b, n, width, 0)
    greatest = last_suffix(b, n, width, 1)
    if (least & 0xFFFFFFFF) > (greatest & 0xFFFFFFFF):
        return least
    return greatest


def last_suffix(b: int, n: int, width: int, backwards: int) -> int:
    """Where the suffix of a text begins that is the last in the order of characters, or in the opposite order; from bit 32 on its
    period."""
    begin = 0
    other = 1
    same = 0
    period = 1
    while other + same < n:
        one = code_at(b, begin + same, width)
        two = code_at(b, other + same, width)
        if one == two:
            same += 1
            if same == period:
                other += period
                same = 0
        elif (two < one and backwards == 0) or (two > one and backwards != 0):
            other += same + 1
            same = 0
            period = other - begin
        else:
            begin = other
            other += 1
            same = 0
            period = 1
    return begin + (period << 32)


# --- decimal digits in nibbles --------------------------------------------------------------------------------------


def bcd_number(a: int) -> int:
    """The number that decimal nibbles form; -1 if one is above 9."""
    number = 0
    shift = 64
    while shift > 0:
        shift -= 4
        if (a >> shift) & 15 > 9:
            return -1
        number = number * 10 + ((a >> shift) & 15)
    return number


def bcd_digits(a: int) -> int:
    """The decimal digits of a in nibbles."""
    digits = 0
    shift = 0
    while a != 0:
        digits |= (a % 10) << shift
        a //= 10
        shift += 4
    return digits


# --- values to text -------------------------------------------------------------------------------------------------


def put_bytes(out: int, at: int, n: int) -> int:
    i = 0
    while i < n:
        poke(out + i, peek(at + i))
        i += 1
    return n


def put_digits(out: int, value: int, count: int) -> int:
    """That many decimal digits."""
    i = count
    while i > 0:
        i -= 1
        poke(out + i, ord("0") + value % 10)
        value //= 10
    return count


def put_number(out: int, value: int) -> int:
    """A number without sign."""
    count = 1
    rest = value // 10
    while rest != 0:
        count += 1
        rest //= 10
    return put_digits(out, value, count)


def put_integer(out: int, value: int) -> int:
    if value < 0:
        poke(out, ord("-"))
        return 1 + put_number(out + 1, -value)
    return put_number(out, value)


def put_lreal(out: int, bits: int) -> int:
    """Fewest digits that read back; an exponent's letter is a capital."""
    if bits & INFINITE == INFINITE:
        if bits & MAGNITUDE != INFINITE:
            return put_bytes(out, data(b"NaN"), 3)
        if bits < 0:
            return put_bytes(out, data(b"-INF"), 4)
        return put_bytes(out, data(b"INF"), 3)
    text = float_text(bits, ord("r"), 0, 2)
    n = put_bytes(out, text, text_length(text, 48))
    free_text(text)
    i = 0
    while i < n:
        if peek(out + i) == ord("e"):
            poke(out + i, ord("E"))
        i += 1
    return n


def put_real(out: int, bits: int) -> int:
    """Fewest digits that round to the same 32 bits; the bits are those of the same LREAL."""
    digits = 1
    while digits < 10 and bits & INFINITE != INFINITE:
        text = float_text(bits, ord("g"), digits, 0)
        shortest = text_float(text)
        free_text(text)
        if single_bits(shortest) == bits:
            return put_lreal(out, shortest)
        digits += 1
    return put_lreal(out, bits)


def unit_ns(unit: int) -> int:
    """Nanoseconds of a unit by its place in d h m s ms us ns."""
    at = data(SIZES) + unit * 8
    size = 0
    i = 8
    while i > 0:
        i -= 1
        size = size * 256 + peek(at + i)
    return size


def put_duration(out: int, value: int, n: int) -> int:
    """A duration behind the n bytes of its prefix."""
    rest = value
    if value < 0:
        poke(out + n, ord("-"))
        n += 1
        rest = -value
    start = n
    unit = 0
    while unit < 7:
        count = rest // unit_ns(unit)
        rest = rest % unit_ns(unit)
        if count != 0:
            n += put_number(out + n, count)
            n += put_bytes(out + n, data(UNITS) + unit * 2, text_length(data(UNITS) + unit * 2, 2))
        unit += 1
    if n == start:
        n += put_bytes(out + n, data(b"0s"), 2)
    return n


def put_time(out: int, value: int) -> int:
    return put_duration(out, value, put_bytes(out, data(b"T#"), 2))


def put_ltime(out: int, value: int) -> int:
    return put_duration(out, value, put_bytes(out, data(b"LT#"), 3))


def whole_days(value: int) -> int:
    """Days since 1970, toward minus infinity."""
    if value < 0:
        return -1 - (-1 - value) // DAY_NS
    return value // DAY_NS


def put_day(out: int, value: int) -> int:
    """The date of a moment: years begin in March here, the leap day ends them."""
    day = whole_days(value) + 719468
    era = day // 146097
    of_era = day % 146097
    year = (of_era - of_era // 1460 + of_era // 36524 - of_era // 146096) // 365
    of_year = of_era - (365 * year + year // 4 - year // 100)
    month = (5 * of_year + 2) // 153
    put_digits(out + 8, of_year - (153 * month + 2) // 5 + 1, 2)
    year += era * 400
    month += 3
    if month > 12:
        month -= 12
        year += 1
    put_digits(out, year, 4)
    put_digits(out + 5, month, 2)
    poke(out + 4, ord("-"))
    poke(out + 7, ord("-"))
    return 10


def put_clock(out: int, value: int) -> int:
    """The time of day of a moment, without zeros at the end of its fraction."""
    rest = value - whole_days(value) * DAY_NS
    seconds = rest // SECOND_NS
    rest = rest % SECOND_NS
    put_digits(out, seconds // 3600, 2)
    put_digits(out + 3, seconds // 60 % 60, 2)
    put_digits(out + 6, seconds % 60, 2)
    poke(out + 2, ord(":"))
    poke(out + 5, ord(":"))
    if rest == 0:
        return 8
    poke(out + 8, ord("."))
    put_digits(out + 9, rest, 9)
    n = 18
    while peek(out + n - 1) == ord("0"):
        n -= 1
    return n


def put_date(out: int, value: int) -> int:
    n = put_bytes(out, data(b"D#"), 2)
    return n + put_day(out + n, value)


def put_ldate(out: int, value: int) -> int:
    n = put_bytes(out, data(b"LD#"), 3)
    return n + put_day(out + n, value)


def put_tod(out: int, value: int) -> int:
    n = put_bytes(out, data(b"TOD#"), 4)
    return n + put_clock(out + n, value)


def put_ltod(out: int, value: int) -> int:
    n = put_bytes(out, data(b"LTOD#"), 5)
    return n + put_clock(out + n, value)


def put_moment(out: int, value: int, n: int) -> int:
    n += put_day(out + n, value)
    poke(out + n, ord("-"))
    return n + 1 + put_clock(out + n + 1, value)


def put_dt(out: int, value: int) -> int:
    return put_moment(out, value, put_bytes(out, data(b"DT#"), 3))


def put_ldt(out: int, value: int) -> int:
    return put_moment(out, value, put_bytes(out, data(b"LDT#"), 4))
