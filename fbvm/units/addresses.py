"""IPv4 addresses as units show them: two words, the first octet in the high half of the first."""

from __future__ import annotations

from functools import lru_cache

from fbvm.base.digits import whole_number


def host_of(high: int, low: int) -> str:
    """The dotted address of two words.

    >>> host_of(0xC424, 0x2037)
    '196.36.32.55'"""
    return f"{high >> 8}.{high & 0xFF}.{low >> 8}.{low & 0xFF}"


@lru_cache(1024)
def words_of(host: str) -> tuple[int, int]:
    """The two words of a dotted address.  Raises ValueError for a text that is none."""
    parts = host.split(".")
    if len(parts) != 4 or not all(part.isdecimal() and whole_number(part) < 256 for part in parts):
        raise ValueError(f'{host!r} is no IPv4 address; write "192.168.250.1"')
    a, b, c, d = map(int, parts)
    return a << 8 | b, c << 8 | d
