"""The loop that runs PLCs: scan the one that is due, wait for the next; in virtual time without waiting.

Time is real as soon as one attached network is real.  One thread, one selector, no sleep longer than to the next scan.
"""

from __future__ import annotations

import gc
import heapq
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import Protocol, cast

from fbvm.base.areas import NEVER
from fbvm.base.host import monotonic_clock
from fbvm.engine.clock import Clock
from fbvm.machine.plc import Plc
from fbvm.machine.scan.inputs import InputRecorder
from fbvm.run.batches import Batch, Batches
from fbvm.run.host_clock import function_at
from fbvm.run.host_date import local_date_ns
from fbvm.run.interrupts import Interrupts
from fbvm.run.running import CYCLIC, EVENT, Running, TimedWrite
from fbvm.run.watchdog import Watchdog
from fbvm.wire.link import Network, RealNetwork

RunNumbers = dict[int, None]
"""An ordered set of run numbers."""
PROGRESS_NS = 100_000_000
"""The shortest time between two calls of `progress`."""
PLC_PROGRESS_NS = 100_000
"""As much for each PLC, if that is more: all are brought up to date before it is called."""
SWITCH_ON_NS = 250_000
"""In real time, so much later than a PLC the next is switched on, rounded down to whole periods: twice what the first scans of
one take."""
FIRST_PERIODS = 10
"""In real time, for so many periods behind its first scan a PLC makes objects that stay."""
LONG_NS = 3_000_000
"""Of scans that take longer, none follow another at once, without coming back to the loop: it hears nothing meanwhile."""
PAUSE_NS = 1_000_000
"""How long the loop ignores a network that has events only for PLCs in cyclic pace, which collect them in their next scan."""


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
    """Runs a PLC in real time if one of its networks is real, else in virtual time, until the first of the bounds.

    `scans`, `for_ns`, `until` and `max_ns` are those of `Plc.run`; `writes` are written when their time has come.  `pace`
    "cyclic" keeps the period of the PLC.  "event" (real time only) scans again at once when a unit has changed words or its
    network has events, else when a timer ends, and at the latest when the period ends.  `progress` is called at most every
    100 ms.

    Returns what ended the run as `Plc.run` does, or "interrupted" after Ctrl-C.  How long scans took is in
    `plc.scan_times`, how late they began in `plc.lateness`.  Raises ValueError for bounds that make no sense."""
    running = Running(plc, scans=scans, for_ns=for_ns, until=until, max_ns=max_ns, writes=writes, pace=pace)
    run_all([running], (lambda: progress(plc)) if progress else None)
    return running.reason


def run_all(runs: Sequence[Running], progress: Callable[[], None] | None = None, until: Callable[[], bool] | None = None, *,
            resumed: bool = False) -> None:  # fmt: skip
    """Runs several PLCs side by side, each until its own end, which its `reason` says then.

    All have the same time, real if a network of any of them is real, so that PLCs may share a network.  `progress` is called
    at most every 100 ms.  When `until` returns True between two scans, the loop is left; the runs go on with `resumed`, after
    `Running.resume` of each.  `until` may not look at the PLCs: those in a batch are up to date only behind the loop."""
    networks = {id(unit.network): unit.network for run in runs for unit in run.plc.units if not unit.network.virtual_time}
    with _uncollected() if networks else nullcontext(_nothing) as keep:
        _run_all(runs, progress, until, resumed, list(networks.values()), keep)


@contextmanager
def _uncollected() -> Iterator[Callable[[], None]]:
    """Python's garbage collector leaves alone what is there already: to visit ten thousand PLCs takes several periods.  What is
    there later is left alone, too, when the function is called that this gives."""
    if gc.get_freeze_count():  # somebody else has decided
        yield _nothing
        return
    gc.freeze()
    try:
        yield gc.freeze
    finally:
        gc.unfreeze()


def _nothing() -> None:
    """In place of `gc.freeze`."""


def _run_all(runs: Sequence[Running], progress: Callable[[], None] | None, until: Callable[[], bool] | None, resumed: bool,
             networks: Sequence[Network], keep: Callable[[], None]) -> None:  # fmt: skip
    """`run_all`; `networks` are those of real time, `keep` keeps the garbage collector from what is there."""
    interrupts = Interrupts()
    clock: _Clock = _VirtualClock()
    watchdogs: list[Watchdog] = []
    if networks:
        _prepare(runs)
        watchdogs = [Watchdog(run.plc) for run in runs]
        clock = _begin_in_real_time(runs, cast(list[RealNetwork], networks), interrupts)
    else:
        _begin_in_virtual_time(runs, resumed, len(runs) == 1 and until is None)
    queue = _SingleRun(runs) if len(runs) == 1 else _Queue(runs)
    batches = Batches(len(watchdogs) > 1 and _are_alone(runs))
    all_on_ns = max((run.due_ns + FIRST_PERIODS * run.plc.cycle_ns for run in runs), default=0) if networks else 0
    told_ns, pause_ns = time.monotonic_ns(), max(PROGRESS_NS, PLC_PROGRESS_NS * len(runs))
    recorders = _recorders(runs)
    try:
        _begin(recorders)
        with interrupts:
            while (due_ns := queue.next_ns()) is not None:
                now_ns, woken = clock.reach(due_ns)
                _scan_all(queue, now_ns, woken, watchdogs, batches)
                if now_ns < all_on_ns:
                    keep()
                interrupts.check()
                if until and until():
                    break
                if progress and time.monotonic_ns() - told_ns >= pause_ns:
                    told_ns = time.monotonic_ns()
                    _end(recorders, batches)
                    progress()
                    _begin(recorders)
                    for number in batches.check():
                        queue.put(number, runs[number])
    except KeyboardInterrupt:
        for run in runs:
            run.reason = run.reason or "interrupted"
    finally:
        _end(recorders, batches)
        clock.stop()
        for watchdog in watchdogs:
            watchdog.stop()


def _recorders(runs: Sequence[Running]) -> list[InputRecorder]:
    """The recorders of the PLCs, if nobody outside has a turn between two scans of any of them."""
    recorders = [run.plc.input_recorder for run in runs]
    return [recorder for recorder in recorders if recorder] if _are_alone(runs) else []


def _are_alone(runs: Sequence[Running]) -> bool:
    """True if nobody outside looks at a PLC between two scans of any of them, but for `progress` of the loop."""
    return not any(run.calls_out for run in runs)


def _begin(recorders: Sequence[InputRecorder]) -> None:
    """From here on nobody outside has a turn between two scans."""
    for recorder in recorders:
        recorder.run_begins()


def _end(recorders: Sequence[InputRecorder], batches: Batches) -> None:
    """Up to here nobody outside had a turn."""
    batches.settle()
    for recorder in recorders:
        recorder.run_ends()


def _prepare(runs: Sequence[Running]) -> None:
    """Does what takes long once, before time begins."""
    for unit in (attached.own for run in runs for attached in run.plc.units):
        if unit is not None:
            unit.prepare()


def _begin_in_real_time(runs: Sequence[Running], networks: list[RealNetwork], interrupts: Interrupts) -> _RealClock:
    """Lets PLCs begin at the same moment, but for their phases.  Where there are many, one after another is switched on, some
    whole periods later, so that none misses a period because of the first scans of others, which take long."""
    start_ns = _latest_ns(runs)
    clock = _RealClock(networks, runs, start_ns, interrupts)
    for number, run in enumerate(runs):
        plc = run.plc
        later_ns = run.phase_ns + (0 if plc.scans else number * SWITCH_ON_NS // plc.cycle_ns * plc.cycle_ns)
        if not plc.servicing.clock_ns:
            plc.servicing.clock_ns = local_date_ns() - start_ns + later_ns
        run.begin(start_ns + later_ns, clock.behind)
    return clock


def _begin_in_virtual_time(runs: Sequence[Running], resumed: bool, alone: bool) -> None:
    """Lets PLCs begin at the same moment, or each where it stood; nothing happens between two periods of virtual time."""
    start_ns = _latest_ns(runs)
    for run in runs:
        run.begin(run.plc.elapsed_ns if resumed else start_ns)
        run.pace, run.alone = CYCLIC, alone


def _latest_ns(runs: Sequence[Running]) -> int:
    return max((run.plc.elapsed_ns for run in runs), default=0)


def _scan_all(queue: _Queue | _SingleRun, now_ns: int, woken: RunNumbers, watchdogs: list[Watchdog],
              batches: Batches) -> None:  # fmt: skip
    """Scans all runs that are woken or due, with the same time for all.  In real time each run has a watchdog."""
    first_ns = began_ns = time.monotonic_ns()
    for number in queue.take(now_ns, woken):
        run = queue.runs[number]
        if run.reason:  # it has ended, and is woken nevertheless
            continue
        if isinstance(run, Batch):
            left = batches.scan(run, now_ns)
            queue.put(number, run)  # in front of those that have left, so that they find it at its next time
            for one in left:
                watchdogs[one].end()
                queue.put(one, queue.runs[one])
            began_ns = time.monotonic_ns()
            continue
        plc, due_ns = run.plc, run.due_ns
        scan = plc.scans
        if watchdogs:
            watchdogs[number].begin(began_ns)
        times = run.scan(now_ns)
        if watchdogs:
            watchdogs[number].end()
        ended_ns = time.monotonic_ns()
        run.takes_long = ended_ns - began_ns > LONG_NS * (len(times) or 1)
        if times:
            plc.scan_times.note_burst(scan, times, ended_ns - began_ns)
        elif scans := plc.scans - scan:
            plc.scan_times.note(scan, (ended_ns - began_ns) // scans, scans)
            if watchdogs and run.pace == CYCLIC:
                plc.lateness.note(scan, now_ns - due_ns + began_ns - first_ns)
        began_ns = ended_ns
        batch = batches.enter(number, run)
        if batch:
            watchdogs[number].begin_batch()
            queue.put_batch(batch)
        else:
            queue.put(number, run)


class _Queue:
    """A priority queue of runs by the time at which they are due.

    Each run is in the row of a time, which is when it is due or earlier.  A run that is woken often, and due later each time,
    is moved only when its row comes first; to move it each time would cost more than its scan."""

    def __init__(self, runs: Sequence[Running]) -> None:
        self.runs: list[Running | Batch] = list(runs)
        """The runs, and behind them batches."""
        self._numbers: dict[Batch, int] = {}
        self._times: list[int] = []
        """The times of the rows, as a heap."""
        self._rows: dict[int, list[int]] = {}
        """The numbers of the runs in each row; PLCs with the same period share one."""
        self._stands_ns = [NEVER] * len(runs)
        """For each run the time of its row; NEVER if it is in none.  Entries of a run in other rows are out of date."""
        for number, run in enumerate(runs):
            self.put(number, run)

    def put_batch(self, batch: Batch) -> None:
        """Puts a batch into the row of its time."""
        number = self._numbers.setdefault(batch, len(self.runs))
        if number == len(self.runs):
            self.runs.append(batch)
            self._stands_ns.append(NEVER)
        self.put(number, batch)

    def put(self, number: int, run: Running | Batch) -> None:
        """Puts a run into the row of its time, unless it has ended or is in an earlier row."""
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
        """The time at which the next run is due; None if all have ended."""
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

    def take(self, now_ns: int, woken: RunNumbers) -> RunNumbers:
        """Adds all runs that are due at `now_ns` to `woken`, and returns it.  The caller puts each back after its scan."""
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


class _SingleRun:
    """In place of a queue, for one run."""

    def __init__(self, runs: Sequence[Running]) -> None:
        self.runs: Sequence[Running | Batch] = runs

    def put_batch(self, batch: Batch) -> None:
        """A single run is in no batch."""

    def put(self, number: int, run: Running | Batch) -> None:
        """Nothing to do: the run itself says when it is due."""

    def next_ns(self) -> int | None:
        run = self.runs[0]
        return None if run.reason else run.due_ns

    def take(self, now_ns: int, woken: RunNumbers) -> RunNumbers:
        return {0: None}


class _Clock(Protocol):
    """The time of the loop."""

    def reach(self, due_ns: int) -> tuple[int, RunNumbers]:
        """Waits until `due_ns`, or until a network has events for a run.  Returns the time, and the runs that are woken."""

    def stop(self) -> None:
        """The loop has ended."""


class _VirtualClock:
    """Virtual time: it goes to the next scan without waiting."""

    def reach(self, due_ns: int) -> tuple[int, RunNumbers]:
        return due_ns, {}

    def stop(self) -> None:
        """Nothing to give back."""


class _RealClock:
    """The host's time, and the networks that live in it; each network is served once before scans."""

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
        """A clock for Python and machine code that is `behind_ns` behind the time of this loop."""
        monotonic_ns, zero_ns = time.monotonic_ns, self._zero_ns + behind_ns
        function = function_at(time.get_clock_info("monotonic").implementation)
        return Clock(lambda: monotonic_ns() - zero_ns, function, monotonic_clock() if function else 0, zero_ns)

    def reach(self, due_ns: int) -> tuple[int, RunNumbers]:
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
                time.sleep(min(left_ns, PAUSE_NS) / 1e9)
        return now_ns, self._serve(now_ns)

    def _serve(self, now_ns: int) -> RunNumbers:
        """Serves the networks at `now_ns`.  Returns the runs in event pace for which they have events."""
        numbers = self._numbers
        woken: RunNumbers = {}
        for network in self._networks:
            for link in network.serve(now_ns):
                if link in numbers:
                    woken[numbers[link]] = None
        return woken

    def stop(self) -> None:
        for network in self._networks:
            network.driven = False


def epoch_ns() -> int:
    """The date in nanoseconds since 1970, for files that outlive a run."""
    return time.time_ns()
