"""When Python's garbage is collected while somebody types: not in front of an answer.

A collection of all generations looks at every tree and fact of a program, which takes tenths of a second; the young are small."""

from __future__ import annotations

import gc

NEVER = 1 << 30
MOST_CHECKS = 1000
"""Checks after which all is collected even if nobody pauses."""


class Garbage:
    """Collects all generations when the caller says that there is time.  Only one of these is in use in a process."""

    def __init__(self) -> None:
        self._before = gc.get_threshold()
        gc.set_threshold(*self._before[:2], NEVER)
        self._checks = 0

    def checked(self) -> None:
        """Called after each check."""
        self._checks += 1
        if self._checks >= MOST_CHECKS:
            self.collect()

    def end(self) -> None:
        """Lets Python collect all generations by itself again."""
        gc.set_threshold(*self._before)

    def collect(self) -> None:
        """Collects all."""
        self._checks = 0
        gc.collect()
