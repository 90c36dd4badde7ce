"""A stepping session: the position in the program, steps forwards and backwards, and changes from outside.

Every scan is executed once on the live PLC, which has units and a network, and is recorded.  A position inside a scan is
reached by executing that scan again (`ScanReplay`) from the state before it, which the recording gives.  A change from outside
is kept with its position.  A change in the past discards all later scans: a new PLC executes everything up to there, in virtual
time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from fbvm.base.memory import compare
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Phase, Plc, State
from fbvm.record.draw.power import RungExecution
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.draw.sfc_recorder import ChartCall
from fbvm.record.recording.recording import Recording
from fbvm.record.trace.events import Statement
from fbvm.record.trace.observing import observing
from fbvm.record.trace.recorder import HEXADECIMAL_AREAS, Signal
from fbvm.step.scan_replay import END, Action, ActionInjector, MomentListener, PastMoment, ScanReplay, Stop, depth
from fbvm.watch import places
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value

NEAR = 32
"""The states before so many scans on either side of the one that is looked at are kept."""
QUIET_AREAS = frozenset(("A", "CF"))
"""Areas that the machine changes in each scan, such as clock pulses."""


@dataclass(frozen=True, order=True)
class Position:
    """The position before a statement: the number of the scan, and of statements of this scan that have been executed."""

    scan: int = 0
    step: int = 0


@dataclass(frozen=True)
class Changed:
    """A value that differs between two stops."""

    place: Place
    old: str
    new: str


class Session:
    """Steps through the scans of a PLC.

    `make` returns a new PLC at power-on, with its units and a network in virtual time; all PLCs that it returns are equal."""

    def __init__(self, make: Callable[[], Plc]) -> None:
        self._make = make
        self._live = make()
        self._actions: dict[Position, list[Action]] = {}
        self._recorded = Recording().add("live", self._live)
        self._changed: dict[int, State] = {}
        """Of scans with changes from outside before them the state before those."""
        self._near: dict[int, State] = {}
        """States before scans near the one that was looked at last."""
        self._replay = ScanReplay(self._live)
        self.names = Names.of(self._live.image, self._live.memory.areas)
        self.here = Position()
        self._go_to(0, 0)
        self._mark = self._replay.plc.memory.fork()

    # --- position

    @property
    def plc(self) -> Plc:
        """The PLC at the current position, for reading; `act` changes it."""
        return self._replay.plc

    @property
    def units(self) -> Plc:
        """The live PLC with its units, which may be some scans ahead."""
        return self._live

    @property
    def statement(self) -> Statement | None:
        """The statement that is executed next; None at the end of the program."""
        return self._replay.statement

    @property
    def trap(self) -> Trap | None:
        """The trap that ended the program at this position."""
        return self._replay.trap

    @property
    def rungs(self) -> list[RungExecution]:
        """The executions of rungs in this scan so far, in order."""
        return self._replay.power.executed

    @property
    def values(self) -> RungValues:
        """The values of operands in these rungs."""
        return self._replay.values

    @property
    def charts(self) -> list[ChartCall]:
        """The calls of charts in this scan so far, in order."""
        return self._replay.chart_recorder.calls

    @property
    def now_ns(self) -> int:
        """The time of this scan."""
        return self._replay.plc.now_ns

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        return self._live.find(text)

    def read(self, where: str | Place | Span) -> Value:
        """The value of a variable, address or range at the current position."""
        return self._replay.plc.read(where)

    # --- forwards

    def step(self) -> None:
        """Executes one statement and stops in a called block; at the end of the program, goes to the next scan."""
        if self.statement is None:
            self._next_scan()
        else:
            self._go_to(self.here.scan, self.here.step + 1)

    def step_over(self) -> None:
        """Executes one statement with all that it calls."""
        self._deeper_than(depth(self.statement.frame) if self.statement else 0)

    def step_out(self) -> None:
        """Executes the rest of this body."""
        self._deeper_than(depth(self.statement.frame) - 1 if self.statement else 0)

    def _deeper_than(self, most: int) -> None:
        if self.statement is None:
            self._next_scan()
            return
        here = self.here.step
        self._stop_at(self.here.scan, lambda number, statement: number > here and depth(statement.frame) <= most)

    def scan(self, count: int = 1) -> None:
        """Goes to the beginning of the scan `count` scans later, or to a trap before it."""
        self.goto(self.here.scan + count)

    def goto(self, scan: int) -> None:
        """Goes to the beginning of any scan, earlier or later, or to a trap before it."""
        self._advance_to(scan)
        if self._live.trap and scan >= self._live.scans:
            self._go_to(self._live.scans - 1, END)
        else:
            self._go_to(max(0, scan), 0)

    def _next_scan(self) -> None:
        if not self.trap:
            self.goto(self.here.scan + 1)

    def run(self, stop: Callable[[Statement | None], bool], scans: int) -> bool:
        """Goes to the next statement, or end of the program (None), for which `stop` returns True, within `scans` scans.

        Returns False if there is none; the position is then the beginning of the scan after them, or a trap."""
        after, start = self.here.step, self.here.scan
        for scan in range(start, start + scans):
            if self._stop_at(scan, partial(_behind, after, stop)):
                return True
            ended = self._replay.count > after or scan > start
            if ended and not self.trap and stop(None):
                return True
            if self.trap:
                return False
            after = -1
        self.goto(start + scans)
        return False

    # --- backwards

    def back(self) -> None:
        """Goes one statement back; from the beginning of a scan to the end of the program in the scan before."""
        if self.here.step:
            self._go_to(self.here.scan, self.here.step - 1)
        elif self.here.scan:
            self._go_to(self.here.scan - 1, END)

    def back_scan(self, count: int = 1) -> None:
        """Goes to the beginning of this scan, or, from there, of the scan `count` scans earlier."""
        self.goto(self.here.scan - count + (self.here.step > 0))

    def run_back(self, stop: Callable[[Statement | None], bool]) -> bool:
        """Goes to the last statement before this one for which `stop` returns True; returns False if there is none."""
        before = self.here
        for scan in range(before.scan, -1, -1):
            last = before.step if scan == before.scan else END
            found = -1

            def note(number: int, statement: Statement, last: int = last) -> bool:
                nonlocal found
                if number >= last:
                    return True
                if stop(statement):
                    found = number
                return False

            self._play(scan, note)
            if found >= 0:
                self._go_to(scan, found)
                return True
        self._go_to(before.scan, before.step)
        return False

    # --- changes from outside

    def act(self, action: Action) -> None:
        """Calls `action` with the PLC at the current position and discards all later scans.  Raises what `action` raises.

        `action` is called again whenever this position is executed again."""
        action(self.plc)
        self._actions = {position: actions for position, actions in self._actions.items() if position <= self.here}
        self._changed = {scan: state for scan, state in self._changed.items() if scan <= self.here.scan}
        if self._live.scans > self.here.scan:
            self._rebuild(self.here.scan)
        self._actions.setdefault(self.here, []).append(action)
        self._go_to(self.here.scan, self.here.step)

    def follow(self, listener: MomentListener, scans: range) -> None:
        """Reports the phases and events of some scans, up to the current position, to `listener`."""
        here = self.here
        for scan in range(max(0, scans.start), min(scans.stop, here.scan + 1)):
            last = here.step if scan == here.scan else END
            self._play(scan, partial(_reached, last), listener)
            if scan < here.scan:
                now_ns = self.now_ns
                self.plc.restore(self._state(scan + 1))
                listener.phase(PastMoment(self.plc, scan, now_ns), Phase.REFRESH)
        self._go_to(here.scan, here.step)

    # --- scans

    def _advance_to(self, scan: int) -> None:
        """Executes scans of the live PLC up to the one before `scan`, or to a trap."""
        plc = self._live
        while plc.scans < scan and not plc.trap:
            with_actions = [position.scan for position in self._actions if position.scan >= plc.scans]
            first = min([*with_actions, scan])
            if first > plc.scans:
                plc.run(scans=first - plc.scans)
            else:
                self._scan_with_actions()

    def _scan_with_actions(self) -> None:
        """Executes one scan of the live PLC with changes from outside before it or inside."""
        plc = self._live
        actions = self._actions_in(plc.scans)
        self._changed[plc.scans] = plc.snapshot()
        for action in actions.get(0, ()):
            action(plc)
        if any(actions):
            with observing(plc, ActionInjector(actions)):
                plc.scan()
            self._recorded.changed()
        else:
            plc.scan()

    def _rebuild(self, scan: int) -> None:
        """Puts the live PLC before a scan: by its state if it has no units and no watchers, else as a new PLC."""
        if not self._live.units and not self._live.watchers and scan >= self._recorded.scans.start:
            self._live.restore(self._state(scan))
        else:
            self._live = self._make()
            self._recorded = Recording().add("live", self._live)
            self._advance_to(scan)
        self._near.clear()

    def _state(self, scan: int) -> State:
        """The state before a scan, without the changes from outside that were made there."""
        self._advance_to(scan)
        held = self._recorded.scans
        if scan < held.start:
            self._rebuild(scan)
        if scan in self._changed:
            return self._changed[scan]
        if scan >= self._live.scans:
            return self._live.snapshot()
        if scan not in self._near:
            near = range(max(held.start, scan - NEAR), min(self._live.scans, scan + NEAR))
            self._near = {state.scans: state for state in self._recorded.states(near)}
        return self._near[scan]

    def _actions_in(self, scan: int) -> Mapping[int, list[Action]]:
        return {position.step: actions for position, actions in self._actions.items() if position.scan == scan}

    def _play(self, scan: int, stop: Stop, listener: MomentListener | None = None) -> bool:
        return self._replay.play(self._state(scan), self._actions_in(scan), stop, listener)

    def _go_to(self, scan: int, step: int) -> None:
        self._stop_at(scan, partial(_reached, step))

    def _stop_at(self, scan: int, stop: Stop) -> bool:
        """Goes to the statement of a scan for which `stop` returns True, or to the end of its program."""
        found = self._play(scan, stop)
        self.here = Position(scan, self._replay.count)
        return found

    # --- what changed

    def mark(self) -> None:
        """Keeps the memory at the current position, to which `changes` compares."""
        self._mark.close()
        self._mark = self.plc.memory.fork()

    def changes(self) -> Iterator[Changed]:
        """The values that differ from those at `mark`, without the areas that the machine changes in each scan."""
        seen: set[Place] = set()
        for offset, size in compare(self._mark.snapshot(), self.plc.memory.snapshot()):
            for place in self._places(offset, size):
                if place in seen or place.is_generated or place.area in QUIET_AREAS:
                    continue
                seen.add(place)
                signal = Signal(place, place.name)
                old, new = (signal.text(self.names.name_references(place.type, value))
                            for value in (places.read(self._mark, place), self.read(place)))
                if old != new:
                    yield Changed(place, old, new)

    def _places(self, offset: int, size: int) -> Iterator[Place]:
        """The single values in some bytes; of words that hold flags the bits."""
        for place in self.names.within(offset, size):
            if place.area in HEXADECIMAL_AREAS and place.bit is None:
                for at in range(offset, offset + size):
                    bits = (self.names.at(at, bit) for bit in range(8))
                    yield from (found for found in bits if found is not None)
            else:
                yield place


def _behind(after: int, stop: Callable[[Statement | None], bool], number: int, statement: Statement) -> bool:
    return number > after and stop(statement)


def _reached(step: int, number: int, statement: Statement) -> bool:
    return number >= step
