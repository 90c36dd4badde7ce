"""What an ETN21 has received and its program has not fetched, one inbox a socket.

The unit's processor counts only; it says by number which bytes, or which datagram, go to PLC memory."""

from __future__ import annotations

COUNTER = 0xFFFF_FFFF
"""Numbers begin again after this."""


class Stream:
    """Bytes of a connection, of which the first has this number."""

    def __init__(self, first: int) -> None:
        self._first = first
        self._bytes = bytearray()

    def add(self, data: bytes) -> None:
        """What has come."""
        self._bytes += data

    def take(self, first: int, size_bytes: int) -> bytes:
        """Those from a number on; they and all before them are forgotten."""
        begin = first - self._first & COUNTER
        end = begin + size_bytes
        data = bytes(self._bytes[begin:end])
        del self._bytes[:end]
        self._first = self._first + end & COUNTER
        return data


class Datagrams:
    """Datagrams, of which the first has this number."""

    def __init__(self, first: int) -> None:
        self._first = first
        self._datagrams: list[bytes] = []

    def add(self, data: bytes) -> None:
        """Another has come."""
        self._datagrams.append(data)

    def take(self, first: int, size_bytes: int) -> bytes:
        """The beginning of the one with this number; it and all before it are forgotten."""
        place = first - self._first & COUNTER
        data = self._datagrams[place][:size_bytes]
        del self._datagrams[: place + 1]
        self._first = first + 1 & COUNTER
        return data
