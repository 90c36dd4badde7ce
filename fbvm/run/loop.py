"""The loop that runs PLCs: scan the one that is due, wait for the next; in virtual time without waiting.

Time is real as soon as one attached network is real.  One thread, one selector, no sleep longer than to the next scan.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, cast

from fbvm.base.areas import NEVER
from fbvm.engine.clock import Clock
from fbvm.machine.plc import Plc
from fbvm.run.host_clock import function_at
from fbvm.run.interrupts import Interrupts
from fbvm.run.running import CYCLIC, EVENT, Running, TimedWrite
from fbvm.wire.link import RealNetwork

Numbers = dict[int, None]
"""Runs by their numbers, each once, in the order of their turns."""
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
    interrupts = Interrupts()
    clock: _Clock = _Virtual()
    if networks:
        clock = real = _Real(cast(list[RealNetwork], list(networks.values())), runs, start_ns, interrupts)
        for run in runs:
            run.begin(start_ns + run.phase_ns, real.behind)
    else:  # nothing happens between two periods of virtual time
        for run in runs:
            run.begin(start_ns)
            run.pace, run.alone = CYCLIC, len(runs) == 1
    queue = _Alone(runs) if len(runs) == 1 else _Queue(runs)
    told_ns = time.monotonic_ns()
    try:
        with interrupts:
            while (due_ns := queue.next_ns()) is not None:
                now_ns, woken = clock.reach(due_ns)
                _scan_all(queue, now_ns, woken, clock.real)
                interrupts.check()
                if progress and time.monotonic_ns() - told_ns >= PROGRESS_NS:
                    told_ns = time.monotonic_ns()
                    progress()
    except KeyboardInterrupt:
        for run in runs:
            run.reason = run.reason or "interrupted"
    finally:
        clock.stop()


def _scan_all(queue: _Queue | _Alone, now_ns: int, woken: Numbers, real: bool) -> None:
    """Scans of everybody who is woken or whose time has come, with the same time for all."""
    first_ns = began_ns = time.monotonic_ns()
    for number in queue.take(now_ns, woken):
        run = queue.runs[number]
        if run.reason:  # it has ended, and is woken nevertheless
            continue
        plc, due_ns = run.plc, run.due_ns
        scan = plc.scans
        times = run.scan(now_ns)
        ended_ns = time.monotonic_ns()
        if times:
            plc.scan_times.note_burst(scan, times, ended_ns - began_ns)
        elif scans := plc.scans - scan:
            plc.scan_times.note(scan, (ended_ns - began_ns) // scans, scans)
            if real and run.pace == CYCLIC:
                plc.lateness.note(scan, now_ns - due_ns + began_ns - first_ns)
        began_ns = ended_ns
        queue.put(number, run)


class _Queue:
    """Who scans when.

    Each stands in the row of a time, which is when it is due or before: who is woken again and again, and due later each
    time, moves on only when that row is the next."""

    def __init__(self, runs: Sequence[Running]) -> None:
        self.runs = runs
        self._times: list[int] = []
        """Of the rows, the next first."""
        self._rows: dict[int, list[int]] = {}
        """Who stands where, by number; PLCs with one period share a row."""
        self._stands_ns = [NEVER] * len(runs)
        """Time of the row in which each stands; where else it is found is out of date."""
        for number, run in enumerate(runs):
            self.put(number, run)

    def put(self, number: int, run: Running) -> None:
        """Remember when a run is due, unless it has ended."""
        due_ns = run.due_ns
        if run.reason:
            self._stands_ns[number] = NEVER
        elif due_ns < self._stands_ns[number]:
            self._stands_ns[number] = due_ns
            row = self._rows.get(due_ns)
            if row is None:
                self._rows[due_ns] = [number]
                heapq.heappush(self._times, due_ns)
            else:
                row.append(number)

    def next_ns(self) -> int | None:
        """When somebody is due; None if all have ended."""
        runs, stands_ns = self.runs, self._stands_ns
        while self._times:
            time_ns = self._times[0]
            row = self._rows[time_ns]
            while row:
                number = row[-1]
                if stands_ns[number] == time_ns:
                    if runs[number].due_ns == time_ns:
                        return time_ns
                    stands_ns[number] = NEVER
                    self.put(number, runs[number])
                row.pop()
            del self._rows[heapq.heappop(self._times)]
        return None

    def take(self, now_ns: int, woken: Numbers) -> Numbers:
        """Those that are woken, and all that are due; who has scanned one puts it back."""
        times = self._times
        while times and times[0] <= now_ns:
            time_ns = heapq.heappop(times)
            for number in self._rows.pop(time_ns):
                if self._stands_ns[number] == time_ns:
                    self._stands_ns[number] = NEVER
                    run = self.runs[number]
                    if run.due_ns <= now_ns:
                        woken[number] = None
                    else:
                        self.put(number, run)
        return woken


class _Alone:
    """Who is alone needs no queue."""

    def __init__(self, runs: Sequence[Running]) -> None:
        self.runs = runs

    def put(self, number: int, run: Running) -> None:
        """It says itself when it is due."""

    def next_ns(self) -> int | None:
        run = self.runs[0]
        return None if run.reason else run.due_ns

    def take(self, now_ns: int, woken: Numbers) -> Numbers:
        return {0: None}


class _Clock(Protocol):
    """The time of the loop."""

    real: bool

    def reach(self, due_ns: int) -> tuple[int, Numbers]:
        """Waits until then, or until somebody is woken; the time, and the runs that have news."""

    def stop(self) -> None:
        """The loop has ended."""


class _Virtual:
    """Time that goes where the next scan is."""

    real = False

    def reach(self, due_ns: int) -> tuple[int, Numbers]:
        return due_ns, {}

    def stop(self) -> None:
        """Nothing to give back."""


class _Real:
    """The host's time, and the networks that live in it: each is asked once whenever somebody scans."""

    real = True

    def __init__(self, networks: Sequence[RealNetwork], runs: Sequence[Running], start_ns: int,
                 interrupts: Interrupts) -> None:  # fmt: skip
        self._networks, self._interrupts = networks, interrupts
        for network in networks:
            network.driven = True
        self._numbers = {unit.link: number for number, run in enumerate(runs) if run.pace == EVENT
                         for unit in run.plc.units}  # fmt: skip
        self._waits = len(networks) == 1 and bool(self._numbers)
        self._zero_ns = time.monotonic_ns() - start_ns

    def behind(self, behind_ns: int) -> Clock:
        """A clock that is behind this time by so much."""
        monotonic_ns, zero_ns = time.monotonic_ns, self._zero_ns + behind_ns
        function = function_at(time.get_clock_info("monotonic").implementation)
        return Clock(lambda: monotonic_ns() - zero_ns, function, time.CLOCK_MONOTONIC if function else 0, zero_ns)

    def reach(self, due_ns: int) -> tuple[int, Numbers]:
        zero_ns = self._zero_ns
        while (left_ns := due_ns - (now_ns := time.monotonic_ns() - zero_ns)) > 0:
            self._interrupts.begin_wait()
            if not self._waits:
                time.sleep(left_ns / 1e9)
                found = False
            else:
                found = self._networks[0].wait(left_ns / 1e9)
            self._interrupts.waits = False
            if found:
                if woken := self._serve(now_ns := time.monotonic_ns() - zero_ns):
                    return now_ns, woken
                time.sleep(min(left_ns, PATIENCE_NS) / 1e9)
        return now_ns, self._serve(now_ns)

    def _serve(self, now_ns: int) -> Numbers:
        """Asks the networks what happened until now; whom it wakes."""
        numbers = self._numbers
        woken: Numbers = {}
        for network in self._networks:
            for link in network.serve(now_ns):
                if link in numbers:
                    woken[numbers[link]] = None
        return woken

    def stop(self) -> None:
        for network in self._networks:
            network.driven = False


def epoch_ns() -> int:
    """The date of this moment, in nanoseconds since 1970, for what is kept beyond a run."""
    return time.time_ns()
