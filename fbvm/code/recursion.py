"""Room for recursion deeper than Python's limit, which is one for all threads.

A limit that falls while a thread is deeper than it ends the process (Python 3.11, `Cannot recover from stack overflow`), so it
falls only when no thread needs room any more."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

_T = TypeVar("_T")

DEEPEST = 20_000
"""Python frames that suffice for the deepest tree, and the deepest code, that the parser lets through."""
_lock = threading.Lock()
_within = 0
"""How many `with` blocks have room now."""
_usual = 0
"""The limit that holds when there are none."""


@contextmanager
def room(frames: int = DEEPEST) -> Iterator[None]:
    """Lets all threads have so many frames at least, inside the `with` block."""
    global _within, _usual
    with _lock:
        if not _within:
            _usual = sys.getrecursionlimit()
        _within += 1
        sys.setrecursionlimit(max(sys.getrecursionlimit(), frames))
    try:
        yield
    finally:
        with _lock:
            _within -= 1
            if not _within:
                sys.setrecursionlimit(_usual)


def with_room(work: Callable[[], _T], frames: Callable[[], int]) -> _T:
    """Returns what `work()` returns; if that met the limit, calls it once more with room for `frames()`.

    For work that is hardly ever too deep, if it takes long to find out how deep it is."""
    with room(0):  # while another thread has more room, it may become deep here without meeting any limit
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
        sys.setrecursionlimit(max(sys.getrecursionlimit(), frames))
