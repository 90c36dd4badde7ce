"""Tasks done by processes of this machine, each within a limit of time; a process that does not answer is ended and replaced.

Processes are started as programs of their own, not by `multiprocessing`: a worker of Dask, which may start none by that, needs
them, too."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from multiprocessing import connection
from types import FrameType
from typing import Any, Generic, TypeAlias, TypeVar

from fbvm.base.host import handling, let_signals_through, signals_held
from fbvm.run.time_limit import time_limit

Task = TypeVar("Task")
Result = TypeVar("Result")
Line: TypeAlias = Any
"""One end of a connection of `multiprocessing`, whose class differs by system."""
CODE = """import sys
from multiprocessing.connection import Client
line = Client({address!r})
sys.stdout.buffer.write(b"+")
sys.stdout.flush()
sys.path[:] = {path!r}
from fbvm.campaign.processes import serve
serve(line)
"""
"""What a process executes: it connects first, so that nobody waits for one that ends before."""

POLL_S = 0.2
"""How often limits are looked at while nobody answers."""
CLOSED_S = 1.0
"""How long a process may live that has closed its line."""
TRIES = 2
"""How often a task is begun whose process ends by itself."""


class Late:
    """What comes of a task that was not done within its limit."""


@dataclass(frozen=True)
class Crashed:
    """What comes of a task that has ended its process, each time that it was tried; `how`, as far as it is known: by which
    signal, or with which status."""

    how: str = ""


LATE = Late()


class Hopeless(ValueError):
    """What `work` may raise to end all tasks: none of them can be done.  Any other error ends the process of its task."""


class NotStarted(OSError):
    """A process could not be started: it has ended before it connected."""


@dataclass
class Process:
    """A process that does what it is told at its line first: a function that pickle knows, which is called with the line."""

    process: subprocess.Popen[bytes]
    door: connection.Listener

    @cached_property
    def line(self) -> Line:
        """The connection to the process, which is awaited at its first use.  Raises NotStarted."""
        assert self.process.stdout
        if not self.process.stdout.read(1):
            raise NotStarted(f"{sys.executable} ended with status {self.process.wait()} before it began")
        return self.door.accept()

    def ended(self) -> Crashed:
        """How the process has ended, whose line is closed."""
        with suppress(subprocess.TimeoutExpired):
            status = self.process.wait(CLOSED_S)
            try:
                return Crashed(f"by {signal.Signals(-status).name}" if status < 0 else f"with status {status}")
            except ValueError:  # a signal without a name
                return Crashed(f"by signal {-status}")
        return Crashed()

    def end(self) -> None:
        """Ends the process, whatever it does."""
        self.process.kill()
        self.process.wait()
        if "line" in vars(self):
            self.line.close()
        self.door.close()
        assert self.process.stdout
        self.process.stdout.close()


def started() -> Process:
    """A new process.  To be called inside of `signals_held`, until who ends the process knows it: Ctrl-C might come between.
    Raises OSError."""
    door = connection.Listener()  # where only this user comes in
    code = CODE.format(address=door.address, path=sys.path)
    try:
        return Process(subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL), door)  # fmt: skip
    except OSError:
        door.close()
        raise


@dataclass
class _Worker(Generic[Task]):
    """A process, the task it does, and whether its time is over.  The time of a task begins when the process is ready."""

    process: Process
    task: Task | None = None
    is_told: bool = False
    is_ready: bool = False
    expired: Callable[[], bool] = lambda: False

    @property
    def line(self) -> Line:
        """The connection to the process."""
        return self.process.line


@dataclass
class Pool(Generic[Task, Result]):
    """Processes that do tasks by `work(number, task)`; `number` is that of the process, from 0 on, also of its replacement.

    `prepare` and `work` have to be functions that pickle knows, with parts that it knows, of modules that can be imported.  Each
    process calls `prepare(number)` first.  Use it in a `with` statement: all processes are ended behind it."""

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
        from its beginning on, without the start of a process.  Raises NotStarted, and Hopeless where `work` does."""
        left, begun = deque(tasks), Counter[int]()
        while left or any(worker and worker.task is not None for worker in self._workers):
            self._hand_out(left, limit_ns)
            busy = {worker.line: number for number, worker in enumerate(self._workers) if worker and worker.task is not None}
            ready = connection.wait(list(busy), POLL_S)
            for line, number in busy.items():
                worker = self._workers[number]
                assert worker is not None and worker.task is not None
                task = worker.task
                found = self._heard(number, worker, limit_ns) if line in ready else None
                if isinstance(found, Crashed):
                    begun[id(task)] += 1
                    if begun[id(task)] < TRIES:
                        left.appendleft(task)
                    else:
                        yield task, found
                elif found:
                    yield task, found[0]
                elif worker.expired():
                    self._end(number)
                    yield task, LATE

    def _hand_out(self, left: deque[Task], limit_ns: int) -> None:
        """Gives each process that does nothing a task, as far as there are some.  Processes that are missing start together."""
        idle = [number for number, worker in enumerate(self._workers) if worker is None or worker.task is None][: len(left)]
        for number in idle:
            with signals_held():
                self._workers[number] = self._workers[number] or _Worker[Task](started())
        for number in idle:
            self._begin(number, left.popleft(), limit_ns)

    def _heard(self, number: int, worker: _Worker[Task], limit_ns: int) -> tuple[Result] | Crashed | None:
        """What a process has sent: a result, None if it is ready to begin; Crashed if it has ended.  Raises Hopeless."""
        try:
            result = worker.line.recv()
        except (EOFError, OSError):
            how = worker.process.ended()
            self._end(number)
            return how
        if not worker.is_ready:
            worker.is_ready, worker.expired = True, time_limit(limit_ns)
            return None
        worker.task = None
        if isinstance(result, Hopeless):
            raise result
        return (result,)

    def _begin(self, number: int, task: Task, limit_ns: int) -> None:
        worker = self._workers[number]
        assert worker
        worker.task = task
        if worker.is_ready:
            worker.expired = time_limit(limit_ns)
        with suppress(BrokenPipeError, ConnectionResetError):  # it has ended, which its line tells, too
            if not worker.is_told:
                worker.line.send(partial(_do_tasks, number, self.prepare, self.work))
                worker.is_told = True
            worker.line.send(task)

    def _end(self, number: int) -> None:
        worker, self._workers[number] = self._workers[number], None
        if worker:
            worker.process.end()


def _do_tasks(number: int, prepare: Callable[[int], None], work: Callable[[int, Any], Any], line: Line) -> None:
    """Does tasks until nobody asks any more."""
    prepare(number)
    line.send(None)
    while True:
        task = line.recv()
        try:
            line.send(work(number, task))
        except Hopeless as error:
            line.send(error)


def serve(line: Line) -> None:
    """What a process does: what it is told first.  What it prints is dropped."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115 - lives as long as the process
    with handling([signal.SIGINT], _wait_for_the_end):
        let_signals_through()
        with suppress(EOFError, OSError):
            line.recv()(line)


def _wait_for_the_end(number: int, frame: FrameType | None) -> None:
    """Ctrl-C reaches all processes of a terminal; the one that has started this one ends it."""
