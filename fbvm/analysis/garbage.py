"""When Python's garbage is collected while somebody types: not in front of an answer.

A collection of all generations looks at every tree and fact of a program, which takes tenths of a second; the young are small.
What a key leaves behind is old when it is free, so all are collected whenever memory has grown by a part."""

from __future__ import annotations

import gc
import sys

NEVER = 1 << 30
IN_A_PAUSE, AT_MOST = 1.25, 2.0
"""How many times as much memory as behind the last collection, counted in blocks of Python's allocator, there may be before all
is collected: when somebody pauses, and while keys come."""
LEAST_BLOCKS = 800_000
"""Blocks, some 50 MiB, from which on that counts: so many may come anew while keys come, a quarter of them up to a pause."""


class Garbage:
    """Collects all generations when the caller says that there is time.  Only one of these is in use in a process."""

    def __init__(self) -> None:
        self._before = gc.get_threshold()
        gc.set_threshold(*self._before[:2], NEVER)
        self._kept = sys.getallocatedblocks()

    def typed(self) -> None:
        """Called behind the answer to a key."""
        self._collect_above(AT_MOST)

    def checked(self) -> None:
        """Called behind the check of a whole program, when nobody has typed for a moment."""
        self._collect_above(IN_A_PAUSE)

    def end(self) -> None:
        """Lets Python collect all generations by itself again."""
        gc.set_threshold(*self._before)

    def collect(self) -> None:
        """Collects all."""
        gc.collect()
        self._kept = sys.getallocatedblocks()

    def _collect_above(self, times: float) -> None:
        if sys.getallocatedblocks() > self._kept + max(self._kept, LEAST_BLOCKS) * (times - 1):
            self.collect()
