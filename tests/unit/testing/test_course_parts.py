"""The checks of lessons without a session of pytest: what is started, what is made of its results, what a learner is told."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from rows import each_of

from fbvm.testing.course import lessons as module
from fbvm.testing.course.lessons import (
    QUIET,
    WORDS,
    Lesson,
    Result,
    answer,
    check,
    check_class,
    is_done,
    prediction_mistake,
    program_mistakes,
)
from fbvm.testing.course.predictions import KEPT, LARGEST_BYTES

TEXTS = {
    "lesson.md": "# Late\n\ntext\n", "given.st": "given", "test_lesson.py": "# test",
    "answers.toml": "# Which scan?\nlamp = ''\n",
    "solution/answers.toml": "lamp = 4\n", "solution/program.st": "program", "solution/why.md": "because",
}  # fmt: skip


@pytest.fixture
def lesson(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lesson:
    folder = tmp_path / "course" / "01-late"
    for name, text in TEXTS.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    made = Lesson(1, "01-late", folder)
    monkeypatch.setattr(module, "lessons", lambda: (made,))
    return made


class Session:
    """Stands in for pytest: the arguments of each run; writes a listing and returns a status."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, status: int = 1, listing: str = "") -> None:
        self.status, self.listing, self.runs = status, listing, list[tuple[list[str], dict[str, Any]]]()
        monkeypatch.setattr(module, "run_pytest", self.run)

    def run(self, arguments: Sequence[str], **more: Any) -> int:
        self.runs.append((list(arguments), more))
        [path] = [each.partition("=")[2] for each in arguments if each.startswith("--junitxml=")] or [""]
        if path and self.listing:
            Path(path).write_text(self.listing, encoding="utf-8")
        return self.status

    def arguments(self) -> list[str]:
        """Those of the last run behind the usual ones, without the path of the listing."""
        arguments, _ = self.runs[-1]
        assert arguments[: len(QUIET)] == list(QUIET)
        return [each for each in arguments[len(QUIET) :] if not each.startswith("--junitxml=")]


def listing(*cases: str, file: str = "anna/01-late/test_lesson.py") -> str:
    return f"<testsuites><testsuite>{''.join(each.replace('FILE', file) for each in cases)}</testsuite></testsuites>"


def case(name: str, *inside: str) -> str:
    return f'<testcase name="{name}" file="FILE">{"".join(inside)}</testcase>'


def failure(message: str, kind: str = "failure") -> str:
    return f'<{kind} message="{message}"/>'


# --- files --------------------------------------------------------------------------------------------------------------


def test_a_learner_begins_with_what_is_given_and_keeps_what_is_there(lesson: Lesson, tmp_path: Path) -> None:
    (tmp_path / "mine" / "01-late").mkdir(parents=True)
    (tmp_path / "mine" / "01-late" / "answers.toml").write_text("lamp = 3\n", encoding="utf-8")
    for _ in range(2):
        target = lesson.begin(tmp_path / "mine")
        assert target == tmp_path / "mine" / "01-late"
        assert {path.name: path.read_text(encoding="utf-8") for path in target.iterdir()} == {
            "given.st": "given", "program.st": "given", "test_lesson.py": "# test", "answers.toml": "lamp = 3\n"}
    (target / "program.st").write_text("mine", encoding="utf-8")
    lesson.begin(tmp_path / "mine")
    assert (target / "program.st").read_text(encoding="utf-8") == "mine"


def test_of_a_learners_files_the_program_and_the_answers_are_gathered(lesson: Lesson, tmp_path: Path) -> None:
    mine, out = lesson.begin(tmp_path / "mine"), tmp_path / "out" / "deep"
    for name, text in (("program.st", "mine"), ("answers.toml", "lamp = 4\n"), ("test_lesson.py", "changed"),
                       ("more.st", "more")):
        (mine / name).write_text(text, encoding="utf-8")
    for _ in range(2):
        lesson.gather(mine, out)
        assert {path.name: path.read_text(encoding="utf-8") for path in out.iterdir()} == {
            "given.st": "given", "program.st": "mine", "test_lesson.py": "# test", "answers.toml": "lamp = 4\n"}
    shutil.rmtree(out)
    (mine / "program.st").write_bytes(b"x" * LARGEST_BYTES)
    (mine / "answers.toml").write_bytes(b"x" * (LARGEST_BYTES + 1))
    lesson.gather(mine, out)
    assert sorted(path.name for path in out.iterdir()) == ["given.st", "program.st", "test_lesson.py"]


def test_the_solution_has_the_answers_the_program_and_why(lesson: Lesson) -> None:
    assert lesson.solution() == "--- answers.toml\n\nlamp = 4\n\n--- program.st\n\nprogram\nbecause"


def test_answers_are_written_into_their_lines(lesson: Lesson, tmp_path: Path) -> None:
    path = lesson.begin(tmp_path) / "answers.toml"
    path.write_text("# Which scan?\nlamp = ''\n  other = 1\n\nlast = 2", encoding="utf-8")
    answer(lesson, tmp_path, {"lamp": 'ä "b"', "last": "3", "nobody": "x"})
    assert path.read_text(encoding="utf-8") == '# Which scan?\nlamp = "ä \\"b\\""\n  other = 1\n\nlast = "3"\n'


# --- a prediction -------------------------------------------------------------------------------------------------------


@each_of("status, message, said, kept", [
    (0, "assert 1 == 2", "", False),
    (1, "AssertionError: answers.toml: lamp is still empty; predict first, then look&#10;more",
     "answers.toml: lamp is still empty; predict first, then look", False),
    (1, "assert 3 == 4", "answers.toml: this is not what the program does; read the text again, and look: LOOK", True),
    (1, "AssertionError: not so", "answers.toml: this is not what the program does; read the text again, and look: LOOK", True),
    (1, "KeyError: x", "", False), (1, "", "", False), (2, None, "", False),
])
def test_what_is_wrong_with_a_prediction(lesson: Lesson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int,
                                         message: str | None, said: str, kept: bool) -> None:
    target = lesson.begin(tmp_path / "mine")
    (target / KEPT).unlink(missing_ok=True)
    session = Session(monkeypatch, status, "" if message is None else listing(case("test_prediction", failure(message))))
    assert prediction_mistake(lesson, tmp_path / "mine", "LOOK") == said
    assert (target / KEPT).exists() is kept and not is_done(lesson, tmp_path / "mine")
    assert session.arguments() == ["--rootdir", str(target), "-c", str(target / "pytest.ini"), "--fbvm-pages", "0", "-k",
                                   "test_prediction", str(target)]
    assert session.runs[-1][1] == {"quiet": True}
    assert (target / "pytest.ini").read_text(encoding="utf-8") == "[pytest]\n"


def test_without_another_word_a_learner_looks_by_stepping(lesson: Lesson, tmp_path: Path,
                                                          monkeypatch: pytest.MonkeyPatch) -> None:
    lesson.begin(tmp_path)
    Session(monkeypatch, 1, listing(case("test_prediction", failure("assert 1"))))
    assert prediction_mistake(lesson, tmp_path).endswith("and look: fbvm step shows every statement")


# --- a program ----------------------------------------------------------------------------------------------------------


@each_of("status, done", [(0, True), (1, False), (5, False)])
def test_a_check_that_passes_marks_the_lesson(lesson: Lesson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int,
                                              done: bool) -> None:
    target, session = lesson.begin(tmp_path / str(status)), Session(monkeypatch, status)
    assert check(lesson, tmp_path / str(status)) == status and is_done(lesson, tmp_path / str(status)) is done
    assert session.arguments() == [*WORDS, "--rootdir", str(target), "-c", str(target / "pytest.ini"), str(target)]
    assert session.runs[-1][1] == {}


@each_of("status, written, said, done", [
    (0, listing(case("test_program", failure("no"))), [], True), (2, "", ["program.st could not be checked"], False),
    (1, listing(case("test_program")), ["program.st could not be checked"], False),
    (1, listing(case("test_stop_wins[1-2]", failure("AssertionError: scan 1&#10;x")), case("test_good"),
                case("test_stop_wins[2-3]", failure("AssertionError: scan 2")), case("test_program", failure("off", "error")),
                case("test_it", "<failure/>")), ["stop wins: scan 1", "off", "it"], False),
])
def test_what_a_program_does_not_do_yet(lesson: Lesson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int,
                                        written: str, said: list[str], done: bool) -> None:
    target, session = lesson.begin(tmp_path / "mine"), Session(monkeypatch, status, written)
    (target / ".done").unlink(missing_ok=True)
    assert program_mistakes(lesson, tmp_path / "mine") == said and is_done(lesson, tmp_path / "mine") is done
    assert session.arguments() == ["--rootdir", str(target), "-c", str(target / "pytest.ini"), "--fbvm-pages", "0", str(target)]
    assert session.runs[-1][1] == {"quiet": True}


# --- a class ------------------------------------------------------------------------------------------------------------


def test_a_class_is_checked_in_one_session(lesson: Lesson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, out = tmp_path / "class", tmp_path / "out"
    for name in ("bert", "anna/deep", ".git"):
        lesson.begin(folder / name)
    (folder / "cleo" / "other").mkdir(parents=True)
    (folder / "a file").touch()
    for name, text in (("bert", "lamp = 4\n"), ("anna/deep", "lamp = 3\n")):
        (folder / name / "01-late" / "answers.toml").write_text(text, encoding="utf-8")
    for old in (".fbvm/old.html", "traces/old", "anna/01-late/old.st"):
        (out / old).parent.mkdir(parents=True, exist_ok=True)
        (out / old).touch()
    said = listing(case("test_prediction", failure("assert 3 == 4&#10;more")), case("test_program"),
                   case("test_more", failure("boom", "error")), case("test_last", "<failure/>"),
                   *(each.replace("FILE", "bert/01-late/test_lesson.py") for each in (case("test_prediction"), case("test_a"))))
    session = Session(monkeypatch, 1, said)
    results = check_class(folder, out)
    failed = [("test_prediction", "assert 3 == 4"), ("test_more", "boom"), ("test_last", "failed")]
    [wrong] = results["anna"]["01-late"].first_wrong
    assert (wrong.question, wrong.given, wrong.right) == ("Which scan?", "3", "4")
    assert results == {"anna": {"01-late": Result(False, 1, 3, failed, [wrong])}, "bert": {"01-late": Result(True, 1, 1)},
                       "cleo": {}}  # fmt: skip
    arguments = session.arguments()
    assert arguments == ["-c", str(out / "pytest.ini"), "--rootdir", str(out), "-o", "junit_family=xunit1", "--fbvm-traces",
                         str(out / "traces"), "--fbvm-pages", "1000000", "./anna", "./bert"]
    assert session.runs == [(session.runs[0][0], {"cwd": out, "quiet": True})]
    assert sorted(path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()) == sorted([
        "pytest.ini", "results.xml", *(f"{name}/01-late/{file}" for name in ("anna", "bert")
                                       for file in ("given.st", "program.st", "answers.toml", "test_lesson.py"))])


def test_results_of_another_check_are_not_taken_for_those_of_this_one(lesson: Lesson, tmp_path: Path,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    lesson.begin(tmp_path / "class" / "anna")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results.xml").write_text(listing(case("test_old")), encoding="utf-8")
    Session(monkeypatch, 3)
    with pytest.raises(FileNotFoundError):
        check_class(tmp_path / "class", tmp_path / "out")
