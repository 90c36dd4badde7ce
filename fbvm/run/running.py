"""One PLC in a run: its bounds, what is written into it and when, and when it scans next.

It reads no clock: the loop tells the time and asks when the next scan is due."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from fbvm.engine.clock import Clock
from fbvm.machine.batch import BatchPlace, place_of
from fbvm.machine.goal import Goal
from fbvm.machine.plc import Plc
from fbvm.watch.paths import Place, Span

CYCLIC, EVENT = "cyclic", "event"
PACES = (CYCLIC, EVENT)
"""cyclic: a fixed period.  event: at once when a unit changed words or a network has events, else when a timer ends."""
MOST_AT_ONCE = 32
"""So many scans one burst has at most; then the loop looks at the networks and the other PLCs."""


@dataclass(frozen=True)
class TimedWrite:
    """A value to be written once, before the first scan at or after `at_ns`."""

    where: Place | Span
    """What is written, as `Plc.find` returns it."""
    value: object
    """The Python value that `Plc.write` takes for it; for a span of places a list."""
    at_ns: int = 0
    """The time of the PLC in nanoseconds, as `Plc.now_ns`."""


@dataclass(frozen=True)
class Batched:
    """A run in a batch."""

    run: Running
    place: BatchPlace
    behind_ns: int
    """How far the time of the PLC is behind that of the loop."""
    until_ns: int
    """The time of the loop at which the run has to scan by itself again."""


class Running:
    """A PLC and the bounds of its run, which are those of `Plc.run`.  Raises ValueError for ones that make no sense.

    Times are of the loop, which `begin` sets in relation to the PLC's own."""

    def __init__(
        self,
        plc: Plc,
        *,
        scans: int | None = None,
        for_ns: int | None = None,
        until: str | Callable[[Plc], bool] | None = None,
        max_ns: int | None = None,
        writes: Iterable[TimedWrite] = (),
        pace: str = CYCLIC,
        phase_ns: int = 0,
    ) -> None:
        if pace not in PACES:
            raise ValueError(f"pace is {CYCLIC} or {EVENT}, not {pace!r}")
        self.plc = plc
        self.pace = pace
        self.phase_ns = phase_ns
        """How much later than the loop it is switched on, in real time, so that PLCs do not all scan at the same moment."""
        self._goal = Goal(plc, scans=scans, for_ns=for_ns, until=until, max_ns=max_ns)
        self.reason = self._goal.reached()
        """What ended the run, by the names of `Plc.run`; "" while it goes on."""
        self.due_ns = plc.elapsed_ns
        """When the next scan is to begin."""
        self.alone = False
        """True for the only PLC of a run in virtual time: many scans may follow without coming back to the loop."""
        self.takes_long = False
        """True if a scan takes so long that the loop has to hear signals and networks behind each: no bursts then."""
        self._behind_ns = 0
        self._clock: Clock | None = None
        self._writes = sorted(writes, key=lambda write: write.at_ns)

    @property
    def writes(self) -> tuple[TimedWrite, ...]:
        """What is still to be written, in order of time."""
        return tuple(self._writes)

    @property
    def calls_out(self) -> bool:
        """True if something is written, or somebody outside has a turn, between scans."""
        return bool(self._writes or self.plc.watchers) or self._goal.calls_out

    def begin(self, start_ns: int, clock: Callable[[int], Clock] | None = None) -> None:
        """Called when the loop starts: the PLC's first scan is at `start_ns` of the loop's time.

        In real time `clock(behind_ns)` makes a clock that is `behind_ns` behind the loop's: the PLC's own, for bursts."""
        self._behind_ns = start_ns - self.plc.elapsed_ns
        self.due_ns = start_ns
        self._clock = clock(self._behind_ns) if clock and self.pace == EVENT else None

    def resume(self) -> None:
        """Called when somebody else has executed scans of the PLC, with what was to be written in them."""
        if self.plc.scans:
            self._writes = [write for write in self._writes if write.at_ns > self.plc.now_ns]
        self.reason = self._goal.reached()

    def enter_batch(self) -> Batched | None:
        """Prepares the next scans for a batch (`machine/batch.py`); None if this run needs its PLC behind each of them."""
        goal, plc = self._goal, self.plc
        if self.pace != CYCLIC or self.reason or self._writes or goal.scans_left < 2 or not (place := place_of(plc)):
            return None
        until_ns = min(place.until_ns, goal.end_ns - plc.cycle_ns) + self._behind_ns
        return Batched(self, place, self._behind_ns, until_ns)

    @property
    def scans_left(self) -> int:
        """How many scans may follow before `reason` has to be looked at, however long they take."""
        return self._goal.scans_left

    def leave_batch(self, due_ns: int, missed: int) -> None:
        """Called when the PLC was brought up to date: the next scan is due at `due_ns`, so many periods were missed."""
        self.due_ns = due_ns
        self.plc.lateness.missed += missed
        self.reason = self._goal.reached()

    def scan(self, now_ns: int) -> list[int]:
        """One scan or a burst at `now_ns` of the loop's time; plans the next, `due_ns`.  An overrun period is not made up
        for.

        Returns the times of a burst's scans, [] for another scan."""
        plc = self.plc
        times: list[int] = []
        if self._writes:
            self._write(max(now_ns - self._behind_ns, plc.now_ns))
        if self._clock and not self.takes_long and (many := self._cycles_left if self._writes else self._goal.scans_left) > 1:
            times = plc.scan_at_once(min(many, MOST_AT_ONCE), now_ns - self._behind_ns, self._clock)
        if times:
            now_ns = times[-1] + self._behind_ns
        elif self.alone and (many := self._cycles_left) > 1 and plc.scan_many(many):
            self.due_ns = plc.elapsed_ns + self._behind_ns
            self.reason = self._goal.reached()
            return times
        else:
            plc.scan(max(now_ns - self._behind_ns, plc.now_ns))
        self.reason = self._goal.reached()
        if plc.breakpoints.halted:
            return times
        if self.pace == EVENT:
            self.due_ns = max(now_ns, min(now_ns + plc.cycle_ns, plc.due_ns + self._behind_ns))
        elif now_ns < self.due_ns + plc.cycle_ns:
            self.due_ns += plc.cycle_ns
        else:
            plc.lateness.missed += (now_ns - self.due_ns) // plc.cycle_ns
            self.due_ns = now_ns + plc.cycle_ns
        return times

    def _write(self, told_ns: int) -> None:
        """Writes what is due at `told_ns` of the PLC's time."""
        while self._writes and self._writes[0].at_ns <= told_ns:
            write = self._writes.pop(0)
            self.plc.write(write.where, write.value)

    @property
    def _cycles_left(self) -> int:
        """How many scans of a cycle each may follow before the bounds have to be looked at, or something is to be written."""
        left, plc = self._goal.cycles_left, self.plc
        return min(left, -((plc.elapsed_ns - self._writes[0].at_ns) // plc.cycle_ns)) if self._writes else left
