"""The string functions over bytes (IEC 61131-3 table 29): positions count from 1.

A negative length, or a position that does not exist in front of the text, raises Undefined."""

from __future__ import annotations

from fbvm.base.arithmetic import Undefined


def _least(low: int, *numbers: int) -> None:
    for number in numbers:
        if number < low:
            raise Undefined("R0108", number)


def left(a: bytes, n: int) -> bytes:
    """The first n characters."""
    _least(0, n)
    return a[:n]


def right(a: bytes, n: int) -> bytes:
    """The last n characters."""
    _least(0, n)
    return a[max(0, len(a) - n):]


def mid(a: bytes, n: int, p: int) -> bytes:
    """n characters from position p on."""
    _least(0, n)
    _least(1, p)
    return a[p - 1:p - 1 + n]


def insert(a: bytes, b: bytes, p: int) -> bytes:
    """b after character p of a, in front of it for 0, behind it if it is shorter."""
    _least(0, p)
    return a[:p] + b + a[p:]


def delete(a: bytes, n: int, p: int) -> bytes:
    """a without n characters from position p on."""
    return replace(a, b"", n, p)


def replace(a: bytes, b: bytes, n: int, p: int) -> bytes:
    """a with b in place of n characters from position p on; behind it if it is shorter."""
    _least(0, n)
    _least(1, p)
    return a[:p - 1] + b + a[p - 1 + n:]


def find(a: bytes, b: bytes) -> int:
    """Position of the first b in a; 0 if there is none or b is empty."""
    return a.find(b) + 1 if b else 0
