"""Executes one scan again, on a second PLC, up to any of its statements, where its memory can be read.

The second PLC starts in the state before that scan.  It has no units: the I/O refresh comes after the program.
"""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
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
from fbvm.step.facts import ProgramFacts
from fbvm.watch import places
from fbvm.watch.paths import Place, Span, find
from fbvm.watch.values import Value

Action = Callable[[Plc], None]
"""A function that changes a PLC from outside the program: a write, a force, a change of the mode."""
Stop = Callable[[int, Statement], bool]
"""True for the statement before which execution stops; called with its number in the scan, from 0, and the statement."""
END = sys.maxsize
"""The number of the end of the program, before the I/O refresh."""


@dataclass(frozen=True)
class PastMoment:
    """The memory of a PLC during scan number `scans`, at time `now_ns`."""

    plc: Plc
    scans: int
    now_ns: int

    @property
    def memory(self) -> Memory:
        return self.plc.memory

    def read(self, where: str | Place | Span) -> Value:
        """A value at that moment."""
        return self.plc.read(where)


class Moment(Protocol):
    """The memory of a PLC during scan number `scans`, at time `now_ns`."""

    @property
    def memory(self) -> Memory: ...
    @property
    def scans(self) -> int: ...
    @property
    def now_ns(self) -> int: ...
    def read(self, where: str | Place | Span) -> Value: ...


class MomentListener(Protocol):
    """Receives the phases and events of a scan until execution stops."""

    def phase(self, moment: Moment, phase: Phase) -> None: ...
    def event(self, moment: Moment, event: Event) -> None: ...


class Paused(Exception):
    """Leaves a scan before its end."""


class Player(ABC):
    """Plays scans that are past, up to any of their statements.

    After `play` it stands before `statement`; None is the end of the program, or a `trap`."""

    def __init__(self, facts: ProgramFacts) -> None:
        self.facts = facts
        self.values = RungValues(facts.image, facts.areas)
        self._begin(lambda number, statement: False, None)

    memory: Memory
    """The memory at this moment."""

    @property
    @abstractmethod
    def now_ns(self) -> int:
        """The time of this scan."""

    @property
    @abstractmethod
    def trap(self) -> Trap | None:
        """The trap that ended the program in this scan."""

    @property
    @abstractmethod
    def moment(self) -> Moment:
        """The state at this moment, for listeners."""

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        return find(self.facts.symbols, self.facts.areas, text)

    def read(self, where: str | Place | Span) -> Value:
        """A value at this moment.  Raises UnknownPlace."""
        return places.read_found(self.memory, self.find(where) if isinstance(where, str) else where)

    def _begin(self, stop: Stop, listener: MomentListener | None) -> None:
        self.statement: Statement | None = None
        self.count = 0
        """Statements of the scan that have been executed."""
        self.power = PowerFlow(self.facts.rungs, lambda scan: True, self.values.keep)
        """The rungs that the scan has executed, with their power."""
        self.chart_recorder = ChartRecorder(self.facts.charts, lambda scan: True)
        """The charts that the scan has executed."""
        self._stop, self._listener = stop, listener

    def _over(self, phase: Phase) -> None:
        """Called at the end of a phase; leaves the scan at the end of its program."""
        if phase is not Phase.REFRESH and self._listener:
            self._listener.phase(self.moment, phase)
        if phase is not Phase.INPUTS:
            raise Paused

    def _see(self, event: Event) -> None:
        """Called for each event; leaves the scan before the statement at which it stops."""
        moment = self.moment
        self.power.event(moment, event)
        self.chart_recorder.event(moment, event)
        if isinstance(event, Statement):
            if self._stop(self.count, event):
                self.statement = event
                raise Paused
            self.count += 1
        if self._listener:
            self._listener.event(moment, event)


class ScanReplay(Player):
    """Executes scans of the program of `plc` on a PLC of its own, `self.plc`."""

    def __init__(self, plc: Plc) -> None:
        super().__init__(ProgramFacts.of(plc))
        self.plc = Plc(plc.image, plc.cycle_ns, budget=plc.budget)
        self.memory = self.plc.memory
        self._engine = self.plc.engine = ObservedEngine(plc.image, self.plc.memory, self._event, self.plc.engine)
        self.plc.phases.append(lambda plc, phase: self._over(phase))
        self._actions: Mapping[int, Sequence[Action]] = {}

    def play(self, state: State, actions: Mapping[int, Sequence[Action]], stop: Stop,
             listener: MomentListener | None = None) -> bool:  # fmt: skip
        """Executes the scan after `state` until `stop` returns True; returns False if the program has ended before.

        `actions` are carried out before the statements with their numbers, those of number 0 before the scan.  `listener`
        receives the events up to there."""
        self.plc.restore(state)
        self._begin(stop, listener)
        self._actions = actions
        self._engine.stands_still = any(actions)  # they change the memory in the middle of the scan
        if self.plc.trap:
            return False
        for action in actions.get(0, ()):
            action(self.plc)
        with suppress(Paused):
            self.plc.scan()
        return self.statement is not None

    @property
    def now_ns(self) -> int:
        return self.plc.now_ns

    @property
    def trap(self) -> Trap | None:
        return self.plc.trap

    @property
    def moment(self) -> PastMoment:
        return PastMoment(self.plc, self.plc.scans, self.plc.now_ns)

    def _event(self, event: Event) -> None:
        if self.count and isinstance(event, Statement):
            for action in self._actions.get(self.count, ()):
                action(self.plc)
        self._see(event)


class ActionInjector:
    """A listener that carries out actions on a PLC before the statements with their numbers."""

    def __init__(self, actions: Mapping[int, Sequence[Action]]) -> None:
        self._actions, self._count = actions, 0

    def phase(self, plc: Plc, phase: Phase) -> None:
        """No action belongs to the end of a phase."""

    def event(self, plc: Plc, event: Event) -> None:
        """Counts statements, as `ScanReplay` does, and carries out their actions."""
        if isinstance(event, Statement):
            if self._count:
                for action in self._actions.get(self._count, ()):
                    action(plc)
            self._count += 1


def depth(frame: Frame) -> int:
    """The call depth of a frame; 1 for a program."""
    count = 0
    above: Frame | None = frame
    while above is not None and above.caller is not None:
        count, above = count + 1, above.caller
    return count
