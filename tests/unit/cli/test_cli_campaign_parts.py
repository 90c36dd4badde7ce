"""Campaigns, mutants and clusters in parts: what the verbs put together, what they keep, how they end."""

from __future__ import annotations

import errno
import logging
import os
import sys
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.campaign.work import Unreachable
from fbvm.cli.projects import campaign, cluster, mutate, planned_runs, runs_of_tests

COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return Path("counter.st")


# --- full disks -------------------------------------------------------------------------------------------------------


def test_a_campaign_whose_results_the_disk_does_not_take_names_their_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(found: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    kept: list[object] = []
    monkeypatch.setattr("fbvm.campaign.runs.conduct", lambda bench, outcome, jobs, take, executor: take(["result"]))
    with pytest.raises(click.UsageError, match=r"^results cannot be written: no space left on device$"):
        campaign._conduct(cast(Any, "bench"), cast(Any, SimpleNamespace(add=kept.append)), cast(Any, SimpleNamespace(add=full)),
                          cast(Any, "shown"), 1, None, Path("results"))  # fmt: skip
    assert kept == []


# --- clusters ---------------------------------------------------------------------------------------------------------


def test_a_cluster_is_asked_for_where_dask_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "find_spec", lambda name: None)
    for make in (lambda: cluster.cluster_of("bench", "local", 2), lambda: cluster.client_of("local", 2)):
        with pytest.raises(click.UsageError, match="--cluster needs Dask"):
            make()
    monkeypatch.setattr(cluster, "find_spec", lambda name: "spec")
    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "fbvm.campaign.cluster", SimpleNamespace(
        Cluster=lambda *given: ("cluster", *given), connected=lambda *given: ("client", *given)))
    logger = logging.getLogger("distributed.client")
    monkeypatch.setattr(logger, "level", logging.NOTSET)
    assert cluster.cluster_of("bench", "local", 2) == cast(Any, ("cluster", "bench", "local", 2))
    assert logger.level == logging.CRITICAL
    assert cluster.client_of("tcp://a:1", 3) == cast(Any, ("client", "tcp://a:1", 3))


@each_of("text, good", [
    ("local", True), ("tcp://192.168.1.5:8786", True), ("tls://host:1", True), ("ws://h:1", True), ("wss://h:1", True),
    ("tcp://host", False), ("locals", False), ("http://h:1", False), ("tcp://h:1/x", False), ("tcp://h h:1", False), ("", False),
])
def test_addresses_of_clusters(text: str, good: bool) -> None:
    with nullcontext() if good else pytest.raises(click.BadParameter, match="is no scheduler: write local, or an address"):
        assert cluster._address(cast(Any, None), cast(Any, None), text) == text
    assert cluster._address(cast(Any, None), cast(Any, None), None) is None


# --- mutants ----------------------------------------------------------------------------------------------------------


def mutated(*arguments: str, survived: int = 0, mutants: int = 5, fails: Exception | None = None) -> tuple[int, str, list[Any]]:
    """Status, output and calls of the verb where the tests find all but so many mutants."""
    calls: list[Any] = []

    def try_mutants(folder: Path, given: Any, sources: Any, settings: Any, outcome: Any, tell: Any, cluster: Any) -> None:
        calls.append((folder, given, sources, settings, cluster and cluster("bench")))
        outcome.tried.extend(given[:2])
        tell(outcome)
        if fails:
            raise fails

    class Outcome:
        def __init__(self, known: int) -> None:
            self.known, self.tried = known, list[Any]()
            self.counts = {"killed": 1, "timed out": 0, "survived": survived, "equal": 0, "invalid": 0}

    session = "fbvm.campaign.mutation.session"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"{session}.sources_of", lambda folder: ["a.st", "b.st"])
        patch.setattr(f"{session}.read_source", lambda folder, name: f"text of {name}")
        patch.setattr(f"{session}.changed_lines", lambda folder, since, names: (since, names))
        patch.setattr(f"{session}.mutants_of", lambda sources, lines: calls.append(lines) or list(range(mutants)))
        patch.setattr(f"{session}.sample", lambda given, most, seed: [*given[:most], f"seed {seed}"])
        patch.setattr(f"{session}.try_mutants", try_mutants)
        patch.setattr(f"{session}.Outcome", Outcome)
        patch.setattr(mutate, "cluster_of", lambda bench, address, jobs: (bench, address, jobs))
        patch.setattr(mutate, "_print", lambda outcome, sources, as_json: calls.append(("print", sources, as_json)))
        result = CliRunner().invoke(mutate.command, arguments)
    return result.exit_code, result.stderr, calls


@pytest.mark.slow
def test_mutants_of_all_sources_or_of_those_that_are_named(counter: Path) -> None:
    status, said, (lines, (folder, given, sources, settings, workers), printed) = mutated("--jobs", "3")
    assert (status, said, lines, folder, given, workers) == (0, "", None, Path.cwd(), [0, 1, 2, 3, 4], None)
    assert sources == ["text of a.st", "text of b.st"] and printed == ("print", sources, False)
    assert (settings.jobs, list(settings.arguments), settings.limit_ns, settings.budget_ns, settings.cycle_ns) == (
        3, [], 0, 5_000_000_000, 10_000_000)
    status, _, calls = mutated("counter.st", "--since", "HEAD", "--sample", "2", "--seed", "9", "--limit", "4s", "--budget", "0s",
                               "--cycle", "5ms", "--cluster", "local", "--json", "--tests", "counter.st", survived=1)
    assert status == 1 and calls[0] == ("HEAD", ["counter.st"]) and calls[2] == ("print", ["text of counter.st"], True)
    _, given, _, settings, workers = calls[1]
    assert given == [0, 1, "seed 9"] and workers == ("bench", "local", settings.jobs)
    assert (list(settings.arguments), settings.limit_ns, settings.budget_ns, settings.cycle_ns) == (
        ["counter.st"], 4_000_000_000, 0, 5_000_000)


@pytest.mark.slow
def test_what_was_tried_before_an_error_is_told(counter: Path) -> None:
    status, said, calls = mutated(fails=Unreachable("no scheduler"))
    assert (status, said) == (5, "no scheduler\n") and calls[-1][0] == "print"
    from fbvm.campaign.mutation.session import NotPossible

    status, said, calls = mutated(fails=NotPossible("the tests fail without a mutant"))
    assert status == 2 and "the tests fail without a mutant" in said and calls[-1][0] == "print"
    status, _, calls = mutated(mutants=0)
    assert status == 0 and calls == [None, ("print", ["text of a.st", "text of b.st"], False)]
    status, said, calls = mutated("--tests", "no.py")
    assert status == 2 and "--tests no.py: there is no no.py in this folder" in said and calls == []


def test_mutants_need_pytest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutate, "find_spec", lambda name: None)
    assert "tests need pytest: pip install pytest" in mutated()[1]


# --- campaigns --------------------------------------------------------------------------------------------------------


def test_golden_files_are_written_from_a_run_in_which_nothing_goes_wrong(counter: Path,
                                                                         capsys: pytest.CaptureFixture[str]) -> None:
    @dataclass(frozen=True)
    class Variant:
        values: tuple[int, ...] = (3, 4)
        faults: tuple[str, ...] = ("fault",)
        cuts: tuple[str, ...] = ("cut",)
        timing: str = "real"

    done: list[Variant] = []
    execution = SimpleNamespace(result=done.append, traces={"one.csv": "a,b\n", "two.csv": "c\n"})
    plan = SimpleNamespace(judging=SimpleNamespace(goldens=["golden"]), axes=["x", "y"])
    bench = cast(Any, SimpleNamespace(plan=plan, execution=lambda: execution, variant=lambda number: Variant((number, 9))))
    campaign._write_golden(bench, Path())
    assert done == [Variant((0, 0), (), (), "exact")]
    assert capsys.readouterr().out == "one.csv is written\ntwo.csv is written\n"
    assert [Path(name).read_text() for name in ("one.csv", "two.csv")] == ["a,b\n", "c\n"]
    plan.judging.goldens = []
    with pytest.raises(click.UsageError, match=r"the campaign has no \[\[golden\]\] to write"):
        campaign._write_golden(bench, Path())


OPTIONS: dict[str, Any] = {"faults": 0, "cuts": 0, "within": (), "never": (), "always": (), "runs": None, "timing": None}


def test_options_of_a_campaign_are_added_to_what_its_file_says() -> None:
    from fbvm.campaign.plan_file import Written, any_cuts, any_faults, with_about

    file = with_about(Written(), never=("a",), always=("b",), runs=7, timing="real")
    plain = campaign._changed(file, None, OPTIONS)
    assert [plain.about[name] for name in ("never", "always", "runs", "timing")] == [("a",), ("b",), 7, "real"]
    assert (plain.responses, plain.faults, plain.cuts) == ((), (), ())
    more = campaign._changed(file, 2_000, OPTIONS | {"never": ("c",), "always": ("d",), "runs": 9, "timing": "exact", "faults": 2,
                                                     "cuts": 3, "within": (("x", "y", "20ms"),)})  # fmt: skip
    assert [more.about[name] for name in ("never", "always", "runs", "timing")] == [("a", "c"), ("b", "d"), 9, "exact"]
    [answer] = more.responses
    assert (answer.trigger, answer.answer, answer.within_ns) == ("x", "y", 20_000_000)
    assert more.faults == (any_faults(2, 2_000),) and more.cuts == (any_cuts(3, 2_000),)
    longer = campaign._changed(with_about(file, **{"for": 5_000}), 2_000, OPTIONS | {"faults": 1})
    assert longer.faults == (any_faults(1, 5_000),) and longer.cuts == ()
    for name in ("faults", "cuts"):
        with pytest.raises(click.UsageError, match="say how long a run takes at most, by --for"):
            campaign._changed(file, None, OPTIONS | {name: 1})


def test_results_of_another_campaign_are_told_with_their_folder() -> None:
    from fbvm.campaign.store import InUse, OtherCampaign

    made: list[Any] = []
    make = cast(Any, lambda *given: made.append(given) or "store")
    assert campaign._open(make, Path("out"), "mark", True) == cast(Any, "store")
    assert made == [(Path("out"), "mark", True)]

    def raising(error: Exception) -> Callable[..., Any]:
        def make(*_: object) -> None:
            raise error

        return make

    with pytest.raises(click.UsageError, match=r"^out is used; wait for it, or name another folder by --out$"):
        campaign._open(raising(InUse("is used")), Path("out"), "", False)
    with pytest.raises(click.UsageError, match=r"^out has others: name another folder by --out, or begin anew by --fresh$"):
        campaign._open(raising(OtherCampaign("has others")), Path("out"), "", False)
    with pytest.raises(click.UsageError, match=r"^out cannot be written: "):
        campaign._open(raising(OSError(28, "No space left on device")), Path("out"), "", False)


def test_results_are_taken_stored_and_told_as_they_come(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    outcome = SimpleNamespace(results=[], plan=SimpleNamespace(count=4), add=lambda found: outcome.results.extend(found))
    store = SimpleNamespace(add=lambda found: calls.append(("stored", found)))
    shown = SimpleNamespace(add=lambda found: f"{len(outcome.results)} runs")

    def conduct(bench: Any, given: Any, jobs: int, take: Callable[[list[int]], None], executor: Any) -> None:
        calls.append((bench, given is outcome, jobs, executor))
        take([1])
        take([2, 3])

    monkeypatch.setattr("fbvm.campaign.runs.conduct", conduct)
    monkeypatch.setattr("fbvm.campaign.executors.ByWorkers", lambda cluster: ("workers", cluster))
    monkeypatch.setattr(campaign, "cluster_of", lambda *given: given)
    monkeypatch.setattr(campaign, "travelling", lambda bench: f"travelling {bench}")
    monkeypatch.setattr(campaign, "show_progress", lambda what: nullcontext(lambda *told: calls.append(told)))
    campaign._conduct(cast(Any, "bench"), cast(Any, outcome), cast(Any, store), cast(Any, shown), 3, None, Path("results"))
    assert calls == [("bench", True, 3, None), ("stored", [1]), ("1 runs", 1, 4), ("stored", [2, 3]), ("3 runs", 3, 4)]
    calls.clear()
    campaign._conduct(cast(Any, "bench"), cast(Any, outcome), cast(Any, store), cast(Any, shown), 3, "local", Path("results"))
    assert calls[0] == ("bench", True, 3, ("workers", ("travelling bench", "local", 3)))


def test_what_is_left_of_a_campaign(counter: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    calls: list[Any] = []
    same, other = SimpleNamespace(variant="same", result="result of same"), SimpleNamespace(variant="other", result="another")
    groups = [SimpleNamespace(first=first, shrunk=shrunk) for first, shrunk in ((4, same), (7, None), (9, other))]
    outcome = cast(Any, SimpleNamespace(results=[1], groups=groups))

    def recorded(bench: Any, variant: str, path: Path) -> str:
        path.write_text(variant) if variant == "same" else None
        return f"result of {variant}"

    monkeypatch.setattr("fbvm.campaign.store.write_table", lambda path, given: calls.append(path))
    monkeypatch.setattr(campaign, "write_results", lambda given, options: calls.append("results"))
    monkeypatch.setattr(campaign, "_recorded", recorded)
    monkeypatch.setattr(campaign, "_print", lambda given, recordings: calls.append(recordings))
    monkeypatch.setattr(campaign, "_as_dict", lambda given, recordings: {"recordings": len(recordings)})
    shown = cast(Any, SimpleNamespace(end=lambda recordings: calls.append(("end", recordings))))
    campaign._finish(cast(Any, None), outcome, {"folder": Path()}, shown, False)
    assert calls == [Path("results.csv"), "results", ("end", {4: "1.fbtrace"}), {4: Path("1.fbtrace"), 9: Path("3.fbtrace")}]
    assert capsys.readouterr() == ("", "3.fbtrace: run 9 did not give the same result again\n")
    campaign._finish(cast(Any, None), outcome, {"folder": Path()}, shown, True)
    assert capsys.readouterr().out == '{"recordings": 2}\n'
    calls.clear()
    campaign._finish(cast(Any, None), cast(Any, SimpleNamespace(results=[])), {"folder": Path()}, shown, True)
    assert calls == [] and capsys.readouterr().out == ""


def test_parquet_and_csv_are_written_where_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    for name in ("write_table", "write_parquet"):
        monkeypatch.setattr(f"fbvm.campaign.store.{name}", lambda path, outcome, name=name: calls.append((name, path, outcome)))
    planned_runs.write_results("outcome", {"csv_file": None, "parquet_file": None})
    planned_runs.write_results("outcome", {"csv_file": Path("a.csv"), "parquet_file": Path("a.parquet")})
    assert calls == [("write_table", Path("a.csv"), "outcome"), ("write_parquet", Path("a.parquet"), "outcome")]
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    planned_runs.check_parquet({"parquet_file": None})
    with pytest.raises(click.UsageError, match="--parquet needs pyarrow"):
        planned_runs.check_parquet({"parquet_file": Path("a")})


@pytest.mark.slow
def test_tests_travel_with_their_project(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.campaign.items.bench import ItemsBench
    from fbvm.campaign.project_copies import TooLarge
    from fbvm.campaign.work import Bench

    plain = object.__new__(Bench)
    assert runs_of_tests.travelling(plain) is plain
    bench = object.__new__(ItemsBench)
    object.__setattr__(bench, "folder", str(Path.cwd()))
    monkeypatch.setattr("fbvm.campaign.project_copies.pack_project", lambda folder: f"packed {folder.name}")
    shipped = runs_of_tests.travelling(bench)
    assert [shipped.bench, shipped.name, shipped.files] == [bench, Path.cwd().name, f"packed {Path.cwd().name}"]

    def large(folder: Path) -> None:
        raise TooLarge("the project has 2 GB")

    monkeypatch.setattr("fbvm.campaign.project_copies.pack_project", large)
    with pytest.raises(click.UsageError, match="the project has 2 GB"):
        runs_of_tests.travelling(bench)


@each_of("where, options, said", [
    (Path("runs.toml"), {}, "runs.toml: x is no name"), (Path("runs.toml"), {"never": ("x",)}, "x is no name"),
    (Path("runs.toml"), {"until": "x"}, "x is no name"), (None, {}, "x is no name"), (None, {"varied": ("x=1",)}, "x is no name"),
])
def test_what_a_file_says_wrongly_is_told_with_its_name(where: Path | None, options: dict[str, Any], said: str) -> None:
    def fails(*_: object) -> None:
        raise ValueError("x is no name")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(planned_runs, "written_plan", lambda files, options: (SimpleNamespace(about={"sources": ("a.st",)}), where))
        patch.setattr("fbvm.campaign.planning.program_project", fails)
        with pytest.raises(click.UsageError) as refused:
            planned_runs.planned((), None, (), options, cast(Any, None))
    assert refused.value.message == said
