"""Fleets: a project in parts that run apart, with the names, addresses and doors of the whole."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.version import VERSION
from fbvm.campaign.fleet import shard
from fbvm.campaign.fleet.places import in_cluster
from fbvm.campaign.fleet.shard import GO_ON, OVER, RUNNING, STOP, Figures, Shard, figures, run_shard
from fbvm.campaign.planning import images_of
from fbvm.campaign.work import packed
from fbvm.cli.main import main
from fbvm.cli.shared import status
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project
from fbvm.run.shards import shards_of
from fbvm.wire.link import Peer

PROJECT = """[plc.one]
sources = ["count.st"]
[[plc.one.unit]]
address = "10.0.0.1"
[plc.many]
sources = ["count.st"]
count = 5
[[plc.many.unit]]
address = "10.0.1.254"
[[door]]
address = "10.0.1.254:502"
bind = "127.0.1.1:5020"
count = 5
[[door]]
address = "10.0.0.1:502"
bind = "127.0.0.1:6020"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "count.st").write_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM")
    (tmp_path / "fbvm.toml").write_text(PROJECT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def project_of(text: str = PROJECT) -> Project:
    found = read_project(Path("fbvm.toml"), text=text)
    assert isinstance(found, Project)
    return found


def test_parts_have_the_names_addresses_and_doors_of_the_whole(folder: Path) -> None:
    parts = shards_of(project_of(), 2)
    names, addresses = [], []
    for part in parts:
        plant = Plant(part, for_ns=1)
        plant.close()
        names.append(list(plant.named_runs))
        addresses.append([unit.unit.address for run in plant.runs for unit in run.plc.units])
    assert names == [["one", "many[1]", "many[2]"], ["many[3]", "many[4]", "many[5]"]]
    assert addresses == [["10.0.0.1", "10.0.1.254", "10.0.1.255"], ["10.0.2.0", "10.0.2.1", "10.0.2.2"]]
    assert [[f"{unit}={host}:{port}" for unit, (host, port) in part.doors] for part in parts] == [
        ["10.0.1.254:502=127.0.1.1:5020", "10.0.1.255:502=127.0.1.2:5020", "10.0.0.1:502=127.0.0.1:6020"],
        ["10.0.2.0:502=127.0.1.3:5020", "10.0.2.1:502=127.0.1.4:5020", "10.0.2.2:502=127.0.1.5:5020"]]
    assert [len(shards_of(project_of(), count)) for count in (1, 5, 9)] == [1, 5, 6]


def test_parts_on_real_connections_reach_the_doors_of_the_others() -> None:
    _, second = shards_of(project_of('[run]\nnet = "tcp"\n' + PROJECT), 2)
    assert (Peer("10.0.0.1", 502), ("127.0.0.1", 6020)) in second.servers
    assert len(second.servers) == 3


@pytest.mark.parametrize(("more", "said"), [
    ('counts = "port"', [("127.0.1.1", 5020), ("127.0.1.1", 5021)]), ("", [("127.0.1.1", 5020), ("127.0.1.2", 5020)])])
def test_doors_count_up_by_address_or_by_port(more: str, said: object) -> None:
    text = PROJECT.replace('"127.0.1.1:5020"\ncount = 5', f'"127.0.1.1:5020"\ncount = 2\n{more}')
    assert [real for _, real in project_of(text).doors[:2]] == said


@pytest.mark.parametrize(("change", "said"), [
    (("127.0.1.1:5020", "here:5020"), "door 1: here is no address that counts up; write counts = \"port\""),
    (("127.0.1.1:5020", "0.0.0.0:5020"), "door 1: 0.0.0.0 is no address that counts up; write counts = \"port\""),
    (("127.0.1.1:5020", "255.255.255.254:5020"), "door 1: the addresses behind 255.255.255.254 are too few"),
    (('"127.0.1.1:5020"', '"127.0.1.1:65533"\ncounts = "port"'), "door 1: there are no 5 ports from 65533 on"),
    (("10.0.0.1:502", "10.0.2.1:502"), "door 2 has the address of door 1")])
def test_doors_that_cannot_count_up_are_refused(change: tuple[str, str], said: str) -> None:
    head, mark, doors = PROJECT.partition("[[door]]")
    found = read_project(Path("fbvm.toml"), text=head + mark + doors.replace(*change))
    assert isinstance(found, list) and all(isinstance(each, Diagnostic) for each in found)
    assert [each.message for each in found] == [said]


class Line:
    """The line of a part: what it is told, and what it tells.  It is told to stop behind its last figures."""

    def __init__(self, *told: object) -> None:
        self.told, self.said = list(told), list[Figures]()

    def poll(self, wait_s: float = 0.0) -> bool:
        return bool(self.told) and (self.told[0] != STOP or self.said[-1:] != [] and self.said[-1].state == OVER)

    def recv(self) -> object:
        return self.told.pop(0)

    def send(self, figures: Figures) -> None:
        self.said.append(figures)


def test_a_part_tells_its_figures_and_waits_for_the_stop(folder: Path) -> None:
    [part] = shards_of(project_of(), 1)
    images, _ = images_of(part)
    line = Line(GO_ON, STOP)
    run_shard(Shard(0, part, packed(images), VERSION, 1_000_000_000), line)
    last = line.said[-1]
    assert (last.state, last.plcs, last.scans, dict(last.ended)) == (OVER, 6, 600, {"time": 6})
    run_shard(Shard(1, part, packed(images), "0.0.1", 1), line)
    assert (line.said[-1].state, line.said[-1].traps) == ("failed", 0) and "not 0.0.1" in line.said[-1].message


class Silent(Line):
    """A line at whose other end nobody is any more."""

    polls = 0

    def poll(self, wait_s: float = 0.0) -> bool:
        self.polls += 1
        assert self.polls < 1000, "the part waits for ever"
        return False


def test_a_part_that_hears_nothing_ends(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shard, "UNHEARD_NS", -1)
    [part] = shards_of(project_of(), 1)
    line = Silent()
    run_shard(Shard(0, part, packed(images_of(part)[0]), VERSION), line)
    assert (line.said[-1].state, line.polls) == (OVER, 1)


class Workers:
    """The client of a cluster with two workers, of which the second has gone away."""

    def __init__(self) -> None:
        self.told: list[tuple[str, object]] = []

    def scheduler_info(self, n_workers: int) -> dict[str, dict[str, object]]:
        return {"workers": {"w2": {}, "w1": {}}}

    def run(self, work: Callable[..., object], *of: object, workers: object = None, on_error: str = "raise") -> object:
        self.told.append((work.__name__, workers))
        return {"w1": {0: Figures(0, RUNNING, 3), 2: Figures(2, OVER, 1)}}


def test_parts_in_a_cluster_are_told_by_their_workers() -> None:
    [part] = shards_of(project_of(), 1)
    workers = Workers()
    with in_cluster(nullcontext(workers), lambda count: [Shard(n, part, (), "") for n in range(count + 1)]) as places:  # type: ignore[arg-type]
        found = {number: (where, each.state, each.plcs, each.message) for number, (where, each) in places.figures().items()}
        places.stop()
    assert found == {0: ("w1", RUNNING, 3, ""), 1: ("w2", "failed", 0, "its worker has gone away"), 2: ("w1", OVER, 1, "")}
    assert [each for each in workers.told if each[0] == "_begin"] == [("_begin", ["w1"]), ("_begin", ["w2"]), ("_begin", ["w1"])]
    assert [name for name, _ in workers.told[3:]] == ["_figures", "_stop", "_end"]


def test_a_scheduler_that_goes_away_is_told_with_the_last_figures(folder: Path) -> None:
    [part] = shards_of(project_of(), 1)
    workers = Workers()
    with in_cluster(nullcontext(workers), lambda count: [Shard(n, part, (), "") for n in range(3)]) as places:  # type: ignore[arg-type]
        places.figures()

        def run(*asked: object, **options: object) -> None:
            raise RuntimeError("ConnectionPool is closed")

        workers.run = run  # type: ignore[method-assign,assignment]
        found = {number: (each.state, each.plcs, each.message) for number, (_, each) in places.figures().items()}
        places.stop()
    gone = "the scheduler has gone away; a part that hears nothing ends by itself within half a minute"
    assert found == {0: ("failed", 3, gone), 1: ("failed", 0, "its worker has gone away"), 2: (OVER, 1, "")}


def test_more_parts_than_plcs_are_refused(folder: Path) -> None:
    result = CliRunner().invoke(main, ["fleet", "--for", "1s", "--net", "loop", "--shards", "7"])
    assert (result.exit_code, "--shards 7: there are 6 PLCs; a part has one at least" in result.stderr) == (status.USAGE, True)


@pytest.mark.slow
def test_a_fleet_in_two_processes_does_all_scans_of_the_project(folder: Path) -> None:
    result = CliRunner().invoke(main, ["fleet", "--for", "2s", "--jobs", "2", "--json-lines"])
    last = json.loads(result.stdout.splitlines()[-1])
    assert (result.exit_code, last["plcs"], last["scans"], [each["plcs"] for each in last["shards"]]) == (0, 6, 1200, [3, 3])
    refused = CliRunner().invoke(main, ["fleet"])
    assert refused.exit_code == status.USAGE and "say when to end" in refused.stderr


def test_the_doors_of_a_part_are_open_on_this_computer(folder: Path) -> None:
    door = '[[door]]\naddress = "10.0.1.254:502"\nbind = "127.0.0.1:0"\ncount = 5\ncounts = "port"\n'
    parts = shards_of(project_of('[run]\nnet = "tcp"\n' + PROJECT.partition("[[door]]")[0] + door), 2)
    plants = [Plant(part, for_ns=1) for part in parts]
    try:
        doors = [plant.doors for plant in plants]
        hosts = [[unit.host for unit in each] for each in doors]
        assert hosts == [["10.0.1.254", "10.0.1.255"], ["10.0.2.0", "10.0.2.1", "10.0.2.2"]]
        assert len({real for each in doors for real in each.values()}) == 5
        assert [figures(0, plant, lambda: 1).connections for plant in plants] == [0, 0]
    finally:
        for plant in plants:
            plant.close()
