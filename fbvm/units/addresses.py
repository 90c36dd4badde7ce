"""IPv4 addresses as units show them: two words, the first octet in the high half of the first."""

from __future__ import annotations

from functools import lru_cache


def host_of(high: int, low: int) -> str:
    """The dotted address of two words.

    >>> host_of(0xC424, 0x2037)
    '196.36.32.55'"""
    return f"{high >> 8}.{high & 0xFF}.{low >> 8}.{low & 0xFF}"


@lru_cache(1024)
def words_of(host: str) -> tuple[int, int]:
    """The two words of a dotted address."""
    a, b, c, d = (int(part) for part in host.split("."))
    return a << 8 | b, c << 8 | d
