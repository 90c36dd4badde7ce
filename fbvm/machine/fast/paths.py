"""Scans in one piece: machine code does all of a scan, or of many, but for what the networks have to know.

For scans in which nobody else has a part: no breakpoints, forces, phases, journal.
"""

from __future__ import annotations

from fbvm.base.areas import NEVER
from fbvm.engine.clock import Clock
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.native.scans.scans import Turn
from fbvm.engine.trap import Trap
from fbvm.machine.clock_words import CLOCKWORK
from fbvm.machine.fast.units_in_code import WithUnits, can_run_in_code, units_in_code
from fbvm.machine.refresh import Attached, Exchange
from fbvm.machine.tasks import Schedule
from fbvm.net.journal import Journal


class Express:
    """The quick ways through the scans of one PLC."""

    def __init__(self, exchange: Exchange, schedule: Schedule) -> None:
        self._exchange, self._schedule = exchange, schedule
        self._machine: NativeEngine | None = None
        self._known: list[Attached] = []
        self._way: Way | None = None

    def way(self, machine: NativeEngine) -> Way | None:
        """The way of this machine code; None if the next scan cannot go it: a variable says which tasks run, one has not
        run yet, units have not been refreshed."""
        way = self._way
        if machine is not self._machine or self._exchange.units != self._known or (way and way.is_outdated):
            self._prepare(machine)
            way = self._way
        return way if way and way.is_open else None

    def _prepare(self, machine: NativeEngine) -> None:
        turns = self._schedule.turns()
        if not turns:
            return
        self._machine, self._known = machine, list(self._exchange.units)
        found = units_in_code(self._exchange)
        if found:
            self._way = WithUnits(self._exchange, machine, turns, found)
        else:
            self._way = Alone(self._exchange, machine, turns)

    def forget(self) -> None:
        """Tasks begin anew."""
        self._machine = self._way = None

    def refresh(self, now_ns: int, journal: Journal | None) -> None:
        """The I/O refresh of a scan that goes another way."""
        if self._way:
            self._way.refresh(now_ns, journal)
        else:
            self._exchange.refresh(now_ns, journal)


class Alone:
    """Machine code up to the I/O refresh, which takes place where a unit has something to do; what it would leave as it
    is, is left out."""

    is_open = True
    """Any scan may go this way."""
    is_outdated = False
    """All units could run inside machine code by now."""

    def __init__(self, exchange: Exchange, machine: NativeEngine, turns: list[Turn]) -> None:
        self._exchange, self._machine = exchange, machine
        offsets = exchange.watched
        self._all_watch = offsets is not None
        """The units say what they watch."""
        self._series = machine.series(turns, CLOCKWORK, offsets or ())
        self._idle = False
        """The last refresh left the units without work, and what they watch is expected to stay as it is."""

    def refresh(self, now_ns: int, journal: Journal | None = None) -> None:
        """I/O refresh, and a look whether the next ones may be left out."""
        seen = self._series.expect if self._all_watch else None
        self._idle = self._exchange.refresh(now_ns, journal, seen) and self._all_watch
        self.is_outdated = can_run_in_code(self._exchange)

    def once(self, now_ns: int, budget: int) -> Trap | None:
        """One scan."""
        series, exchange = self._series, self._exchange
        point = series.once(now_ns, budget)
        if point:
            return self._machine.trap_at(point)
        if self._idle and not series.changed and exchange.is_idle(now_ns):
            exchange.passed += 1
            exchange.changed_words = False
        else:
            self.refresh(now_ns)
        return None

    def burst(self, times: list[int], most: int, now_ns: int, clock: Clock, budget: int) -> Trap | None:
        """Scans each at the time that the clock tells, one upon the other for as long as units have news for the program;
        `times` takes when they began.

        A refresh that was left out takes place now if there is something for it: waiting comes before the refresh, as in
        a PLC with a fixed cycle time (W394)."""
        exchange, now_ns = self._exchange, clock.now()
        if exchange.passed and not exchange.is_idle(now_ns):
            exchange.passed -= 1
            self.refresh(now_ns)
        while True:
            times.append(now_ns)
            trap = self.once(now_ns, budget)
            if trap or len(times) >= most or exchange.wake_ns(NEVER) > now_ns:
                return trap
            now_ns = clock.now()

    def many(self, most: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, Trap | None]:
        """Scans that follow the one at `now_ns`, each a step later, while the units are idle; how many there were.

        No other begins when all together have executed `spend` statements."""
        exchange = self._exchange
        most = min(most, (exchange.unit_ns(NEVER) - now_ns - 1) // step_ns)
        if not self._idle or most <= 0 or not exchange.is_idle(now_ns):
            return 0, None
        exchange.changed_words = False
        done, point = self._series.run(most, now_ns + step_ns, step_ns, budget, spend)
        exchange.passed += done
        if point or self._series.changed:
            exchange.passed -= 1
        if point:
            return done, self._machine.trap_at(point)
        if self._series.changed:
            self.refresh(now_ns + done * step_ns)
        return done, None


Way = Alone | WithUnits
