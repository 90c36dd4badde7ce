"""The fast paths of a PLC: machine code does all of a scan, or of many, but for what the networks have to know.

Only for scans in which nobody else has a part: no breakpoints, forces, phases or journal.  docs/explanation/fast-paths.md lists
the paths, when each is taken, what it leaves out, and the test that it leaves the same memory as the plain scan."""

from __future__ import annotations

from fbvm.base.areas import NEVER
from fbvm.engine.clock import Clock
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.native.scans.scans import NativeScans, ScheduledTask
from fbvm.engine.trap import Trap
from fbvm.machine.fast.units_in_code import WithUnits, can_run_in_code, units_in_code
from fbvm.machine.scan.clock_words import CLOCK_WORDS
from fbvm.machine.scan.refresh import Attached, IORefresh
from fbvm.machine.scan.tasks import TaskSchedule
from fbvm.net.journal import Journal


class FastPaths:
    """Chooses the fast path for the next scan of one PLC, and keeps it until its machine code, its units or its tasks change.

    `io` are the PLC's units and their I/O refresh, `schedule` its tasks."""

    def __init__(self, io: IORefresh, schedule: TaskSchedule) -> None:
        self._io, self._schedule = io, schedule
        self._machine: NativeEngine | None = None
        self._units: list[Attached] = []
        self._path: FastPath | None = None

    def path(self, machine: NativeEngine) -> FastPath | None:
        """The fast path that the next scan takes with this machine code.

        None if there is none now: a variable says which tasks run, a task has not run yet, or the units have not been refreshed
        since the path was made."""
        path = self._path
        if machine is not self._machine or self._io.units != self._units or (path and path.is_outdated):
            self._make(machine)
            path = self._path
        return path if path and path.is_open else None

    def _make(self, machine: NativeEngine) -> None:
        tasks = self._schedule.by_time()
        if not tasks:
            return
        self._machine, self._units = machine, list(self._io.units)
        units = units_in_code(self._io)
        if units:
            self._path = WithUnits(self._io, machine, tasks, units)
        else:
            self._path = ProgramAlone(self._io, machine, tasks)

    def forget(self) -> None:
        """Drops the path: after a restart or a restore all tasks count as not executed yet."""
        self._machine = self._path = None

    def refresh(self, now_ns: int, journal: Journal | None) -> None:
        """The I/O refresh at the end of a scan that took no fast path."""
        if self._path:
            self._path.refresh(now_ns, journal)
        else:
            self._io.refresh(now_ns, journal)


class ProgramAlone:
    """The fast path of a PLC whose program alone is machine code: one call up to the I/O refresh, which Python does.

    A refresh that would leave everything as it is, is left out."""

    is_open = True
    """Always True: any scan may take this path."""
    is_outdated = False
    """True as soon as all units could run inside machine code, which is the faster path."""

    def __init__(self, io: IORefresh, machine: NativeEngine, tasks: list[ScheduledTask]) -> None:
        self._io, self._machine = io, machine
        offsets = io.watched
        self._all_watch = offsets is not None
        """True if every unit says which words it watches."""
        self._scans = machine.scans(tasks, CLOCK_WORDS, offsets or ())
        self._idle = False
        """True if the last refresh left no unit with anything to do, and machine code expects the watched words as they are."""

    def refresh(self, now_ns: int, journal: Journal | None = None) -> None:
        """An I/O refresh in Python; finds out whether the next ones may be left out."""
        seen = self._scans.expect if self._all_watch else None
        self._idle = self._io.refresh(now_ns, journal, seen) and self._all_watch
        self.is_outdated = can_run_in_code(self._io)

    def once(self, now_ns: int, budget: int) -> Trap | None:
        """One scan at `now_ns` in which the program may execute `budget` statements.  Returns the trap that ended it."""
        return self.finish(now_ns, self._scans.once(now_ns, budget))

    def finish(self, now_ns: int, point: int) -> Trap | None:
        """The part of a scan at `now_ns` behind machine code, which has returned `point`.  Returns the trap that ended it."""
        scans, io = self._scans, self._io
        if point:
            return self._machine.trap_at(point)
        if self._idle and not scans.changed and io.is_idle(now_ns):
            io.skipped += 1
            io.changed_words = False
        else:
            self.refresh(now_ns)
        return None

    def burst(self, times: list[int], most: int, now_ns: int, clock: Clock, budget: int) -> Trap | None:
        """Runs up to `most` scans back to back while units have changed words; see `WithUnits.burst`."""
        io, now_ns = self._io, clock.now()
        if io.skipped and not io.is_idle(now_ns):
            io.skipped -= 1
            self.refresh(now_ns)
        while True:
            times.append(now_ns)
            trap = self.once(now_ns, budget)
            if trap or len(times) >= most or io.wake_ns(NEVER) > now_ns:
                return trap
            now_ns = clock.now()

    def many(self, most: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, Trap | None]:
        """Up to `most` scans after the one at `now_ns`, while the units have nothing to do; see `WithUnits.many`."""
        io = self._io
        most = min(most, (io.unit_ns(NEVER) - now_ns - 1) // step_ns)
        if not self._idle or most <= 0 or not io.is_idle(now_ns):
            return 0, None
        if io.recorder:
            io.recorder.before(now_ns + step_ns)
        io.changed_words = False
        done, point = self._scans.run(most, now_ns + step_ns, step_ns, budget, spend)
        io.skipped += done
        if point or self._scans.changed:
            io.skipped -= 1
        if point:
            return done, self._machine.trap_at(point)
        if self._scans.changed:
            self.refresh(now_ns + done * step_ns)
        return done, None


    def enter_batch(self, now_ns: int, budget: int) -> tuple[NativeScans, int] | None:
        """Prepares scans of several PLCs at once, see `WithUnits.enter_batch`."""
        if not self._idle or not self._io.is_idle(now_ns):
            return None
        self._scans.parameters.scan_budget = budget
        self._scans.load_times()
        return self._scans, self._io.unit_ns(NEVER)

    def leave_batch(self, scans: int) -> None:
        """Called when machine code has done so many scans in which nobody wanted anything."""
        self._scans.store_times()
        self._io.skipped += scans
        self._io.changed_words = False


FastPath = ProgramAlone | WithUnits
