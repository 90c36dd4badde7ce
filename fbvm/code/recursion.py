"""Room for recursion deeper than Python's limit, which is one for all threads.

A limit that falls while a thread is deeper than it ends the process (Python 3.11, `Cannot recover from stack overflow`), so it
falls only when no thread needs room or is deep any more."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

_T = TypeVar("_T")

DEEPEST = 20_000
"""Python frames that suffice for the deepest tree, and the deepest code, that the parser lets through."""
_lock = threading.Lock()
_within = 0
"""How many `with` blocks there are now."""
_raisers = 0
"""How many of them need more than the usual limit."""
_usual = 0
"""The limit that holds when none of them does."""
_raised = 0
"""The limit that they have set; 0 for none."""


@contextmanager
def room(frames: int = DEEPEST) -> Iterator[None]:
    """Lets all threads have so many frames at least, inside the `with` block.

    A limit that somebody else has set meanwhile, as Hypothesis does, is left as it is."""
    global _within, _raisers, _usual, _raised
    with _lock:
        before = sys.getrecursionlimit()
        usual = _usual if _raisers or before == _raised else before
        raises = frames > usual
        if raises:
            _usual = usual
        if frames > before:
            sys.setrecursionlimit(frames)
            _raised = frames
        _within, _raisers = _within + 1, _raisers + raises
    try:
        yield
    finally:
        with _lock:
            _within, _raisers = _within - 1, _raisers - raises
            if not _raisers and sys.getrecursionlimit() == _raised and (not _within or _others_are_shallow()):
                sys.setrecursionlimit(_usual)
                _raised = 0


def _others_are_shallow() -> bool:
    """True if each other thread has no more than half of the usual frames."""
    own = threading.get_ident()
    return all(_depth(frame, _usual // 2) < _usual // 2 for thread, frame in sys._current_frames().items() if thread != own)


def _depth(frame: FrameType | None, most: int) -> int:
    """The number of frames of a thread, `most` at most."""
    count = 0
    while frame is not None and count < most:
        frame, count = frame.f_back, count + 1
    return count


def with_room(work: Callable[[], _T], frames: Callable[[], int]) -> _T:
    """Returns what `work()` returns; if that met the limit, calls it once more with room for `frames()`.

    For work that is hardly ever too deep, if it takes long to find out how deep it is."""
    with room(0):  # another thread that has more room restores the limit when this one is no longer deep
        try:
            return work()
        except RecursionError:
            with room(frames()):
                return work()


def keep_room(frames: int) -> None:
    """Lets all threads have so many frames at least from now on."""
    global _usual
    with _lock:
        _usual = max(_usual, frames)
        if frames > sys.getrecursionlimit():
            sys.setrecursionlimit(frames)
