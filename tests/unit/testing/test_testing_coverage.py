"""Coverage of PLC code: what is counted, and how it is shown."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rows import each_of
from test_testing_plugin import run

from fbvm.code.compiler import compile_text
from fbvm.machine.counting import counting
from fbvm.machine.plc import Plc
from fbvm.record.trace.branches import branches, statements
from fbvm.testing.coverage import SKIPPED, Coverage, FileCoverage
from fbvm.testing.coverage_report import cobertura, percent, table, write_pages
from fbvm.testing.subject import subject

pytest_plugins = ["pytester"]

TEXT = """\
FUNCTION_BLOCK Choose
VAR_INPUT
    Which : INT;
END_VAR
VAR_OUTPUT
    Out : INT;
END_VAR
VAR
    n : INT;
END_VAR
    IF Which = 1 THEN
        Out := 1;
    ELSIF Which = 2 THEN
        Out := 2;
    END_IF
    CASE Which OF
        3: Out := 3;
        4: Out := 4;
    ELSE
        n := 0;
    END_CASE
    FOR n := 1 TO 2 DO
        Out := Out + 0;
    END_FOR
END_FUNCTION_BLOCK
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "choose.st"
    path.write_text(TEXT, encoding="utf-8")
    return path


def counted(file: Path, *which: int) -> Coverage:
    coverage = Coverage()
    what = subject([file], "")
    plc = Plc(what.image)
    with counting(plc) as counts:
        for value in which:
            plc.write("Test.Block.Which", value)
            plc.scan()
    coverage.add_run(what, counts)
    return coverage


def only(coverage: Coverage) -> FileCoverage:
    (each,) = coverage.files.values()
    return each


# --- what is counted --------------------------------------------------------------------------------------------------


def test_each_statement_is_counted(file: Path) -> None:
    each = only(counted(file, 1, 1))
    assert each.lines == {11: 2, 12: 2, 14: 0, 16: 2, 17: 0, 18: 0, 20: 2, 22: 2, 23: 4}
    assert each.missing == [14, 17, 18]


def test_ways_that_were_never_taken(file: Path) -> None:
    assert only(counted(file, 1)).partial == {11: [0, 14], 16: [17, 18]}
    assert only(counted(file, 1, 2, 5)).partial == {16: [17, 18]}
    assert only(counted(file, 1, 2, 3, 4)).partial == {}


@pytest.mark.slow
def test_rungs_that_were_jumped_over_are_missing(tmp_path: Path) -> None:
    """Line 1 is that of the PROGRAM; the guard that a jump is made of is no statement."""
    file = tmp_path / "rungs.st"
    rungs = "LD W0.00\nJMP 1\nLD P_On\nSET W0.01\nJME 1\n"
    file.write_text(f"PROGRAM Main\nLADDER\n{rungs}END_LADDER\nEND_PROGRAM\n", encoding="utf-8")
    coverage, what = Coverage(), subject([file], "")
    plc = Plc(what.image)
    with counting(plc) as counts:
        plc.scan()
    coverage.add_run(what, counts)
    assert only(coverage).missing == [6]
    with counting(plc) as counts:
        plc.write("W0.00", True)
        plc.scan()
    coverage.add_run(what, counts)
    assert only(coverage).missing == []


def test_what_was_never_executed_is_not_partial(file: Path) -> None:
    each = only(counted(file))
    assert each.partial == {}
    assert each.rate() == 0.0


def test_the_rate_counts_statements_and_ways(file: Path) -> None:
    assert only(counted(file, 1)).rate() == pytest.approx((6 + 2) / (9 + 6))
    assert only(counted(file, 1, 2, 3, 4)).rate() == 1.0
    assert FileCoverage().rate() == 1.0


def test_libraries_that_come_with_fbvm_are_not_counted(tmp_path: Path) -> None:
    path = tmp_path / "user.st"
    path.write_text("FUNCTION_BLOCK User VAR t : TON; END_VAR\n t();\nEND_FUNCTION_BLOCK", encoding="utf-8")
    assert list(counted_of(path).files) == [str(path)]


def counted_of(path: Path) -> Coverage:
    coverage = Coverage()
    coverage.add_run(subject([path], ""))
    return coverage


def test_libraries_of_the_project_are(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    helper = tmp_path / "lib" / "Helper.st"
    helper.write_text("FUNCTION_BLOCK Helper VAR n : INT; END_VAR n := 1; END_FUNCTION_BLOCK", encoding="utf-8")
    path = tmp_path / "user.st"
    path.write_text("FUNCTION_BLOCK User VAR h : Helper; END_VAR h(); END_FUNCTION_BLOCK", encoding="utf-8")
    coverage = Coverage()
    coverage.add_run(subject([path], "", [tmp_path / "lib"]))
    assert set(coverage.files) == {str(path), str(helper)}


def test_counts_of_two_processes_add_up(file: Path) -> None:
    total = Coverage.from_data(counted(file, 1, 2).to_data())
    total.add(counted(file, 1, 3))
    each, known = only(total), only(counted(file, 1, 2, 1, 3))
    assert (each.statements, each.branches) == (known.statements, known.branches)


def test_counts_of_another_process_are_taken_as_they_are(file: Path) -> None:
    other, mine = only(counted(file, 1, 2)), FileCoverage()
    mine.add(other)
    assert (mine.statements, mine.branches) == (other.statements, other.branches)


def test_branches_of_an_image() -> None:
    image = compile_text("""FUNCTION F : BOOL VAR_INPUT x : INT; END_VAR F := x > 3; END_FUNCTION
PROGRAM Main VAR a, b : INT; t : TON; END_VAR
IF a = 1 THEN
  b := 1;
ELSIF F(a) THEN
  b := 2;
ELSE
  WHILE F(b) DO
    b := 0;
  END_WHILE
END_IF
t(EN := b > 1, IN := TRUE);
END_PROGRAM""").image
    assert image is not None
    shown = [(image.sites[branch.site].line, [image.sites[target].line for target in branch.targets], branch.may_skip)
             for branch in branches(image) if image.sites[branch.site].pou == "Main"]  # fmt: skip
    assert shown == [(3, [4, 6, 8], False)]
    lines = sorted(image.sites[number].line for number in statements(image) if image.sites[number].pou == "Main")
    assert lines == [3, 4, 6, 8, 9, 12]


# --- how it is shown --------------------------------------------------------------------------------------------------


def test_a_table_of_files(file: Path) -> None:
    lines = list(table(counted(file, 1), file.parent))
    assert lines[1].endswith("11->past, 11->14, 14, 16->17, 16->18, 17-18")
    assert lines[1].split()[:6] == ["choose.st", "9", "3", "6", "4", "53%"]
    assert lines[2].split() == ["TOTAL", "9", "3", "6", "4", "53%"]


@each_of(("rate", "said"), [(0.0, "0%"), (0.001, "1%"), (0.5, "50%"), (0.999, "99%"), (1.0, "100%")])
def test_only_all_is_all(rate: float, said: str) -> None:
    assert percent(rate) == said


def test_cobertura(file: Path) -> None:
    top = ElementTree.fromstring(cobertura(counted(file, 1), file.parent))
    assert (top.get("lines-valid"), top.get("lines-covered"), top.get("branches-covered")) == ("9", "6", "2")
    row = top.find("packages/package/classes/class")
    assert row is not None and row.get("filename") == "choose.st"
    lines = {line.get("number"): dict(line.attrib) for line in row.iter("line")}
    assert lines["12"] == {"number": "12", "hits": "1", "branch": "false"}
    assert lines["11"]["condition-coverage"] == "33% (1/3)"


def test_pages(file: Path) -> None:
    index = write_pages(counted(file, 1), file.parent, file.parent / "pages")
    assert "choose.st</a><td>9<td>3<td>6<td>4<td>53%" in index.read_text(encoding="utf-8")
    page = (index.parent / "0_choose.html").read_text(encoding="utf-8")
    assert '<div class="miss"><i>   14       0</i>          Out := 2;' in page
    assert 'title="never went past it, to line 14"' in page
    assert re.search(r'class="run"><i>   23 +2</i>', page)


def test_the_way_past_is_no_place() -> None:
    assert SKIPPED == (0, 0)


# --- in pytest --------------------------------------------------------------------------------------------------------


def project_of(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\n")
    (pytester.mkdir("src") / "Choose.st").write_text(TEXT, encoding="utf-8")
    pytester.makepyfile("""
        def test_one(fb, trace):
            choose = fb("src/Choose.st")
            run = trace(choose)
            assert choose.scan(Which=1).Out == 1
            assert "FALSE" not in run.chart()

        def test_two(fb):
            assert fb("src/Choose.st").scan(Which=2).Out == 2
    """)
    pytester.makefile(".st", test_choose="PROGRAM Test VAR c : Choose; END_VAR\nc(Which := 3);\nASSERT(c.Out = 3);\nEND_PROGRAM")


@pytest.mark.slow
def test_a_report_at_the_end(pytester: pytest.Pytester) -> None:
    project_of(pytester)
    result = run(pytester, "--fbvm-cov", "--fbvm-cov-html=pages", "--fbvm-cov-xml=cov.xml")
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(["Name*", "src/Choose.st*9*1*6*1*87%*16->18, 18", "test_choose.st*2*100%", "TOTAL*",
                                  "written to *pages*", "written to cov.xml"])
    assert (pytester.path / "pages" / "index.html").is_file()
    assert 'filename="src/Choose.st"' in (pytester.path / "cov.xml").read_text()


@pytest.mark.slow
def test_what_stands_behind_a_failed_assert_was_not_executed(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\n")
    pytester.makefile(".st", test_one="PROGRAM Test VAR n : INT; END_VAR\nn := 1;\nASSERT(n = 2);\nn := 3;\nEND_PROGRAM")
    result = run(pytester, "--fbvm-cov")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["test_one.st*3*1*67%*4"])


@pytest.mark.slow
def test_with_xdist(pytester: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    project_of(pytester)
    from test_testing_plugin import ARGUMENTS

    result = pytester.runpytest_subprocess(*ARGUMENTS, "--fbvm-cov", "-n", "2", f"--rootdir={pytester.path}")
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(["src/Choose.st*9*1*6*1*87%*16->18, 18"])


@pytest.mark.slow
def test_without_the_option_nothing_is_counted(pytester: pytest.Pytester) -> None:
    project_of(pytester)
    run(pytester).stdout.no_fnmatch_line("*coverage of PLC code*")


@pytest.mark.slow
def test_nothing_to_count(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_it(): assert True")
    run(pytester, "--fbvm-cov").stdout.fnmatch_lines(["nothing was executed"])
