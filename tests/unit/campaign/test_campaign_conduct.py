"""Who executes the runs of a campaign, in which batches, and what is made smaller; what is drawn for a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from typing import Any

import pytest

from fbvm.base.diagnostics import Source
from fbvm.campaign import axes, runs
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.execution import Result
from fbvm.campaign.fleet.shard import Figures
from fbvm.campaign.items.execution import conditions_of
from fbvm.campaign.judge import CRASHED, NEVER, Failure
from fbvm.campaign.plan import EXACT, REAL, Axis, FaultRule, Moments, Plan, PowerRule
from fbvm.campaign.runs import Outcome, conduct
from fbvm.campaign.shrinking import Shrunk
from fbvm.campaign.variants import Cut, NamedFault, Variant, draw, phase_ns, project_of, settings_of
from fbvm.campaign.work import Batch, Shrinking
from fbvm.net.faults import NAMED
from fbvm.run.project import PlcRow, Project, SetRow
from fbvm.run.varied import PowerCut, Written

MS, S = 1_000_000, 1_000_000_000
PROJECT = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())
BAD = Failure(NEVER, "Main.Up")


class Bench:
    """Does tasks at once: the runs of `failing` fail, each in a group of its own."""

    def __init__(self, count: int, failing: Sequence[int] = (), ends_processes: bool = False, batch_ns: int = 100 * MS) -> None:
        self.plan, self.failing = Plan(PROJECT, runs=count), set(failing)
        self.ends_processes, self.batch_ns = ends_processes, batch_ns
        self.done = list[Any]()

    def work(self, number: int, task: Any) -> Any:
        self.done.append(task.numbers if isinstance(task, Batch) else task.result.number)
        if isinstance(task, Batch):
            failures = {number: Failure(NEVER, f"{number}") for number in self.failing}
            return [Result(number, failure=failures.get(number)) for number in task.numbers]
        return Shrunk(Variant(task.result.number, 0, ()), task.result, 5)


class Others:
    """An executor with so many workers, which has a bench of its own."""

    def __init__(self, bench: Bench, count: int) -> None:
        self.bench, self.count, self.is_open = Bench(0, bench.failing), count, False

    def __enter__(self) -> Others:
        self.is_open = True
        return self

    def __exit__(self, *raised: object) -> None:
        self.is_open = False

    def done(self, tasks: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        assert self.is_open
        for task in tasks:
            yield task, self.bench.work(0, task)


def conducted(bench: Bench, others: Others, jobs: int = 2, run_ns: int = 10 * MS, monkeypatch: Any = None, own: bool = False,
              known: Sequence[int] = (), shrinks: bool = True) -> Outcome:  # fmt: skip
    """A campaign of which each run takes `run_ns`; `others` are given, or (`own`) stand for the processes of this machine."""
    monkeypatch.setattr(runs, "stopwatch", lambda: lambda: run_ns)
    monkeypatch.setattr(runs, "in_processes", lambda bench, jobs: others)
    outcome = Outcome(bench.plan)
    outcome.add([Result(number) for number in known])
    conduct(bench, outcome, jobs, outcome.add, None if own else others, shrinks=shrinks)  # type: ignore[arg-type]
    assert sorted(outcome.results) == list(range(bench.plan.count)) and not others.is_open
    return outcome


def test_two_runs_are_done_here_and_the_others_in_batches_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(23)
    others = Others(bench, 2)
    conducted(bench, others, monkeypatch=monkeypatch)
    assert bench.done == [(0,), (1,)] and others.bench.done == [tuple(range(2, 12)), tuple(range(12, 22)), (22,)]


def test_what_is_there_already_is_not_done_again(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(8)
    others = Others(bench, 1)
    conducted(bench, others, known=(0, 1, 2, 5), monkeypatch=monkeypatch)
    assert bench.done == [(3,), (4,)] and others.bench.done == [(6, 7)]


@pytest.mark.parametrize(("jobs", "run_ns", "count", "is_here"), [
    (1, S, 9, True), (2, 100 * MS, 11, True), (2, 100 * MS, 12, False), (2, 125 * MS, 9, True), (2, 125 * MS, 10, False)])
def test_what_takes_less_than_a_second_is_done_here_one_run_after_the_other(
        jobs: int, run_ns: int, count: int, is_here: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(count)
    others = Others(bench, 2)
    conducted(bench, others, jobs, run_ns, monkeypatch, own=True)
    assert (others.bench.done == []) is is_here
    if is_here:
        assert bench.done == [(number,) for number in range(count)]


def test_runs_that_may_end_their_process_are_all_done_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    for own in (False, True):
        bench = Bench(5, ends_processes=True)
        others = Others(bench, 1)
        conducted(bench, others, monkeypatch=monkeypatch, own=own)
        assert bench.done == [] and others.bench.done == [(0,), (1,), (2, 3, 4)]


def test_of_runs_that_take_long_one_says_how_long(monkeypatch: pytest.MonkeyPatch) -> None:
    for run_ns, first in ((10 * S, [(0,), (1,)]), (10 * S + 1, [(0,)])):
        bench = Bench(5)
        conducted(bench, Others(bench, 1), run_ns=run_ns, monkeypatch=monkeypatch)
        assert bench.done == first


@pytest.mark.parametrize(("once_ns", "count", "workers", "size"), [
    (10 * MS, 1000, 2, 10), (0, 10_000, 2, 500), (100 * MS + 1, 1000, 2, 1), (100 * MS, 1000, 2, 1), (50 * MS, 1000, 2, 2),
    (1, 90, 4, 22), (1, 3, 4, 1), (1, 0, 4, 1)])  # fmt: skip
def test_a_batch_is_as_long_as_it_should_be_and_all_workers_have_some(once_ns: int, count: int, workers: int, size: int) -> None:
    assert runs._size(Bench(0), once_ns, count, workers) == size  # type: ignore[arg-type]


def test_the_first_runs_of_the_largest_groups_are_made_smaller_where_all_is_executed(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(40, range(10, 35))
    others = Others(bench, 2)
    outcome = conducted(bench, others, monkeypatch=monkeypatch)
    assert sorted(outcome.shrunk) == list(range(10, 30)) and [group.shrunk is not None for group in outcome.groups] == \
        [True] * 20 + [False] * 5
    assert bench.done == [(0,), (1,)] and others.bench.done[-20:] == list(range(10, 30))
    assert conducted(Bench(40, (3,)), Others(Bench(40, (3,)), 2), monkeypatch=monkeypatch, shrinks=False).shrunk == {}
    assert conducted(Bench(5, (3,), True), Others(Bench(5, (3,)), 2), monkeypatch=monkeypatch, shrinks=False).shrunk == {}


def test_a_run_that_has_ended_its_process_is_not_made_smaller() -> None:
    outcome = Outcome(Plan(PROJECT, runs=2))
    outcome.add([Result(0, failure=Failure(CRASHED, "it has ended")), Result(1, failure=BAD)])
    others = Others(Bench(0), 1)
    with others:
        runs._shrink(others, outcome)  # type: ignore[arg-type]
    assert list(outcome.shrunk) == [1] and isinstance(Shrinking(Result(0)).result, Result)


# --- what a run is ------------------------------------------------------------------------------------------------------


def row(name: str, **more: Any) -> PlcRow:
    return PlcRow(name, (), None, None, "iec", (), 10 * MS, S, "cyclic", "python", None, None, (), (), (), **more)


AXES = (axis_from_text("Main.n=1,2"), Axis("Main.m", "value", (3, 4), "pump", "Main.m", 5),
        Axis("cycle", "cycle", (20 * MS, 30 * MS)), Axis("pump.cycle", "cycle", (40 * MS, 50 * MS), "pump"),
        Axis("phase", "phase", (1, 2)), Axis("pump.phase", "phase", (10, 20), "pump"),
        Axis("pump.timing", "timing", (EXACT, REAL), "pump"))  # fmt: skip
SLOW, LOST = NamedFault("slow", NAMED["slow"].fault), NAMED["silent"].fault


def test_the_project_of_a_run_has_its_values_and_faults() -> None:
    project = replace(PROJECT, net="tcp", faults=(LOST,), plcs=(row("pump"), row("tank")))
    plan = Plan(project, axes=AXES)
    variant = Variant(3, 99, (1, 0, 0, 1, 1, 0, 1), (SLOW,), (), EXACT)
    made = project_of(plan, variant)
    assert (made.net, made.faults) == ("loop", (SLOW.fault, LOST))
    pump, tank = made.plcs
    assert (pump.cycle_ns, tank.cycle_ns) == (50 * MS, 20 * MS), "what is said of one PLC counts, not what is said of all"
    assert pump.sets == (SetRow("Main.n", 2, 0), SetRow("Main.m", 3, 5)) and tank.sets == (SetRow("Main.n", 2, 0),)
    assert (phase_ns(plan, variant, "pump"), phase_ns(plan, variant, "tank")) == (12, 2)
    assert [value for _, value in settings_of(plan, variant, "tank")] == [2, 20 * MS, 2]


def test_the_conditions_of_tests_are_those_of_the_run() -> None:
    plan = Plan(PROJECT, axes=AXES)
    variant = Variant(3, 99, (1, 0, 0, 1, 1, 0, 1), (SLOW,), (Cut("pump", S, MS, True),), REAL)
    made = conditions_of(plan, variant)
    assert (made.seed, made.timing) == (99, REAL)
    assert made.written == (Written("Main.n", 2, 0), Written("Main.m", 3, 5))
    assert (made.cycles_ns, made.phases_ns) == ((("", 20 * MS), ("pump", 50 * MS)), (("", 2), ("pump", 10)))
    assert made.timings == (("pump", REAL),)
    assert (made.faults, made.cuts) == ((SLOW.fault,), (PowerCut("pump", S, MS, True),))


def test_what_is_drawn_lies_within_its_bounds_and_reaches_them() -> None:
    rule = FaultRule(Moments((S, S + 2 * MS), (MS, 2 * MS), 4), (("slow", SLOW.fault), ("silent", LOST)), {"latency_ns": (5, 7)})
    power = PowerRule(Moments((0, 3 * MS), (0, 0), 2), ("a", "b"))
    plan = Plan(PROJECT, runs=60, faults=(rule,), cuts=(power,), axes=(Axis("n", "value", (1, 2, 3)),))
    drawn = [draw(plan, number) for number in range(60)]
    faults = [named for variant in drawn for named in variant.faults]
    kinds = {(named.kind, named.fault.latency_ns) for named in faults}
    assert kinds == {(kind, latency_ns) for kind in ("slow", "silent") for latency_ns in (5, 7)}
    assert {named.fault.from_ns for named in faults} == {S, S + MS, S + 2 * MS} and len(faults) == 240
    assert {named.fault.until_ns - named.fault.from_ns for named in faults} == {MS, 2 * MS}
    cuts = [cut for variant in drawn for cut in variant.cuts]
    assert {cut.at_ns for cut in cuts} == {0, MS, 2 * MS, 3 * MS} and {cut.plc for cut in cuts} == {"a", "b"}
    assert {cut.off_ns for cut in cuts} == {0} and {variant.values for variant in drawn} == {(0,), (1,), (2,)}
    assert {variant.timing for variant in drawn} == {REAL} and len({variant.seed for variant in drawn}) == 60
    empty = FaultRule(Moments((S, S), (0, 0)), (("slow", SLOW.fault),))
    [named] = draw(Plan(PROJECT, runs=1, faults=(empty,)), 0).faults
    assert named.fault.until_ns == S + 1, "a fault lasts for a moment at least"


def test_a_range_has_so_many_values_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(axes, "MOST_VALUES", 5)
    for written in ("n=1..5", "n=0.0..0.4/0.1", "n=T#0ms..T#9ms/2ms"):
        assert len(axis_from_text(written).values) == 5
    for written in ("n=1..6", "n=T#0ms..T#10ms/2ms"):
        with pytest.raises(ValueError, match="a range has 5 values at most"):
            axis_from_text(written)


def test_a_part_of_a_fleet_begins_with_nothing() -> None:
    assert asdict(Figures(3)) == {
        "number": 3, "state": "building", "plcs": 0, "scans": 0, "missed": 0, "traps": 0, "connections": 0, "elapsed_s": 0.0,
        "ended": {}, "doors": {}, "scan_time": {}, "lateness": {}, "message": ""}
