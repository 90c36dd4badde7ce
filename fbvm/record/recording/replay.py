"""Executes recorded scans again, on a second PLC with the same program, the same inputs and no network."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any, Protocol

from fbvm.base.areas import NEVER
from fbvm.engine.allowance import WHOLE_BUDGET, Allowance
from fbvm.engine.choice.tiers import again_choice, python_of
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc
from fbvm.machine.scan.refresh import Attached
from fbvm.record.recording.chunks import Chunk, ScanInputs, Write
from fbvm.record.recording.packed import unpacked
from fbvm.units.contract import AreaMemory, ResumableUnit, Unit
from fbvm.wire.link import Event, Request
from fbvm.wire.tap import Tap, TapEvent


class Recorded(Protocol):
    """What was recorded of a PLC."""

    @property
    def plc(self) -> Plc: ...

    @property
    def substituted(self) -> Sequence[int]: ...

    def chunk(self, scan: int) -> Chunk: ...

    def inputs(self, scan: int) -> ScanInputs | None: ...

    def now_ns(self, scan: int) -> int: ...

    def applying(self, scan: int) -> AbstractContextManager[None]: ...


class RecordedLink:
    """Network and link of a unit at once: tells what was recorded, and takes requests without doing anything."""

    virtual_time = True

    def __init__(self, address: str, tap: Tap | None) -> None:
        self.address, self.tap = address, tap
        self.told: list[Event] = []
        """What it tells in the next refresh."""
        self.traffic: Sequence[tuple[int, str, TapEvent]] = ()
        """What its tap is told then."""

    @property
    def is_quiet(self) -> bool:
        """True if it has nothing to tell."""
        return not self.told and not self.traffic

    def attach(self, address: str) -> RecordedLink:
        return self

    def pass_by(self, refreshes: int) -> None:
        """It counts no refreshes."""

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        """What they led to was recorded."""

    def events(self, now_ns: int) -> list[Event]:
        told, self.told = self.told, []
        if self.tap:
            for passed in self.traffic:
                self.tap(*passed)
        self.traffic = ()
        return told

    def close(self) -> None:
        """There is nothing to end."""


class RecordedRefresh:
    """Stands for a unit whose refreshes cannot be done again: writes what they changed."""

    watched: Sequence[tuple[str, int]] = ()
    exchanged = None
    changed_words = False

    def __init__(self, plc: Plc, unit: Unit) -> None:
        self._plc = plc
        self.name, self.address = unit.name, unit.address
        self.descriptions = getattr(unit, "descriptions", {})
        self.meanings = getattr(unit, "meanings", {})
        self.configuration: dict[str, Any] = {}
        self.settings: dict[str, Any] = {}
        self.writes: Sequence[Write] = ()
        """What the next refresh changes."""

    @property
    def wake_ns(self) -> int:
        """0 if it has something to write, else NEVER."""
        return 0 if self.writes else NEVER

    def reset(self, memory: AreaMemory) -> list[Request]:
        return []

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        write(self._plc, self.writes)
        self.writes = ()
        return []


class Replay:
    """A PLC that executes the scans of a recording again, from the keyframe before `scan` on.  `plc` is between two scans."""

    def __init__(self, recorded: Recorded, scan: int) -> None:
        self._recorded = recorded
        source, chunk = recorded.plc, recorded.chunk(scan)
        self._engine = again_choice(source.image, source.engine_choice, bool(recorded.substituted))
        if chunk.machine and self._engine == "auto" and native.available():
            self._engine = "native"  # between keyframes are more scans than Python does in that time
        self.plc = Plc(source.image, source.cycle_ns, budget=chunk.budget, engine=self._engine)
        self._links: list[RecordedLink] = []
        self._refreshes: list[RecordedRefresh] = []
        self._loaded: Chunk | None = None
        self._results: deque[tuple[int, bytes]] = deque()
        for body in recorded.substituted:
            python_of(self.plc.engine).substitute(body, self._play_back)
        with recorded.applying(chunk.first):
            self._load(chunk)

    def advance(self, scan: int) -> None:
        """Executes scans up to the one before `scan`, as fast as that can be done; the PLC is in the state before `scan` then."""
        self.execute(scan)
        self._enter()

    def execute(self, scan: int) -> None:
        """Executes scans up to the one before `scan`, as fast as that can be done; the PLC is in the state that this one left."""
        plc = self.plc
        while plc.scans < scan:
            if not self.many(scan):
                self.scan()
        plc.cycle_ns = self._recorded.plc.cycle_ns

    def many(self, scan: int) -> bool:
        """Executes scans up to one before `scan` at once, as far as they have no inputs; returns False if there is none."""
        most = self._regular(scan)
        return most > 1 and self.plc.scan_many(most)

    def scan(self) -> None:
        """Executes one scan with its inputs, or goes on with one that stands at a breakpoint."""
        plc, number = self.plc, self.plc.scans
        if plc.halted:
            plc.scan()
        else:
            self._enter()
            with self._recorded.applying(number):
                self._begin(number)
        if plc.halted:
            return
        self._results.clear()
        if plc.engine.allowance is not WHOLE_BUDGET:
            plc.engine.allowance = WHOLE_BUDGET

    def _begin(self, number: int) -> None:
        """Executes a scan with its inputs."""
        recorded, plc = self._recorded, self.plc
        if inputs := recorded.inputs(number):
            self._apply(inputs)
        plc.scan(recorded.now_ns(number))

    def _enter(self) -> None:
        """Puts the PLC into the state of the keyframe before the next scan, if the scan before does not lead to that."""
        chunk = self._recorded.chunk(self.plc.scans)
        if chunk is not self._loaded and chunk.first == self.plc.scans and not chunk.follows:
            with self._recorded.applying(chunk.first):
                self._load(chunk)

    def leave(self) -> None:
        """Takes the units off, so that the PLC goes on alone."""
        self.plc.units.clear()

    def _regular(self, scan: int) -> int:
        """How many scans without inputs follow one another from here to `scan` in equal steps, which `plc.cycle_ns` then is."""
        plc, number = self.plc, self.plc.scans
        chunk = self._recorded.chunk(number)
        if number >= chunk.times.end or chunk.first == number:
            return 0
        count, step_ns = chunk.times.regular(number)
        if count > 1:
            plc.cycle_ns = step_ns
        with_inputs = chunk.next_with_inputs(number)
        last = min(scan, number + count, scan if with_inputs is None else with_inputs)
        return last - number if chunk.times.at(number) == plc.elapsed_ns else 0

    def _load(self, chunk: Chunk) -> None:
        """Puts the PLC into the state of a keyframe."""
        plc, self._loaded = self.plc, chunk
        plc.budget = chunk.budget
        tap = self._links[0].tap if self._links else None
        self._links = [RecordedLink(frame.unit.address, tap) for frame in chunk.units]
        self._refreshes, units = [], list[Unit]()
        for frame in chunk.units:
            if frame.state is None:
                self._refreshes.append(refresh := RecordedRefresh(plc, frame.unit))
                units.append(refresh)
            else:
                units.append(type(frame.unit)(**frame.unit.configuration))
        attached = [Attached(unit, link, link) for unit, link in zip(units, self._links, strict=True)]
        plc.resume(replace(chunk.state, memory=unpacked(chunk.state.memory)), attached)
        for row, frame in zip(attached, chunk.units, strict=True):
            if row.own:
                row.own.run_on(self._engine)
            if frame.state and isinstance(row.unit, ResumableUnit):
                memory = frame.state.memory
                row.unit.resume(replace(frame.state, memory=memory and unpacked(memory)), plc.memory)

    def _apply(self, inputs: ScanInputs) -> None:
        plc = self.plc
        for number, settings in inputs.settings.items():
            plc.units[number].unit.settings = settings
        if inputs.forces is not None:
            self._force(inputs.forces)
        if inputs.budget is not None:
            plc.budget = inputs.budget
        if inputs.watch is not None:
            steps, plc.watch_cycle.time_ns = inputs.watch
            plc.engine.allowance = Allowance(max(0, plc.budget - steps + 1))
        write(plc, inputs.writes)
        for number, events in inputs.events.items():
            self._links[number].told = list(events)
        for link in self._links[:1]:  # one of them has all of it, in its order
            link.traffic = inputs.traffic if link.tap else ()
        for refresh in self._refreshes[-1:]:
            refresh.writes = inputs.refreshed
        self._results.extend(inputs.results)

    def _force(self, forces: Mapping[str, Any]) -> None:
        """Changes what is forced, but not the memory: what a force wrote at once is among the writes."""
        before = self.plc.memory.snapshot()
        self.plc.unforce()
        for name, value in forces.items():
            self.plc.force(name, value)
        self.plc.memory.restore(before)

    def _play_back(self, base: int) -> None:
        """Writes into an instance what Python left there in the recorded scan."""
        if self._results and self._results[0][0] == base:
            write(self.plc, [self._results.popleft()])


def write(plc: Plc, writes: Iterable[tuple[int, bytes]]) -> None:
    """Writes bytes into the memory of a PLC."""
    for offset, data in writes:
        plc.memory.u8[offset : offset + len(data)] = data
