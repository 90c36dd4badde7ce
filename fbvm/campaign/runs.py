"""Executes the runs of a campaign; the results are the same whoever executes them, and in whatever order they come."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from fbvm.campaign.execution import Result
from fbvm.campaign.executors import LIMIT_NS, Executor, InThisProcess, in_processes
from fbvm.campaign.groups import Group, grouped
from fbvm.campaign.judge import CRASHED, Failure
from fbvm.campaign.plan import Plan
from fbvm.campaign.processes import Crashed, Late
from fbvm.campaign.shrinking import Shrunk
from fbvm.campaign.work import AnyBench, Batch, Shrinking, Task
from fbvm.run.time_limit import stopwatch

MOST_IN_BATCH = 500
QUICK_NS = 1_000_000_000
"""What takes less time is done in this process: others take about as long to begin."""
LONG_NS = 10_000_000_000
"""A run that takes longer than this is a batch of its own, whatever a second one would take."""
MOST_SHRUNK = 20
"""Groups whose first run is made smaller."""


@dataclass
class Outcome:
    """What came of a campaign so far."""

    plan: Plan
    results: dict[int, Result] = field(default_factory=dict)
    shrunk: dict[int, Shrunk] = field(default_factory=dict)
    """The smallest failing runs, by the number of the first run of their group."""
    failing: int = 0
    """How many runs failed."""

    def add(self, results: Sequence[Result]) -> None:
        """Takes further results."""
        self.results.update((result.number, result) for result in results)
        self.failing += sum(result.failure is not None for result in results)

    @property
    def rows(self) -> list[Result]:
        """The results in the order of their numbers."""
        return [self.results[number] for number in sorted(self.results)]

    @property
    def groups(self) -> list[Group]:
        """The groups of failing runs; those with most runs come first."""
        found = grouped(self.results)
        for group in found:
            group.shrunk = self.shrunk.get(group.first)
        return found

    @property
    def left(self) -> list[int]:
        """The numbers of the runs without a result."""
        return [number for number in range(self.plan.count) if number not in self.results]


def conduct(bench: AnyBench, outcome: Outcome, jobs: int, take: Callable[[Sequence[Result]], None],
            others: Executor | None = None, *, shrinks: bool = True) -> None:  # fmt: skip
    """Executes the runs that have no result in `outcome`; then, if it `shrinks`, makes the first run of each group of failures
    smaller.

    `take` is called with results as they come, and enters them.  `others` execute runs, else `jobs` processes of this machine, or
    this process if that is quicker and no run can end it.  What is in `outcome` at a KeyboardInterrupt is good.

    Raises Wrong for a project that cannot be executed; ConditionError, LookupError, TypeError and ValueError for names and
    conditions that do not fit its programs."""
    if bench.ends_processes:
        with others or in_processes(bench, jobs) as those:
            left, once_ns = _first_runs(those, outcome.left, take)
            _execute(those, left, _size(bench, once_ns, len(left), those.count), take)
            if shrinks:
                _shrink(those, outcome)
        return
    left, once_ns = _first_runs(InThisProcess(bench), outcome.left, take)
    is_quick = others is None and (jobs == 1 or once_ns * len(left) < QUICK_NS)
    with InThisProcess(bench) if is_quick else others or in_processes(bench, jobs) as those:
        _execute(those, left, 1 if is_quick else _size(bench, once_ns, len(left), those.count), take)
        if shrinks:
            _shrink(those, outcome)


def _first_runs(executor: Executor, left: Sequence[int], take: Callable[[Sequence[Result]], None]) -> tuple[Sequence[int], int]:
    """Executes one run or two, which find out what does not fit.  Returns the others, and how long a run takes: the first one
    takes longer, since all is made ready for it."""
    once_ns = 0
    for number in left[:2]:
        if once_ns > LONG_NS:
            break
        elapsed = stopwatch()
        _execute(executor, [number], 1, take)
        once_ns = elapsed()
        left = left[1:]
    return left, once_ns


def _size(bench: AnyBench, once_ns: int, count: int, workers: int) -> int:
    """How many runs a batch has, if each of so many takes so long, and so many workers share them."""
    return max(1, min(bench.batch_ns // max(once_ns, 1), MOST_IN_BATCH, count // workers))


def _execute(executor: Executor, numbers: Sequence[int], size: int, take: Callable[[Sequence[Result]], None]) -> None:
    """Executes runs in batches.  Of a batch that has ended its process each run is tried alone."""
    batches: list[Task] = [Batch(tuple(numbers[at : at + size])) for at in range(0, len(numbers), size)]
    alone: list[int] = []
    for task, found in executor.done(batches):
        assert isinstance(task, Batch)
        if isinstance(found, list):
            take(found)
        elif len(task.numbers) > 1:
            alone += task.numbers
        else:
            assert isinstance(found, Late | Crashed)
            take([ended(task.numbers[0], found)])
    if alone:
        _execute(executor, alone, 1, take)


def ended(number: int, found: Late | Crashed) -> Result:
    """The result of a run that has ended its process, or was ended."""
    how = found.how if isinstance(found, Crashed) else ""
    said = f"it has not ended within {LIMIT_NS // 1_000_000_000} s" if isinstance(found, Late) else "the process of the run ended"
    return Result(number, failure=Failure(CRASHED, f"{said} {how}".rstrip()))


def _shrink(executor: Executor, outcome: Outcome) -> None:
    groups = [group for group in outcome.groups if group.failure.kind != CRASHED][:MOST_SHRUNK]
    for task, found in executor.done([Shrinking(outcome.results[group.first]) for group in groups]):
        if isinstance(task, Shrinking) and isinstance(found, Shrunk):
            outcome.shrunk[task.result.number] = found
