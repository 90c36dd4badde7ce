"""What coverage says of single lines, branches and files, over the corner cases."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from rows import each_of

from fbvm.testing.coverage import SKIPPED, Coverage, FileCoverage
from fbvm.testing.coverage_report import cobertura, percent, table, write_pages


def file(statements: dict[int, int], branches: dict[int, dict[int, int]] | None = None) -> FileCoverage:
    """Statements in column 5 of their lines, by line, and the branches of some of them, 0 for the one that is past it."""
    return FileCoverage({(line, 5): count for line, count in statements.items()}, {
        (line, 5): {(to, 5) if to else SKIPPED: count for to, count in ways.items()} for line, ways in (branches or {}).items()})


def of(**files: FileCoverage) -> Coverage:
    made = Coverage()
    made.files |= {f"/plant/{name}.st": each for name, each in files.items()}
    return made


@each_of("rate, said", [
    (0.0, "0%"), (1e-9, "1%"), (0.004, "1%"), (0.014, "1%"), (0.016, "2%"), (0.5, "50%"), (0.986, "99%"), (0.994, "99%"),
    (0.996, "99%"), (1 - 1e-9, "99%"), (1.0, "100%")])
def test_all_and_nothing_are_said_of_all_and_nothing_only(rate: float, said: str) -> None:
    assert percent(rate) == said


@each_of("statements, branches, said", [
    ({}, {}, ""), ({4: 1}, {}, ""), ({4: 0}, {}, "4"), ({4: 0, 5: 0}, {}, "4-5"), ({4: 0, 9: 0, 30: 0}, {}, "4-30"),
    ({4: 0, 5: 1, 6: 0}, {}, "4, 6"), ({1: 0, 2: 0, 3: 1, 4: 0, 5: 1, 6: 0, 9: 0}, {}, "1-2, 4, 6-9"),
    # a branch that was not taken stands where its IF does, the one to none behind the others of another line
    ({4: 1, 5: 0, 7: 1}, {4: {5: 0, 7: 1}}, "4->5, 5"), ({4: 1, 5: 1}, {4: {5: 1, 0: 0}}, "4->past"),
    ({4: 3, 5: 0, 8: 0}, {4: {5: 0, 8: 0, 0: 3}}, "4->5, 4->8, 5-8"), ({4: 0, 5: 0}, {4: {5: 0, 0: 0}}, "4-5"),
    ({2: 0, 4: 1, 5: 1, 9: 0}, {4: {5: 1, 0: 0}}, "2, 4->past, 9"),
])
def test_what_was_missed_is_told_in_runs_of_lines_and_ways(statements: dict[int, int], branches: dict[int, dict[int, int]],
                                                          said: str) -> None:
    row = list(table(of(a=file(statements, branches)), Path("/plant")))[1]
    assert row.partition("%")[2].strip() == said


def test_a_table_is_as_wide_as_its_longest_name_and_counts_every_file() -> None:
    branching = file({1: 1, 2: 0, 3: 1}, {1: {2: 0, 0: 1}})
    made = of(zoo=file({1: 1}), a_rather_long_name=branching, none=file({}))
    assert list(table(made, Path("/plant"))) == [
        "Name                   Stmts  Miss  Branch  Miss  Cover  Missing",
        "a_rather_long_name.st      3     1       2     1    60%  1->2, 2",
        "none.st                    0     0       0     0   100%",
        "zoo.st                     1     0       0     0   100%",
        "TOTAL                      4     1       2     1    67%"]
    assert list(table(Coverage(), Path("/plant"))) == [
        "Name   Stmts  Miss  Branch  Miss  Cover  Missing", "TOTAL      0     0       0     0   100%"]
    assert [row.split()[0] for row in table(made, Path("/plant/deep"))][1:] == [
        "/plant/a_rather_long_name.st", "/plant/none.st", "/plant/zoo.st", "TOTAL"]


@each_of("counts, said", [
    ({2: 0, 3: 0}, "0% (0/2)"), ({2: 7, 3: 0}, "50% (1/2)"), ({2: 1, 3: 1, 0: 0}, "66% (2/3)"), ({2: 1, 0: 0, 3: 0}, "33% (1/3)"),
    ({2: 1, 0: 9}, "100% (2/2)")])
def test_conditions_of_a_line_in_cobertura(counts: dict[int, int], said: str) -> None:
    line = ElementTree.fromstring(cobertura(of(a=file({1: 3}, {1: counts})), Path("/plant"))).find(".//line")
    assert line is not None
    assert line.attrib == {"number": "1", "hits": "3", "branch": "true", "condition-coverage": said}


def test_two_ifs_in_a_line_are_counted_together() -> None:
    made = of(a=FileCoverage({(1, 5): 2, (1, 30): 1}, {(1, 5): {(2, 1): 1, SKIPPED: 1}, (1, 30): {(3, 1): 0, SKIPPED: 1}}))
    line = ElementTree.fromstring(cobertura(made, Path("/plant"))).find(".//line")
    assert line is not None and line.attrib == {"number": "1", "hits": "1", "branch": "true", "condition-coverage": "75% (3/4)"}


def test_the_totals_of_cobertura_count_lines_of_each_file() -> None:
    made = of(a=file({1: 1, 2: 0}, {1: {2: 0, 0: 1}}), b=file({1: 1, 2: 5, 3: 0}))
    top = ElementTree.fromstring(cobertura(made, Path("/plant")))
    assert {name: top.attrib[name] for name in ("line-rate", "branch-rate", "lines-covered", "lines-valid", "branches-covered",
                                                "branches-valid")} == {
        "line-rate": "0.6000", "branch-rate": "0.5000", "lines-covered": "3", "lines-valid": "5", "branches-covered": "1",
        "branches-valid": "2"}  # fmt: skip
    assert [(each.get("filename"), each.get("line-rate"), each.get("branch-rate")) for each in top.iter("class")] == [
        ("a.st", "0.5000", "0.5000"), ("b.st", "0.6667", "1.0000")]


def test_names_are_written_as_text_and_a_source_that_is_gone_is_told(tmp_path: Path) -> None:
    made = Coverage()
    (tmp_path / "a&b.st").write_text("x < y\n", encoding="utf-8")
    made.files |= {str(tmp_path / "a&b.st"): file({1: 2}), str(tmp_path / "gone.st"): file({1: 0})}
    index = write_pages(made, tmp_path, tmp_path / "pages").read_text(encoding="utf-8")
    assert '<tr><td><a href="0_a&amp;b.html">a&amp;b.st</a><td>1<td>0<td>0<td>0<td>100%' in index
    page = (tmp_path / "pages" / "0_a&b.html").read_text(encoding="utf-8")
    assert "<title>a&amp;b.st: 100%</title>" in page
    assert '<div class="run"><i>    1       2</i>  x &lt; y</div><div class=""><i>    2        </i>  </div></pre>' in page
    gone = (tmp_path / "pages" / "1_gone.html").read_text(encoding="utf-8")
    assert "<h1>gone.st: 0%</h1>\n<p>" in gone and "gone.st" in gone.partition("<p>")[2] and "<pre>" not in gone


@pytest.mark.parametrize(("partial", "note"), [({2: 0, 3: 0, 0: 1}, "to line 2, to line 3"), ({2: 1, 0: 0}, "past it"),
                                               ({2: 0, 0: 0}, "past it, to line 2")])
def test_ways_that_were_never_gone_are_told_at_their_line(partial: dict[int, int], note: str, tmp_path: Path) -> None:
    (tmp_path / "a.st").write_text("IF\n", encoding="utf-8")
    made = Coverage()
    made.files[str(tmp_path / "a.st")] = file({1: 1}, {1: partial})
    write_pages(made, tmp_path, tmp_path)
    page = (tmp_path / "0_a.html").read_text(encoding="utf-8")
    assert f'<div class="part" title="never went {note}"><i>    1       1</i>  IF</div>' in page
