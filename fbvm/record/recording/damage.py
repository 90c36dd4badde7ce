"""Errors that data of another form raise, as one sentence about the file that holds them."""

from __future__ import annotations

import struct
from types import TracebackType

from fbvm.record.recording.container import RecordingError

DAMAGES = (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, BufferError, MemoryError, StopIteration,
           struct.error)  # fmt: skip
"""What data of another form raises where it is read."""


class damages:
    """For a `with` block that reads data which may have any form: what that raises is a RecordingError that begins with the
    sentence.  A class, since a generator takes three times as long and there is one for each scan that is executed again."""

    __slots__ = ("_sentence",)

    def __init__(self, sentence: str) -> None:
        self._sentence = sentence

    def __enter__(self) -> None:
        """Nothing to prepare."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if error is None or isinstance(error, RecordingError):
            return
        if isinstance(error, RecursionError):
            raise RecordingError(f"{self._sentence}: it is nested too deeply") from None
        if isinstance(error, DAMAGES):
            raise RecordingError(f"{self._sentence}: {error}") from None
