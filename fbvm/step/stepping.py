"""Moves through the scans of a PLC that are past or come next: statements, blocks and scans, forwards and backwards.

`Session` steps through a PLC that runs, `PastSession` through a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from fbvm.base.memory import Memory, compare
from fbvm.engine.trap import Trap
from fbvm.record.draw.power import RungExecution
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.draw.sfc_recorder import ChartCall
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.trace.events import Frame, Statement
from fbvm.record.trace.recorder import HEXADECIMAL_AREAS, Signal
from fbvm.step.facts import ProgramFacts
from fbvm.step.position import Position
from fbvm.step.properties import Properties, PropertyValue
from fbvm.step.scan_replay import END, Action, MomentListener, Player, Stop, depth
from fbvm.watch import places
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.scopes import Scope, place_of
from fbvm.watch.values import Value

QUIET_AREAS = frozenset(("A", "CF"))
"""Areas that the machine changes in each scan, such as clock pulses."""


@dataclass(frozen=True)
class Changed:
    """A value that differs between two stops."""

    place: Place
    old: str
    new: str


class Stepping(ABC):
    """Steps through the scans of a PLC.  `player` plays its scans."""

    def __init__(self, player: Player) -> None:
        self.player = player
        self.properties = Properties(player.facts)
        self.here = Position()
        self._mark: Memory | None = None

    # --- what a session has to bring

    @abstractmethod
    def play(self, scan: int, stop: Stop, listener: MomentListener | None = None) -> bool:
        """Plays a scan until `stop` returns True; returns False if its program has ended before."""

    @abstractmethod
    def reachable(self, scan: int) -> int:
        """The number of the scan nearest to `scan` that can be looked at.  What has not been executed yet is executed."""

    @abstractmethod
    def act(self, action: Action) -> None:
        """Calls `action` with the PLC at the current position and discards all later scans.

        Raises what `action` raises, and ReadOnlyPast where nothing can be changed."""

    @abstractmethod
    def follow(self, listener: MomentListener, scans: range) -> None:
        """Reports the phases and events of some scans, up to the current position, to `listener`."""

    @property
    @abstractmethod
    def recorded(self) -> RecordedPlc:
        """The recording of the PLC."""

    @abstractmethod
    def first(self) -> int:
        """The oldest scan that can be looked at."""

    # --- position

    @property
    def facts(self) -> ProgramFacts:
        """What is known of the program."""
        return self.player.facts

    @property
    def names(self) -> Names:
        """The names of all variables and addresses."""
        return self.player.facts.names

    @property
    def memory(self) -> Memory:
        """The memory at the current position, for reading; `act` changes it."""
        return self.player.memory

    @property
    def statement(self) -> Statement | None:
        """The statement that is executed next; None at the end of the program."""
        return self.player.statement

    @property
    def trap(self) -> Trap | None:
        """The trap that ended the program at this position."""
        return self.player.trap

    @property
    def rungs(self) -> list[RungExecution]:
        """The executions of rungs in this scan so far, in order."""
        return self.player.power.executed

    @property
    def values(self) -> RungValues:
        """The values of operands in these rungs."""
        return self.player.values

    @property
    def charts(self) -> list[ChartCall]:
        """The calls of charts in this scan so far, in order."""
        return self.player.chart_recorder.calls

    @property
    def now_ns(self) -> int:
        """The time of this scan."""
        return self.player.now_ns

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        return self.player.find(text)

    def scope(self, frame: Frame | None) -> Scope:
        """The names as they are written inside a body in execution; of all, in none."""
        path = self.names.instance(frame.base) if frame is not None and frame.base else ""
        newest = self.statement.frame if self.statement else None
        local = self.facts.local(frame.body, newer(newest, frame)) if frame is not None and frame.body >= 0 else None
        return Scope(self.player.find, place_of(self.player.find, path), local)

    def find_here(self, text: str) -> Place | Span:
        """What `text` names inside the body that is executed, `Speed` as well as `Main.slow.Speed`.  Raises UnknownPlace."""
        return self.scope(self.statement.frame if self.statement else None).find(text)

    def property(self, text: str, scope: Scope | None = None) -> PropertyValue | None:
        """The value of the property that `text` names in a scope, or inside the body that is executed; None if it names none.

        Raises ValueError if it cannot be computed."""
        here = scope or self.scope(self.statement.frame if self.statement else None)
        return self.properties.read(text, here, self.player.memory)

    def read(self, where: str | Place | Span) -> Value:
        """The value of a variable, address or range at the current position."""
        return self.player.read(where)

    # --- forwards

    def step(self) -> None:
        """Executes one statement and stops in a called block; at the end of the program, goes to the next scan."""
        if self.statement is None:
            self._next_scan()
        else:
            self.go_to(Position(self.here.scan, self.here.step + 1))

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
        found = self.reachable(scan)
        self.go_to(Position(found, 0 if found == max(scan, self.first()) else END))

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
            ended = self.player.count > after or scan > start
            if ended and not self.trap and stop(None):
                return True
            if self.trap:
                return False
            after = -1
        self.goto(start + scans)
        return False

    def go_to(self, position: Position) -> None:
        """Goes to a position, or to the end of the program of its scan."""
        self._stop_at(position.scan, partial(reached_step, position.step))

    def _stop_at(self, scan: int, stop: Stop) -> bool:
        """Goes to the statement of a scan for which `stop` returns True, or to the end of its program."""
        found = self.play(scan, stop)
        self.here = Position(scan, self.player.count)
        return found

    # --- backwards

    def back(self) -> None:
        """Goes one statement back; from the beginning of a scan to the end of the program in the scan before."""
        if self.here.step:
            self.go_to(Position(self.here.scan, self.here.step - 1))
        elif self.here.scan > self.first():
            self.go_to(Position(self.here.scan - 1, END))

    def back_scan(self, count: int = 1) -> None:
        """Goes to the beginning of this scan, or, from there, of the scan `count` scans earlier."""
        self.goto(self.here.scan - count + (self.here.step > 0))

    def run_back(self, stop: Callable[[Statement | None], bool]) -> bool:
        """Goes to the last statement before this one for which `stop` returns True; returns False if there is none."""
        before = self.here
        for scan in range(before.scan, self.first() - 1, -1):
            last = before.step if scan == before.scan else END
            found = -1

            def note(number: int, statement: Statement, last: int = last) -> bool:
                nonlocal found
                if number >= last:
                    return True
                if stop(statement):
                    found = number
                return False

            self.play(scan, note)
            if found >= 0:
                self.go_to(Position(scan, found))
                return True
        self.go_to(before)
        return False

    # --- what changed

    def mark(self) -> None:
        """Keeps the memory at the current position, to which `changes` compares."""
        if self._mark is not None:
            self._mark.close()
        self._mark = self.memory.fork()

    def changes(self) -> Iterator[Changed]:
        """The values that differ from those at `mark`, without the areas that the machine changes in each scan."""
        seen: set[Place] = set()
        if self._mark is None:
            return
        for offset, size in compare(self._mark.snapshot(), self.memory.snapshot()):
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


def reached_step(step: int, number: int, statement: Statement) -> bool:
    """A `Stop` at the statement with that number."""
    return number >= step


def newer(newest: Frame | None, wanted: Frame) -> int:
    """How many executions of the same body are newer than a frame of the stack of the newest one, which has perhaps been played
    again since."""
    count = 0
    for _ in range(depth(newest) - depth(wanted) if newest else 0):
        assert newest is not None
        count += newest.body == wanted.body
        newest = newest.caller
    return count
