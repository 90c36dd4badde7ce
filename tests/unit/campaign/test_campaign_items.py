"""Campaigns over tests: what is varied reaches every PLC that a test makes, and each failing run is known and done again."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.campaign.items.bench import ItemsBench
from fbvm.campaign.project_copies import copy_project, files_of
from fbvm.cli.main import main
from fbvm.net.faults import fault
from fbvm.run.varied import Conditions, PowerCut, VariedRun, Written
from fbvm.testing.plant_rig import PlantRig
from fbvm.testing.rig import Rig

COUNTER = """FUNCTION_BLOCK Counter
VAR_INPUT Step : INT := 1; END_VAR
VAR_OUTPUT Total, Scans : INT; END_VAR
VAR a : ARRAY[0..20] OF INT; END_VAR
    Scans := Scans + 1;
    Total := Total + Step;
    a[Total] := 1;
END_FUNCTION_BLOCK
"""
TESTS = """def test_it_counts(fb):
    counter = fb("src/Counter.st")
    counter.run(scans=5)
    assert counter.Total < 15


def test_it_scans(fb):
    assert fb("src/Counter.st").run("50ms").Scans < 6
"""
ST_TEST = "PROGRAM Test_of_st\nVAR Limit : INT := 5; c : Counter; END_VAR\nc();\nASSERT(c.Total < Limit);\nEND_PROGRAM\n"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    files = {"src/Counter.st": COUNTER, "tests/test_counter.py": TESTS, "tests/test_st.st": ST_TEST, "pytest.ini": "[pytest]\n"}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fbvm(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["campaign", *arguments])
    return result.exit_code, result.stdout if result.exit_code < 2 else result.stderr


@pytest.mark.slow
def test_failing_runs_of_tests_are_grouped_and_each_is_done_again_by_its_number(project: Path) -> None:
    status, said = fbvm("tests/test_counter.py", "--vary", "Step=1,2,3,9", "--vary", "cycle=10ms,5ms", "--json", "--jobs", "1")
    found = {(group["kind"], group["file"], group["line"]): group for group in json.loads(said)["groups"]}
    counts, scans = (("test", "tests/test_counter.py", line) for line in (4, 8))
    trap = ("trap", "src/Counter.st", 7)
    assert (status, {key: group["runs"] for key, group in found.items()}) == (1, {counts: 2, trap: 2, scans: 2})
    assert found[counts]["values"] == {"Step": 3, "cycle": 10_000_000}
    assert found[counts]["detail"] == "AssertionError: assert 15 < 15"
    assert [found[scans]["first"], found[trap]["first"]] == [1, 6]
    assert Path(found[trap]["recording"]).is_file()
    rows = list(csv.DictReader(Path("campaign-results/results.csv").read_text().splitlines()))
    status, said = fbvm("tests/test_counter.py", "--vary", "Step=1,2,3,9", "--vary", "cycle=10ms,5ms", "--only", "4")
    assert (status, rows[4]["scan"]) == (1, "4")
    assert ">       assert counter.Total < 15" in said
    assert f"run 4, seed {rows[4]['seed']}: test tests/test_counter.py::test_it_counts (tests/test_counter.py:4)" in said
    verb = ["chart", str(Path("campaign-results/1.fbtrace"))]
    assert f"  fbvm {' '.join(verb)}\n" in fbvm("tests/test_counter.py", "--vary", "Step=1,2,3,9", "--vary", "cycle=10ms,5ms")[1]
    assert CliRunner().invoke(main, verb).exit_code == 0


ENDS = """import ctypes
import os

def test_it(fb):
    counter = fb("src/Counter.st")
    if counter.Step < 3:
        os._exit(3)
    if counter.Step == 3:
        ctypes.string_at(0)
    counter.run(scans=2)
    assert counter.Total < 8
"""


@pytest.mark.slow
def test_a_test_that_ends_its_process_is_a_failure_of_its_own_and_the_others_are_done(project: Path) -> None:
    (project / "tests" / "test_ends.py").write_text(ENDS)
    arguments = ("tests/test_ends.py", "--vary", "Step=2,3,4")
    status, said = fbvm(*arguments, "--json", "--jobs", "2")
    found = {(group["kind"], group["text"]): (group["first"], group["runs"]) for group in json.loads(said)["groups"]}
    ended, segfault = "the process of the run ended with status 3", "the process of the run ended by SIGSEGV"
    assert (status, found) == (1, {("crashed", ended): (0, 1), ("crashed", segfault): (1, 1),
                                   ("test", "tests/test_ends.py::test_it"): (2, 1)})  # fmt: skip
    status, said = fbvm(*arguments, "--only", "0")
    assert (status, f": crashed {ended}\n" in said) == (1, True)


@pytest.mark.slow
def test_a_test_in_st_is_varied_and_its_line_told(project: Path) -> None:
    status, said = fbvm("tests/test_st.st::Test_of_st", "--vary", "Limit=5,1", "--jobs", "1", "--json")
    [group] = json.loads(said)["groups"]
    assert (status, group["first"], group["file"], group["line"]) == (1, 1, "tests/test_st.st", 4)


@pytest.mark.slow
def test_conditions_are_watched_behind_the_scans_of_a_test(project: Path) -> None:
    status, said = fbvm("tests/test_counter.py", "--vary", "Step=1,2", "--never", "Total > 6", "--jobs", "1", "--json")
    [group] = json.loads(said)["groups"]
    assert (status, group["kind"], group["text"], group["first"], group["scan"]) == (1, "never", "Total > 6", 1, 3)
    assert (group["file"], group["line"]) == ("tests/test_counter.py", 3)


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "said"), [
    (("tests/test_counter.py", "--vary", "Foo=1,2"), "no PLC that these tests make has Foo"),
    (("tests/test_counter.py", "--until", "Total > 3"), "tests say that themselves: leave out until"),
    (("tests/test_counter.py", "--never", "Foo > 3"), "the conditions fit no PLC that these tests make"),
    (("tests/test_counter.py", "--cycle", "5ms"), "tests say themselves what they run: leave out --cycle"),
    (("tests/test_counter.py", "src/Counter.st"), "name tests, or programs, not both"),
    (("tests/test_counter.py::test_nothing",), "not found"),
])  # fmt: skip
def test_what_tests_cannot_have_is_refused(project: Path, arguments: tuple[str, ...], said: str) -> None:
    status, text = fbvm(*arguments)
    assert (status, said in text) == (2, True), text


def test_what_tools_have_made_is_no_part_of_a_project_that_is_copied(project: Path) -> None:
    for name in ("env/pyvenv.cfg", "env/lib/a.py", ".git/config", "src/__pycache__/a.pyc"):
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text("")
    (project / "pyvenv.cfg").write_text("")  # the project is an environment itself
    copy_project(project, project / "build")
    assert {path.as_posix() for path in files_of(project / "build")} == {
        "pyvenv.cfg", "pytest.ini", "src/Counter.st", "tests/test_counter.py", "tests/test_st.st"}


def test_results_of_tests_belong_to_the_files_that_they_read(project: Path) -> None:
    from fbvm.campaign.items.bench import plan_of_tests
    from fbvm.campaign.plan_file import Written as InFile

    plan = plan_of_tests(InFile(), ["tests/test_counter.py"])
    before = ItemsBench.of(plan, project).mark
    (project / "results.csv").write_text("1,2")
    assert ItemsBench.of(plan, project).mark == before
    (project / "src" / "Counter.st").write_text(COUNTER.replace(":= 1;", ":= 2;", 1))
    assert ItemsBench.of(plan, project).mark != before


# --- what is varied ---------------------------------------------------------------------------------------------------

KEEPS = """PROGRAM Main
VAR n : INT; limit : INT := 3; END_VAR
VAR RETAIN kept : INT; END_VAR
    n := n + 1; kept := kept + 1;
END_PROGRAM
"""


@pytest.mark.slow
def test_power_is_cut_and_comes_back_while_time_goes_on(project: Path) -> None:
    (project / "keeps.st").write_text(KEEPS)
    run = VariedRun(Conditions(written=(Written("limit", 7),), cuts=(PowerCut("", 35_000_000, 50_000_000),)))
    rig = Rig.of("keeps.st", block=False, varied=run)
    rig.run("60ms")  # four scans, then it is off from 40 to 85 ms, and one scan follows
    assert (rig.elapsed_ns, rig["n"], rig["kept"], rig["limit"]) == (95_000_000, 1, 5, 7)
    assert run.used == {"limit"}


def test_a_value_may_be_written_later_and_a_cycle_be_another(project: Path) -> None:
    (project / "keeps.st").write_text(KEEPS)
    run = VariedRun(Conditions(written=(Written("limit", "INT#9", 25_000_000),), cycles_ns=(("", 5_000_000),),
                               phases_ns=(("", 12_000_000),)))  # fmt: skip
    rig = Rig.of("keeps.st", block=False, varied=run)
    rig.run("10ms")
    assert (rig["n"], rig["limit"]) == (2, 3)  # at 12 and 17 ms
    assert rig.run("10ms")["limit"] == 9


def test_plcs_of_a_plant_are_varied_by_their_names(project: Path) -> None:
    (project / "keeps.st").write_text(KEEPS)
    (project / "fbvm.toml").write_text("".join(f'[plc.{name}]\nsources = ["keeps.st"]\n' for name in ("one", "two")))
    one = PowerCut("one", 30_000_000, 40_000_000)
    run = VariedRun(Conditions(written=(Written("two.Main.limit", 5),), cycles_ns=(("two", 20_000_000),), cuts=(one,),
                               faults=(fault("silent"),)))  # fmt: skip
    plant = PlantRig(project / "fbvm.toml", varied=run)
    plant.run("100ms")
    found = [(rig["kept"], rig["limit"], rig.plc.cycle_ns) for rig in plant.rigs.values()]
    assert found == [(6, 3, 10_000_000), (5, 5, 20_000_000)]
    assert plant.network.faults == [fault("silent")]


@pytest.mark.slow
def test_failures_are_explained_where_somebody_reads_them_only(project: Path) -> None:
    """To find out why a variable has its value takes many times as long as the run."""
    from fbvm.campaign.items.bench import plan_of_tests
    from fbvm.campaign.plan_file import Written as InFile

    (project / "tests" / "test_counter.py").write_text(TESTS.replace("< 15", "< 5"))
    bench = ItemsBench.of(plan_of_tests(InFile(), ["tests/test_counter.py"]), project)
    execution, because = bench.execution(), "Total is 5 since scan 4 (40ms), by src/Counter.st:6"
    result = execution.result(bench.variant(0))
    assert result.failure and because not in execution.report
    again, _ = execution.recorded(bench.variant(0), project / "run.fbtrace")
    assert again == result and because in execution.report


@pytest.mark.slow
def test_a_run_that_leaves_no_trace_leaves_none_of_an_earlier_one(project: Path) -> None:
    from fbvm.campaign.items.bench import plan_of_tests
    from fbvm.campaign.plan_file import Written as InFile

    bench, path = ItemsBench.of(plan_of_tests(InFile(), ["tests/test_st.st"]), project), project / "run.fbtrace"
    path.write_bytes(b"of an earlier campaign")
    result, kept = bench.execution().recorded(bench.variant(0), path)
    assert (result.failure, kept, path.exists()) == (None, [], False)


@pytest.mark.slow
def test_folders_may_have_settings_of_pytest_of_their_own(project: Path) -> None:
    for folder in ("tests", "tests/slow", "tests/quick"):
        (project / folder).mkdir(exist_ok=True)
        (project / folder / "conftest.py").write_text("def pytest_runtest_setup(item):\n    pass\n")
    (project / "tests" / "quick" / "test_here.py").write_text(TESTS.partition("\n\n\n")[2])
    assert fbvm("tests/quick/test_here.py", "tests/test_counter.py::test_it_scans", "--runs", "2", "--jobs", "1")[0] == 0


@pytest.mark.slow
def test_tests_may_make_no_plc(project: Path) -> None:
    (project / "tests" / "test_none.py").write_text("def test_it():\n    assert 1 < 2\n\ndef test_other():\n    assert 1 > 2\n")
    status, said = fbvm("tests/test_none.py::test_other", "--runs", "2", "--jobs", "1")
    assert (status, "fails in scan" in said) == (1, False)
    status, said = fbvm("tests/test_none.py::test_it", "--never", "Foo > 3", "--fresh")
    assert (status, "these tests make no PLC by a fixture" in said) == (2, True)
