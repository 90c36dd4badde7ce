"""What the verbs over many runs say: fleets, campaigns, mutants; figures, doors, groups, single runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.campaign.fleet.shard import Figures
from fbvm.campaign.judge import Failure
from fbvm.campaign.work import Mismatch, Unreachable
from fbvm.cli.projects import campaign, fleet, mutate, planned_runs
from fbvm.cli.shared import status

# --- fleets -----------------------------------------------------------------------------------------------------------

ONE = Figures(0, "running", 1200, 48_000, 3, 1, 7, 1.5, doors={"192.168.0.1:502": "10.0.0.1:1502"},
              lateness={"longest_ns": 2_340_000})
TWO = Figures(1, "over", 3, 10, 0, 0, 0, 0.0, doors={"192.168.0.2:502": "10.0.0.2:1503", "192.168.0.3:502": "10.0.0.2:1504"})
TOLD = {0: ("here", ONE), 1: ("there", TWO)}


def test_a_table_has_a_line_for_each_part_and_one_for_all(capsys: pytest.CaptureFixture[str]) -> None:
    fleet._print(TOLD)
    assert capsys.readouterr().out.splitlines() == [
        "part  where   PLCs  doors   scans  a second  missed  connections  trapped  latest scan",
        "1     here   1,200      1  48,000    32,000       3            7        1  2.3 ms late",
        "2     there      3      2      10         0       0            0        0",
        "all          1,203      3  48,010    32,000       3            7        1",
    ]


def test_figures_in_words_and_for_scripts() -> None:
    assert fleet._in_words(TOLD, 1234.5) == (
        "1,203 PLCs, 1,234 scans a second, 7 connections, 3 periods missed; parts that run")
    made = fleet._as_dict(TOLD)
    assert {name: made[name] for name in ("plcs", "scans", "missed", "traps", "connections")} == {
        "plcs": 1203, "scans": 48_010, "missed": 3, "traps": 1, "connections": 7}
    assert [(shard["where"], shard["number"], "doors" in shard) for shard in made["shards"]] == [
        ("here", 0, False), ("there", 1, False)]


def test_doors_are_written_with_the_part_that_has_them(tmp_path: Path) -> None:
    fleet._write_doors(TOLD, tmp_path / "doors.csv")
    assert (tmp_path / "doors.csv").read_text(encoding="utf-8").splitlines() == [
        "unit,door,where", "192.168.0.1:502,10.0.0.1:1502,here", "192.168.0.2:502,10.0.0.2:1503,there",
        "192.168.0.3:502,10.0.0.2:1504,there"]


@each_of("counts, shards, said", [
    ((3, None), None, ""), ((3, None), 4, ""), ((3, None), 5, "--shards 5: there are 4 PLCs; a part has one at least"),
    ((None,), 1, ""), ((None,), 2, "--shards 2: there is 1 PLC; a part has one at least"),
    ((2000,), 2001, "--shards 2001: there are 2,000 PLCs; a part has one at least"),
])
def test_parts_are_not_more_than_plcs(counts: tuple[int | None, ...], shards: int | None, said: str) -> None:
    project = cast(Any, SimpleNamespace(plcs=[SimpleNamespace(count=count) for count in counts]))
    with pytest.raises(click.UsageError, match=said) if said else nullcontext():
        fleet._check_shards(project, shards)


class Parts:
    """Parts of a fleet that tell what they have to tell, one answer after the other, and then the last one again."""

    def __init__(self, *answers: Mapping[int, tuple[str, Figures]]) -> None:
        self._answers = list(answers)
        self.is_stopped = False

    def __enter__(self) -> Parts:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def figures(self) -> Mapping[int, tuple[str, Figures]]:
        return self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]

    def stop(self) -> None:
        self.is_stopped = True


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The pauses of what waits, in ns; nobody really waits.  Limits are over at their third question."""
    waited: list[int] = []

    def limit(_: int) -> Callable[[], bool]:
        questions: list[int] = []
        return lambda: questions.append(1) or len(questions) > 2  # type: ignore[func-returns-value]

    monkeypatch.setattr("fbvm.run.time_limit.pause", waited.append)
    monkeypatch.setattr("fbvm.run.time_limit.time_limit", limit)
    return waited


def state(name: str, **more: Any) -> Figures:
    return Figures(0, name, 2, **more)


def test_a_fleet_is_conducted_until_all_parts_are_over(tmp_path: Path, pauses: list[int],
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    """The doors are written as soon as all of them run, and once."""
    running = state("running", scans=10, doors={"unit": "door"})
    parts = Parts({0: ("a", state("building"))}, {0: ("a", running)}, {0: ("a", state("running", doors={"other": "door"}))},
                  {0: ("a", state("over", scans=30))})
    told = fleet._conducted(cast(Any, parts), {"json_lines": True, "doors_file": tmp_path / "doors.csv"})
    assert parts.is_stopped and told[0][1].scans == 30 and pauses == [10**9] * 3
    assert (tmp_path / "doors.csv").read_text(encoding="utf-8") == "unit,door,where\nunit,door,a\n"
    assert [json.loads(line)["scans"] for line in capsys.readouterr().out.splitlines()] == [10, 0, 30, 30]


def test_ctrl_c_stops_a_fleet_and_its_last_figures_are_waited_for(
        monkeypatch: pytest.MonkeyPatch, pauses: list[int], capsys: pytest.CaptureFixture[str]) -> None:
    parts = Parts({0: ("a", state("running"))}, {0: ("a", state("running", scans=5))}, {0: ("a", state("over", scans=9))})

    def pause(time_ns: int) -> None:
        pauses.append(time_ns)
        if len(pauses) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr("fbvm.run.time_limit.pause", pause)
    told = fleet._conducted(cast(Any, parts), {"json_lines": False, "doors_file": None})
    assert parts.is_stopped and told[0][1].scans == 9 and pauses == [10**9, 5 * 10**7, 5 * 10**7]
    assert capsys.readouterr() == ("", "stopping all parts\n")


def test_a_part_that_does_not_end_is_not_waited_for_for_ever(pauses: list[int]) -> None:
    parts = Parts({0: ("a", state("failed"))}, {0: ("a", state("running"))})
    assert fleet._conducted(cast(Any, parts), {"json_lines": False, "doors_file": None})[0][1].state == "failed"
    monkey = Parts({0: ("a", state("running"))})
    monkey.figures = lambda: {0: ("a", state("failed" if len(pauses) > 7 else "running"))}  # type: ignore[method-assign]
    assert fleet._conducted(cast(Any, monkey), {"json_lines": False, "doors_file": None})[0][1].state == "failed"


@each_of("figures, said, ended", [
    (state("over"), "", status.GOOD), (state("over", traps=1), "", status.STOPPED),
    (state("failed", message="no port"), "part 1: no port\n", status.NETWORK),
    (state("failed", traps=1, message="gone"), "part 1: gone\n", status.NETWORK),
])
def test_how_a_fleet_ends(figures: Figures, said: str, ended: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        errors: list[str] = []
        patch.setattr(fleet, "_places", lambda *_: None)
        patch.setattr(fleet, "_conducted", lambda *_: {0: ("here", figures)})
        patch.setattr(fleet, "_print", lambda told: None)
        patch.setattr(fleet, "say", lambda text, fg, err=False: errors.append(f"{text}\n" if err else "not among the errors"))
        with pytest.raises(SystemExit) as exit_:
            fleet.command.callback(None, json_lines=False)  # type: ignore[misc]
    assert (exit_.value.code, "".join(errors)) == (ended, said)


# --- campaigns --------------------------------------------------------------------------------------------------------

FAILURE = Failure("never", "Main.bad", "tank", 12, 110_000_000, detail="Level = 4")


def outcome_of(tests: bool = False, plcs: int = 1, count: int = 5, groups: Any = (), results: int = 5, failing: int = 2) -> Any:
    plan = SimpleNamespace(tests=tests, count=count, seed=77, project=SimpleNamespace(plcs=[None] * plcs),
                           axes=[SimpleNamespace(name="Main.x", text=lambda value: f"T#{value}s", plain=lambda value: value)])
    return SimpleNamespace(plan=plan, groups=list(groups), results=dict.fromkeys(range(results)), failing=failing)


def variant_of(**more: Any) -> Any:
    given = {"faults": (), "cuts": (), "timing": "exact", "seed": 9, "number": 3, "value": lambda plan, at: 4 + at} | more
    return SimpleNamespace(**given)


def group_of(failure: Failure = FAILURE, numbers: tuple[int, ...] = (3, 4), shrunk: Any = None) -> Any:
    return SimpleNamespace(failure=failure, numbers=list(numbers), first=numbers[0], shrunk=shrunk)


SHRUNK = SimpleNamespace(variant=variant_of(faults=("late",), cuts=("cut",), timing="real", seed=8),
                         result=SimpleNamespace(failure=FAILURE))


@pytest.fixture
def common(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What runs of a group have in common; none is drawn."""
    found = ["Main.x = 4"]
    monkeypatch.setattr("fbvm.campaign.groups.in_common", lambda *_: found)
    monkeypatch.setattr("fbvm.campaign.variants.draw", lambda plan, number: variant_of(seed=100 + number))
    return found


def test_a_group_is_told_with_its_smallest_run(common: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("1.fbtrace")
    small = group_of(shrunk=SHRUNK)
    assert campaign._about(outcome_of(), small, {3: path}) == [
        "run 3, made smaller: Main.x = T#4s, late, cut, late units", "fails in scan 12 of tank",
        "all of them, and not all others, have Main.x = 4", "Level = 4", "fbvm replay 1.fbtrace"]
    assert campaign._about(outcome_of(plcs=2), small, {3: path})[-1] == "fbvm replay 1.fbtrace --plc tank"
    common.clear()
    plain = campaign._about(outcome_of(), group_of(Failure("trap", "stopped")), {})
    assert plain == ["run 3, as it was: Main.x = T#4s"]
    tests = outcome_of(tests=True)
    assert campaign._about(tests, small, {3: path})[-1] == "the same command with --only 3"
    path.write_text("", encoding="utf-8")
    assert campaign._about(tests, small, {3: path})[-1] == "fbvm chart 1.fbtrace"
    assert campaign._about(tests, small, {})[-1] == "the same command with --only 3"
    nothing = outcome_of()
    nothing.plan.axes = []
    assert campaign._about(nothing, group_of(Failure("trap", "stopped")), {}) == ["run 3, as it was: without any fault"]


def test_a_group_for_scripts(common: list[str], tmp_path: Path) -> None:
    groups = [group_of(shrunk=SHRUNK), group_of(numbers=(2,))]
    made = campaign._as_dict(outcome_of(groups=groups), {3: tmp_path, 2: tmp_path / "no"})
    assert {name: made[name] for name in ("runs", "done", "good", "failing", "seed")} == {
        "runs": 5, "done": 5, "good": 3, "failing": 2, "seed": 77}
    first, second = made["groups"]
    wanted = {"kind": "never", "text": "Main.bad", "plc": "tank", "scan": 12, "now_ns": 110_000_000, "runs": 2, "first": 3,
              "seed": 8, "common": ["Main.x = 4"], "values": {"Main.x": 4}, "faults": ["late"], "power": ["cut"],
              "timing": "real", "shrunk": True, "recording": str(tmp_path)}  # fmt: skip
    assert {name: first[name] for name in wanted} == wanted
    assert (second["seed"], second["shrunk"], second["recording"], second["first"]) == (102, False, None, 2)


@each_of("given, lines", [
    ({"failing": 0}, ["5 runs: 5 good"]), ({"failing": 0, "count": 1, "results": 1}, ["1 run: 1 good"]),
    ({"failing": 0, "results": 3}, ["3 of 5 runs: 3 good"]),
    ({"groups": [group_of()]}, ["2 of 5 runs: never Main.bad", "  about", "5 runs: 3 good, 2 failed in 1 group"]),
    ({"groups": [group_of(numbers=(n,)) for n in range(22)], "failing": 22, "results": 3000, "count": 3000},
     [*["1 of 3,000 runs: never Main.bad", "  about"] * 20, "and 2 groups more",
      "3,000 runs: 2,978 good, 22 failed in 22 groups"]),
])
def test_what_came_of_a_campaign(given: dict[str, Any], lines: list[str]) -> None:
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(campaign, "_about", lambda *_: ["about"])
        patch.setattr(campaign, "say", lambda text, **style: said.append(text))
        patch.setattr(Failure, "__str__", lambda self: f"{self.kind} {self.text}")
        campaign._print(outcome_of(**given), {})
    assert said == lines


@each_of("failure, report, tests, lines, ended", [
    (None, "", True, ["Main.x = T#4s", "late", "run 3, seed 9: good; recorded in RUN"], status.GOOD),
    (FAILURE, "assert x", True, ["Main.x = T#4s", "late", "assert x", "run 3, seed 9: never Main.bad; recorded in RUN"],
     status.FAILED),
    (None, "assert x", True, ["Main.x = T#4s", "late", "run 3, seed 9: good; recorded in RUN"], status.GOOD),
    (FAILURE, "", False, ["Main.x = T#4s", "late", "run 3, seed 9: never Main.bad"], status.FAILED),
])
def test_one_run_is_told_with_what_was_drawn_for_it(failure: Failure | None, report: str, tests: bool, lines: list[str],
                                                    ended: int, tmp_path: Path) -> None:  # fmt: skip
    said: list[str] = []
    bench = cast(Any, SimpleNamespace(plan=outcome_of(tests=tests).plan, variant=lambda number: variant_of(faults=("late",))))
    folder = tmp_path / ("tests" if tests else "programs")

    def recorded(bench: Any, variant: Any, path: Path) -> Any:
        if tests:
            path.write_text("", encoding="utf-8")
        result = SimpleNamespace(failure=failure)
        return (result, report) if tests else result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(campaign, "record_test" if tests else "_recorded", recorded)
        patch.setattr(campaign, "named", lambda path: "RUN")
        patch.setattr(campaign, "say", said.append)
        patch.setattr(Failure, "__str__", lambda self: f"{self.kind} {self.text}")
        assert campaign._execute_one(bench, 3, folder) == ended
        assert said == lines
        with pytest.raises(click.UsageError, match="--only 5: there are runs 0 to 4"):
            campaign._execute_one(bench, 5, folder)


@each_of("error, ended", [(Unreachable("no scheduler"), status.NETWORK), (Mismatch("another version"), status.NETWORK)])
def test_a_cluster_that_cannot_be_used_ends_the_verbs(error: Exception, ended: int) -> None:
    said: list[str] = []

    def fails(*_: object) -> None:
        raise error

    store = SimpleNamespace(known=(), close=lambda: said.append("closed"))
    outcome: Any = SimpleNamespace(plan=outcome_of().plan, add=lambda found: None)
    options = {"write_golden": False, "only": None, "folder": Path("out"), "fresh": False, "json_lines": False, "jobs": 1,
               "cluster": "auto", "parquet_file": None}  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(campaign, "bench_of_tests", lambda *_: (SimpleNamespace(plan=outcome.plan, mark=""), Path()))
        patch.setattr("fbvm.campaign.runs.Outcome", lambda plan: outcome)
        patch.setattr(campaign, "_open", lambda *_: store)
        patch.setattr(campaign, "ShownProgress", lambda *_: None)
        patch.setattr(campaign, "_conduct", fails)
        patch.setattr(campaign, "_finish", lambda *_: said.append("finished"))
        for module in (campaign, mutate):
            patch.setattr(module, "say", lambda text, **style: said.append(text))
        with pytest.raises(SystemExit) as exit_:
            campaign.command.callback((), None, (), False, **options)  # type: ignore[misc]
        assert (exit_.value.code, said) == (ended, ["finished", "closed", str(error)])


def test_what_is_wrong_with_the_files_of_a_campaign_ends_it(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = Diagnostic("S0201", Source("a.st", "x := 1;"), 0, 1, "x is not declared")
    with pytest.raises(SystemExit) as ended:
        planned_runs.refuse([wrong])
    assert ended.value.code == status.PROGRAM_ERRORS
    shown = capsys.readouterr()
    assert "S0201" in shown.out + shown.err and "x is not declared" in shown.out + shown.err


def test_processes_are_as_many_as_processors_or_as_one_says(monkeypatch: pytest.MonkeyPatch) -> None:
    for count, jobs, made in ((8, None, 8), (8, 3, 3), (None, None, 1)):
        monkeypatch.setattr("os.cpu_count", lambda count=count: count)
        assert planned_runs.processes(jobs) == made


# --- mutants ----------------------------------------------------------------------------------------------------------


def tried(result: str) -> Any:
    change = SimpleNamespace(operator="relation", pou="Pump")
    mutant = SimpleNamespace(file="pump.st", line=7, number=2, change=change,
                             diff=lambda text: f"--- a\n+++ b\n@@ 1 @@\n-{text}\n+new")
    return SimpleNamespace(result=result, mutant=mutant, by="tests/test_pump.py")


def mutants(known: int, *results: str) -> Any:
    counts = {name: results.count(name) for name in mutate.RESULTS}
    rows = [tried(result) for result in results]
    return SimpleNamespace(known=known, tried=rows, rows=rows, counts=counts, score=0.754)


SOURCES: Any = [SimpleNamespace(name="pump.st", text="old")]


@each_of("outcome, lines", [
    (mutants(0), ["nothing to change"]),
    (mutants(2, "killed", "killed"), ["2 mutants: 2 killed; the tests find 75 %"]),
    (mutants(1, "equal"), ["1 mutant: 1 equal; the tests find 75 %"]),
    (mutants(9, "killed", "survived", "timed out"), [
        "pump.st:7: relation in Pump survived", "@@ 1 @@\n-old\n+new", "",
        "3 of 9 mutants: 1 killed, 1 timed out, 1 survived; the tests find 75 %"]),
])
def test_survivors_are_shown_and_all_are_counted(outcome: Any, lines: list[str]) -> None:
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mutate, "say", lambda text="", **style: said.append(text))
        mutate._print(outcome, SOURCES, False)
    assert said == lines


def test_mutants_for_scripts(capsys: pytest.CaptureFixture[str]) -> None:
    mutate._print(mutants(9, "killed", "survived"), SOURCES, True)
    made = json.loads(capsys.readouterr().out)
    assert {name: made[name] for name in ("known", "tried", "score")} == {"known": 9, "tried": 2, "score": 0.754}
    assert made["counts"] == {"killed": 1, "timed out": 0, "survived": 1, "equal": 0, "invalid": 0}
    assert made["mutants"][1] == {"number": 2, "file": "pump.st", "line": 7, "pou": "Pump", "operator": "relation",
                                  "result": "survived", "by": "tests/test_pump.py",
                                  "diff": "--- a\n+++ b\n@@ 1 @@\n-old\n+new"}


def test_tests_and_files_that_are_not_there_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("test_a.py").write_text("", encoding="utf-8")
    mutate._check_tests(["test_a.py::test_x", "test_a.py", "-k", "nothing"])
    with pytest.raises(click.UsageError, match=r"--tests no\.py::test_x: there is no no\.py in this folder"):
        mutate._check_tests(["test_a.py", "no.py::test_x"])
    assert mutate._names((Path("a/../b.st"), tmp_path / "c.st"), tmp_path) == ["b.st", "c.st"]
    with pytest.raises(click.UsageError, match="is not in this folder: go to the folder of its project"):
        mutate._names((Path("../b.st"),), tmp_path)
