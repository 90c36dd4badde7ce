"""Ctrl-C takes effect between two scans, or while nobody does anything: what is half sent would be forgotten else."""

from __future__ import annotations

import signal
from types import FrameType


class Interrupts:
    """While it is entered, Ctrl-C is noted; it is KeyboardInterrupt at once while the loop `waits`, and the second time.

    Does nothing outside the main thread, or where somebody else has a say in Ctrl-C."""

    def __init__(self) -> None:
        self.noted = False
        self.waits = False
        self._is_ours = False

    def __enter__(self) -> Interrupts:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            try:
                signal.signal(signal.SIGINT, self._come)
                self._is_ours = True
            except ValueError:  # another thread than the main one
                pass
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _come(self, number: int, frame: FrameType | None) -> None:
        if self.waits or self.noted:
            raise KeyboardInterrupt
        self.noted = True

    def begin_wait(self) -> None:
        """From now on until `waits` is set back it takes effect at once."""
        self.waits = True
        self.check()

    def check(self) -> None:
        """Raises KeyboardInterrupt if one has come."""
        if self.noted:
            raise KeyboardInterrupt
