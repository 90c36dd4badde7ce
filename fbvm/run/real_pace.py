"""Real time for a PLC whose scans a debugger executes: it passes while scans are executed, and stands while none is."""

from __future__ import annotations

import time
from typing import cast

from fbvm.machine.plc import Plc
from fbvm.wire.link import RealNetwork


class RealPace:
    """The pace of one PLC with real connections."""

    def __init__(self, plc: Plc) -> None:
        self._plc = plc
        found = {id(attached.network): attached.network for attached in plc.units if not attached.network.virtual_time}
        self._networks = cast("list[RealNetwork]", list(found.values()))
        self.begin()

    @property
    def is_real(self) -> bool:
        """True if the PLC has a real connection."""
        return bool(self._networks)

    def begin(self) -> None:
        """Called when scans begin again: time goes on where it stood."""
        self._zero_ns = time.monotonic_ns() - self._plc.elapsed_ns

    def wait(self) -> int:
        """Waits until the next scan is due, and serves the networks; returns the time of the scan."""
        due_ns = self._plc.elapsed_ns
        if (left_ns := due_ns - (time.monotonic_ns() - self._zero_ns)) > 0:
            time.sleep(left_ns / 1e9)
        now_ns = max(due_ns, time.monotonic_ns() - self._zero_ns)
        for network in self._networks:
            network.serve(now_ns)
        return now_ns

