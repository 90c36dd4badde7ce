"""A Dask cluster that executes the runs of a campaign."""

from __future__ import annotations

import os
import signal
from importlib.util import find_spec
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.campaign.executors import LIMIT_NS, InThisProcess
from fbvm.campaign.plan_file import Written, with_about
from fbvm.campaign.planning import images_of, plan_of, program_project
from fbvm.campaign.runs import Outcome
from fbvm.campaign.work import Batch, Bench, Mismatch
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


def test_a_scheduler_that_is_not_there_is_told_with_its_status(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign import cluster

    monkeypatch.setattr(cluster, "CONNECT_S", 0.1)
    result = CliRunner().invoke(main, ["campaign", "count.st", "--for", "1s", "--runs", "9", "--cluster", "tcp://127.0.0.1:9"])
    assert result.exit_code == status.NETWORK
    assert "tcp://127.0.0.1:9 is no Dask scheduler that answers" in result.stderr
