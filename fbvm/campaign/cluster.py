"""Has a Dask cluster do tasks: processes of this machine, or those of a scheduler somewhere.

What the tasks need, a bench, travels once to each worker, also to one that comes later.  A worker that goes away loses nothing:
the scheduler gives its tasks to another one.  A scheduler executes whatever it is sent: it belongs into a network that one
trusts."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from tempfile import TemporaryDirectory
from typing import Any, Generic, Protocol, TypeVar, cast

from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
from distributed.scheduler import KilledWorker

from fbvm.base.host import deaf_children
from fbvm.base.version import VERSION
from fbvm.campaign.processes import Crashed, Late
from fbvm.campaign.work import Mismatch, Unreachable

Task = TypeVar("Task")
Result = TypeVar("Result")
Given = TypeVar("Given", contravariant=True)
Made = TypeVar("Made", covariant=True)

LOCAL = "local"
"""In place of an address: processes of this machine."""
TASKS_A_WORKER = 4
"""Tasks that are with the scheduler at a time, for each thread of its workers: the next ones come with the results."""
AGAIN = ("lost", "pending")
"""States of a task that had ended: the result went with its worker before anybody had fetched it, and it is done again."""
CONNECT_S = 10
ASK_VERSION = "__import__('fbvm').__version__"


class Workable(Protocol[Given, Made]):
    """What does tasks in a worker; pickle has to know it.  `mark` tells it from others."""

    @property
    def mark(self) -> str: ...

    def limited(self, task: Given, limit_ns: int) -> Made:
        """Does a task, for `limit_ns` at most where it can be ended."""

    def close(self) -> None:
        """Called in the worker when no more tasks come."""


class _Prepared(WorkerPlugin):
    """Keeps a bench in each worker."""

    def __init__(self, bench: Workable[Any, Any]) -> None:
        self.name, self.bench = bench.mark, bench

    def teardown(self, worker: Any) -> None:
        self.bench.close()


def _work(mark: str, task: Any, limit_ns: int) -> Any:
    """Does a task in a worker."""
    return cast(_Prepared, get_worker().plugins[mark]).bench.limited(task, limit_ns)


@contextmanager
def connected(address: str, jobs: int) -> Iterator[Client]:
    """A client of the scheduler at `address`, or of `jobs` processes of this machine, LOCAL.

    Raises Unreachable, and Mismatch for a worker with another version of fbvm or without it."""
    with ExitStack() as stack:
        cluster = address if address != LOCAL else stack.enter_context(_local(stack, jobs))
        try:
            client: Any = Client(cluster, timeout=CONNECT_S, set_as_default=False)  # type: ignore[no-untyped-call]
            stack.enter_context(client)
        except (OSError, ValueError) as error:
            raise Unreachable(f"{address} is no Dask scheduler that answers: {error}") from None
        _check(client, address)
        yield client


def _local(stack: ExitStack, jobs: int) -> Any:
    scratch = stack.enter_context(TemporaryDirectory())
    with deaf_children():  # they are ended by this process
        return LocalCluster(  # type: ignore[no-untyped-call]
            n_workers=jobs, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", memory_limit=0,
            local_directory=scratch, silence_logs=logging.CRITICAL)  # fmt: skip


def _check(client: Any, address: str) -> None:
    """Asks each worker for its version of fbvm."""
    found = client.run(eval, ASK_VERSION, on_error="return")
    if not found:
        raise Unreachable(f"the scheduler {address} has no workers: start some by dask worker {address}")
    for worker, version in found.items():
        if isinstance(version, Exception):
            raise Mismatch(f"the worker {worker} has no fbvm: {version}")
        if version != VERSION:
            raise Mismatch(f"the worker {worker} has fbvm {version}, not {VERSION}")


class Cluster(Generic[Task, Result]):
    """Does tasks in a cluster as a `Pool` does: at `address`, such as tcp://192.168.1.5:8786, or in `jobs` processes of this
    machine, LOCAL.

    Raises Unreachable, and Mismatch for a worker with another version of fbvm or without it."""

    def __init__(self, bench: Workable[Task, Result | Late | Crashed], address: str, jobs: int) -> None:
        self._bench, self._address, self._jobs = bench, address, jobs
        self.count = jobs
        """How many tasks are done at once: the threads of all workers that there were in the beginning."""

    def __enter__(self) -> Cluster[Task, Result]:
        with ExitStack() as stack:
            client: Any = stack.enter_context(connected(self._address, self._jobs))
            self._client = client
            self._client.register_plugin(_Prepared(self._bench))
            stack.callback(self._leave)
            self.count = sum(self._client.nthreads().values())
            self._stack = stack.pop_all()
        return self

    def _leave(self) -> None:
        """Takes the bench from the workers, as far as there are some."""
        with suppress(Exception):  # the scheduler may have gone
            self._client.unregister_worker_plugin(self._bench.mark)

    def __exit__(self, *raised: object) -> None:
        self._stack.close()

    def results(self, tasks: Iterable[Task], limit_ns: int) -> Iterator[tuple[Task, Result | Late | Crashed]]:
        """Each task with what came of it, in the order in which they end, Crashed for one that ends every worker that tries
        it."""
        left, waiting = iter(tasks), dict[str, Task]()

        def sent(count: int) -> list[Any]:
            made = []
            for task in islice(left, count):
                future = self._client.submit(_work, self._bench.mark, task, limit_ns, pure=False)
                waiting[future.key] = task
                made.append(future)
            return made

        if not (first := sent(TASKS_A_WORKER * self.count)):
            return
        running: Any = as_completed(first, loop=self._client.loop)  # type: ignore[no-untyped-call]
        for future in running:
            if future.status in AGAIN:
                running.add(future)
                continue
            task = waiting.pop(future.key)
            if future.status == "finished":
                yield task, future.result()
            elif future.status == "error" and isinstance(future.exception(), KilledWorker):
                yield task, Crashed()
            elif future.status == "error":
                raise future.exception()
            else:
                raise Unreachable(f"{self._address} has gone away; the same command goes on where it was")
            running.update(sent(1))
