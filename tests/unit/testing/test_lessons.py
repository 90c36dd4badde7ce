"""The lessons: one screen each, wrong as they are given, right as their solutions have them; and the run over a class."""

from __future__ import annotations

import ast
import os
import re
from base64 import b64encode
from hashlib import sha256
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.cli.main import main
from fbvm.code.compiler import compile_files
from fbvm.record.trace.reader import Trace
from fbvm.testing.course import predictions
from fbvm.testing.course.class_report import report, summary
from fbvm.testing.course.lessons import (
    ANSWERS,
    GIVEN,
    PROGRAM,
    Lesson,
    answer,
    check,
    check_class,
    is_done,
    lessons,
    prediction_mistake,
    program_mistakes,
    questions,
)
from fbvm.testing.course.predictions import KEPT, first_wrong, keep_first_wrong
from fbvm.testing.lesson import predicted
from fbvm.testing.pytest_process import run_pytest

HOUSE = Path(__file__).resolve().parents[3]
LINES, COLUMNS = 25, 79
every_lesson = pytest.mark.parametrize("lesson", lessons(), ids=lambda lesson: lesson.slug)


@pytest.fixture(autouse=True)
def found_by_children(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is started by a test uses this fbvm, too."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HOUSE), os.environ.get("PYTHONPATH", "")]))


def test_there_are_sixteen() -> None:
    assert [lesson.number for lesson in lessons()] == list(range(1, 17))


@every_lesson
def test_a_lesson_is_one_screen_and_complete(lesson: Lesson) -> None:
    lines = lesson.text.splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS
    assert "## Predict" in lines and "## Do" in lines
    for program in (lesson.folder / GIVEN, lesson.folder / "solution" / PROGRAM):
        assert not compile_files([program], runnable=True).errors
    asked = re.findall(r"^(\w+) = ", (lesson.folder / ANSWERS).read_text(encoding="utf-8"), re.M)
    assert asked == re.findall(r"^(\w+) = ", (lesson.folder / "solution" / ANSWERS).read_text(encoding="utf-8"), re.M)
    tests = (lesson.folder / "test_lesson.py").read_text(encoding="utf-8")
    assert sorted(asked) == sorted(re.findall(r'predicted\(__file__, "(\w+)"\)', tests))


@every_lesson
def test_every_check_of_a_program_says_in_words_what_is_wrong(lesson: Lesson) -> None:
    tree = ast.parse((lesson.folder / "test_lesson.py").read_text(encoding="utf-8"))
    checks = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name.startswith("test_")
              and one.name != "test_prediction"]  # fmt: skip
    silent = [f"{one.name}:{found.lineno}" for one in checks for found in ast.walk(one)
              if isinstance(found, ast.Assert) and found.msg is None]  # fmt: skip
    assert checks and silent == []


@every_lesson
def test_what_it_shows_of_a_program_stands_there(lesson: Lesson) -> None:
    program = (lesson.folder / GIVEN).read_text(encoding="utf-8")
    spaced = re.sub(r"\s+", " ", program)
    for line in re.findall(r"^    (.*;)", lesson.text, re.M):
        if "Edge(CLK" not in line:
            assert re.sub(r"\s+", " ", line.strip()) in spaced


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_heap")
def test_solutions_pass_and_what_is_given_does_not(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    for lesson in lessons():
        for solved in (False, True):
            target = lesson.begin(tmp_path / ("solved" if solved else "given"))
            if solved:
                for path in (lesson.folder / "solution").iterdir():
                    (target / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    arguments = ["-q", "--import-mode=importlib", "-p", "no:cacheprovider", "--fbvm-pages", "0", "-o", "junit_family=xunit1"]
    assert run_pytest([*arguments, "--junitxml=solved.xml", "solved"], tmp_path, quiet=True) == 0
    assert run_pytest([*arguments, "--junitxml=given.xml", "given"], tmp_path, quiet=True) == 1
    failed: dict[str, list[str]] = {lesson.slug: [] for lesson in lessons()}
    for case in ElementTree.parse(tmp_path / "given.xml").iter("testcase"):
        if case.find("failure") is not None:
            failed[Path(case.get("file", "")).parts[1]].append(case.get("name", ""))
    for names in failed.values():
        assert "test_prediction" in names
        assert len(names) > 1


def test_no_check_waits_for_plugins_that_lessons_do_not_need(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sessions: list[list[str]] = []

    def begun(arguments: list[str], cwd: Path | None = None, quiet: bool = False) -> int:
        sessions.append(arguments)
        return 0

    monkeypatch.setattr("fbvm.testing.course.lessons.run_pytest", begun)
    first = lessons()[0]
    first.begin(tmp_path)
    assert (prediction_mistake(first, tmp_path), check(first, tmp_path), program_mistakes(first, tmp_path)) == ("", 0, [])
    assert len(sessions) == 3 and all("no:hypothesispytest" in arguments for arguments in sessions)
    assert not any("hypothesis" in path.read_text(encoding="utf-8") for path in first.folder.parent.rglob("*.py"))


@pytest.mark.slow
def test_a_class(tmp_path: Path) -> None:
    first, third = lessons()[0], lessons()[2]
    for name in ("anna", "bert", "carla"):
        (tmp_path / "class" / name).mkdir(parents=True)
    for name, lesson in (("anna", first), ("anna", third), ("bert", first)):
        lesson.begin(tmp_path / "class" / name / "lessons")
    for path in (first.folder / "solution").iterdir():
        (tmp_path / "class" / "anna" / "lessons" / first.slug / path.name).write_bytes(path.read_bytes())
    (tmp_path / "class" / "bert" / "lessons" / first.slug / "test_lesson.py").write_text(
        "def test_prediction(): pass\ndef test_program(): pass\n", encoding="utf-8")  # nobody marks his own work
    kept = tmp_path / "class" / "anna" / "lessons" / first.slug / KEPT
    kept.write_text("lamp_on_in_scan = '<script>alert(1)</script>'\n", encoding="utf-8")
    results = check_class(tmp_path / "class", tmp_path / "out")
    assert results["anna"][first.slug].is_complete
    assert not results["bert"][first.slug].prediction
    assert (results["bert"][first.slug].passed, results["bert"][first.slug].checks) == (0, 1)
    assert results["carla"] == {}
    assert [row.split()[:4] for row in summary(results, lessons())[1:]] == [
        ["anna", "ok", "-", "1/4"], ["bert", "0/2", "-", "-"], ["carla", "-", "-", "-"]]  # fmt: skip
    page = report(results, lessons(), tmp_path / "out")
    [row] = re.findall(r"<tr><th>anna<td>1\. .*", page)
    assert "<td class=\"bad\">&lt;script&gt;alert(1)&lt;/script&gt;<td>4" in row, "right now, and wrong at first"
    assert '<tr><th>bert<td class="none" colspan="4">none' in page, "what is empty is not wrong"
    for link in re.findall(r'href="([^#"]*)"', page):
        assert (tmp_path / "out" / unquote(link)).exists()
    [trace] = (tmp_path / "out" / "traces").glob("bert.*test_program*.fbtrace")
    with Trace.open(trace) as opened:
        assert opened.at(4).read("CIO 100.00") is True


def test_a_class_in_which_nobody_has_begun(tmp_path: Path) -> None:
    (tmp_path / "class" / "anna").mkdir(parents=True)
    results = check_class(tmp_path / "class", tmp_path / "out")
    assert results == {"anna": {}}
    assert "anna" in report(results, lessons(), tmp_path / "out") and (tmp_path / "out").is_dir()


def test_predictions_are_read(tmp_path: Path) -> None:
    test = str(tmp_path / "test_lesson.py")
    with pytest.raises(AssertionError, match="cannot be read"):
        predicted(test, "x")
    (tmp_path / ANSWERS).write_text("x = ''\ny = 3\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="x is still empty; predict first"):
        predicted(test, "x")
    assert predicted(test, "y") == 3
    (tmp_path / ANSWERS).write_text("x = [", encoding="utf-8")
    with pytest.raises(AssertionError, match="cannot be read"):
        predicted(test, "x")


def called(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["learn", *arguments])
    return result.exit_code, result.output


def test_the_verb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "   3  Level against edge\n" in called()[1]
    code, output = called("3")
    assert code == 0 and "# Level against edge" in output
    own = tmp_path / "lessons" / "03-level-against-edge" / PROGRAM
    own.write_text("// mine", encoding="utf-8")
    called("3")
    assert own.read_text(encoding="utf-8") == "// mine"
    assert not (own.parent / "solution").exists() and not (own.parent / "lesson.md").exists()
    assert re.search(r"Level against edge +begun\n", called()[1])
    assert "Press(CLK := Button);" in called("3", "--solution")[1]
    assert called("17")[0] == called("--check")[0] == called("--class", "nobody")[0] == 2
    (tmp_path / "class").mkdir()
    assert called("--class", "class", "--report", "class/out")[0] == called("--class", "class")[0] == 2


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_heap")
def test_a_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert called("1", "--check")[0] == 1
    answers = tmp_path / "lessons" / lessons()[0].slug / ANSWERS
    for written, message in (("", "is still empty; predict first"), ("3", "this is not what the program does")):
        answers.write_text(f'lamp_on_in_scan = "{written}"\n', encoding="utf-8")
        code, output = called("1", "--check")
        assert code == 1 and message in output and "checked when the prediction is right" in output
        assert "4" not in output and "5" not in output, "the answer is not given away"
        assert (answers.parent / KEPT).exists() == bool(written)
    answers.write_text("lamp_on_in_scan = 4\n", encoding="utf-8")
    capfd.readouterr()
    assert called("1", "--check")[0] == 1
    said = capfd.readouterr().out
    assert "Lamp is ON at the end of scan 4, not of scan 3" in said and "assert" not in said and "scan 4   40ms" in said
    for path in (lessons()[0].folder / "solution").iterdir():
        (tmp_path / "lessons" / lessons()[0].slug / path.name).write_bytes(path.read_bytes())
    code, output = called("1", "--check")
    assert code == 0 and "lesson 1 is done; the next one: fbvm learn 2" in output
    assert re.search(r"one scan late +done\n", called()[1])


@each_of(("written", "value"), [
    ('"4"', 4), ('" -7 "', -7), ('"true"', True), ('"False"', False), ('"00 01"', "00 01"), ("2.5", 2.5)])  # fmt: skip
def test_a_number_in_quotes_is_a_number(written: str, value: object, tmp_path: Path) -> None:
    (tmp_path / "answers.toml").write_text(f"x = {written}\n", encoding="utf-8")
    assert predicted(str(tmp_path / "test_lesson.py"), "x") == value


def test_predictions_are_asked_for_and_written_without_what_stands_around_them(tmp_path: Path) -> None:
    lesson = lessons()[1]
    lesson.begin(tmp_path)
    assert [(name, said) for name, said, _ in questions(lesson, tmp_path)] == [
        ("between", "true or false: Lamp between the two statements"),
        ("at_the_end", "true or false: Lamp at the end of the scan"),
    ]
    answer(lesson, tmp_path, {"between": 'a "b"'})
    assert [given for _, _, given in questions(lesson, tmp_path)] == ['a "b"', ""]
    assert predicted(str(tmp_path / lesson.slug / "test_lesson.py"), "between") == 'a "b"'
    assert "# true or false: Lamp at the end of the scan" in (tmp_path / lesson.slug / ANSWERS).read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_wrong_program_is_told_in_sentences_and_a_right_one_ends_the_lesson(tmp_path: Path) -> None:
    lesson = next(one for one in lessons() if one.number == 14)
    target = lesson.begin(tmp_path)
    for path in (lesson.folder / "solution").iterdir():
        if path.name != PROGRAM:
            (target / path.name).write_bytes(path.read_bytes())
    assert program_mistakes(lesson, tmp_path) == [
        "stop stops the motor: Stop is ON in scan 1, and Motor is ON at its end",
        "stop wins while start is pressed: Start and Stop are ON in scan 1, and Motor is ON at its end"]  # fmt: skip
    (target / PROGRAM).write_bytes((lesson.folder / "solution" / PROGRAM).read_bytes())
    assert program_mistakes(lesson, tmp_path) == [] and is_done(lesson, tmp_path)


def test_the_first_wrong_prediction_is_kept_when_it_is_corrected(tmp_path: Path) -> None:
    lesson = lessons()[1]
    answers = lesson.begin(tmp_path) / ANSWERS
    for written in ('between = "false"\nat_the_end = ""', "between = true\nat_the_end = true"):
        answers.write_text(written, encoding="utf-8")
        keep_first_wrong(answers.parent)
    [wrong] = first_wrong(answers.parent, lesson.folder, is_right=True)
    assert (wrong.question, wrong.given, wrong.right) == ("true or false: Lamp between the two statements", "false", "true")


@each_of(("written", "given"), [
    ("between = true\nat_the_end = true", ["true"]), ('between = "TRUE"\nat_the_end = false', []), ("between = ", []),
    ("other = 3", []), ("between = " + "9" * 5000, []), ("between = " + "[" * 5000, []),
    ("between = 0x" + "f" * 9000, ["a number of thousands of digits"]), (f"between = '{'x' * 900}'", ["x" * 200])])  # fmt: skip
def test_answers_that_are_not_kept_are_taken_as_they_are(written: str, given: list[str], tmp_path: Path) -> None:
    (tmp_path / ANSWERS).write_text(written, encoding="utf-8")
    assert [one.given for one in first_wrong(tmp_path, lessons()[1].folder, is_right=False)] == given
    assert first_wrong(tmp_path, lessons()[1].folder, is_right=True) == []


@each_of(("largest", "given"), [(17, ["true"]), (16, [])])
def test_answers_in_a_file_that_is_too_large_are_not_taken(
    largest: int, given: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(predictions, "LARGEST_BYTES", largest)
    (tmp_path / ANSWERS).write_bytes(b"at_the_end = true")
    assert [one.given for one in first_wrong(tmp_path, lessons()[1].folder, is_right=False)] == given


def test_the_report_lets_no_script_run_and_loads_nothing() -> None:
    page = report({"<b>": {}}, lessons(), Path())
    style = re.search(r"<style>(.*?)</style>", page, re.S)
    assert style is not None
    named = b64encode(sha256(style[1].encode()).digest()).decode()
    assert f"content=\"default-src 'none'; style-src 'sha256-{named}'; base-uri 'none'; form-action 'none'\"" in page
    assert "<b>" not in page and " style=" not in page and "src=" not in page
