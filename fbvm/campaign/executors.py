"""Who executes the tasks of a campaign: this process, or several of this machine.

An executor is used in a `with` statement; `done` gives back each task with what came of it, Late or Crashed for one that
ends its process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Protocol, cast

from fbvm.campaign.processes import Crashed, Late, Pool
from fbvm.campaign.work import AnyBench, Done, Task

LIMIT_NS = 600_000_000_000
"""How long a task may take.  Scans have a budget of statements, so only what hangs itself takes longer."""


class Executor(AbstractContextManager["Executor"], Protocol):
    """Does tasks."""

    @property
    def count(self) -> int:
        """How many tasks it does at once; known inside the `with` statement."""

    def done(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Done | Late | Crashed]]:
        """Each task with what came of it, in the order in which they end."""


class InThisProcess(Executor):
    """Does one task after the other, in this process."""

    count = 1

    def __init__(self, bench: AnyBench) -> None:
        self._bench = bench

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Nothing to give back."""

    def done(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Done | Late | Crashed]]:
        for task in tasks:
            yield task, self._bench.work(0, task)


class Workers(AbstractContextManager["Workers"], Protocol):
    """Who does tasks elsewhere: processes of this machine, or a cluster."""

    @property
    def count(self) -> int:
        """How many tasks they do at once; known inside the `with` statement."""

    def results(self, tasks: Sequence[Task], limit_ns: int) -> Iterator[tuple[Task, Done | Late | Crashed]]:
        """Each task with what came of it, in the order in which they end."""


class ByWorkers(Executor):
    """Has others do the tasks, many at once."""

    def __init__(self, workers: Workers) -> None:
        self._workers = workers

    @property
    def count(self) -> int:
        return self._workers.count

    def __enter__(self) -> ByWorkers:
        self._workers.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._workers.__exit__(kind, error, trace)

    def done(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Done | Late | Crashed]]:
        yield from self._workers.results(tasks, LIMIT_NS)


def in_processes(bench: AnyBench, jobs: int) -> Executor:
    """Does so many tasks at once, each in a process of its own."""
    return ByWorkers(cast(Workers, Pool[Task, Done](jobs, bench.prepare, bench.work)))
