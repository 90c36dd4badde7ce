"""A Dask cluster that executes the runs of a campaign."""

from __future__ import annotations

import os
import signal
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from fbvm.base.version import VERSION
from fbvm.campaign.executors import LIMIT_NS, InThisProcess
from fbvm.campaign.plan_file import Written, with_about
from fbvm.campaign.planning import images_of, plan_of, program_project
from fbvm.campaign.runs import Outcome
from fbvm.campaign.work import Batch, Bench, Mismatch, Unreachable
from fbvm.cli.main import main
from fbvm.cli.shared import status

pytestmark = [pytest.mark.slow, pytest.mark.skipif(find_spec("distributed") is None, reason="the extra cluster is not installed")]

PROGRAM = "PROGRAM Main VAR n, limit : INT; END_VAR n := n + 1; n := n / (n - limit); END_PROGRAM\n"


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    (tmp_path / "count.st").write_text(PROGRAM)
    monkeypatch.chdir(tmp_path)
    written = with_about(Written(), **{"for": 1_000_000_000, "runs": 40, "show": ("Main.n",)})
    project = program_project([Path("count.st")], written.about, Path())
    images, _ = images_of(project)
    return Bench.of(plan_of(written, project, images), images)


def test_the_workers_of_a_cluster_keep_what_was_sent_until_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    kept: dict[str, object] = {}
    client = SimpleNamespace(register_plugin=lambda plugin: kept.update({plugin.name: plugin.bench}),
                             nthreads=lambda: {"a": 2, "b": 1}, unregister_worker_plugin=kept.pop)  # fmt: skip
    monkeypatch.setattr(cluster, "connected", lambda address, jobs: nullcontext(client))
    bench: Any = SimpleNamespace(mark="bench 1")
    with cluster.Cluster(bench, cluster.LOCAL, 2) as executor:
        assert (kept, executor.count) == ({"bench 1": bench}, 3)
    assert kept == {}
    client.unregister_worker_plugin = lambda mark: kept["gone"]
    with cluster.Cluster(bench, cluster.LOCAL, 2):
        """The scheduler goes away meanwhile."""


def test_a_cluster_gives_the_same_results_though_a_worker_is_killed(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    batches = [Batch((number,)) for number in range(40)]
    here, there = Outcome(bench.plan), Outcome(bench.plan)
    for _, found in InThisProcess(bench).done(batches):
        assert isinstance(found, list)
        here.add(found)
    with cluster.Cluster(bench, cluster.LOCAL, 2) as executor:
        client = executor._client
        victims = list(client.run(os.getpid).values())
        assert len(victims) == 2
        for number, (_, found) in enumerate(executor.results(batches, LIMIT_NS)):
            assert isinstance(found, list)
            there.add(found)
            if number == 0:
                os.kill(victims[0], signal.SIGKILL)
        assert there.rows == here.rows
        monkeypatch.setattr(cluster, "VERSION", "0.0.1")
        with pytest.raises(Mismatch, match=r"has fbvm .*, not 0\.0\.1"), cluster.Cluster(bench, client.scheduler.address, 1):
            raise AssertionError("a worker of another version was accepted")


class Ended:
    """A task of Dask, which is in the next of some states each time when it is said to have ended."""

    def __init__(self, key: str, *states: str) -> None:
        self.key, self.states = key, iter(states)

    @property
    def status(self) -> str:
        if not hasattr(self, "state"):
            self.state = next(self.states)
        return self.state

    def result(self) -> str:
        return f"result of {self.key}"


class Completed(list[Ended]):
    """Yields what has ended, also what is added meanwhile."""

    def __init__(self, tasks: list[Ended], loop: None) -> None:
        super().__init__(tasks)

    def add(self, task: Ended) -> None:
        task.state = next(task.states)
        self.append(task)

    update = list.extend


@pytest.mark.parametrize("state", ["lost", "pending"])
def test_a_result_that_goes_with_its_worker_is_waited_for(monkeypatch: pytest.MonkeyPatch, state: str) -> None:
    """It had ended, and the worker is killed before anybody has fetched what came of it."""
    from fbvm.campaign import cluster

    made = iter([Ended("a", state, state, "finished"), Ended("b", "finished")])
    executor: Any = cluster.Cluster(SimpleNamespace(mark="m"), cluster.LOCAL, 1)  # type: ignore[arg-type]
    executor._client = SimpleNamespace(submit=lambda *_, **__: next(made), loop=None)
    monkeypatch.setattr(cluster, "as_completed", Completed)
    assert list(executor.results([1, 2], LIMIT_NS)) == [(2, "result of b"), (1, "result of a")]


@pytest.mark.parametrize(("state", "raised", "said"), [
    ("error", None, ""), ("error", ValueError, "of the task"), ("cancelled", Unreachable, "tcp://h:1 has gone away")])
def test_a_task_that_fails_ends_all_unless_it_ends_its_workers(
        state: str, raised: type[Exception] | None, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    failing: Any = Ended("a", state)
    killed: Any = cluster.KilledWorker
    failing.exception = lambda: ValueError("of the task") if raised else killed("t", SimpleNamespace(address="w"), 3)
    made = iter([failing, Ended("b", "finished")])
    executor: Any = cluster.Cluster(SimpleNamespace(mark="m"), "tcp://h:1", 1)  # type: ignore[arg-type]
    executor._client = SimpleNamespace(submit=lambda *_, **__: next(made), loop=None)
    monkeypatch.setattr(cluster, "as_completed", Completed)
    if raised is None:
        found = [(task, type(each).__name__) for task, each in executor.results([1, 2], LIMIT_NS)]
        assert found == [(1, "Crashed"), (2, "str")]
    else:
        with pytest.raises(raised, match=said):
            list(executor.results([1, 2], LIMIT_NS))


@pytest.mark.parametrize(("workers", "raised", "said"), [
    ({}, Unreachable, "the scheduler a has no workers"), ({"w": VERSION}, None, ""),
    ({"w": VERSION, "v": OSError("no module")}, Mismatch, "the worker v has no fbvm: no module"),
    ({"w": "0.0"}, Mismatch, f"the worker w has fbvm 0.0, not {VERSION}")])  # fmt: skip
def test_workers_are_asked_for_their_version(workers: dict[str, Any], raised: type[Exception] | None, said: str) -> None:
    from fbvm.campaign import cluster

    client = SimpleNamespace(run=lambda made, asked, on_error: workers if asked == cluster.ASK_VERSION else {})
    if raised is None:
        cluster._check(client, "a")
    else:
        with pytest.raises(raised, match=said):
            cluster._check(client, "a")


def test_a_scheduler_that_is_not_there_is_told_with_its_status(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    monkeypatch.setattr(cluster, "CONNECT_S", 0.1)
    result = CliRunner().invoke(main, ["campaign", "count.st", "--for", "1s", "--runs", "9", "--cluster", "tcp://127.0.0.1:9"])
    assert result.exit_code == status.NETWORK
    assert "tcp://127.0.0.1:9 is no Dask scheduler that answers" in result.stderr
