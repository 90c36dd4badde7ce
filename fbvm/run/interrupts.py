"""Delays Ctrl-C to the end of a scan: in the middle of one, bytes could be sent without the program knowing."""

from __future__ import annotations

import signal
from types import FrameType


class Interrupts:
    """A context in which Ctrl-C is noted for `check`.

    While the loop `waits`, and at the second Ctrl-C, KeyboardInterrupt is raised at once.  Does nothing outside the main
    thread, or if another handler of SIGINT is installed."""

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
        """From now on, until `waits` is set to False, Ctrl-C raises KeyboardInterrupt at once.  Raises one that was noted."""
        self.waits = True
        self.check()

    def check(self) -> None:
        """Raises KeyboardInterrupt if Ctrl-C was noted."""
        if self.noted:
            raise KeyboardInterrupt
