"""What a recording keeps of one PLC: keyframes, and behind each the times and the inputs of the scans that follow."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.memory import Snapshot
from fbvm.machine.state import State
from fbvm.record.recording.packed import PackedSnapshot
from fbvm.units.contract import Unit, UnitState
from fbvm.watch.values import Value
from fbvm.wire.link import Event, Received
from fbvm.wire.tap import TapEvent

Write = tuple[int, bytes]
"""Bytes that were written: the offset in the flat memory, and the new bytes."""
SMALL_BYTES = 200
"""About what a keyframe, or the inputs of one scan, take beside pages and data."""


_NOTHING: Mapping[Any, Any] = MappingProxyType({})


@dataclass(slots=True)
class ScanInputs:
    """What came from outside in one scan, beside its time; a scan without any has none of these.

    A recording has thousands of them: what is rare shares one empty value."""

    scan: int
    writes: Sequence[Write] = ()
    """What was written into the memory before the scan."""
    forces: Mapping[str, Value] | None = None
    """What is forced from this scan on; None if that is what was forced before."""
    budget: int | None = None
    """How many statements a scan may execute from this one on; None for as many as before."""
    settings: Mapping[int, dict[str, Any]] = field(default_factory=lambda: _NOTHING)
    """How units are set from this scan on, by their numbers."""
    events: dict[int, list[Event]] = field(default_factory=dict)
    """What the network told units in the I/O refresh, by their numbers."""
    results: Sequence[Write] = ()
    """What Python functions in place of blocks left in their instances, in the order of their calls."""
    traffic: list[tuple[int, str, TapEvent]] = field(default_factory=list)
    """What passed the networks at the units of this PLC: time, address of the unit, event."""
    watch: tuple[int, int] | None = None
    """Of a scan that took longer than the watch cycle time: the steps that it had charged, and that time in ns."""
    refreshed: Sequence[Write] = ()
    """What the I/O refresh changed, if the units of this PLC cannot be run again."""

    @property
    def is_empty(self) -> bool:
        """True if nothing came from outside."""
        found = self.writes or self.settings or self.events or self.results or self.refreshed or self.traffic
        return not found and self.forces is None and self.budget is None and self.watch is None

    @property
    def size_bytes(self) -> int:
        """About how many bytes of memory this takes."""
        parts, data = 1 + len(self.traffic), 0
        if self.writes or self.results or self.refreshed:
            data += sum(len(written) for rows in (self.writes, self.results, self.refreshed) for _, written in rows)
        for told in self.events.values():
            parts += len(told)
            for event in told:
                if isinstance(event, Received):
                    data += len(event.data)
        for _, _, passed in self.traffic:
            data += len(passed.data)
        return SMALL_BYTES * parts + data


class Times:
    """The times of consecutive scans from number `first` on; those that follow one another in equal steps take one row."""

    def __init__(self, first: int) -> None:
        self.end = first
        """The number behind the last scan."""
        self._scans, self._times_ns, self._steps_ns = array("q"), array("q"), array("q")
        self._last_ns = self._count = 0
        """Time of the last scan, and how many scans the last row has."""

    def add(self, now_ns: int, scans: int = 1, step_ns: int = 0) -> None:
        """Adds some scans: the first at `now_ns`, each other one `step_ns` after the one before."""
        step = now_ns - self._last_ns
        fits = scans == 1 or step == step_ns
        if self._count == 1 and fits:
            self._steps_ns[-1] = step
        elif not self._count or not fits or step != self._steps_ns[-1]:
            self._scans.append(self.end)
            self._times_ns.append(now_ns)
            self._steps_ns.append(step_ns)
            self._count = 0
        self._count += scans
        self.end += scans
        self._last_ns = now_ns + (scans - 1) * step_ns

    def at(self, scan: int) -> int:
        """The time of a scan."""
        row = bisect_right(self._scans, scan) - 1
        return self._times_ns[row] + (scan - self._scans[row]) * self._steps_ns[row]

    def regular(self, scan: int) -> tuple[int, int]:
        """How many scans, this one among them, follow one another in equal steps, and the step."""
        row = bisect_right(self._scans, scan)
        end = self._scans[row] if row < len(self._scans) else self.end
        return end - scan, self._steps_ns[row - 1]

    def rows(self, first: int) -> list[list[int]]:
        """The times of the scans from number `first` on, in rows: scan, its time, the step to those that follow, how many."""
        made, scan = [], first
        while scan < self.end:
            count, step_ns = self.regular(scan)
            made.append([scan, self.at(scan), step_ns, count])
            scan += count
        return made

    def cut(self, scan: int) -> None:
        """Forgets this scan and those behind it."""
        rows = bisect_left(self._scans, scan)
        del self._scans[rows:], self._times_ns[rows:], self._steps_ns[rows:]
        self.end = min(self.end, scan)
        self._count = self.end - self._scans[-1] if rows else 0
        self._last_ns = self.at(self.end - 1) if rows else 0

    @property
    def size_bytes(self) -> int:
        """How many bytes the rows take."""
        return 3 * 8 * len(self._scans)


@dataclass(frozen=True)
class UnitKeyframe:
    """A unit between two scans: the unit, from which another of its class is made, and its state; None if its refreshes are
    recorded instead."""

    unit: Unit
    state: UnitState | None


class Chunk:
    """A keyframe, and the scans up to the next one.

    `units` are the units on the backplane.  `follows` is True if the scans before lead to this keyframe; else the state was
    changed in between."""

    def __init__(self, state: State, units: Sequence[UnitKeyframe], budget: int, follows: bool) -> None:
        self.state, self.units, self.budget, self.follows = state, units, budget, follows
        self.times = Times(state.scans)
        self.numbers: list[int] = []
        """The numbers of the scans that have inputs."""
        self.inputs: list[ScanInputs] = []
        """Of each of them."""
        self.inputs_bytes = 0
        self.machine = False
        """True if machine code did some of the scans."""

    @property
    def first(self) -> int:
        """The number of the first scan."""
        return self.state.scans

    def add(self, inputs: ScanInputs) -> None:
        """Adds the inputs of a scan behind those that are there."""
        self.numbers.append(inputs.scan)
        self.inputs.append(inputs)
        self.inputs_bytes += inputs.size_bytes

    def next_with_inputs(self, scan: int) -> int | None:
        """The number of this scan, or of the next one, that has inputs."""
        at = bisect_left(self.numbers, scan)
        return self.numbers[at] if at < len(self.numbers) else None

    def inputs_of(self, scan: int) -> ScanInputs | None:
        """The inputs of a scan."""
        at = bisect_left(self.numbers, scan)
        return self._inputs_at(at) if at < len(self.numbers) and self.numbers[at] == scan else None

    def _inputs_at(self, at: int) -> ScanInputs:
        return self.inputs[at]

    def cut(self, scan: int) -> None:
        """Forgets this scan and those behind it."""
        self.times.cut(scan)
        at = bisect_left(self.numbers, scan)
        del self.numbers[at:], self.inputs[at:]

    def pack(self, base: Chunk) -> None:
        """Keeps of its memories what differs from those of `base`, an earlier chunk that is not packed, as long as both have the
        same ones."""
        known = base.memories
        own = self.memories
        if [len(snapshot.pages) for snapshot in known] != [len(snapshot.pages) for snapshot in own]:
            return
        packed = iter([PackedSnapshot(new, old) for new, old in zip(own, known, strict=True)])
        self.state = replace(self.state, memory=next(packed))
        self.units = [UnitKeyframe(frame.unit, replace(frame.state, memory=next(packed))) if frame.state and frame.state.memory
                      else frame for frame in self.units]  # fmt: skip

    @property
    def memories(self) -> list[Snapshot]:
        """The memory of the PLC, then those of units with processors that are on."""
        return [self.state.memory, *(unit.state.memory for unit in self.units if unit.state and unit.state.memory)]

    def size_bytes(self, before: Chunk | None) -> int:
        """About how many bytes this takes, without the pages that it shares with the chunk before."""
        known = before.memories if before else []
        pages = sum(_pages(new, known[number] if number < len(known) else None) for number, new in enumerate(self.memories))
        return pages + SMALL_BYTES + self.inputs_bytes + self.times.size_bytes


def _pages(new: Snapshot, old: Snapshot | None) -> int:
    """The bytes that a snapshot takes beside another one."""
    base = old.base if isinstance(old, PackedSnapshot) else old
    if isinstance(new, PackedSnapshot):
        return new.size_bytes + (0 if new.base is base else _pages(new.base, None))
    if base is None or len(base.pages) != len(new.pages):
        return 8 * len(new.pages) + PAGE_BYTES * sum(page is not None for page in new.pages)
    return 8 * len(new.pages) + PAGE_BYTES * sum(
        page is not known and page is not None for page, known in zip(new.pages, base.pages, strict=True))
