"""Scans in one piece: machine code does all of a scan, or of many, but for the I/O refresh.

The refresh takes place where a unit has something to do; what it would leave as it is, is left out.  For scans in which
nobody else has a part: no breakpoints, forces, phases, journal.
"""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.base.areas import NEVER
from fbvm.base.memory import Memory
from fbvm.engine.native import NativeEngine
from fbvm.engine.native_scans import Series
from fbvm.engine.trap import Trap
from fbvm.exchange import Attached, is_idle, pass_by, refresh, wake_ns, watched
from fbvm.flags import CLOCKWORK, MOST, TENTH_MS_NS
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
        self.idle = False
        """The units have nothing to do as long as what they watch does not change and none of them wakes."""
        self._passed = 0
        """How many refreshes were left out since the last one."""

    def ready(self, machine: NativeEngine) -> bool:
        """Be ready for this machine code; False if a variable says which tasks run, or one has not run yet."""
        return (machine is self.machine and self._units == self._known) or self._prepare(machine)

    def _prepare(self, machine: NativeEngine) -> bool:
        turns = self._schedule.turns()
        if not turns:
            return False
        self.machine, self._known, self.idle = machine, list(self._units), False
        self._series = machine.series(turns, CLOCKWORK, watched(self._units, self._memory.areas))
        return True

    def forget(self) -> None:
        """Tasks begin anew."""
        self.machine, self.idle = None, False

    def refresh(self, now_ns: int, journal: Journal | None = None) -> None:
        """I/O refresh of all units."""
        if self._passed:
            pass_by(self._units, self._passed)
            self._passed = 0
        refresh(self._units, self._memory, now_ns, journal)

    def once(self, step_ns: int, now_ns: int, budget: int) -> Trap | None:
        """One scan at `now_ns`, so much later than the one before."""
        point = self._series.once(step_ns, budget, min(step_ns // TENTH_MS_NS, MOST))
        if point:
            return self._trap(point)
        if not self.idle or self._series.changed or wake_ns(self._units, NEVER) <= now_ns:
            self._exchange(self._series, now_ns)
        else:
            self._passed += 1
        return None

    def many(self, most: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, Trap | None]:
        """Scans that follow the one at `now_ns`, each a step later, while the units are idle; how many there were.

        No other begins when all together have executed `spend` statements."""
        most = min(most, (wake_ns(self._units, NEVER) - now_ns - 1) // step_ns)
        if most <= 0:
            return 0, None
        done, point = self._series.run(most, step_ns, budget, min(step_ns // TENTH_MS_NS, MOST), spend)
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
        self.refresh(now_ns)
        self.idle = is_idle(self._units, now_ns)
        if self.idle:
            series.expect()
