"""Batches: scans of several PLCs at the same time by one call of machine code, which comes back for those that want something.

What a PLC's Python objects know of scans in a batch, their number and time, is brought up to date when it leaves: of ten
thousand PLCs, what a scan touches has left the processor's caches since the scan before, so the less the better."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fbvm.engine.native.scans.code import ALL_OVER
from fbvm.engine.native.scans.scans import CallAll, NativeScans
from fbvm.engine.trap import Trap
from fbvm.machine.fast.paths import FastPath
from fbvm.machine.plc import Plc


@dataclass(frozen=True)
class BatchPlace:
    """The place of a PLC in a batch: by which fast path it scans, its machine code, and from which time on (of its own, in ns)
    it has to scan by itself."""

    path: FastPath
    scans: NativeScans
    until_ns: int

    @property
    def call(self) -> CallAll:
        """The machine code, which all PLCs of a batch have in common."""
        return self.scans.call_all

    def finish(self, plc: Plc, now_ns: int, point: int) -> Trap | None:
        """Ends a scan at `now_ns` behind which somebody wants something: machine code has returned `point`."""
        self.scans.store_times()
        return plc.end_fast_scan(now_ns, self.path.finish(now_ns, point))

    def leave(self, plc: Plc, scans: int, now_ns: int) -> None:
        """Brings the PLC up to date after so many scans, the last at `now_ns`, behind which nobody wanted anything."""
        self.path.leave_batch(scans)
        if scans:
            plc.scans += scans
            plc.now_ns = now_ns


def place_of(plc: Plc) -> BatchPlace | None:
    """Prepares the next scans of a PLC for a batch; None if somebody has a part in them or has to be told between them."""
    if plc.watchers or plc.input_recorder or plc.trap or plc.servicing.is_needed or not (path := plc.fast_path()):
        return None
    entered = path.enter_batch(plc.elapsed_ns, plc.budget)
    return BatchPlace(path, *entered) if entered else None


class BatchScans:
    """The machine code of a batch: `rows` are the places of its PLCs, and how far the time of each is behind that of `scan`."""

    def __init__(self, rows: Sequence[tuple[BatchPlace, int]]) -> None:
        self._call = rows[0][0].call
        self._rows = array("q", [number for place, behind_ns in rows for number in (place.scans.parameters_at, behind_ns)])
        self._rows_at = self._rows.buffer_info()[0]
        self._count = len(rows)

    def scan(self, now_ns: int) -> Iterator[tuple[int, int]]:
        """One scan of each PLC.  Yields those that want something behind it: their number, and what machine code has returned."""
        first = 0
        while (answer := self._call(self._rows_at, first, self._count, now_ns)) != ALL_OVER:
            number, point = answer >> 32, answer & 0xFFFF_FFFF
            yield number, point - (1 << 32) if point >> 31 else point
            first = number + 1
