"""Scans in one piece: machine code does all of a scan, or of many, but for the I/O refresh.

The refresh takes place where a unit has something to do; what it would leave as it is, is left out.  For scans in which
nobody else has a part: no breakpoints, forces, phases, journal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fbvm.base.areas import NEVER
from fbvm.base.memory import Memory
from fbvm.engine.native import NativeEngine
from fbvm.engine.native_scans import Series
from fbvm.engine.trap import Trap
from fbvm.exchange import Attached, is_idle, pass_by, wake_ns, watched
from fbvm.flags import CLOCKWORK, TENTH_MS_NS
from fbvm.net.journal import Journal
from fbvm.schedule import Schedule


class Express:
    """The quick way through the scans of one PLC.  It has to be ready for the machine code before `once` or `many`."""

    def __init__(self, units: Sequence[Attached], memory: Memory, schedule: Schedule) -> None:
        self._units, self._memory, self._schedule = units, memory, schedule
        self.machine: NativeEngine | None = None
        """Machine code for which it is ready."""
        self._known: list[Attached] = []
        """Units for which it is ready."""
        self._series: Series
        self._all_watch = False
        """The units say what they watch."""
        self.idle = False
        """The last refresh left the units without work, and what they watch is expected to stay as it is."""
        self._passed = 0
        """How many refreshes were left out since the last one."""
        self._news = False
        """The units changed words in the last refresh, and no scan has come upon it."""

    def ready(self, machine: NativeEngine) -> bool:
        """Be ready for this machine code; False if a variable says which tasks run, or one has not run yet."""
        return (machine is self.machine and self._units == self._known) or self._prepare(machine)

    def _prepare(self, machine: NativeEngine) -> bool:
        turns = self._schedule.turns()
        if not turns:
            return False
        self.machine, self._known, self.idle = machine, list(self._units), False
        offsets = watched(self._units, self._memory.areas)
        self._all_watch = offsets is not None
        self._series = machine.series(turns, CLOCKWORK, offsets or ())
        return True

    def forget(self) -> None:
        """Tasks begin anew."""
        self.machine, self.idle = None, False

    def refresh(self, now_ns: int, journal: Journal | None = None) -> bool:
        """I/O refresh: each unit exchanges its words once, the networks take what the units ask for.

        True if nobody has anything left to do."""
        if self._passed:
            pass_by(self._units, self._passed)
            self._passed = 0
        memory, news, at_rest = self._memory, False, True
        for number, attached in enumerate(self._units):
            unit, link = attached.unit, attached.link
            events = link.events(now_ns)
            if journal:
                journal.told(number, events)
            requests = unit.refresh(memory, events, now_ns)
            if requests:
                link.submit(requests, now_ns)
            if unit.news:
                news = True
            if unit.wake_ns <= now_ns or not link.is_quiet:
                at_rest = False
        self._news = news
        return at_rest

    def wake_ns(self, latest_ns: int) -> int:
        """When the units want another scan: at once if the program has not seen yet what they changed."""
        return 0 if self._news else wake_ns(self._units, latest_ns)

    def once(self, step_ns: int, now_ns: int, budget: int) -> Trap | None:
        """One scan at `now_ns`, so much later than the one before."""
        series = self._series
        point = series.once(step_ns, budget, step_ns // TENTH_MS_NS)
        if point:
            return self._trap(point)
        if self.idle and not series.changed and is_idle(self._units, now_ns):
            self._passed += 1
            self._news = False
        else:
            self._exchange(series, now_ns)
        return None

    def burst(self, times: list[int], most: int, last_ns: int, clock: Callable[[], int], budget: int) -> Trap | None:
        """Scans each at the time that the clock tells, one upon the other for as long as units have news for the program;
        `times` takes when they began.  The last one before them was at `last_ns`.

        A refresh that was left out takes place now if there is something for it: waiting comes before the refresh, as in
        a PLC with a fixed cycle time (W394)."""
        now_ns = clock()
        if self._passed and not is_idle(self._units, now_ns):
            self._passed -= 1
            self._exchange(self._series, now_ns)
        while True:
            times.append(now_ns)
            trap = self.once(now_ns - last_ns, now_ns, budget)
            if trap or len(times) >= most or (not self._news and wake_ns(self._units, NEVER) > now_ns):
                return trap
            last_ns, now_ns = now_ns, clock()

    def many(self, most: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, Trap | None]:
        """Scans that follow the one at `now_ns`, each a step later, while the units are idle; how many there were.

        No other begins when all together have executed `spend` statements."""
        most = min(most, (wake_ns(self._units, NEVER) - now_ns - 1) // step_ns)
        if most <= 0:
            return 0, None
        self._news = False
        done, point = self._series.run(most, step_ns, budget, step_ns // TENTH_MS_NS, spend)
        if point:
            self._passed += done - 1
            return done, self._trap(point)
        if self._series.changed:
            self._passed += done - 1
            self._exchange(self._series, now_ns + done * step_ns)
        else:
            self._passed += done
        return done, None

    def _trap(self, point: int) -> Trap:
        assert self.machine
        return self.machine.trap_at(point)

    def _exchange(self, series: Series, now_ns: int) -> None:
        """I/O refresh, and a look whether the next ones may be left out."""
        self.idle = self.refresh(now_ns) and self._all_watch
        if self.idle:
            series.expect()
