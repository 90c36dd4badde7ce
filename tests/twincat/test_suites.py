"""Suites of a TwinCAT project under pytest: the shipped example, names that span cycles, suites that never finish."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from twincat_files import write_tested_solution

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_text
from fbvm.code.image import Site
from fbvm.testing.suites import results
from fbvm.testing.suites.items import OTHERS, SuiteItem, SuiteTestFailed
from fbvm.testing.suites.program import FoundTest, find_suites
from fbvm.testing.suites.results import Failure, SuiteRun, SuiteTestResult, run_suites
from fbvm.testing.suites.xunit import write_xunit

pytest_plugins = ["pytester"]
EXAMPLE = data_folder("fblib").parent / "examples" / "twincat"
SUITE = """
FUNCTION_BLOCK FB_A_Test EXTENDS TcUnit.FB_TestSuite
METHOD One
TEST('one');
AssertEquals_INT(Expected := 5, Actual := 5, Message := 'five');
AssertEquals_INT(5, 4, 'four');
TEST_FINISHED();
END_METHOD
METHOD Two
VAR_INST t : TON; END_VAR
TEST(' two ');
t(IN := TRUE, PT := T#50ms);
IF t.Q THEN AssertTrue(TRUE, 'x'); TEST_FINISHED(); END_IF
END_METHOD
METHOD InTurn
IF TEST_ORDERED('first') THEN AssertEquals_BYTE(16#AB, 16#CD, 'bytes'); TEST_FINISHED(); END_IF
IF TEST_ORDERED('second') THEN TEST_FINISHED(); END_IF
TEST('disabled_three'); AssertTrue(FALSE, 'never'); TEST_FINISHED();
END_METHOD
One(); Two(); InTurn();
END_FUNCTION_BLOCK
FUNCTION_BLOCK FB_B_Test EXTENDS FB_TestSuite
TEST('never'); AssertTrue(TRUE, '');
END_FUNCTION_BLOCK
"""
PROGRAM = "PROGRAM PRG_TEST VAR {} END_VAR TcUnit.RUN(); END_PROGRAM"


def ran(instances: str, *suites: str, limit_ns: int = 10**9) -> SuiteRun:
    made = compile_text(SUITE + PROGRAM.format(instances), dialect="twincat")
    assert made.image is not None, [message.render() for message in made.errors]
    return run_suites(made.image, suites, limit_ns)


def test_suites_and_the_names_of_their_tests_are_found_without_running() -> None:
    found = find_suites([Source("a.st", SUITE + PROGRAM.format("a, b : FB_A_Test; c : FB_B_Test; n : INT;"))])
    assert [suite.path for suite in found] == ["PRG_TEST.a", "PRG_TEST.b", "PRG_TEST.c"]
    assert [(test.name, test.skipped) for test in found[0].tests] == [
        ("one", False), ("two", False), ("first", False), ("second", False), ("three", True)]
    assert find_suites([Source("a.st", SUITE + "PROGRAM P VAR a : FB_A_Test; END_VAR a(); END_PROGRAM")]) == []


def test_the_line_of_a_failure_is_that_of_the_assertion_with_its_message() -> None:
    [suite] = find_suites([Source("a.st", SUITE + PROGRAM.format("a : FB_A_Test;"))])
    one = suite.tests[0]
    assert one.asserts == (("five", 5), ("four", 6))
    assert one.line_of("EXP: 5, ACT: 4, MSG: four") == 6
    assert one.line_of("EXP: 5, ACT: 4, MSG: six") is None


def item(suite: str, test: FoundTest, **parts: object) -> SuiteItem:
    """A test of a suite apart from pytest's session."""
    made = SuiteItem.__new__(SuiteItem)
    made.__dict__.update(suite=suite, test=test)
    made.parent, made.session = SimpleNamespace(subject=None), SimpleNamespace(items=[])  # type: ignore[assignment]
    return made


def test_a_failure_is_told_at_its_statement_or_that_of_its_message_or_its_test() -> None:
    [suite] = find_suites([Source("a.st", SUITE + PROGRAM.format("a : FB_A_Test;"))])
    known = Failure("EXP: 5, ACT: 4, MSG: four", 3, 30_000_000, Site("b.st", "Helper", 9, 1))
    failures = [replace(known, site=None), known, replace(known, text="MSG: made up")]
    failures[2].site = None
    assert item("PRG_TEST.a", suite.tests[0])._said(SuiteTestFailed("PRG_TEST.a", "one", failures, "")).splitlines() == [
        "a.st:6: in PRG_TEST.a, test one, scan 3 (30ms)", ">   ", "E   EXP: 5, ACT: 4, MSG: four",
        "b.st:9: in PRG_TEST.a, test one, scan 3 (30ms)", ">   ", "E   EXP: 5, ACT: 4, MSG: four",
        "a.st:4: in PRG_TEST.a, test one, scan 3 (30ms)", "E   MSG: made up"]  # fmt: skip


def test_tests_whose_names_are_made_up_by_the_program_are_one_of_pytest() -> None:
    [suite] = find_suites([Source("a.st", SUITE + PROGRAM.format("a : FB_A_Test;"))])
    others = item("PRG_TEST.a", FoundTest(OTHERS, "a.st", 1))
    others.session.items += [item("PRG_TEST.a", suite.tests[0]), item("PRG_TEST.b", suite.tests[1])]
    own, own_two, foreign = (SuiteTestResult(True, False, False, 1, 0.0) for _ in range(3))
    found = {("PRG_TEST.a", "one"): own, ("PRG_TEST.a", "two"): own_two, ("PRG_TEST.b", "two"): foreign}
    assert others._results(SimpleNamespace(results=found)) == [("two", own_two)]  # type: ignore[arg-type]


@pytest.mark.slow
def test_runs_that_are_not_recorded_are_done_again_up_to_their_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "OWN", "a function that TcUnit has not")
    run = ran("a : FB_A_Test;", "PRG_TEST.a")
    assert run.recorded is None
    failed = {name: result for (_, name), result in run.results.items() if result.failed}
    assert set(failed) == {"one", "first"}
    lines = []
    for result in failed.values():
        [failure] = result.failures
        assert result.recorded is not None and result.recorded.scans.stop == failure.scan + 1
        lines.append(failure.site.line if failure.site is not None else None)
    assert lines == [6, 16]


@pytest.mark.slow
def test_suites_test_blocks_of_the_projects_that_theirs_refers_to(pytester: pytest.Pytester) -> None:
    write_tested_solution(pytester.path)
    result = pytester.runpytest("-q", "Line/Line.plcproj")
    result.assert_outcomes(passed=1)


@pytest.mark.slow
def test_two_variables_of_any_type_are_compared() -> None:
    made = compile_text("""FUNCTION_BLOCK FB_Any_Test EXTENDS TcUnit.FB_TestSuite
VAR a, b : INT; c : DINT; s, t : STRING(20); u : STRING(30); w, x : WORD; END_VAR
TEST('equal'); s := 'xy'; t := 'xyz'; t := 'xy'; AssertEquals(a, b, 'int'); AssertEquals(s, t, 'text'); TEST_FINISHED();
TEST('other'); b := 4; x := 16#AB; t := 'abc';
AssertEquals(a, b, 'int'); AssertEquals(a, c, ''); AssertEquals(s, t, ''); AssertEquals(s, u, ''); AssertEquals(w, x, '');
TEST_FINISHED();
END_FUNCTION_BLOCK
""" + PROGRAM.format("a : FB_Any_Test;"), dialect="twincat")
    assert made.image is not None, [message.render() for message in made.errors]
    found = run_suites(made.image, ["PRG_TEST.a"]).results
    assert not found["PRG_TEST.a", "equal"].failed and found["PRG_TEST.a", "equal"].asserts == 2
    assert [failure.text for failure in found["PRG_TEST.a", "other"].failures] == [
        "EXP: 0, ACT: 4, MSG: int", "EXP: (Type class = INT), ACT: (Type class = DINT)", "EXP: xy, ACT: abc",
        "EXP: (Data size = 21), ACT: (Data size = 31)", "EXP: 0x0000, ACT: 0x00AB"]


VALUES = {
    "BOOL": ("TRUE", "FALSE"), "BYTE": ("0x0A", "0x00"), "WORD": ("0x000A", "0x0000"), "DWORD": ("0x0000000A", "0x00000000"),
    "LWORD": ("0x000000000000000A", "0x0000000000000000"), "SINT": ("-3", "0"), "INT": ("-3", "0"), "DINT": ("-3", "0"),
    "LINT": ("-3", "0"), "USINT": ("3", "0"), "UINT": ("3", "0"), "UDINT": ("3", "0"), "ULINT": ("3", "0"),
    "REAL": ("1.5", "0.0"), "LREAL": ("-1.5", "0.0"), "STRING": ("ab", ""), "TIME": ("T#1s", "T#0s"),
    "LTIME": ("LTIME#1s", "LTIME#0ns"),
    "DATE": ("D#2026-11-29", "D#1970-01-01"), "TIME_OF_DAY": ("TOD#01:02:03", "TOD#00:00:00"),
    "DATE_AND_TIME": ("DT#2026-11-29-01:02:03", "DT#1970-01-01-00:00:00"),
}  # fmt: skip
"""By type what a test tells of a value and of the initial one."""


@pytest.mark.slow
def test_the_values_of_every_type_are_told() -> None:
    written = {name: text.replace("0x", "16#") if "0x" in text else f"'{text}'" if name == "STRING" else text
               for name, (text, _) in VALUES.items()}  # fmt: skip
    declared = " ".join(f"{name}_a : {name} := {written[name]}; {name}_b : {name};" for name in VALUES)
    compared = " ".join(f"AssertEquals({name}_a, {name}_b, '{name}');" for name in VALUES)
    made = compile_text(f"""FUNCTION_BLOCK FB_Told_Test EXTENDS TcUnit.FB_TestSuite
VAR {declared} END_VAR
TEST('told'); {compared} TEST_FINISHED();
END_FUNCTION_BLOCK
""" + PROGRAM.format("a : FB_Told_Test;"), dialect="twincat")
    assert made.image is not None, [message.render() for message in made.errors]
    told = [failure.text for failure in run_suites(made.image, ["PRG_TEST.a"]).results["PRG_TEST.a", "told"].failures]
    assert told == [f"EXP: {value}, ACT: {initial}, MSG: {name}" for name, (value, initial) in VALUES.items()]


@pytest.mark.slow
def test_arrays_are_compared_element_by_element_whatever_their_bounds() -> None:
    made = compile_text("""FUNCTION_BLOCK FB_Arrays_Test EXTENDS TcUnit.FB_TestSuite
VAR a : ARRAY[1..3] OF INT := [1, 2, 3]; b : ARRAY[0..2] OF INT := [1, 7, 3]; c : ARRAY[5..6] OF INT;
p : ARRAY[-1..0, 1..3] OF LREAL := [1, 2, 3, 4, 5, 6]; q : ARRAY[0..1, 0..2] OF LREAL := [1, 2, 3.02, 4, 5.1, 6];
r : ARRAY[1..3, 1..2] OF LREAL;
x : ARRAY[0..1, 0..1, 0..1] OF REAL := [8(1)]; y : ARRAY[1..2, 1..2, 1..2] OF REAL := [7(1), 2];
n : INT; t : TON; END_VAR
TEST('same'); AssertArrayEquals_INT(a, a, ''); AssertArray2dEquals_LREAL(p, q, 0.03, ''); AssertEquals_WSTRING("a", "a", '');
WRITE_PROTECTED_TIME(ADR(t.PT), T#3s); AssertEquals_TIME(T#3s, t.PT, ''); AssertFalse(IS_TEST_FINISHED('same'), '');
TEST_FINISHED();
TEST('other'); AssertArrayEquals_INT(Expecteds := a, Actuals := b, Message := 'one');
AssertArrayEquals_INT(a, c, 'two'); AssertArray2dEquals_LREAL(p, q, Delta := 0.01, 'three');
AssertArray2dEquals_LREAL(p, r, 0.01, '');
AssertArray3dEquals_REAL(x, y, 0.5, ''); AssertEquals_WSTRING("a", "b", ''); AssertTrue(IS_TEST_FINISHED('same'), '');
TEST_FINISHED();
END_FUNCTION_BLOCK
""" + PROGRAM.format("a : FB_Arrays_Test;"), dialect="twincat")
    assert made.image is not None, [message.render() for message in made.errors]
    found = run_suites(made.image, ["PRG_TEST.a"]).results
    assert not found["PRG_TEST.a", "same"].failed and found["PRG_TEST.a", "same"].asserts == 5
    assert [failure.text for failure in found["PRG_TEST.a", "other"].failures] == [
        "EXP: ARRAY[2] = 2, ACT: ARRAY[1] = 7, MSG: one",
        "EXP: SIZE = 3, ACT: SIZE = 2, MSG: two, size of arrays not matching.",
        "EXP: ARRAY[0,2] = 5.0, ACT: ARRAY[1,1] = 5.1, MSG: three",
        "EXP: SIZE = [-1..0,1..3] (2x3), ACT: SIZE = [1..3,1..2] (3x2), MSG: size of arrays not matching.",
        "EXP: ARRAY[1,1,1] = 1.0, ACT: ARRAY[2,2,2] = 2.0",
        "EXP: Not possible to print EXP unicode WSTRING value, ACT: Not possible to print ACT unicode WSTRING value"]


@pytest.mark.slow
def test_tests_of_one_cycle_and_of_several_ordered_and_disabled_ones() -> None:
    run = ran("a : FB_A_Test;", "PRG_TEST.a")
    seen = {name: (r.finished, r.failed, r.skipped, r.asserts, r.duration_s) for (_, name), r in run.results.items()}
    assert run.is_over
    assert seen == {"one": (True, True, False, 2, 0.0), "two": (True, False, False, 1, 0.05),
                    "first": (True, True, False, 1, 0.0), "second": (True, False, False, 0, 0.0),
                    "three": (False, False, True, 0, 0.0)}
    failures = [failure for result in run.results.values() for failure in result.failures]
    assert [failure.text for failure in failures] == ["EXP: 5, ACT: 4, MSG: four", "EXP: 0xAB, ACT: 0xCD, MSG: bytes"]
    assert [failure.site and failure.site.line for failure in failures] == [6, 16]


@pytest.mark.slow
def test_a_suite_that_never_finishes_ends_at_the_limit() -> None:
    run = ran("b : FB_B_Test;", "PRG_TEST.b", limit_ns=10**8)
    assert (run.is_over, run.plc.elapsed_ns, run.results["PRG_TEST.b", "never"].finished) == (False, 10**8, False)


@pytest.mark.slow
def test_results_in_the_form_of_tcunit(tmp_path: Path) -> None:
    write_xunit(tmp_path / "x.xml", [ran("a : FB_A_Test;", "PRG_TEST.a")])
    text = (tmp_path / "x.xml").read_text()
    assert '<testsuites disabled="" failures="2" tests="3" time="' in text
    assert '<testcase name="one" classname="PRG_TEST.a" time="0.0" status="FAIL">' in text
    assert '<failure message="EXP: 5, ACT: 4, MSG: four" type=""></failure>' in text


@pytest.mark.slow
def test_each_test_of_the_example_is_one_of_pytest(pytester: pytest.Pytester) -> None:
    settings = str(pytester.makeini("[pytest]"))
    done = pytester.runpytest_inprocess(str(EXAMPLE), "-c", settings, "-p", "no:cacheprovider", "-p", "no:randomly")
    done.assert_outcomes(passed=3, failed=1, skipped=1)
    [page] = set(re.findall("every scan, in a browser: (.*)", done.stdout.str()))  # CI=true tells it twice
    assert "a motor that was stopped is started again" in (pytester.path / page).read_text(encoding="utf-8")
    done.stdout.fnmatch_lines(["*FB_Motor_Test.TcPOU:31: in PRG_TEST.fbMotors, test a motor that was stopped is started again, *",
                               ">   AssertEquals_UDINT(Expected := 3, Actual := fbMotor.nStarts, *",
                               "E   EXP: 3, ACT: 2, MSG: starts behind a stop"])  # fmt: skip
