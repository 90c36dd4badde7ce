"""What the recorder of a PLC is told: everything that comes from outside and makes one run differ from another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from fbvm.wire.link import Event


class InputRecorder(Protocol):
    """Records the inputs of one PLC (`Plc.recorder`).  Each call of machine code that does several scans is told of once."""

    @property
    def wants_plain_scans(self) -> bool:
        """True if a unit cannot be run again, so that what its refreshes change has to be recorded."""

    def before(self, now_ns: int) -> None:
        """Called before scans, the first of which is at `now_ns`: what was changed from outside since the last one?

        Called again, without a scan in between, if machine code has done none."""

    def received(self, unit: int, events: Sequence[Event]) -> None:
        """Called with the events that the network has for a unit in the refresh of the last scan of this call."""

    def refresh_begins(self) -> None:
        """Called before an I/O refresh in Python."""

    def refresh_ended(self) -> None:
        """Called after an I/O refresh in Python."""

    def after(self, scans: int, now_ns: int, step_ns: int = 0) -> None:
        """Called after so many scans, 0 if there was none.  The first was at `now_ns`, each other one `step_ns` later."""

    def run_begins(self) -> None:
        """Called before scans between which nobody outside has a turn, so that nothing is changed from outside there."""

    def run_ends(self) -> None:
        """Called when these scans are over."""

    def changed(self) -> None:
        """Called when the state of the PLC was changed in a way that is no input: a start, another mode, a new unit, a scan that
        stood at a breakpoint."""
