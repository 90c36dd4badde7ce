"""Tasks done by processes of this machine, each within a limit of time; a process that does not answer is ended and replaced."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import connection, resource_tracker
from types import FrameType
from typing import Any, Generic, TypeAlias, TypeVar

from fbvm.base.host import handling, let_signals_through, signals_held
from fbvm.run.time_limit import time_limit

Task = TypeVar("Task")
Result = TypeVar("Result")
Line: TypeAlias = Any
"""One end of a pipe of `multiprocessing`, whose class differs by system."""

POLL_S = 0.2
"""How often limits are looked at while nobody answers."""
TRIES = 2
"""How often a task is begun whose process ends by itself."""


class Late:
    """What comes of a task that was not done within its limit."""


class Crashed:
    """What comes of a task that has ended its process, each time that it was tried."""


LATE, CRASHED = Late(), Crashed()


@dataclass
class _Worker(Generic[Task]):
    """A process, the task it does, and whether its time is over.  The time of a task begins when the process is ready."""

    process: multiprocessing.process.BaseProcess
    line: Line
    task: Task | None = None
    is_ready: bool = False
    expired: Callable[[], bool] = lambda: False


@dataclass
class Pool(Generic[Task, Result]):
    """Processes that do tasks by `work(number, task)`; `number` is that of the process, from 0 on, also of its replacement.

    `prepare` and `work` have to be functions that pickle knows, with parts that it knows.  Each process calls `prepare(number)`
    first.  Use it in a `with` statement: all processes are ended behind it."""

    count: int
    prepare: Callable[[int], None]
    work: Callable[[int, Task], Result]
    _workers: list[_Worker[Task] | None] = field(default_factory=list)

    def __enter__(self) -> Pool[Task, Result]:
        self._workers = [None] * self.count
        return self

    def __exit__(self, *raised: object) -> None:
        with signals_held():
            for number in range(len(self._workers)):
                self._end(number)

    def results(self, tasks: Iterable[Task], limit_ns: int) -> Iterator[tuple[Task, Result | Late | Crashed]]:
        """Each task with what came of it, in the order in which they end.  A task has `limit_ns`
        from its beginning on, without the start of a process."""
        left, begun = deque(tasks), dict[int, int]()
        while left or any(worker and worker.task is not None for worker in self._workers):
            for number in range(self.count):
                if left and ((worker := self._workers[number]) is None or worker.task is None):
                    self._begin(number, left.popleft(), limit_ns)
            busy = {worker.line: number for number, worker in enumerate(self._workers) if worker and worker.task is not None}
            ready = connection.wait(list(busy), POLL_S)
            for line, number in busy.items():
                worker = self._workers[number]
                assert worker is not None and worker.task is not None
                task = worker.task
                if line in ready:
                    try:
                        result = worker.line.recv()
                    except (EOFError, OSError):
                        self._end(number)
                        begun[id(task)] = begun.get(id(task), 0) + 1
                        if begun[id(task)] < TRIES:
                            left.appendleft(task)
                        else:
                            yield task, CRASHED
                        continue
                    if not worker.is_ready:
                        worker.is_ready, worker.expired = True, time_limit(limit_ns)
                        continue
                    worker.task = None
                    yield task, result
                elif worker.expired():
                    self._end(number)
                    yield task, LATE

    def _begin(self, number: int, task: Task, limit_ns: int) -> None:
        worker = self._workers[number] or self._started(number)
        worker.task = task
        if worker.is_ready:
            worker.expired = time_limit(limit_ns)
        with suppress(OSError):  # it has ended, which its line tells, too
            worker.line.send(task)

    def _started(self, number: int) -> _Worker[Task]:
        """A new process.  It is spawned, not forked: threads of the compiler may hold locks."""
        context = multiprocessing.get_context("spawn")
        resource_tracker.ensure_running()  # its start would let held signals through
        with signals_held():
            near, far = context.Pipe()
            process = context.Process(target=_serve, args=(far, number, self.prepare, self.work), daemon=True)
            process.start()
            worker = self._workers[number] = _Worker[Task](process, near)
        far.close()
        return worker

    def _end(self, number: int) -> None:
        worker, self._workers[number] = self._workers[number], None
        if worker:
            worker.process.kill()
            worker.process.join()
            worker.line.close()


def _serve(line: Line, number: int, prepare: Callable[[int], None],
           work: Callable[[int, Task], Result]) -> None:  # fmt: skip
    """What a process does: tasks, until nobody asks any more.  What they print is dropped."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115 - lives as long as the process
    with handling([signal.SIGINT], _wait_for_the_end):
        let_signals_through()
        prepare(number)
        with suppress(EOFError, OSError):
            line.send(None)
            while True:
                line.send(work(number, line.recv()))


def _wait_for_the_end(number: int, frame: FrameType | None) -> None:
    """Ctrl-C reaches all processes of a terminal; the one that has started this one ends it."""
