"""Parts of the test plugin alone: golden texts, results as xUnit, wrappers of blocks, a rig of a project."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.base import types as t
from fbvm.record.trace.recorder import Recorder
from fbvm.testing import golden, strategies
from fbvm.testing.plant_rig import PlantRig, project_near
from fbvm.testing.recorded import Recorded
from fbvm.testing.rig import Rig, not_found
from fbvm.testing.subject import SubjectError, subject
from fbvm.testing.suites.results import Failure, SuiteTestResult
from fbvm.testing.suites.xunit import write_xunit
from fbvm.watch.paths import UnknownPlace

MS = 1_000_000

# --- golden texts -----------------------------------------------------------------------------------------------------

STEPS = "PROGRAM Main VAR n : INT; even : BOOL; END_VAR n := n + 1; even := n MOD 4 > 1; END_PROGRAM"
GOLDEN = """\
scans 1 to 4

Main.n
  scan 1      10ms      2
  scan 2      20ms      3
  scan 3      30ms      4
  scan 4      40ms      5

Main.even
  scan 1      10ms      TRUE
  scan 3      30ms      FALSE
"""


@pytest.fixture
def recorder() -> Recorder:
    image = compile_text(STEPS).image
    assert image is not None
    plc = Plc(image)
    plc.scan()
    made = Recorder(plc, ["Main.n", "Main.even"])
    plc.run(scans=4)
    return made


def test_a_golden_text_has_the_changes_of_each_variable(recorder: Recorder) -> None:
    assert golden.golden_text(recorder) == GOLDEN  # type: ignore[arg-type]


def test_a_golden_file_is_written_or_compared(recorder: Recorder, tmp_path: Path) -> None:
    path = tmp_path / "deep" / "run.txt"
    with pytest.raises(AssertionError, match=r"run\.txt is not there; look at this run"):
        golden.check(path, recorder, False)  # type: ignore[arg-type]
    golden.check(path, recorder, True)  # type: ignore[arg-type]
    assert path.read_text() == GOLDEN
    golden.check(path, recorder, False)  # type: ignore[arg-type]
    path.write_text(GOLDEN.replace("3\n", "7\n"))
    with pytest.raises(AssertionError, match=r"run\.txt was another run") as raised:
        golden.check(path, recorder, False)  # type: ignore[arg-type]
    assert "Main.n\n  - scan 2      20ms      7\n  + scan 2      20ms      3" in str(raised.value)


@each_of(("change", "said"), [
    (lambda text: text, ""), (lambda text: text.replace("1 to 4", "1 to 5"), "length\n  - scans 1 to 4\n  + scans 1 to 5"),
    (lambda text: text.replace("Main.even", "Main.odd"), "Main.even: not recorded now\nMain.odd: was not recorded"),
    (lambda text: text + "  scan 4      40ms      TRUE\n", "Main.even\n  + scan 4      40ms      TRUE"),
])  # fmt: skip
def test_differences_are_told_variable_by_variable(change: Any, said: str) -> None:
    assert golden.differences(GOLDEN, change(GOLDEN)) == said


def test_of_many_differences_the_first_five_are_shown() -> None:
    rows = [f"  scan {scan}" for scan in range(8)]

    def said(count: int) -> list[str]:
        old, new = ("".join(f"{row}{mark}\n" for row in rows[:count]) for mark in ("", "!"))
        return golden.differences(f"a\n{old}", f"a\n{new}").splitlines()

    assert said(8)[0] == "a" and len(said(8)) == 12 and said(8)[-1] == "    and 3 more"
    assert len(said(5)) == 11 and "more" not in said(5)[-1]


# --- results of suites as xUnit ---------------------------------------------------------------------------------------


def test_results_are_written_as_tcunit_writes_them(tmp_path: Path) -> None:
    def result(failed: bool = False, skipped: bool = False, time: float = 0.5, *failures: str) -> SuiteTestResult:
        made = SuiteTestResult(True, failed, skipped, 3, time)
        made.failures.extend(Failure(text, 0, 0) for text in failures)
        return made

    one = SimpleNamespace(plc=SimpleNamespace(elapsed_ns=1500 * MS), results={
        ("A", "good"): result(), ("A", "bad <1>"): result(True, False, 0.75, 'is "5"', "later"),
        ("B", "left"): result(skipped=True)})
    other = SimpleNamespace(plc=SimpleNamespace(elapsed_ns=500 * MS), results={
        ("C", "bad"): result(True)})
    write_xunit(tmp_path / "x.xml", [one, other])  # type: ignore[list-item]
    root = ElementTree.parse(tmp_path / "x.xml").getroot()
    assert (root.get("failures"), root.get("tests"), root.get("time")) == ("2", "2", "2.0")
    suites = [tuple(suite.get(name) for name in ("id", "name", "tests", "failures", "time")) for suite in root]
    assert suites == [("0", "A", "2", "1", "0.75"), ("1", "B", "1", "0", "0.5"), ("2", "C", "1", "1", "0.5")]
    cases = [(case.get("name"), case.get("classname"), case.get("status"), [row.get("message") for row in case])
             for case in root.iter("testcase")]  # fmt: skip
    assert cases == [("good", "A", "PASS", []), ("bad <1>", "A", "FAIL", ['is "5"']), ("left", "B", "SKIP", []),
                     ("bad", "C", "FAIL", [""])]  # fmt: skip


# --- what is tested ---------------------------------------------------------------------------------------------------

BLOCKS = """FUNCTION Sum : INT VAR_INPUT a, b : INT; END_VAR VAR_OUTPUT big : BOOL; END_VAR VAR_IN_OUT io : INT; END_VAR
Sum := a + b; big := a > 5; io := io + 1; END_FUNCTION
FUNCTION Nothing VAR_INPUT a : INT; END_VAR END_FUNCTION
FUNCTION_BLOCK Twice VAR_INPUT x : INT; END_VAR VAR_OUTPUT y : INT; END_VAR VAR_IN_OUT io : INT; END_VAR
y := 2 * x; io := io - 1; END_FUNCTION_BLOCK
FUNCTION Open : INT VAR_IN_OUT a : ARRAY[*] OF INT; END_VAR END_FUNCTION
PROGRAM Main VAR n : INT; t : Twice; END_VAR n := n + 1; t(x := n, io := n); END_PROGRAM
PROGRAM Other VAR m : INT; END_VAR m := m + 1; END_PROGRAM
"""


def rig(name: str | None) -> Rig:
    return Rig(subject([], name, [], None, BLOCKS), "10ms")


def test_a_function_is_called_with_variables_of_its_names() -> None:
    made = rig("Sum").write(a=4, b=5, io=10).scan()
    assert (made.Result, made.big, made.io) == (9, False, 11)
    assert rig("sum").write(a=6).scan().big is True
    assert not hasattr(rig("Nothing").scan(), "Result")


def test_an_in_out_of_a_block_is_a_variable_of_its_name() -> None:
    made = rig("Twice").write(x=3, io=7).scan()
    assert (made.y, made.io) == (6, 6)


@each_of(("name", "said"), [
    ("Nobody", "there is no Nobody; there is Sum, Nothing, Twice, Open, Main, Other"),
    ("", "say which: test.st::NAME; there is Sum"),
    ("Open", "Open takes what has no type of its own, a : ARRAY[*] OF INT"),
])  # fmt: skip
def test_what_cannot_be_tested_says_why(name: str, said: str) -> None:
    with pytest.raises(SubjectError) as raised:
        rig(name)
    assert said in str(raised.value)


def test_alone_a_program_is_compiled_without_the_others() -> None:
    made = subject([], "Main", [], None, BLOCKS.replace("m := m + 1", "m := wrong"), alone=True)
    assert made.prefix == "Main." and made.image.sites[-1].file
    with pytest.raises(SubjectError, match="wrong"):
        subject([], "Main", [], None, BLOCKS.replace("m := m + 1", "m := wrong"))


# --- inputs to choose values for --------------------------------------------------------------------------------------


def test_inputs_that_a_block_does_not_have_are_refused() -> None:
    with pytest.raises(ValueError, match="Twice has no input z; it has x, io"):
        strategies.inputs(rig("Twice"), z=strategies.values(t.INT))
    with pytest.raises(ValueError, match="Sum has no input z; it has a, b, io, big"):
        strategies.inputs(rig("Sum"), z=strategies.values(t.INT))


def test_a_course_of_inputs_is_followed() -> None:
    seen = strategies.follow(rig("Twice"), [(30 * MS, {"x": 4}), (0, {"x": 5})])
    assert (seen.plc.scans, seen.y) == (5, 10)


@pytest.mark.slow
def test_what_is_done_with_a_rig_can_be_written_in_a_row() -> None:
    made = rig("Twice")
    for done in (made.write(x=1), made.scan(x=2), made.run(scans=2), made.until(lambda rig: True), made.power_on(),
                 made.cold_start(), made.mode("PROGRAM"), made.mode("RUN"), made.unforce()):  # fmt: skip
        assert done is made


def test_a_course_has_one_step_at_least_and_as_many_as_are_wanted_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strategies.st, "lists", lambda step, min_size, max_size: (min_size, max_size))
    assert strategies.courses(rig("Twice"), "30ms", 4) == (1, 4) and strategies.courses(rig("Twice")) == (1, 20)


# --- a rig of a project -----------------------------------------------------------------------------------------------

PROJECT = """[run]
net = "loop"
[plc.fast]
sources = ["count.st"]
cycle = "10ms"
[[plc.fast.set]]
name = "Main.step"
value = 3
[plc.slow]
sources = ["count.st"]
cycle = "25ms"
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "count.st").write_text("PROGRAM Main VAR n : INT; step : INT := 1; END_VAR n := n + step; END_PROGRAM")
    (tmp_path / "fbvm.toml").write_text(PROJECT)
    return tmp_path


def test_plcs_of_a_project_scan_in_the_order_of_time(project: Path) -> None:
    plant = PlantRig(project / "fbvm.toml")
    assert [*plant.rigs] == ["fast", "slow"] and plant.elapsed_ns == 0
    assert plant.scan() is plant
    assert (plant.fast.n, plant["slow"].n, plant.elapsed_ns) == (3, 1, 10 * MS)
    plant.run("40ms")
    assert (plant.fast.n, plant.slow.n) == (15, 2) and plant.elapsed_ns == 50 * MS
    plant.until("slow.Main.n = 3 AND fast.Main.n > 3")
    assert plant.fast.plc.scans == 6
    plant.until(lambda plant: plant.fast.n == 21)
    with pytest.raises(AssertionError, match=r"slow\.Main\.n < 0 does not hold within 30ms"):
        plant.until("slow.Main.n < 0", max="30ms")
    with pytest.raises(KeyError, match="there is no PLC other; there is fast, slow"):
        plant["other"]
    assert not hasattr(plant, "other")


def test_the_nearest_project_is_taken(project: Path) -> None:
    deep = project / "tests"
    deep.mkdir()
    assert project_near([deep, project], "fbvm.toml").resolve() == (project / "fbvm.toml").resolve()
    assert project_near([project], ".").resolve() == (project / "fbvm.toml").resolve()
    with pytest.raises(FileNotFoundError, match=r"none\.toml is neither in .* nor in"):
        project_near([deep, project], "none.toml")


@each_of("name, said", [
    ("lo", "Main has no lo; it has low, high"), ("Main.lo", "Main has no lo; it has low, high"),
    ("main.low.x", "low is INT and has no member x"), ("low.x", "low is INT and has no member x"),
])
def test_a_misspelt_name_is_told_in_both_ways_to_write_it(name: str, said: str) -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR low, high : INT; END_VAR END_PROGRAM")
    with pytest.raises(UnknownPlace) as error:
        rig[name]
    assert str(error.value) == said


@each_of("named, said", [
    ("pmp.st", "pmp.st is neither in {0}/tests nor in {0}; did you mean pump.st?"),
    ("src/mian.st", "src/mian.st is neither in {0}/tests nor in {0}; did you mean src/main.st?"),
    ("{0}/pmp.st", "{0}/pmp.st is neither in {0}/tests nor in {0}; did you mean {0}/pump.st?"),
    ("none/pump.st", "none/pump.st is neither in {0}/tests nor in {0}"), ("zzz.st", "zzz.st is neither in {0}/tests nor in {0}"),
])
def test_a_misspelt_file_of_a_test_gets_a_suggestion(tmp_path: Path, named: str, said: str) -> None:
    (tmp_path / "src").mkdir(exist_ok=True)
    for name in ("pump.st", "src/main.st"):
        (tmp_path / name).touch()
    path, expected = (str(Path(text.format(tmp_path))) for text in (named, said))
    assert str(not_found(path, [tmp_path / "tests", tmp_path])) == expected.replace("/", os.sep)
    assert str(not_found("zzz.st", [tmp_path])) == f"zzz.st is not in {tmp_path}"


def test_a_rig_is_looked_at_afterwards(tmp_path: Path) -> None:
    made = rig("Twice").write(x=1).scan()
    seen = Recorded(made, tmp_path / "t.fbtrace", folder=tmp_path)
    made.write(x=2).scan()
    made.write(x=3).scan()
    assert seen.chart("y") == "y  4|6"
    assert "y := 2 * x" in seen.why("y")
    some = seen.table("y", scans=range(1, 2))
    assert "6" in seen.table("y") and "scan 1" in some and "scan 2" not in some
    with pytest.raises(AssertionError, match="is not there"):
        seen.golden("g.txt", "y")
    Recorded(made, tmp_path / "u.fbtrace", folder=tmp_path, write_golden=True)
    assert seen.path.stat().st_size > 100
