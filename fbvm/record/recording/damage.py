"""Errors that data of another form raise, as one sentence about the file that holds them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager

from fbvm.record.recording.container import RecordingError


@contextmanager
def damages(sentence: str) -> Iterator[None]:
    """For a `with` block that reads data which may have any form: what that raises is a RecordingError that begins with the
    sentence."""
    try:
        yield
    except RecordingError:
        raise
    except RecursionError:
        raise RecordingError(f"{sentence}: it is nested too deeply") from None
    except (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, BufferError, MemoryError, StopIteration,
            struct.error) as error:  # fmt: skip
        raise RecordingError(f"{sentence}: {error}") from None
