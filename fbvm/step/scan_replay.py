"""Executes one scan again, on a second PLC, up to any of its statements, where its memory can be read.

The second PLC starts in the state before that scan.  It has no units: the I/O refresh comes after the program.
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


class MomentListener(Protocol):
    """Receives the phases and events of a scan until execution stops."""

    def phase(self, moment: PastMoment, phase: Phase) -> None: ...
    def event(self, moment: PastMoment, event: Event) -> None: ...


class _Paused(Exception):
    """Leaves a scan before its end."""


class ScanReplay:
    """Executes scans of the program of `plc` on a PLC of its own, `self.plc`.

    After `play` execution has stopped before `statement`; None is the end of the program, or a `trap`."""

    def __init__(self, plc: Plc) -> None:
        self.plc = Plc(plc.image, plc.cycle_ns, budget=plc.budget)
        self._engine = self.plc.engine = ObservedEngine(plc.image, self.plc.memory, self._event, self.plc.engine)
        self.plc.phases.append(self._phase)
        self.statement: Statement | None = None
        self.count = 0
        """Statements of the scan that have been executed."""
        self.values = RungValues(plc.image, self.plc.memory.areas)
        self.power = PowerFlow(plc.image.rungs, lambda scan: True, self.values.keep)
        """The rungs that the scan has executed, with their power."""
        self.chart_recorder = ChartRecorder(plc.image.charts, lambda scan: True)
        """The charts that the scan has executed."""
        self._stop: Stop = lambda number, statement: False
        self._actions: Mapping[int, Sequence[Action]] = {}
        self._listener: MomentListener | None = None

    def play(self, state: State, actions: Mapping[int, Sequence[Action]], stop: Stop,
             listener: MomentListener | None = None) -> bool:  # fmt: skip
        """Executes the scan after `state` until `stop` returns True; returns False if the program has ended before.

        `actions` are carried out before the statements with their numbers, those of number 0 before the scan.  `listener`
        receives the events up to there."""
        self.plc.restore(state)
        self.statement, self.count = None, 0
        self.power = PowerFlow(self.plc.image.rungs, lambda scan: True, self.values.keep)
        self.chart_recorder = ChartRecorder(self.plc.image.charts, lambda scan: True)
        self._stop, self._actions, self._listener = stop, actions, listener
        self._engine.stands_still = any(actions)  # they change the memory in the middle of the scan
        if self.plc.trap:
            return False
        for action in actions.get(0, ()):
            action(self.plc)
        with suppress(_Paused):
            self.plc.scan()
        return self.statement is not None

    @property
    def trap(self) -> Trap | None:
        """The trap that ended the program in this scan."""
        return self.plc.trap

    def _phase(self, plc: Plc, phase: Phase) -> None:
        if phase is not Phase.REFRESH and self._listener:
            self._listener.phase(PastMoment(plc, plc.scans, plc.now_ns), phase)
        if phase is not Phase.INPUTS:
            raise _Paused

    def _event(self, event: Event) -> None:
        self.power.event(self.plc, event)
        self.chart_recorder.event(self.plc, event)
        if isinstance(event, Statement):
            if self.count:
                for action in self._actions.get(self.count, ()):
                    action(self.plc)
            if self._stop(self.count, event):
                self.statement = event
                raise _Paused
            self.count += 1
        if self._listener:
            self._listener.event(PastMoment(self.plc, self.plc.scans, self.plc.now_ns), event)


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
