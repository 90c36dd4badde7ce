"""The loop that runs PLCs: scan the one that is due, wait for the next; in virtual time without waiting.

Time is real as soon as one attached network is real.  One thread, one selector, no sleep longer than to the next scan.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Protocol, cast

from fbvm.plc import Plc
from fbvm.run.running import CYCLIC, EVENT, Running, TimedWrite
from fbvm.wire.link import RealNetwork

PROGRESS_NS = 100_000_000
"""How often progress is told, at most."""
PATIENCE_NS = 1_000_000
"""How long nobody looks at a network that has something only for PLCs which keep their period and fetch it then."""


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
    has news, else when a timer ends, and at the latest when the period ends.  `progress` is called now and then, not in
    each scan.  How long scans took is in `plc.scan_times`, how late they began in `plc.lateness`."""
    running = Running(plc, scans=scans, for_ns=for_ns, until=until, max_ns=max_ns, writes=writes, pace=pace)
    run_all([running], (lambda: progress(plc)) if progress else None)
    return running.reason


def run_all(runs: Sequence[Running], progress: Callable[[], None] | None = None) -> None:
    """Runs several PLCs side by side, each until its own end; the `reason` of each says what that was.

    They share one time: real if a network of any of them is, so that a network may have units of several PLCs."""
    networks = {id(unit.network): unit.network for run in runs for unit in run.plc.units if not unit.network.virtual_time}
    start_ns = max((run.plc.elapsed_ns for run in runs), default=0)
    clock: _Clock = _Virtual()
    if networks:
        clock = real = _Real(cast(list[RealNetwork], list(networks.values())), runs, start_ns)
        for run in runs:
            run.begin(start_ns + run.phase_ns, real.behind)
    else:  # nothing happens between two periods of virtual time
        for run in runs:
            run.begin(start_ns)
            run.pace, run.alone = CYCLIC, len(runs) == 1
    queue = _Queue(runs)
    told_ns = time.monotonic_ns()
    try:
        while (due_ns := queue.next_ns()) is not None:
            now_ns = clock.reach(due_ns)
            for number in clock.woken:
                queue.hasten(number, now_ns)
            _scan_all(queue, now_ns, clock.real)
            if progress and time.monotonic_ns() - told_ns >= PROGRESS_NS:
                told_ns = time.monotonic_ns()
                progress()
    except KeyboardInterrupt:
        for run in runs:
            run.reason = run.reason or "interrupted"
    finally:
        clock.stop()


def _scan_all(queue: _Queue, now_ns: int, real: bool) -> None:
    """One scan of everybody whose time has come, with the same time for all."""
    first_ns = began_ns = time.monotonic_ns()
    for number, run in queue.take(now_ns):
        plc, scan, due_ns = run.plc, run.plc.scans, run.due_ns
        times = run.scan(now_ns)
        if scans := plc.scans - scan:
            ended_ns = time.monotonic_ns()
            for time_ns, next_ns in pairwise(times) if len(times) > 1 else ():
                plc.scan_times.note(scan, next_ns - time_ns)
                began_ns, scan, scans = began_ns + next_ns - time_ns, scan + 1, scans - 1
            plc.scan_times.note(scan, (ended_ns - began_ns) // scans, scans)
            if real and run.pace == CYCLIC:
                plc.lateness.note(scan, now_ns - due_ns + began_ns - first_ns)
            began_ns = ended_ns
        queue.put(number, run)


class _Queue:
    """Who scans when."""

    def __init__(self, runs: Sequence[Running]) -> None:
        self._runs = runs
        self._times: list[int] = []
        """When anybody is due, the next first; PLCs with one period share theirs."""
        self._rows: dict[int, list[int]] = {}
        """Whose times these are, by number."""
        self._queued: list[int | None] = [None] * len(runs)
        """When each is due; if it stands in the row of another time, too, that is out of date."""
        for number, run in enumerate(runs):
            self.put(number, run)

    def put(self, number: int, run: Running) -> None:
        """Remember when a run is due, unless it has ended."""
        if run.reason:
            return
        due_ns = self._queued[number] = run.due_ns
        row = self._rows.get(due_ns)
        if row is None:
            self._rows[due_ns] = [number]
            heapq.heappush(self._times, due_ns)
        else:
            row.append(number)

    def next_ns(self) -> int | None:
        """When somebody is due; None if all have ended."""
        times, queued = self._times, self._queued
        while times:
            due_ns = times[0]
            for number in self._rows[due_ns]:
                if queued[number] == due_ns:
                    return due_ns
            del self._rows[heapq.heappop(times)]
        return None

    def hasten(self, number: int, now_ns: int) -> None:
        """Let one be due already now."""
        queued_ns = self._queued[number]
        if queued_ns is not None and queued_ns > now_ns:
            self._runs[number].due_ns = now_ns
            self.put(number, self._runs[number])

    def take(self, now_ns: int) -> list[tuple[int, Running]]:
        """Takes out all that are due, with their numbers; who has scanned one puts it back."""
        times, queued, taken = self._times, self._queued, []
        while times and times[0] <= now_ns:
            due_ns = heapq.heappop(times)
            for number in self._rows.pop(due_ns):
                if queued[number] == due_ns:
                    queued[number] = None
                    taken.append((number, self._runs[number]))
        return taken


class _Clock(Protocol):
    """The time of the loop."""

    real: bool
    woken: list[int]
    """Numbers of the runs that have news before their time."""

    def reach(self, due_ns: int) -> int:
        """Waits until then, or until somebody is woken; the time."""

    def stop(self) -> None:
        """The loop has ended."""


class _Virtual:
    """Time that goes where the next scan is."""

    real = False

    def __init__(self) -> None:
        self.woken: list[int] = []

    def reach(self, due_ns: int) -> int:
        return due_ns

    def stop(self) -> None:
        """Nothing to give back."""


class _Real:
    """The host's time, and the networks that live in it: each is asked once whenever somebody scans."""

    real = True

    def __init__(self, networks: Sequence[RealNetwork], runs: Sequence[Running], start_ns: int) -> None:
        self.woken: list[int] = []
        self._networks = networks
        for network in networks:
            network.driven = True
        self._numbers = {id(unit.link): number for number, run in enumerate(runs) if run.pace == EVENT
                         for unit in run.plc.units}  # fmt: skip
        self._waits = len(networks) == 1 and bool(self._numbers)
        self._zero_ns = time.monotonic_ns() - start_ns

    def now(self) -> int:
        """The time."""
        return time.monotonic_ns() - self._zero_ns

    def behind(self, behind_ns: int) -> Callable[[], int]:
        """A clock that is behind this time by so much."""
        monotonic_ns, zero_ns = time.monotonic_ns, self._zero_ns + behind_ns
        return lambda: monotonic_ns() - zero_ns

    def reach(self, due_ns: int) -> int:
        while (left_ns := due_ns - (now_ns := self.now())) > 0:
            if not self._waits:
                time.sleep(left_ns / 1e9)
            elif self._networks[0].wait(left_ns / 1e9):
                self._serve(now_ns := self.now())
                if self.woken:
                    return now_ns
                time.sleep(min(left_ns, PATIENCE_NS) / 1e9)
        self._serve(now_ns)
        return now_ns

    def _serve(self, now_ns: int) -> None:
        """Asks the networks what happened until now, and notes whom it wakes."""
        self.woken.clear()
        for network in self._networks:
            for link in network.serve(now_ns):
                if (number := self._numbers.get(id(link))) is not None:
                    self.woken.append(number)

    def stop(self) -> None:
        for network in self._networks:
            network.driven = False


def epoch_ns() -> int:
    """The date of this moment, in nanoseconds since 1970, for what is kept beyond a run."""
    return time.time_ns()
