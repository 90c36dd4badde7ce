"""The loop that runs PLCs: scan the one that is due, wait for the next; in virtual time without waiting.

Time is real as soon as one attached network is real.  One thread, one selector, no sleep longer than to the next scan.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Protocol

from fbvm.plc import Plc
from fbvm.run.running import CYCLIC, EVENT, Running, TimedWrite
from fbvm.wire.link import Link

PROGRESS_NS = 100_000_000
"""How often progress is told, at most."""


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
    if not networks:  # nothing happens between two periods of virtual time
        for run in runs:
            run.pace = CYCLIC
    clock = _Real(list(networks.values()), runs) if networks else _Virtual()
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


def _scan_all(queue: _Queue, now_ns: int, real: bool) -> None:
    """One scan of everybody whose time has come, with the same time for all."""
    first_ns = began_ns = time.monotonic_ns()
    for run in queue.due(now_ns):
        plc, scan, due_ns = run.plc, run.plc.scans, run.due_ns
        run.scan(now_ns)
        if plc.scans > scan:
            ended_ns = time.monotonic_ns()
            plc.scan_times.note(scan, ended_ns - began_ns)
            if real and run.pace == CYCLIC:
                plc.lateness.note(scan, now_ns - due_ns + began_ns - first_ns)
            began_ns = ended_ns


class _Queue:
    """Who scans when."""

    def __init__(self, runs: Sequence[Running]) -> None:
        self._runs = runs
        self._rows = [(run.due_ns, number) for number, run in enumerate(runs) if not run.reason]
        self._queued = {number: due_ns for due_ns, number in self._rows}
        """The row of each that counts; others of its number are out of date."""

    def next_ns(self) -> int | None:
        """When somebody is due; None if all have ended."""
        while self._rows and self._queued.get(self._rows[0][1]) != self._rows[0][0]:
            heapq.heappop(self._rows)
        return self._rows[0][0] if self._rows else None

    def hasten(self, number: int, now_ns: int) -> None:
        """Let one be due already now."""
        if self._queued.get(number, now_ns) > now_ns:
            self._runs[number].due_ns = now_ns
            self._put(number, now_ns)

    def due(self, now_ns: int) -> Iterator[Running]:
        """Takes out those that are due, each once; when the caller has scanned it, it is put back."""
        taken = []
        while (next_ns := self.next_ns()) is not None and next_ns <= now_ns:
            number = heapq.heappop(self._rows)[1]
            del self._queued[number]
            taken.append(number)
        for number in taken:
            run = self._runs[number]
            yield run
            if not run.reason:
                self._put(number, run.due_ns)

    def _put(self, number: int, due_ns: int) -> None:
        self._queued[number] = due_ns
        heapq.heappush(self._rows, (due_ns, number))


class _Clock(Protocol):
    """The time of the loop, which begins with 0."""

    real: bool
    woken: Sequence[int]
    """Numbers of the runs that have news before their time."""

    def reach(self, due_ns: int) -> int:
        """Waits until then, or until somebody is woken; the time."""


class _Virtual:
    """Time that goes where the next scan is."""

    real = False
    woken: Sequence[int] = ()

    def reach(self, due_ns: int) -> int:
        return due_ns


class _Real:
    """The host's time."""

    real = True

    def __init__(self, networks: Sequence[object], runs: Sequence[Running]) -> None:
        self.woken: Sequence[int] = ()
        waits: list[Callable[[float], Collection[Link]]] = [
            wait for network in networks if (wait := getattr(network, "wait", None))]  # fmt: skip
        self._numbers = {id(unit.link): number for number, run in enumerate(runs) if run.pace == EVENT
                         for unit in run.plc.units}  # fmt: skip
        self._wait = waits[0] if len(waits) == 1 and self._numbers else None
        self._zero_ns = time.monotonic_ns()

    def reach(self, due_ns: int) -> int:
        self.woken = ()
        while (left_ns := due_ns - (time.monotonic_ns() - self._zero_ns)) > 0:
            if self._wait is None:
                time.sleep(left_ns / 1e9)
            elif woken := self._wait(left_ns / 1e9):
                self.woken = [self._numbers[id(link)] for link in woken if id(link) in self._numbers]
                break
        return time.monotonic_ns() - self._zero_ns


def epoch_ns() -> int:
    """The date of this moment, in nanoseconds since 1970, for what is kept beyond a run."""
    return time.time_ns()
