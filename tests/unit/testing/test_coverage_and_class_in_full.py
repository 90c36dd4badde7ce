"""What coverage and the check of a class write, in full: a table, Cobertura, pages, the report for a teacher."""

from __future__ import annotations

from pathlib import Path

import pytest

from fbvm.testing.course.class_report import report, summary
from fbvm.testing.course.lessons import Lesson, Result
from fbvm.testing.course.predictions import WrongAnswer
from fbvm.testing.coverage import SKIPPED, Coverage, FileCoverage
from fbvm.testing.coverage_report import cobertura, table, write_pages
from fbvm.testing.pages import page_path

# --- coverage -----------------------------------------------------------------------------------------------------------

FAN = """PROGRAM Fan
VAR a, b : INT; END_VAR
    IF a = 1 THEN
        b := 1;
    ELSIF a < 2 THEN
        b := 2;
    END_IF
    a := 1;   a := a + 1;
    b := 3;

    IF b = 3 THEN
        a := 0;
    END_IF
END_PROGRAM
"""
PUMP = "PROGRAM Pump\nVAR n : INT; END_VAR\n    IF n = 0 THEN\n\n        n := 1;\n    END_IF\nEND_PROGRAM\n"


@pytest.fixture
def coverage(tmp_path: Path) -> Coverage:
    """Two files in `project/`, one with two statements in a line and one that is executed as a whole but for a way past it."""
    made = Coverage()
    (tmp_path / "project" / "src").mkdir(parents=True)
    for name, text in (("project/src/fan.st", FAN), ("pump.st", PUMP)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    made.files[str(tmp_path / "project" / "src" / "fan.st")] = FileCoverage(
        {(3, 5): 2, (4, 9): 0, (6, 9): 0, (8, 5): 0, (8, 15): 4, (9, 5): 1, (11, 5): 3, (12, 9): 3},
        {(3, 5): {(4, 9): 0, (6, 9): 0, SKIPPED: 2}, (11, 5): {(12, 9): 3}})  # fmt: skip
    made.files[str(tmp_path / "pump.st")] = FileCoverage({(3, 5): 1, (5, 9): 1}, {(3, 5): {(5, 9): 1, SKIPPED: 0}})
    return made


TABLE = """\
Name                Stmts  Miss  Branch  Miss  Cover  Missing
src/fan.st              8     3       4     2    58%  3->4, 3->6, 4-8
PUMP                    2     0       2     1    75%  3->past
TOTAL                  10     3       6     3    62%
"""


def test_the_table(coverage: Coverage, tmp_path: Path) -> None:
    lines = list(table(coverage, tmp_path / "project"))
    other = str(tmp_path / "pump.st")
    wide = len(other)
    assert lines == [f"{('Name' if row[:4] == 'Name' else row[:18].strip().replace('PUMP', other)):<{wide}}{row[18:]}"
                     for row in TABLE.splitlines()]


COBERTURA = """\
<?xml version="1.0" encoding="utf-8"?>
<coverage line-rate="0.6667" branch-rate="0.5000" lines-covered="6" lines-valid="9" branches-covered="3" branches-valid="6" \
complexity="0" version="fbvm" timestamp="0">
  <sources>
    <source>ROOT/project</source>
  </sources>
  <packages>
    <package name="." complexity="0" line-rate="0.6667" branch-rate="0.5000">
      <classes>
        <class name="fan" filename="src/fan.st" complexity="0" line-rate="0.5714" branch-rate="0.5000">
          <methods />
          <lines>
            <line number="3" hits="2" branch="true" condition-coverage="33% (1/3)" />
            <line number="4" hits="0" branch="false" />
            <line number="6" hits="0" branch="false" />
            <line number="8" hits="0" branch="false" />
            <line number="9" hits="1" branch="false" />
            <line number="11" hits="3" branch="true" condition-coverage="100% (1/1)" />
            <line number="12" hits="3" branch="false" />
          </lines>
        </class>
        <class name="pump" filename="ROOT/pump.st" complexity="0" line-rate="1.0000" branch-rate="0.5000">
          <methods />
          <lines>
            <line number="3" hits="1" branch="true" condition-coverage="50% (1/2)" />
            <line number="5" hits="1" branch="false" />
          </lines>
        </class>
      </classes>
    </package>
  </packages>
</coverage>
"""


def test_cobertura_in_full(coverage: Coverage, tmp_path: Path) -> None:
    assert cobertura(coverage, tmp_path / "project") == COBERTURA.replace("ROOT", str(tmp_path))
    assert 'line-rate="1.0000" branch-rate="1.0000" lines-covered="0"' in cobertura(Coverage(), tmp_path)


LINES = """\
<div class=""><i>    1        </i>  PROGRAM Fan</div>
<div class=""><i>    2        </i>  VAR a, b : INT; END_VAR</div>
<div class="part" title="never went to line 4, to line 6"><i>    3       2</i>      IF a = 1 THEN</div>
<div class="miss"><i>    4       0</i>          b := 1;</div>
<div class=""><i>    5        </i>      ELSIF a &lt; 2 THEN</div>
<div class="miss"><i>    6       0</i>          b := 2;</div>
<div class=""><i>    7        </i>      END_IF</div>
<div class="miss"><i>    8       0</i>      a := 1;   a := a + 1;</div>
<div class="run"><i>    9       1</i>      b := 3;</div>
<div class=""><i>   10        </i>  </div>
<div class="run"><i>   11       3</i>      IF b = 3 THEN</div>
<div class="run"><i>   12       3</i>          a := 0;</div>
<div class=""><i>   13        </i>      END_IF</div>
<div class=""><i>   14        </i>  END_PROGRAM</div>
<div class=""><i>   15        </i>  </div>
"""


def test_pages_in_full(coverage: Coverage, tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "pages"
    for _ in range(2):
        index = write_pages(coverage, tmp_path / "project", folder)
    assert index == folder / "index.html"
    assert sorted(path.name for path in folder.iterdir()) == ["0_fan.html", "1_pump.html", "index.html"]
    text = index.read_text(encoding="utf-8")
    assert text.count("<h1>Coverage: 62%</h1>") == text.count("<title>Coverage: 62%</title>") == 1
    other = str(tmp_path / "pump.st")
    assert text.partition("<table>")[2].partition("</table>")[0] == (
        "<tr><th>File<th>Statements<th>missed<th>Branches<th>missed<th>Coverage"
        '<tr><td><a href="0_fan.html">src/fan.st</a><td>8<td>3<td>4<td>2<td>58%'
        f'<tr><td><a href="1_pump.html">{other}</a><td>2<td>0<td>2<td>1<td>75%')
    page = (folder / "0_fan.html").read_text(encoding="utf-8")
    assert "<h1>src/fan.st: 58%</h1>" in page and '<p><a href="index.html">all files</a></p><pre>' in page
    assert page.partition("<pre>")[2].partition("</pre>")[0] == LINES.replace("</div>\n", "</div>")
    assert 'title="never went past it"' in (folder / "1_pump.html").read_text(encoding="utf-8")


def test_counts_go_to_another_process_as_lists() -> None:
    made = Coverage()
    made.files["a.st"] = FileCoverage({(3, 5): 2, (4, 9): 0}, {(3, 5): {(4, 9): 0, SKIPPED: 2}})
    data = made.to_data()
    assert data == {"a.st": [[[3, 5, 2], [4, 9, 0]], [[3, 5, 4, 9, 0], [3, 5, 0, 0, 2]]]}
    again = Coverage.from_data(data)
    assert again.files == made.files
    again.add(Coverage.from_data({"a.st": [[[3, 5, 1], [7, 1, 4]], [[3, 5, 4, 9, 1], [7, 1, 8, 1, 3]]], "b.st": [[], []]}))
    assert again.files == {"a.st": FileCoverage({(3, 5): 3, (4, 9): 0, (7, 1): 4}, {
        (3, 5): {(4, 9): 1, SKIPPED: 2}, (7, 1): {(8, 1): 3}}), "b.st": FileCoverage()}  # fmt: skip


# --- a class ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def course(tmp_path: Path) -> tuple[Lesson, ...]:
    made = []
    for number, slug, title in ((1, "01-late", "Why it is late"), (2, "02-edge", "Edges & levels")):
        (tmp_path / slug).mkdir()
        (tmp_path / slug / "lesson.md").write_text(f"# {title}\n\ntext\n", encoding="utf-8")
        made.append(Lesson(number, slug, tmp_path / slug))
    return tuple(made)


def results() -> dict[str, dict[str, Result]]:
    wrong = [WrongAnswer("true or false?", "<no>", "true"), WrongAnswer("which?", "4", "5")]
    return {"anna": {"01-late": Result(True, 2, 2),
                     "02-edge": Result(True, 3, 4, [("test_program[2]", "AssertionError: Lamp is OFF <b>")], wrong)},
            "bert b": {"01-late": Result(), "02-edge": Result(False, 4, 4, [("test_prediction", "assert 1 == 2")])},
            "cleo": {}}  # fmt: skip


SUMMARY = """\
           1     2  done
anna      ok   4/5     1
bert b   0/1   4/5     0
cleo       -     -     0
"""
ROWS = """\
<tr><th>anna<td class="good">✓ 2/2<td class="bad"><a href="#anna-2">✓ 3/4</a><td>1
<tr><th>bert b<td class="bad">✗ 0/0<td class="bad"><a href="#bert%20b-2">✗ 4/4</a><td>0
<tr><th>cleo<td class="none">-<td class="none">-<td>0
"""
WRONG = """\
<tr><th>anna<td>2. Edges &amp; levels<td>true or false?<td class="bad">&lt;no&gt;<td>true
<tr><th>anna<td>2. Edges &amp; levels<td>which?<td class="bad">4<td>5
<tr><th>bert b<td class="none" colspan="4">none
<tr><th>cleo<td class="none" colspan="4">none
"""
DETAILS = """\
<h2 id="anna-2">anna: 2. Edges &amp; levels</h2><p><a href="anna/02-edge/program.st">program.st</a> and \
<a href="anna/02-edge/answers.toml">answers.toml</a></p><ul><li><b>test_program[2]</b>: Lamp is OFF &lt;b&gt; \
<a href=".fbvm/anna.02-edge.test_lesson.test_program%5B2%5D.html">every scan</a></ul>
<h2 id="bert%20b-2">bert b: 2. Edges &amp; levels</h2><p><a href="bert%20b/02-edge/program.st">program.st</a> and \
<a href="bert%20b/02-edge/answers.toml">answers.toml</a></p><ul><li><b>test_prediction</b>: assert 1 == 2</ul>
"""


def test_the_summary_of_a_class(course: tuple[Lesson, ...]) -> None:
    assert "\n".join(summary(results(), course)) + "\n" == SUMMARY
    assert summary({"a": {}}, course)[0] == f"{'':4}     1     2  done"


def test_the_report_of_a_class(course: tuple[Lesson, ...], tmp_path: Path) -> None:
    out = tmp_path / "out"
    page = page_path(out, "anna/02-edge/test_lesson.py::test_program[2]")
    page.parent.mkdir(parents=True)
    page.touch()
    made = report(results(), course, out)
    first, second = (part.partition("</tbody>")[0].strip() + "\n" for part in made.split("<tbody>")[1:])
    assert (first, second) == (ROWS, WRONG)
    assert made.rpartition("</table></div>\n")[2] == f"{DETAILS}</main></body></html>\n"
    assert ('<th>learner<th><abbr title="Why it is late">1</abbr><th><abbr title="Edges &amp; levels">2</abbr><th>done</thead>'
            in made)
    assert made.count("<title>Lessons</title>") == made.count("<h1>Lessons</h1>") == 1
