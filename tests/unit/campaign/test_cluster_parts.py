"""What a campaign asks of Dask: a client, processes of this machine, a bench in each worker, tasks a few at a time."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of

from fbvm.base.version import VERSION
from fbvm.campaign.work import Mismatch, Unreachable

pytestmark = [pytest.mark.slow, pytest.mark.skipif(find_spec("distributed") is None, reason="the extra cluster is not installed")]


class Dask:
    """Stands in for Dask: what was asked of it, in order."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, error: Exception | None = None, versions: Any = None) -> None:
        from fbvm.campaign import cluster

        self.said: list[Any] = []
        self.error, self.versions, self.scratch = error, {"w": VERSION} if versions is None else versions, Path()
        for name, made in (("Client", self.client), ("LocalCluster", self.processes), ("deaf_children", self.deaf)):
            monkeypatch.setattr(cluster, name, made)

    def client(self, *given: Any, **named: Any) -> Any:
        self.said.append(("client", given, named))
        if self.error:
            raise self.error
        return self.closed("client", run=self.run)

    def run(self, function: Callable[..., Any], *given: Any, **named: Any) -> Any:
        self.said.append(("run", function, given, named))
        return self.versions

    def processes(self, *given: Any, local_directory: str, **named: Any) -> Any:
        self.scratch = Path(local_directory)
        assert self.scratch.is_dir()
        self.said.append(("processes", given, named))
        return self.closed("processes")

    @contextmanager
    def deaf(self) -> Iterator[None]:
        self.said.append("deaf")
        yield
        self.said.append("not deaf")

    def closed(self, name: str, **has: Any) -> Any:
        """What is told when it is closed, as a context manager that is what it enters."""
        dask = self

        class Made(SimpleNamespace):
            def __enter__(self) -> Any:
                return self

            def __exit__(self, *raised: object) -> None:
                assert dask.scratch.exists()
                dask.said.append(f"{name} closed")

        return Made(name=name, **has)


RUN = ("run", eval, ("__import__('fbvm').__version__",), {"on_error": "return"})
CLIENT = {"timeout": 10, "set_as_default": False}


def test_a_scheduler_elsewhere_is_asked_for_its_workers_and_left_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    dask = Dask(monkeypatch)
    with cluster.connected("tcp://h:1", 3) as client:
        assert client.name == "client"  # type: ignore[attr-defined]
        assert dask.said == [("client", ("tcp://h:1",), CLIENT), RUN]
    assert dask.said[2:] == ["client closed"]


def test_processes_of_this_machine_hear_no_signals_and_are_reached_from_here_only(monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    dask = Dask(monkeypatch)
    with cluster.connected(cluster.LOCAL, 3):
        [deaf, processes, heard, (_, [given], named), run] = dask.said
        assert (deaf, heard, given.name, named, run) == ("deaf", "not deaf", "processes", CLIENT, RUN)
        assert processes == ("processes", (), {
            "n_workers": 3, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "memory_limit": 0,
            "silence_logs": logging.CRITICAL})
    assert dask.said[5:] == ["client closed", "processes closed"] and not dask.scratch.exists()


@each_of("versions, error, raised, said", [
    (None, OSError("no way"), Unreachable, "tcp://h:1 is no Dask scheduler that answers: no way"),
    (None, ValueError("what?"), Unreachable, "tcp://h:1 is no Dask scheduler that answers: what?"),
    (None, RuntimeError("a mistake"), RuntimeError, "a mistake"),
    ({}, None, Unreachable, "the scheduler tcp://h:1 has no workers: start some by dask worker tcp://h:1"),
    ({"w": VERSION, "v": "0.1"}, None, Mismatch, f"the worker v has fbvm 0.1, not {VERSION}"),
    ({"w": ImportError("No module named 'fbvm'")}, None, Mismatch, "the worker w has no fbvm: No module named 'fbvm'"),
])
def test_a_cluster_that_cannot_be_used_says_why_and_is_left(versions: Any, error: Exception | None, raised: type[Exception],
                                                            said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    dask = Dask(monkeypatch, error=error, versions=versions)
    with pytest.raises(raised) as found, cluster.connected("tcp://h:1", 1):
        raise AssertionError("it was used")
    assert str(found.value) == said
    assert dask.said[1:] == ([] if error else [RUN, "client closed"])


def test_a_bench_is_sent_once_and_does_the_tasks_of_its_own_mark(monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    told: list[Any] = []

    def bench(mark: str) -> Any:
        return SimpleNamespace(mark=mark, close=lambda: told.append(f"{mark} closed"),
                               limited=lambda task, limit_ns: f"{mark} did {task} within {limit_ns}")  # fmt: skip

    plugins = {plugin.name: plugin for plugin in map(cluster._Prepared, map(bench, ("a", "b")))}
    monkeypatch.setattr(cluster, "get_worker", lambda: SimpleNamespace(plugins=plugins))
    assert [cluster._work(mark, 5, 9) for mark in ("a", "b")] == ["a did 5 within 9", "b did 5 within 9"]
    plugins["a"].teardown(None)
    assert told == ["a closed"]


class Future:
    """A task that ends at once, with itself."""

    status = "finished"

    def __init__(self, key: str, given: tuple[Any, ...]) -> None:
        self.key, self.given = key, given

    def result(self) -> str:
        return f"result of {self.given[2]}"


@each_of("tasks, first", [(0, 0), (1, 1), (7, 7), (8, 8), (9, 8), (20, 8)])
def test_each_thread_has_four_tasks_at_a_time_and_the_next_ones_come_with_results(
        tasks: int, first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    sent: list[Any] = []
    asked: list[Any] = []

    class Completed(list[Future]):
        update = list.extend

    def completed(futures: list[Future], **named: Any) -> Completed:
        asked.append((len(futures), named))
        return Completed(futures)

    def submit(*given: Any, **named: Any) -> Future:
        sent.append((given, named))
        return Future(f"key {len(sent)}", given)

    executor: Any = cluster.Cluster(SimpleNamespace(mark="m"), cluster.LOCAL, 2)
    executor._client = SimpleNamespace(submit=submit, loop="the loop")
    monkeypatch.setattr(cluster, "as_completed", completed)
    found = []
    for number, row in enumerate(executor.results(range(tasks), 77)):
        found.append(row)
        assert len(sent) == min(tasks, first + number), "a task is sent for each that has ended"
    assert found == [(task, f"result of {task}") for task in range(tasks)]
    assert sent == [((cluster._work, "m", task, 77), {"pure": False}) for task in range(tasks)]
    assert asked == ([(first, {"loop": "the loop"})] if tasks else [])


def test_a_cluster_is_as_large_as_its_threads_and_left_when_it_cannot_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    told: list[Any] = []

    @contextmanager
    def connected(*given: Any) -> Iterator[Any]:
        told.append(given)
        try:
            yield SimpleNamespace(register_plugin=lambda plugin: told.append(plugin.name), nthreads=nthreads,
                                  unregister_worker_plugin=lambda mark: told.append(f"without {mark}"))  # fmt: skip
        finally:
            told.append("left")

    def nthreads() -> dict[str, int]:
        raise OSError("gone")

    monkeypatch.setattr(cluster, "connected", connected)
    executor = cluster.Cluster(SimpleNamespace(mark="m"), "tcp://h:1", 5)
    assert executor.count == 5
    with pytest.raises(OSError, match="gone"), executor:
        raise AssertionError("it was used")
    assert told == [("tcp://h:1", 5), "m", "without m", "left"]
