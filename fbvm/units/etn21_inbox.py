"""The bytes that one socket of an ETN21 has received and its program has not fetched.

The unit's processor counts only; it says by number which bytes go to PLC memory.  Datagrams lie one behind the other."""

from __future__ import annotations

COUNTER = 0xFFFF_FFFF
"""Numbers begin again after this."""


class Inbox:
    """Bytes by number: the first one since power-on has number 0."""

    def __init__(self) -> None:
        self._first = 0
        """Number of the first that is here."""
        self._bytes = bytearray()

    def add(self, data: bytes) -> None:
        """What has come."""
        self._bytes += data

    def take(self, first: int, size_bytes: int) -> bytes:
        """So many from a number on; they and all before them are forgotten."""
        begin = first - self._first & COUNTER
        end = begin + size_bytes
        data = bytes(self._bytes[begin:end])
        del self._bytes[:end]
        self._first = self._first + end & COUNTER
        return data

    def forget(self) -> None:
        """Nobody wants what is here."""
        self.take(self._first, len(self._bytes))
