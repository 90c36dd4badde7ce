"""A session of stepping: where the program stands, ways forth and back, and what is done to it on the way.

Every scan is done once on a PLC with units and network, and its state before is kept.  A place inside a scan is reached
by doing that scan again on a twin.  What somebody does from outside is written down with its place; done in the past, it
ends what came after: the PLC is made anew, and does all again up to there, with units and network, in virtual time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial

from fbvm.base.memory import compare
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Phase, Plc, State
from fbvm.record.draw.power import RungExecution
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.draw.sfc_recorder import ChartCall
from fbvm.record.trace.events import Statement
from fbvm.record.trace.history import observing
from fbvm.record.trace.recorder import HEXADECIMAL_AREAS, Signal
from fbvm.step.twin import END, Act, Injector, Seen, Stop, Told, Twin, depth
from fbvm.watch import places
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value

KEPT, EVERY = 2000, 100
"""States that are kept, and of older scans every which one."""
QUIET_AREAS = frozenset(("A", "CF"))
"""Areas that change by themselves in each scan."""


@dataclass(frozen=True, order=True)
class Position:
    """Before a statement: the scan, and how many of its statements are done."""

    scan: int = 0
    step: int = 0


@dataclass(frozen=True)
class Changed:
    """A value that differs between two stops."""

    place: Place
    old: str
    new: str


class Session:
    """`make` gives a PLC at power-on with all its units and their network in virtual time, each time the same."""

    def __init__(self, make: Callable[[], Plc]) -> None:
        self._make = make
        self._live = make()
        self._acts: dict[Position, list[Act]] = {}
        self._states: dict[int, State] = {0: self._live.snapshot()}
        self._twin = Twin(self._live)
        self.names = Names.of(self._live.image, self._live.memory.areas)
        self.here = Position()
        self._look(0, 0)
        self._mark = self._twin.plc.memory.fork()

    # --- where it stands

    @property
    def plc(self) -> Plc:
        """The PLC as it stands here, to be read; what is to be changed, goes through `act`."""
        return self._twin.plc

    @property
    def units(self) -> Plc:
        """The PLC with its units, maybe scans ahead."""
        return self._live

    @property
    def statement(self) -> Statement | None:
        """What is executed next; None at the end of the program."""
        return self._twin.statement

    @property
    def trap(self) -> Trap | None:
        """What stopped the program here."""
        return self._twin.trap

    @property
    def rungs(self) -> list[RungExecution]:
        """The rungs that were executed in this scan, in order, and what was seen in them."""
        return self._twin.power.executed

    @property
    def values(self) -> RungValues:
        """The values in those rungs."""
        return self._twin.values

    @property
    def charts(self) -> list[ChartCall]:
        """The charts that were called in this scan, in order, and what was seen of them."""
        return self._twin.evolutions.called

    @property
    def now_ns(self) -> int:
        """The time of this scan."""
        return self._twin.plc.now_ns

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        return self._live.find(text)

    def read(self, where: str | Place | Span) -> Value:
        """A value here."""
        return self._twin.plc.read(where)

    # --- ways forth

    def step(self) -> None:
        """One statement, into calls; from the end of the program, through the I/O refresh into the next scan."""
        if self.statement is None:
            self._next_scan()
        else:
            self._look(self.here.scan, self.here.step + 1)

    def over(self) -> None:
        """The next statement of this body, or of one above it."""
        self._deeper_than(depth(self.statement.frame) if self.statement else 0)

    def out(self) -> None:
        """Until this body is over."""
        self._deeper_than(depth(self.statement.frame) - 1 if self.statement else 0)

    def _deeper_than(self, most: int) -> None:
        if self.statement is None:
            self._next_scan()
            return
        here = self.here.step
        self._stop_at(self.here.scan, lambda number, statement: number > here and depth(statement.frame) <= most)

    def scan(self, count: int = 1) -> None:
        """To the beginning of a scan further on; stops where a trap stops the program."""
        self.goto(self.here.scan + count)

    def goto(self, scan: int) -> None:
        """To the beginning of any scan, back or forth."""
        while self._live.scans < scan and not self._live.trap:
            self._advance()
        if self._live.trap and scan >= self._live.scans:
            self._look(self._live.scans - 1, END)
        else:
            self._look(max(0, scan), 0)

    def _next_scan(self) -> None:
        if not self.trap:
            self.goto(self.here.scan + 1)

    def run(self, stop: Callable[[Statement | None], bool], scans: int) -> bool:
        """To the next statement, or end of a program, of which `stop` says so; looks so many scans ahead.

        False if there was none: then it stands at the beginning of the scan behind them, or where a trap is."""
        after, start = self.here.step, self.here.scan
        for scan in range(start, start + scans):
            self._need(scan)
            if self._stop_at(scan, partial(_behind, after, stop)):
                return True
            ended = self._twin.count > after or scan > start
            if ended and not self.trap and stop(None):
                return True
            if self.trap:
                return False
            after = -1
        self.goto(start + scans)
        return False

    # --- ways back

    def back(self) -> None:
        """One statement back; from the beginning of a scan, to the end of the program in the one before."""
        if self.here.step:
            self._look(self.here.scan, self.here.step - 1)
        elif self.here.scan:
            self._look(self.here.scan - 1, END)

    def back_scan(self, count: int = 1) -> None:
        """To the beginning of this scan, or of one before it."""
        self.goto(self.here.scan - count + (self.here.step > 0))

    def run_back(self, stop: Callable[[Statement | None], bool]) -> bool:
        """To the last statement before this one of which `stop` says so; False if there was none."""
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
                self._look(scan, found)
                return True
        self._look(before.scan, before.step)
        return False

    # --- from outside

    def act(self, act: Act) -> None:
        """Does something to the PLC here, and forgets what came after.  Raises what `act` raises.

        `act` is called again whenever this moment is."""
        act(self.plc)
        self._acts = {position: acts for position, acts in self._acts.items() if position <= self.here}
        self._states = {scan: state for scan, state in self._states.items() if scan <= self.here.scan}
        if self._live.scans > self.here.scan:
            self._again(self.here.scan)
        self._acts.setdefault(self.here, []).append(act)
        self._look(self.here.scan, self.here.step)

    def follow(self, told: Told, scans: range) -> None:
        """Tells what happened in some scans, up to here."""
        here = self.here
        for scan in range(max(0, scans.start), min(scans.stop, here.scan + 1)):
            last = here.step if scan == here.scan else END
            self._play(scan, partial(_reached, last), told)
            if scan < here.scan:
                now_ns = self.now_ns
                self._need(scan + 1)
                self.plc.restore(self._states[scan + 1])
                told.phase(Seen(self.plc, scan, now_ns), Phase.REFRESH)
        self._look(here.scan, here.step)

    # --- scans

    def _advance(self) -> None:
        """One scan of the PLC with its units."""
        plc = self._live
        acts = self._acts_in(plc.scans)
        for act in acts.get(0, ()):
            act(plc)
        with observing(plc, Injector(acts)) if any(acts) else nullcontext():
            plc.scan()
        self._states[plc.scans] = plc.snapshot()
        if (old := plc.scans - KEPT) > 0 and old % EVERY:
            self._states.pop(old, None)

    def _again(self, scan: int) -> None:
        """Brings the PLC before a scan: alone by its state, with units or others that follow it, made anew."""
        state = self._states.get(scan)
        if not self._live.units and not self._live.watchers and state is not None:
            self._live.restore(state)
            return
        self._live = self._make()
        while self._live.scans < scan:
            self._advance()

    def _need(self, scan: int) -> None:
        """Sees to it that the state before a scan is there."""
        while self._live.scans < scan and not self._live.trap:
            self._advance()
        if scan not in self._states:
            ahead, kept = self._live, dict(self._states)
            self._again(scan)
            self._live, self._states = ahead, {**self._states, **kept}

    def _acts_in(self, scan: int) -> Mapping[int, list[Act]]:
        return {position.step: acts for position, acts in self._acts.items() if position.scan == scan}

    def _play(self, scan: int, stop: Stop, told: Told | None = None) -> bool:
        self._need(scan)
        return self._twin.play(self._states[scan], self._acts_in(scan), stop, told)

    def _look(self, scan: int, step: int) -> None:
        self._stop_at(scan, partial(_reached, step))

    def _stop_at(self, scan: int, stop: Stop) -> bool:
        """Stands where `stop` says so in a scan, or at the end of its program."""
        found = self._play(scan, stop)
        self.here = Position(scan, self._twin.count)
        return found

    # --- what changed

    def mark(self) -> None:
        """Remembers the memory here, for `changes`."""
        self._mark.close()
        self._mark = self.plc.memory.fork()

    def changes(self) -> Iterator[Changed]:
        """The values that differ from those at the mark; not those that change in each scan by themselves."""
        seen: set[Place] = set()
        for offset, size in compare(self._mark.snapshot(), self.plc.memory.snapshot()):
            for place in self._places(offset, size):
                if place in seen or place.is_generated or place.area in QUIET_AREAS:
                    continue
                seen.add(place)
                signal = Signal(place, place.name)
                old, new = (signal.text(self.names.told(place.type, value))
                            for value in (places.read(self._mark, place), self.read(place)))
                if old != new:
                    yield Changed(place, old, new)

    def _places(self, offset: int, size: int) -> Iterator[Place]:
        """The values in some bytes; words of flags bit by bit."""
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
