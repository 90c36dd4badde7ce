"""Routines of native code that read times and dates from text, in the subset that `library.subset` translates.

They work as those of `library.reading`: the values are nanoseconds."""

from __future__ import annotations

from fbvm.base.types import DAY_NS
from fbvm.engine.native.library.reading import (
    GOOD,
    MALFORMED,
    OUTSIDE,
    SIGN,
    count_digits,
    number_at,
    place_of,
    read_decimal,
    run_of_digits,
    upper,
)
from fbvm.engine.native.library.routines import UNITS, unit_ns
from fbvm.engine.native.library.subset import data, peek, peek_all, poke_all
from fbvm.syntax.st.literals import LONGEST, SECOND_NS

MOST = (1 << 63) - 1
LAST_DAY = MOST // DAY_NS


def read_fraction(out: int, at: int, n: int, size: int) -> int:
    """Digits behind a point times a size, which must give a whole number."""
    while n > 0 and (peek(at + n - 1) == ord("0") or peek(at + n - 1) == ord("_")):
        n -= 1
    poke_all(out, 0)
    parts = 1
    number = 0
    i = 0
    while i < n:
        if peek(at + i) != ord("_"):
            if parts >= 10000000000000000:
                return OUTSIDE
            parts *= 10
            number = number * 10 + peek(at + i) - ord("0")
        i += 1
    prime = 5  # then 2
    while prime >= 2:
        while size % prime == 0 and parts % prime == 0:
            size //= prime
            parts //= prime
        prime -= 3
    if number % parts != 0:
        return OUTSIDE
    poke_all(out, number // parts * size)
    return GOOD


def unit_at(at: int, n: int) -> int:
    """Place in d h m s ms us ns of the unit that a text begins with, the longest one; 7 if none."""
    unit = 6
    if n > 1 and upper(peek(at + 1)) == ord("S"):
        while unit > 3:
            if upper(peek(at)) == upper(peek(data(UNITS) + unit * 2)):
                return unit
            unit -= 1
    unit = 0
    while unit < 4 and (n == 0 or upper(peek(at)) != upper(peek(data(UNITS) + unit * 2))):
        unit += 1
    if unit == 4:
        return 7
    return unit


def number_length(at: int, n: int) -> int:
    """Characters of the number that a part of a duration begins with, such as 3.5 of 3.5s; 0 if there is none.

    In front of the number there may be one `_`."""
    skip = peek(at) == ord("_")
    whole = run_of_digits(at + skip, n - skip)
    if whole == 0:
        return 0
    end = skip + whole
    if end < n and peek(at + end) == ord("."):
        behind = run_of_digits(at + end + 1, n - end - 1)
        if behind == 0:
            return 0
        end += 1 + behind
    return end


def subtract_part(out: int, at: int, n: int, size: int, total: int) -> int:
    """Writes `total` less the number of n characters times `size` nanoseconds to `out`; OUTSIDE if 64 bits cannot hold it."""
    skip = peek(at) == ord("_")
    whole = run_of_digits(at + skip, n - skip)
    status = read_decimal(out, at + skip, whole)
    count = peek_all(out)
    if status == GOOD and count == SIGN and size == 1 and total == 0:
        total = SIGN
    elif status != GOOD or count < 0 or count > MOST // size or count * size - 1 > total + MOST:
        status = OUTSIDE
    else:
        total -= count * size
    behind = n - skip - whole - 1
    if behind > 0:
        if read_fraction(out, at + skip + whole + 1, behind, size) != GOOD or peek_all(out) - 1 > total + MOST:
            status = OUTSIDE
        total -= peek_all(out)
    poke_all(out, total)
    return status


def read_duration(out: int, at: int, n: int) -> int:
    """The nanoseconds of 1d2h3.5s or -5us300ns.  Units fall from part to part, and only the last part may have a fraction.

    The total is kept negative until the end: below 0 there is room for one nanosecond more."""
    negative = 0
    if n > 0 and (peek(at) == ord("-") or peek(at) == ord("+")):
        negative = peek(at) == ord("-")
        at += 1
        n -= 1
    if n == 0:
        return MALFORMED
    total = 0
    outside = 0
    last = -1
    while n > 0:
        length = number_length(at, n)
        unit = unit_at(at + length, n - length)
        end = length + 1 + (unit > 3)
        if length == 0 or unit == 7 or unit <= last or end > LONGEST:
            return MALFORMED
        if end != n and place_of(ord("."), at, length) != length:
            return MALFORMED
        if subtract_part(out, at, length, unit_ns(unit), total) != GOOD:
            outside = 1
        total = peek_all(out)
        last = unit
        at += end
        n -= end
    if outside or (total == SIGN and not negative):
        return OUTSIDE
    if not negative:
        total = -total
    poke_all(out, total)
    return GOOD


def days_of_month(year: int, month: int) -> int:
    if month == 2:
        if year % 4 == 0 and (year % 100 != 0 or year % 400 == 0):
            return 29
        return 28
    return 30 + (month + month // 8) % 2


def read_day(out: int, at: int, n: int) -> int:
    """Days since 1970-01-01 of a date such as 2024-05-31."""
    size = count_digits(at, n)
    if size == 0 or size > 4 or size >= n or peek(at + size) != ord("-"):
        return MALFORMED
    year = number_at(at, size)
    at += size + 1
    n -= size + 1
    size = count_digits(at, n)
    if size == 0 or size > 2 or size >= n or peek(at + size) != ord("-"):
        return MALFORMED
    month = number_at(at, size)
    at += size + 1
    n -= size + 1
    if n == 0 or n > 2 or count_digits(at, n) != n:
        return MALFORMED
    day = number_at(at, n)
    if month < 1 or month > 12 or day < 1 or day > days_of_month(year, month):
        return MALFORMED
    if year < 1:
        return OUTSIDE
    if month < 3:
        year -= 1
        month += 12
    days = 365 * year + year // 4 - year // 100 + year // 400 + (153 * (month - 3) + 2) // 5 + day - 719469
    if days < -LAST_DAY or days > LAST_DAY:
        return OUTSIDE
    poke_all(out, days)
    return GOOD


def read_date(out: int, at: int, n: int) -> int:
    status = read_day(out, at, n)
    poke_all(out, peek_all(out) * DAY_NS)
    return status


def two_digits(at: int, n: int) -> int:
    """Length of a number of one or two digits; 0 for another."""
    size = count_digits(at, n)
    if size > 2:
        return 0
    return size


def read_clock(out: int, at: int, n: int) -> int:
    """Nanoseconds since midnight of 13:45 or 13:45:30.25."""
    size = two_digits(at, n)
    if n > LONGEST or size == 0 or size >= n or peek(at + size) != ord(":"):
        return MALFORMED
    hour = number_at(at, size)
    at += size + 1
    n -= size + 1
    size = two_digits(at, n)
    if size == 0 or (size < n and peek(at + size) != ord(":")):
        return MALFORMED
    minute = number_at(at, size)
    second = 0
    poke_all(out, 0)
    behind = 0
    if size < n:
        at += size + 1
        n -= size + 1
        size = two_digits(at, n)
        if size == 0 or (size < n and peek(at + size) != ord(".")):
            return MALFORMED
        second = number_at(at, size)
        at += size + 1
        behind = n - size - 1
        if size < n and (behind == 0 or run_of_digits(at, behind) != behind):
            return MALFORMED
    if hour > 23 or minute > 59 or second > 59:
        return MALFORMED
    if behind > 0 and read_fraction(out, at, behind, SECOND_NS) != GOOD:
        return OUTSIDE
    poke_all(out, ((hour * 60 + minute) * 60 + second) * SECOND_NS + peek_all(out))
    return GOOD


def read_moment(out: int, at: int, n: int) -> int:
    """A date, `-` and a time of day."""
    mark = n - 1
    while mark >= 0 and peek(at + mark) != ord("-"):
        mark -= 1
    if mark < 0 or place_of(ord(":"), at + mark + 1, n - mark - 1) == n - mark - 1:
        return MALFORMED
    status = read_day(out, at, mark)
    if status != GOOD:
        return status
    start = peek_all(out) * DAY_NS
    status = read_clock(out, at + mark + 1, n - mark - 1)
    if status != GOOD:
        return status
    if start > MOST - peek_all(out):
        return OUTSIDE
    poke_all(out, start + peek_all(out))
    return GOOD
