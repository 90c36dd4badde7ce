"""Real time for PLCs whose scans a debugger executes: it passes while scans are executed, and stands while none is."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import cast

from fbvm.machine.plc import Plc
from fbvm.wire.link import RealNetwork


class RealPace:
    """The pace of PLCs of which some have real connections."""

    def __init__(self, plcs: Sequence[Plc]) -> None:
        self._plcs = plcs
        found = {id(attached.network): attached.network for plc in plcs for attached in plc.units
                 if not attached.network.virtual_time}  # fmt: skip
        self._networks = cast("list[RealNetwork]", list(found.values()))
        self.begin()

    @property
    def is_real(self) -> bool:
        """True if one of the PLCs has a real connection."""
        return bool(self._networks)

    def begin(self) -> None:
        """Called when scans begin again: time goes on where it stood."""
        self._zero_ns = time.monotonic_ns() - max(plc.elapsed_ns for plc in self._plcs)

    def wait(self, due_ns: int) -> int:
        """Waits until `due_ns`, when a scan is due, and serves the networks; returns the time of the scan."""
        if (left_ns := due_ns - (time.monotonic_ns() - self._zero_ns)) > 0:
            time.sleep(left_ns / 1e9)
        now_ns = max(due_ns, time.monotonic_ns() - self._zero_ns)
        for network in self._networks:
            network.serve(now_ns)
        return now_ns
