"""Batches of runs in cyclic pace that are due at the same times: one call of machine code scans all their PLCs.

A run is in a batch while nobody has to be told of its scans.  A PLC behind whose scan somebody wants something, such as a unit
with a request for its network, leaves the batch, scans by itself, and comes back when it is quiet again."""

from __future__ import annotations

import time
from collections.abc import Sequence

from fbvm.machine.batch import BatchScans
from fbvm.machine.scan_times import Lateness, ScanTimes
from fbvm.run.running import Batched, Running

MOST = 32
"""So many PLCs one batch has at most: whenever one comes or leaves, all of them are brought up to date."""
TRY_AGAIN = 8
"""A run that could not enter a batch is asked again after so many scans."""
FIRST_SCANS = 4
"""After the first ones, in which its fast path is made, again at once."""


Key = tuple[int, int, int]
"""When runs are due, their period, and which machine code they have in common, which lives as long as the process."""


class Batch:
    """Some runs with the same period, the next scans of which are all at `due_ns` of the loop's time.

    How long scans took, and how late they began, is measured for all of them together: each is said to have taken the average,
    and to have begun as late as the last."""

    def __init__(self) -> None:
        self.due_ns = 0
        self.reason = "empty"
        """"" while there are runs in it."""
        self.members: dict[int, Batched] = {}
        """By the numbers of the runs."""
        self._order: list[int] = []
        self._scans: BatchScans | None = None
        self._until_ns = self._most = 0
        """The time, and the number of rounds, at which some have to scan by themselves."""
        self._rounds = self._now_ns = self._missed = self._cycle_ns = 0
        """Scans of each PLC of which its Python objects do not know yet, the time of the last, missed periods; the period."""
        self._times, self._lateness = ScanTimes(0), Lateness()
        self._call = 0

    def begin(self, key: Key) -> None:
        """The batch, which is empty, is for runs of this kind."""
        self.due_ns, self._cycle_ns, self._call = key
        self._forget()

    @property
    def key(self) -> Key:
        """What its runs have in common: when they are due, their period, their machine code."""
        return self.due_ns, self._cycle_ns, self._call

    def _forget(self) -> None:
        self._rounds = self._missed = 0
        self._times, self._lateness = ScanTimes(self._cycle_ns), Lateness()

    def add(self, number: int, batched: Batched) -> None:
        """Adds a run."""
        self.settle()
        self.members[number] = batched
        self._scans, self.reason = None, ""

    def settle(self) -> None:
        """Brings all PLCs up to date."""
        if self._rounds:
            for batched in self.members.values():
                self._settle(batched)
            self._forget()

    def _settle(self, batched: Batched) -> None:
        plc = batched.run.plc
        first_scan = plc.scans
        batched.place.leave(plc, self._rounds, self._now_ns - batched.behind_ns)
        plc.scan_times.add(self._times, first_scan)
        plc.lateness.add(self._lateness, first_scan)
        batched.run.leave_batch(self.due_ns, self._missed)

    def remove(self, numbers: Sequence[int]) -> None:
        """Removes runs; all PLCs are up to date."""
        for number in numbers:
            del self.members[number]
        self._scans = None
        if not self.members:
            self.reason = "empty"

    def scan(self, now_ns: int) -> list[int]:
        """One scan of each PLC at `now_ns`.  Returns the runs that have left; some may be due still."""
        left: list[int] = []
        if self._scans is None or now_ns >= self._until_ns or self._rounds >= self._most:
            self.settle()
            left = [number for number, batched in self.members.items()
                    if batched.until_ns <= now_ns or batched.run.scans_left < 2]  # fmt: skip
            if left:
                self.remove(left)
        return left + self._scan_all(now_ns) if self.members else left

    def _prepared(self) -> BatchScans:
        """The machine code of all that are in it now."""
        members = self.members.values()
        self._order = list(self.members)
        self._until_ns = min(batched.until_ns for batched in members)
        self._most = min(batched.run.scans_left for batched in members) - 1
        return BatchScans([(batched.place, batched.behind_ns) for batched in members])

    def _scan_all(self, now_ns: int) -> list[int]:
        scans = self._scans
        if scans is None:
            scans = self._scans = self._prepared()
        began_ns = time.monotonic_ns()
        wanting = {self._order[at]: point for at, point in scans.scan(now_ns)}
        took_ns = time.monotonic_ns() - began_ns
        each_ns, due_ns, missed = took_ns // len(self.members), self.due_ns, 0
        late_ns = now_ns - due_ns + took_ns - each_ns
        if now_ns < due_ns + self._cycle_ns:
            self.due_ns += self._cycle_ns
        else:
            missed = (now_ns - due_ns) // self._cycle_ns
            self.due_ns = now_ns + self._cycle_ns
        for number, point in wanting.items():
            batched = self.members[number]
            if self._rounds:
                self._settle(batched)
            plc, run = batched.run.plc, batched.run
            plc.scan_times.note(plc.scans, each_ns)
            plc.lateness.note(plc.scans, late_ns)
            batched.place.finish(plc, now_ns - batched.behind_ns, point)
            run.leave_batch(self.due_ns, missed)
            del self.members[number]
        self._times.note(self._rounds, each_ns)
        self._lateness.note(self._rounds, late_ns)
        self._rounds += 1
        self._missed += missed
        self._now_ns = now_ns
        if wanting:
            self.settle()
            self.remove(())
        return list(wanting)


class Batches:
    """All batches of a loop, by when they are due, their period and their machine code.  None unless they are `allowed`."""

    def __init__(self, allowed: bool) -> None:
        self._allowed = allowed
        self._batches: list[Batch] = []
        self._open: dict[Key, Batch] = {}
        """Those that take more runs."""
        self._empty: list[Batch] = []
        self._again: dict[int, int] = {}
        """By the numbers of runs that could not enter: from which scan on they are asked again."""

    def enter(self, number: int, run: Running) -> Batch | None:
        """The batch into which the run has been put; None if it has to scan by itself."""
        scans = run.plc.scans
        if not self._allowed or scans < self._again.get(number, 0):
            return None
        batched = run.enter_batch()
        if batched is None:
            self._again[number] = scans + (TRY_AGAIN if scans >= FIRST_SCANS else 1)
            return None
        key = run.due_ns, run.plc.cycle_ns, id(batched.place.call)
        batch = self._open.get(key)
        if batch is None:
            batch = self._open[key] = self._made()
            batch.begin(key)
        batch.add(number, batched)
        if len(batch.members) >= MOST:
            del self._open[key]
        return batch

    def _made(self) -> Batch:
        """A batch without members."""
        if not self._empty:
            self._empty.append(Batch())
            self._batches.append(self._empty[-1])
        return self._empty.pop()

    def scan(self, batch: Batch, now_ns: int) -> list[int]:
        """One scan of each PLC of a batch at `now_ns`.  Returns the runs that have left; some may be due still."""
        self._close(batch)
        left = batch.scan(now_ns)
        self._keep(batch)
        return left

    def _close(self, batch: Batch) -> None:
        """No further run comes into the batch at the time at which it is due now."""
        if self._open.get(batch.key) is batch:
            del self._open[batch.key]

    def _keep(self, batch: Batch) -> None:
        """Remembers a batch to which runs have come, or from which they have gone."""
        if not batch.members:
            self._empty.append(batch)
        elif len(batch.members) < MOST:
            self._open[batch.key] = batch

    def settle(self) -> None:
        """Brings all PLCs up to date."""
        for batch in self._batches:
            batch.settle()

    def check(self) -> list[int]:
        """Removes the runs that may not stay, since somebody outside had a turn; all PLCs are up to date.  Returns their
        numbers."""
        left: list[int] = []
        for batch in self._batches:
            gone = [number for number, batched in batch.members.items() if batched.run.enter_batch() != batched]
            if gone:
                self._close(batch)
                batch.remove(gone)
                self._keep(batch)
                left += gone
        return left
