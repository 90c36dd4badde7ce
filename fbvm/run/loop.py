"""The loop that runs a PLC: scan, wait for the next period, scan again; in virtual time without waiting.

Time is real as soon as one attached network is real.  One thread, no sleep longer than to the next scan.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from fbvm.goal import Goal
from fbvm.plc import Plc
from fbvm.watch.paths import Place, Span

PROGRESS_NS = 100_000_000
"""How often progress is told, at most."""
CYCLIC, EVENT = "cyclic", "event"


@dataclass(frozen=True)
class TimedWrite:
    """A value to be written once, before the first scan at or after `at_ns`."""

    where: Place | Span
    value: object
    at_ns: int = 0


def run(
    plc: Plc,
    *,
    scans: int | None = None,
    for_ns: int | None = None,
    until: str | Callable[[Plc], bool] | None = None,
    max_ns: int | None = None,
    writes: Iterable[TimedWrite] = (),
    pace: str = CYCLIC,
    progress: Callable[[Plc], None] | None = None,
) -> str:
    """Runs until the first of the bounds, as `Plc.run` has them; returns its name, or "interrupted" after Ctrl-C.

    `pace` "cyclic" keeps the period of the PLC; "event" (real time only) scans again at once when a unit or its network
    changed something, and at the latest when the period ends.  `progress` is called now and then, not in each scan.  How
    long scans took is in `plc.scan_times`."""
    if pace not in (CYCLIC, EVENT):
        raise ValueError(f"pace is {CYCLIC} or {EVENT}, not {pace!r}")
    goal = Goal(plc, scans=scans, for_ns=for_ns, until=until, max_ns=max_ns)
    networks = {id(unit.network): unit.network for unit in plc.units if not unit.network.virtual_time}
    clock = _Real(plc, list(networks.values()), pace) if networks else _Virtual(plc)
    waiting = sorted(writes, key=lambda write: write.at_ns)
    told_ns = time.monotonic_ns()
    try:
        while not (reason := goal.reached()):
            now_ns = clock.next_scan_ns()
            while waiting and waiting[0].at_ns <= now_ns:
                write = waiting.pop(0)
                plc.write(write.where, write.value)
            began_ns = time.monotonic_ns()
            plc.scan(now_ns)
            if plc.halted:
                continue
            plc.scan_times.note(plc.scans - 1, time.monotonic_ns() - began_ns, plc.cycle_ns)
            if progress and time.monotonic_ns() - told_ns >= PROGRESS_NS:
                told_ns = time.monotonic_ns()
                progress(plc)
    except KeyboardInterrupt:
        return "interrupted"
    return reason


class _Virtual:
    """Time that a scan moves."""

    def __init__(self, plc: Plc) -> None:
        self._plc = plc

    def next_scan_ns(self) -> int:
        return self._plc.elapsed_ns


class _Real:
    """The host's time, counted on from where the PLC's time stands."""

    def __init__(self, plc: Plc, networks: Sequence[object], pace: str) -> None:
        self._plc = plc
        self._waits = [wait for network in networks if (wait := getattr(network, "wait", None))]
        self._pace = pace
        self._zero_ns = time.monotonic_ns() - plc.elapsed_ns
        self._planned_ns = plc.elapsed_ns

    def next_scan_ns(self) -> int:
        """Waits until the next scan is to begin; its time.  A period that was overrun is not made up for."""
        if self._pace == EVENT and len(self._waits) == 1:
            self._wait_for_events(self._waits[0])
        else:
            while (left_ns := self._planned_ns - self._now_ns()) > 0:
                time.sleep(left_ns / 1e9)
        now_ns = max(self._now_ns(), self._plc.now_ns)
        self._planned_ns += self._plc.cycle_ns
        if self._pace == EVENT or self._planned_ns <= now_ns:
            self._planned_ns = now_ns + self._plc.cycle_ns
        return now_ns

    def _wait_for_events(self, wait: Callable[[float], bool]) -> None:
        due_ns = self._plc.due_ns
        if due_ns > self._plc.now_ns:
            wait((min(due_ns, self._planned_ns) - self._now_ns()) / 1e9)

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._zero_ns


def epoch_ns() -> int:
    """The date of this moment, in nanoseconds since 1970, for what is kept beyond a run."""
    return time.time_ns()
