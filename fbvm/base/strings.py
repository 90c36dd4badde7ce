"""The string functions over characters (IEC 61131-3 table 34): positions count from 1.

A STRING is `bytes`, a WSTRING a `str` with one character for each unit of UTF-16, so that lengths and positions count
units.  A negative length, or a position that does not exist in front of the text, raises Undefined."""

from __future__ import annotations

import re
from typing import AnyStr

from fbvm.base.arithmetic import Undefined


def _least(low: int, *numbers: int) -> None:
    for number in numbers:
        if number < low:
            raise Undefined("R0108", number)


def left(a: AnyStr, n: int) -> AnyStr:
    """The first n characters."""
    _least(0, n)
    return a[:n]


def right(a: AnyStr, n: int) -> AnyStr:
    """The last n characters."""
    _least(0, n)
    return a[max(0, len(a) - n):]


def mid(a: AnyStr, n: int, p: int) -> AnyStr:
    """n characters from position p on."""
    _least(0, n)
    _least(1, p)
    return a[p - 1:p - 1 + n]


def insert(a: AnyStr, b: AnyStr, p: int) -> AnyStr:
    """b after character p of a, in front of it for 0, behind it if it is shorter."""
    _least(0, p)
    return a[:p] + b + a[p:]


def delete(a: AnyStr, n: int, p: int) -> AnyStr:
    """a without n characters from position p on."""
    return replace(a, a[:0], n, p)


def replace(a: AnyStr, b: AnyStr, n: int, p: int) -> AnyStr:
    """a with b in place of n characters from position p on; behind it if it is shorter."""
    _least(0, n)
    _least(1, p)
    return a[:p - 1] + b + a[p - 1 + n:]


def find(a: AnyStr, b: AnyStr) -> int:
    """Position of the first b in a; 0 if there is none or b is empty."""
    return a.find(b) + 1 if b else 0


_PAIR = re.compile("[\ud800-\udbff][\udc00-\udfff]")
"""The two units of a character beyond 16#FFFF."""


def characters(a: str) -> int:
    """The number of characters of a WSTRING, in which one beyond 16#FFFF has two units."""
    return len(a) - len(_PAIR.findall(a))


def units_of(a: str, n: int) -> int:
    """How many units the first n characters of a WSTRING have; all of them if it has fewer, n itself if that is negative."""
    if n <= 0:
        return n
    for pair in _PAIR.finditer(a):
        if pair.start() >= n:
            break
        n += 1
    return min(n, len(a))


# --- characters of two widths ---------------------------------------------------------------------------------------


def units(data: bytes) -> str:
    """UTF-16, low byte first, as one character for each unit."""
    text = data.decode("utf-16-le", "surrogatepass")
    if text.isascii() or max(text) <= "\uffff":
        return text
    return "".join(map(chr, memoryview(data).cast("H")))


def packed(text: str) -> bytes:
    """The same as UTF-16, low byte first; a character beyond 16 bits becomes two units."""
    return text.encode("utf-16-le", "surrogatepass")


def character(code: int, wide: bool) -> bytes | str:
    """The text of one character; the code 0 ends a text and gives none."""
    if wide:
        return chr(code) if code else ""
    return bytes((code,)) if code else b""


def first(text: bytes | str) -> int:
    """The code of the first character; 0 if there is none."""
    return ord(text[:1]) if text else 0


def widened(a: bytes) -> str:
    """A STRING as WSTRING: Latin-1 is the beginning of Unicode."""
    return a.decode("latin-1")


def narrowed(a: str) -> bytes:
    """A WSTRING as STRING; a unit above 255 becomes `?`."""
    return a.encode("latin-1", "replace")
