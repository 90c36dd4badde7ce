"""The routine that `from_text` calls, in the subset that `library.subset` translates: any literal, with or without prefix."""

from __future__ import annotations

from fbvm.engine.native.library.reading import (
    CANONICAL_NAN,
    DATE,
    DT,
    GOOD,
    LREAL,
    MALFORMED,
    OUTSIDE,
    REAL,
    SIGN,
    STRING,
    TIME,
    TOD,
    kind_of,
    place_of,
    read_number,
    says,
)
from fbvm.engine.native.library.routines import INFINITE
from fbvm.engine.native.library.subset import data, peek, poke_all
from fbvm.engine.native.library.times import read_clock, read_date, read_duration, read_moment
from fbvm.syntax.st.texts import LEADING


def read_special(out: int, at: int, n: int) -> int:
    """What no literal can say: NaN and the infinite numbers."""
    bits = 0
    if says(at, n, data(b"NAN")):
        bits = CANONICAL_NAN
    elif says(at, n, data(b"INF")) or says(at, n, data(b"+INF")):
        bits = INFINITE
    elif says(at, n, data(b"-INF")):
        bits = INFINITE | SIGN
    else:
        return MALFORMED
    poke_all(out, bits)
    return GOOD


def read_bool(out: int, at: int, n: int) -> int:
    if says(at, n, data(b"TRUE")) or says(at, n, data(b"1")):
        poke_all(out, 1)
    elif says(at, n, data(b"FALSE")) or says(at, n, data(b"0")):
        poke_all(out, 0)
    else:
        return MALFORMED
    return GOOD


def read_typed(out: int, kind: int, at: int, n: int) -> int:
    """What stands behind the prefix of a type."""
    if kind == STRING:
        return MALFORMED
    if kind >= DT:
        return read_moment(out, at, n)
    if kind >= TOD:
        return read_clock(out, at, n)
    if kind >= DATE:
        return read_date(out, at, n)
    if kind >= TIME:
        return read_duration(out, at, n)
    if kind == 0:
        return read_bool(out, at, n)
    return read_number(out, kind, at, n)


def read_leading(out: int, wanted: int, whole: int, at: int, n: int) -> int:
    """The value of the longest literal that a text begins with, or if `whole` that it is; 0 if there is none."""
    if whole == 0 and n > LEADING:
        n = LEADING
    while n > 0:
        status = read_value(out, wanted, at, n)
        if status == GOOD:
            return GOOD
        n -= 1
        if whole != 0 or status == OUTSIDE:
            n = 0
    poke_all(out, 0)
    return GOOD


def read_value(out: int, wanted: int, at: int, n: int) -> int:
    """The value of the wanted type that a text names; spaces around it do not count."""
    while n > 0 and peek(at) == ord(" "):
        at += 1
        n -= 1
    while n > 0 and peek(at + n - 1) == ord(" "):
        n -= 1
    kind = wanted
    mark = place_of(ord("#"), at, n)
    if mark < n:
        kind = kind_of(at, mark)
        if kind < 0:
            kind = wanted
        else:
            at += mark + 1
            n -= mark + 1
    if kind == wanted and REAL <= kind <= LREAL and read_special(out, at, n) == GOOD:
        return GOOD
    status = read_typed(out, kind, at, n)
    if status == GOOD and kind != wanted:
        return MALFORMED
    return status
