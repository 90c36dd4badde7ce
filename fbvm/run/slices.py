"""Does work in slices of time, for those who look at their input between them."""

from __future__ import annotations

import time
from collections.abc import Callable

SLICE_NS = 20_000_000
TOLD_NS = 500_000_000


class Slices:
    """Calls `work`, which returns False when nothing is left, for at most 20 ms at a time; `tell` is called every half second."""

    def __init__(self, work: Callable[[], bool], tell: Callable[[], None]) -> None:
        self._work, self._tell = work, tell
        self._told_ns = time.monotonic_ns()

    def begin(self) -> None:
        """Called when there is new work: the first half second begins."""
        self._told_ns = time.monotonic_ns()

    def slice(self) -> None:
        """Does one slice."""
        began_ns = time.monotonic_ns()
        while self._work() and time.monotonic_ns() - began_ns < SLICE_NS:
            pass
        if time.monotonic_ns() - self._told_ns >= TOLD_NS:
            self._told_ns = time.monotonic_ns()
            self._tell()
