"""Messages of the Debug Adapter Protocol as bytes: a header with their length, and JSON.

No I/O here: bytes come in by `Framer.feed`, messages come out.  From the protocol's overview, "Base Protocol"."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

Message = dict[str, Any]
LONGEST_HEADER_BYTES = 4096
LONGEST_BODY_BYTES = 16 << 20
_END = b"\r\n\r\n"


class FramingError(ValueError):
    """The bytes are no messages; nothing that follows can be understood."""


class Framer:
    """Takes bytes in any pieces, and gives the messages that are complete."""

    def __init__(self) -> None:
        self._data = bytearray()

    def feed(self, data: bytes) -> Iterator[Message]:
        """The messages that these bytes complete.  Raises FramingError."""
        self._data += data
        while (message := self._next()) is not None:
            yield message

    @property
    def is_inside(self) -> bool:
        """True if a message has begun and not ended."""
        return bool(self._data)

    def _next(self) -> Message | None:
        end = self._data.find(_END)
        if end < 0:
            if len(self._data) > LONGEST_HEADER_BYTES:
                raise FramingError("a header without an end")
            return None
        size = _length(bytes(self._data[:end]))
        start = end + len(_END)
        if len(self._data) < start + size:
            return None
        body = bytes(self._data[start : start + size])
        del self._data[: start + size]
        try:
            message = json.loads(body.decode("utf-8"))
        except (ValueError, RecursionError) as error:  # also of a number with more digits than Python takes
            raise FramingError(f"a message that is no JSON: {error}") from None
        if not isinstance(message, dict):
            raise FramingError("a message that is no object")
        return message


def encode(message: Message) -> bytes:
    """The bytes of a message."""
    body = json.dumps(message, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "replace")
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


def _length(header: bytes) -> int:
    """The number of bytes that a header says.  Raises FramingError."""
    for line in header.split(b"\r\n"):
        name, _, value = line.partition(b":")
        if name.strip().lower() == b"content-length":
            text = value.strip()
            if not text.isdigit() or len(text) > 9 or int(text) > LONGEST_BODY_BYTES:
                raise FramingError(f"no length of a message: {text[:20].decode('ascii', 'replace')}")
            return int(text)
    raise FramingError("a header without Content-Length")
