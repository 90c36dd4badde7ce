"""The recent scans of a PLC, which can be executed again with a listener: the run itself needs no listener and stays fast.

A state is kept at least every `every` scans, and scans are executed again from there, without units and network: what
units changed is in the next state.  `mark_changed` announces a change from outside the program.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Protocol

from fbvm.base.memory import Snapshot
from fbvm.engine.choice.tiers import python_of
from fbvm.machine.plc import Phase, Plc, State
from fbvm.record.trace.events import Event, ObservedEngine


class Listener(Protocol):
    """Receives the phases and events of scans."""

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Called at the end of a phase."""

    def event(self, plc: Plc, event: Event) -> None:
        """Called for each event."""


@contextmanager
def observing(plc: Plc, listener: Listener) -> Iterator[None]:
    """Reports the events of all scans of `plc` to `listener` inside the `with` block."""
    program = plc.engine
    report = partial(listener.event, plc)
    if isinstance(program, ObservedEngine):
        report = partial(_both, program.report, report)
    plc.engine = ObservedEngine(plc.image, plc.memory, report, program)
    plc.phases.append(listener.phase)
    try:
        yield
    finally:
        plc.phases.remove(listener.phase)
        plc.engine = program


def _both(first: Callable[[Event], None], second: Callable[[Event], None], event: Event) -> None:
    first(event)
    second(event)


class History:
    """The last `keep` states of `plc` before scans."""

    def __init__(self, plc: Plc, every: int = 32, keep: int = 256) -> None:
        self._plc = plc
        self._every = every
        self._states: deque[State] = deque(maxlen=keep)
        self._changed = True
        self._substituted: list[int] = []
        self._substitute_results: deque[tuple[int, int, bytes]] = deque(maxlen=keep * every)
        self._ends: deque[tuple[int, Snapshot]] = deque(maxlen=keep)
        plc.watchers.append(self._scan_ended)

    def mark_changed(self) -> None:
        """Announces that the PLC has been changed from outside the program since its last scan."""
        self._changed = True

    def before_scan(self) -> None:
        """Keeps a state if one is due; to be called before each scan."""
        plc = self._plc
        if self._changed or plc.units or plc.scans - self._states[-1].scans >= self._every:
            self._states.append(plc.snapshot())
            self._changed = bool(plc.units)

    def _scan_ended(self, plc: Plc) -> None:
        """Keeps the memory after the I/O refresh, so that changes by units differ from writes before the next scan."""
        if plc.units:
            self._ends.append((plc.scans - 1, plc.memory.snapshot()))

    def substitute(self, body: int, function: Callable[[int], None]) -> None:
        """Executes a Python function in place of a body.  A replay does not call the function but restores what it wrote."""
        self._substituted.append(body)
        engine, memory, size = self._plc.engine, self._plc.memory, self._plc.image.bodies[body].instance_size

        def recorded(base: int) -> None:
            function(base)
            self._substitute_results.append((self._plc.scans, base, bytes(memory.map[base : base + size])))

        python_of(engine).substitute(body, recorded)

    @property
    def scans(self) -> range:
        """The scans that can be executed again."""
        return range(self._states[0].scans, self._plc.scans) if self._states else range(0)

    def at(self, scan: int) -> Plc:
        """A new PLC in the state before a scan, without units.  Raises ValueError if the scan is not kept."""
        replica = self._replica()
        self._advance_to(replica, scan)
        return replica

    def replay(self, scans: range, listener: Listener) -> None:
        """Executes scans again and reports their events to `listener`.  Scans after the last one are executed without inputs."""
        self.replay_with(scans, lambda replica: observing(replica, listener))

    def replay_with(self, scans: range, attached: Callable[[Plc], AbstractContextManager[object]]) -> None:
        """Executes scans again on a new PLC, inside the context that `attached` makes for this PLC."""
        scans = range(max(scans.start, self._states[0].scans if self._states else scans.stop), scans.stop)
        if not scans:
            return
        replica = self._replica()
        self._advance_to(replica, scans.start)
        states, ends = {state.scans: state for state in self._states}, dict(self._ends)

        def refresh(plc: Plc, phase: Phase) -> None:
            """Restores the changes by units after the program."""
            if phase is Phase.PROGRAM and plc.scans in ends:
                plc.memory.restore(ends[plc.scans])

        with attached(replica):
            replica.phases.append(refresh)
            for scan in scans:
                if scan in states and scan != scans.start:
                    replica.restore(states[scan])
                replica.scan()

    def _replica(self) -> Plc:
        plc = self._plc
        replica = Plc(plc.image, plc.cycle_ns, budget=plc.budget)
        for body in self._substituted:
            python_of(replica.engine).substitute(body, self._playback(replica))
        return replica

    def _playback(self, replica: Plc) -> Callable[[int], None]:
        """A function that writes into an instance what its substitute wrote in the same scan."""

        def play(base: int) -> None:
            for scan, at, data in self._substitute_results:
                if (scan, at) == (replica.scans, base):
                    replica.memory.u8[base : base + len(data)] = data

        return play

    def _advance_to(self, replica: Plc, scan: int) -> None:
        """Puts a PLC into the state before a scan."""
        before = [state for state in self._states if state.scans <= scan]
        if not before or scan > self._plc.scans:
            raise ValueError(f"scan {scan} is not kept; those from {self.scans.start} to {self._plc.scans} are")
        replica.restore(before[-1])
        while replica.scans < scan:
            replica.scan()
