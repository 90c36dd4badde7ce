"""The recent scans of a PLC, to be done again under observation: a run stays fast until somebody wants to see inside.

Keeps states from which scans follow, a state at least every `every` scans.  Doing again needs no units and no network:
what they changed stands in the next state.  What is written from outside must be announced with `mark_changed`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Protocol

from fbvm.base.memory import Snapshot
from fbvm.engine.tiers import python_of
from fbvm.machine.plc import Phase, Plc, State
from fbvm.record.trace.events import Event, ObservedEngine


class Listener(Protocol):
    """Who is told what happens inside scans."""

    def phase(self, plc: Plc, phase: Phase) -> None:
        """A phase of a scan is over."""

    def event(self, plc: Plc, event: Event) -> None:
        """Something happened in the program."""


@contextmanager
def observing(plc: Plc, listener: Listener) -> Iterator[None]:
    """Tells a listener all that happens inside the scans of `plc` meanwhile."""
    program = plc.engine
    tell = partial(listener.event, plc)
    if isinstance(program, ObservedEngine):
        tell = partial(_both, program.report, tell)
    plc.engine = ObservedEngine(plc.image, plc.memory, tell, program)
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
    """States of `plc` before its scans, `keep` of them, the oldest forgotten first."""

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
        """Something outside the program changed the PLC since its last scan."""
        self._changed = True

    def before_scan(self) -> None:
        """To be called before each scan."""
        plc = self._plc
        if self._changed or plc.units or plc.scans - self._states[-1].scans >= self._every:
            self._states.append(plc.snapshot())
            self._changed = bool(plc.units)

    def _scan_ended(self, plc: Plc) -> None:
        """What units changed is told apart from what is written before the next scan."""
        if plc.units:
            self._ends.append((plc.scans - 1, plc.memory.snapshot()))

    def substitute(self, body: int, function: Callable[[int], None]) -> None:
        """Python in place of a body, which is not called again when scans are: what it did is played back."""
        self._substituted.append(body)
        engine, memory, size = self._plc.engine, self._plc.memory, self._plc.image.bodies[body].instance_size

        def noted(base: int) -> None:
            function(base)
            self._substitute_results.append((self._plc.scans, base, bytes(memory.map[base : base + size])))

        python_of(engine).substitute(body, noted)

    @property
    def scans(self) -> range:
        """The scans that can be done again."""
        return range(self._states[0].scans, self._plc.scans) if self._states else range(0)

    def at(self, scan: int) -> Plc:
        """A PLC in the state before a scan, without units.  Raises ValueError if the scan is not kept."""
        twin = self._twin()
        self._advance_to(twin, scan)
        return twin

    def replay(self, scans: range, listener: Listener) -> None:
        """Does scans again; the listener looks inside.  Beyond the last one it goes on as if nobody did anything."""
        self.replay_with(scans, lambda twin: observing(twin, listener))

    def replay_with(self, scans: range, attached: Callable[[Plc], AbstractContextManager[object]]) -> None:
        """Does scans again on a PLC to which something is attached meanwhile."""
        scans = range(max(scans.start, self._states[0].scans if self._states else scans.stop), scans.stop)
        if not scans:
            return
        twin = self._twin()
        self._advance_to(twin, scans.start)
        states, ends = {state.scans: state for state in self._states}, dict(self._ends)

        def refresh(plc: Plc, phase: Phase) -> None:
            """What the units did comes after the program."""
            if phase is Phase.PROGRAM and plc.scans in ends:
                plc.memory.restore(ends[plc.scans])

        with attached(twin):
            twin.phases.append(refresh)
            for scan in scans:
                if scan in states and scan != scans.start:
                    twin.restore(states[scan])
                twin.scan()

    def _twin(self) -> Plc:
        plc = self._plc
        twin = Plc(plc.image, plc.cycle_ns, budget=plc.budget)
        for body in self._substituted:
            python_of(twin.engine).substitute(body, self._playback(twin))
        return twin

    def _playback(self, twin: Plc) -> Callable[[int], None]:
        """What a substitute left in its instance in each scan of before."""

        def play(base: int) -> None:
            for scan, at, data in self._substitute_results:
                if (scan, at) == (twin.scans, base):
                    twin.memory.u8[base : base + len(data)] = data

        return play

    def _advance_to(self, twin: Plc, scan: int) -> None:
        """Brings a twin to the state before a scan."""
        before = [state for state in self._states if state.scans <= scan]
        if not before or scan > self._plc.scans:
            raise ValueError(f"scan {scan} is not kept; those from {self.scans.start} to {self._plc.scans} are")
        twin.restore(before[-1])
        while twin.scans < scan:
            twin.scan()
