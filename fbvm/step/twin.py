"""A PLC that does one scan again up to any statement of it, and stands there to be read.

It begins from a state before that scan and has no units: what they do comes after the program.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from fbvm.base.memory import Memory
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Phase, Plc, State
from fbvm.record.draw.power import PowerFlow
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.draw.sfc_recorder import ChartRecorder
from fbvm.record.trace.events import Event, Frame, ObservedEngine, Statement
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value

Act = Callable[[Plc], None]
"""Something that is done to a PLC from outside: a write, a force, another mode."""
Stop = Callable[[int, Statement], bool]
"""Whether to stand still before a statement, the so manieth of its scan."""
END = sys.maxsize
"""The statement behind the last one: the program is over, the I/O refresh comes next."""


@dataclass(frozen=True)
class Seen:
    """A PLC in a scan of the past, to be read."""

    plc: Plc
    scans: int
    now_ns: int

    @property
    def memory(self) -> Memory:
        return self.plc.memory

    def read(self, where: str | Place | Span) -> Value:
        """A value at that moment."""
        return self.plc.read(where)


class Told(Protocol):
    """Who is told what happens until the twin stands still."""

    def phase(self, moment: Seen, phase: Phase) -> None: ...
    def event(self, moment: Seen, event: Event) -> None: ...


class _Still(Exception):
    """Ends a scan in its midst."""


class Twin:
    """`plc` stands where `play` left it: before `statement`, or at the end of the program (None), or after a `trap`."""

    def __init__(self, plc: Plc) -> None:
        self.plc = Plc(plc.image, plc.cycle_ns, budget=plc.budget)
        self.plc.engine = ObservedEngine(plc.image, self.plc.memory, self._event, self.plc.engine)
        self.plc.phases.append(self._phase)
        self.statement: Statement | None = None
        self.count = 0
        """Statements of the scan that are done."""
        self.values = RungValues(plc.image, self.plc.memory.areas)
        self.power = PowerFlow(plc.image.rungs, lambda scan: True, self.values.keep)
        """What was seen in the rungs of this scan."""
        self.evolutions = ChartRecorder(plc.image.charts, lambda scan: True)
        """What was seen of charts in this scan."""
        self._stop: Stop = lambda number, statement: False
        self._acts: Mapping[int, Sequence[Act]] = {}
        self._told: Told | None = None

    def play(self, state: State, acts: Mapping[int, Sequence[Act]], stop: Stop, told: Told | None = None) -> bool:
        """Does the scan after `state` until `stop` says so.  False if the program ended first.

        `acts` happen before the statements of their numbers, 0 before the scan."""
        self.plc.restore(state)
        self.statement, self.count = None, 0
        self.power = PowerFlow(self.plc.image.rungs, lambda scan: True, self.values.keep)
        self.evolutions = ChartRecorder(self.plc.image.charts, lambda scan: True)
        self._stop, self._acts, self._told = stop, acts, told
        if self.plc.trap:
            return False
        for act in acts.get(0, ()):
            act(self.plc)
        with suppress(_Still):
            self.plc.scan()
        return self.statement is not None

    @property
    def trap(self) -> Trap | None:
        """What stopped the program in this scan."""
        return self.plc.trap

    def _phase(self, plc: Plc, phase: Phase) -> None:
        if phase is not Phase.REFRESH and self._told:
            self._told.phase(Seen(plc, plc.scans, plc.now_ns), phase)
        if phase is not Phase.INPUTS:
            raise _Still

    def _event(self, event: Event) -> None:
        self.power.event(self.plc, event)
        self.evolutions.event(self.plc, event)
        if isinstance(event, Statement):
            if self.count:
                for act in self._acts.get(self.count, ()):
                    act(self.plc)
            if self._stop(self.count, event):
                self.statement = event
                raise _Still
            self.count += 1
        if self._told:
            self._told.event(Seen(self.plc, self.plc.scans, self.plc.now_ns), event)


class Injector:
    """Listens to a scan and does to the PLC what is to be done before its statements."""

    def __init__(self, acts: Mapping[int, Sequence[Act]]) -> None:
        self._acts, self._count = acts, 0

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Nothing is done between phases."""

    def event(self, plc: Plc, event: Event) -> None:
        """Counts statements as the twin does."""
        if isinstance(event, Statement):
            if self._count:
                for act in self._acts.get(self._count, ()):
                    act(plc)
            self._count += 1


def depth(frame: Frame) -> int:
    """How many calls deep a body is executed; 1 for a program."""
    count = 0
    above: Frame | None = frame
    while above is not None and above.caller is not None:
        count, above = count + 1, above.caller
    return count
