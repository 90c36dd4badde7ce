"""Which run is in which batch: those that are due at the same times, at most so many, again and again the same few batches."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from fbvm.run import batches as module
from fbvm.run.batches import FIRST_SCANS, TRY_AGAIN, Batch, Batches
from fbvm.run.running import Batched


class Run:
    """A run, as far as batches ask: in one whenever it is asked, unless it `wants` something."""

    def __init__(self, due_ns: int = 0, cycle_ns: int = 10, call: object = "code", scans: int = 50) -> None:
        self.due_ns, self.wants, self.asked = due_ns, False, 0
        self.plc = SimpleNamespace(scans=scans, cycle_ns=cycle_ns)
        self.place = SimpleNamespace(call=call)

    def enter_batch(self) -> Batched | None:
        self.asked += 1
        found: Any = self
        return None if self.wants else Batched(found, self.place, 0, 1000)  # type: ignore[arg-type]


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> Batches:
    """Batches of at most three, whose scans only move the time at which they are due."""

    def scan(batch: Batch, now_ns: int) -> list[int]:
        left = [number for number, each in batch.members.items() if each.run.wants]  # type: ignore[attr-defined]
        for number in left:
            del batch.members[number]
        batch.due_ns = now_ns + 10
        return left

    monkeypatch.setattr(module, "MOST", 3)
    monkeypatch.setattr(Batch, "scan", scan)
    return Batches(True)


def entered(kept: Batches, number: int, run: Any) -> Batch:
    found = kept.enter(number, run)
    assert found is not None and number in found.members
    return found


@pytest.mark.parametrize("other", [Run(due_ns=1), Run(cycle_ns=11), Run(call="others")])
def test_runs_are_in_one_batch_if_they_are_due_at_the_same_times_and_have_the_same_code(kept: Batches, other: Run) -> None:
    batch = entered(kept, 0, Run())
    assert entered(kept, 1, Run()) is batch and (batch.due_ns, batch.reason) == (0, "")
    assert entered(kept, 2, other) is not batch
    assert entered(kept, 3, Run()) is batch, "the third is the last one"
    full = entered(kept, 4, Run())
    assert full is not batch and sorted(batch.members) == [0, 1, 3]


def test_a_batch_takes_more_runs_at_its_next_time_and_none_at_that_of_its_scan(kept: Batches) -> None:
    batch = entered(kept, 0, Run())
    assert kept.scan(batch, 0) == []
    assert entered(kept, 1, Run(due_ns=10)) is batch, "it is due at 10 now"
    assert entered(kept, 2, Run(due_ns=0)) is not batch
    entered(kept, 3, Run(due_ns=10))
    assert kept.scan(batch, 10) == []
    assert entered(kept, 4, Run(due_ns=20)) is not batch, "three are in it"


def test_a_batch_that_all_have_left_is_used_again(kept: Batches) -> None:
    runs = [Run(), Run()]
    batch = entered(kept, 0, runs[0])
    entered(kept, 1, runs[1])
    runs[0].wants = True
    assert kept.scan(batch, 0) == [0] and list(batch.members) == [1]
    runs[1].wants = True
    assert kept.scan(batch, 10) == [1]
    other = entered(kept, 2, Run(due_ns=77, cycle_ns=5))
    assert other is batch and other.key[:2] == (77, 5)
    assert entered(kept, 3, Run(due_ns=78)) is not batch
    assert len(kept._batches) == 2


@pytest.mark.parametrize(("scans", "again"), [
    (0, 1), (FIRST_SCANS - 1, FIRST_SCANS), (FIRST_SCANS, FIRST_SCANS + TRY_AGAIN), (50, 50 + TRY_AGAIN)])
def test_a_run_that_could_not_enter_is_asked_again_some_scans_later(kept: Batches, scans: int, again: int) -> None:
    run: Any = Run(scans=scans)
    run.wants = True
    assert kept.enter(0, run) is None and run.asked == 1
    run.wants = False
    run.plc.scans = again - 1
    assert kept.enter(0, run) is None and run.asked == 1
    run.plc.scans = again
    assert kept.enter(0, run) is not None and run.asked == 2


def test_none_is_in_a_batch_where_they_are_not_allowed() -> None:
    run: Any = Run()
    assert Batches(False).enter(0, run) is None and run.asked == 0


def test_runs_that_may_not_stay_leave_and_their_batch_takes_others(kept: Batches) -> None:
    runs = [Run() for _ in range(3)]
    batch = next(iter({entered(kept, number, run) for number, run in enumerate(runs)}))
    other = entered(kept, 3, Run(due_ns=5))
    assert kept.check() == [] and sorted(batch.members) == [0, 1, 2]
    runs[1].wants = True
    assert kept.check() == [1] and sorted(batch.members) == [0, 2] and list(other.members) == [3]
    assert entered(kept, 5, Run()) is batch
    for run in runs:
        run.wants = True
    assert kept.check() == [0, 2] and list(batch.members) == [5]


class Member:
    """A run in a batch that counts its scans down."""

    def __init__(self, left: int, until_ns: int = 1 << 60) -> None:
        self.scans_left, self.times = left, list[int]()
        self.plc = SimpleNamespace(scans=7, scan_times=SimpleNamespace(add=lambda *given: None),
                                   lateness=SimpleNamespace(add=lambda *given: None))
        self.batched: Any = Batched(self, SimpleNamespace(leave=self._leave), 100, until_ns)  # type: ignore[arg-type]

    def _leave(self, plc: object, rounds: int, now_ns: int) -> None:
        self.scans_left -= rounds
        self.times.append(now_ns)

    def leave_batch(self, due_ns: int, missed: int) -> None:
        self.due = due_ns, missed


@pytest.mark.parametrize(("members", "scanned", "left"), [
    ((Member(4), Member(9)), [(0, 2), (10, 2), (20, 2), (30, 1), (40, 1), (50, 1), (60, 1), (70, 1)], [(30, [0]), (80, [1])]),
    ((Member(9, 20), Member(3, 15)), [(0, 2), (10, 2), ], [(20, [0, 1])]),
    ((Member(3),), [(0, 1), (10, 1)], [(20, [0])]),
])  # fmt: skip
def test_who_has_one_scan_left_or_whose_time_has_come_leaves_in_front_of_the_scan(
    monkeypatch: pytest.MonkeyPatch, members: tuple[Member, ...], scanned: list[tuple[int, int]],
    left: list[tuple[int, list[int]]],
) -> None:
    done: list[tuple[int, int]] = []
    monkeypatch.setattr(module, "BatchScans", lambda rows: SimpleNamespace(
        scan=lambda now_ns: done.append((now_ns, len(rows))) or []))
    batch, gone = Batch(), []
    batch.begin((0, 10, 1))
    for number, member in enumerate(members):
        batch.add(number, member.batched)
    while not batch.reason:
        now_ns = batch.due_ns
        if found := batch.scan(now_ns):
            gone.append((now_ns, found))
        assert batch.due_ns == (now_ns + 10 if batch.members else now_ns)
    assert (done, gone) == (scanned, left)
    assert all(member.scans_left < 2 or member.batched.until_ns <= left[-1][0] for member in members)
    assert all(each.times[-1] == now_ns - 10 - 100 for now_ns, numbers in left for each in (members[at] for at in numbers))


def test_a_batch_that_all_may_not_stay_in_is_used_for_others(kept: Batches) -> None:
    run = Run()
    batch = entered(kept, 0, run)
    run.wants = True
    assert kept.check() == [0] and not batch.members
    assert entered(kept, 1, Run(due_ns=77)) is batch and batch.key[0] == 77
    again = entered(kept, 2, Run())
    assert again is not batch and list(again.members) == [2]


def test_all_batches_are_brought_up_to_date(kept: Batches, monkeypatch: pytest.MonkeyPatch) -> None:
    settled: list[Batch] = []
    batches = [entered(kept, 0, Run()), entered(kept, 1, Run(due_ns=5))]
    monkeypatch.setattr(Batch, "settle", lambda batch: settled.append(batch))
    kept.settle()
    assert settled == batches
