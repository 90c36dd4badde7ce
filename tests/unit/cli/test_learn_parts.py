"""`fbvm learn` in parts: the list of lessons, what is refused, which PLC a lesson on a page has."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner
from images import counter_image
from rows import each_of

from fbvm.cli.projects import learn
from fbvm.machine.plc import Plc
from fbvm.run.plant import ENDLESS
from fbvm.run.running import Running, TimedWrite


class Lesson:
    """Stands in for a lesson."""

    def __init__(self, number: int, title: str) -> None:
        self.number, self.title, self.slug, self.text = number, title, f"{number:02}-slug", f"# {title}"

    def begin(self, folder: Path) -> Path:
        (folder / self.slug).mkdir(parents=True, exist_ok=True)
        return folder / self.slug

    def solution(self) -> str:
        return f"solution of {self.number}"


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Two lessons; what is checked of them."""
    made: list[Any] = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fbvm.testing.course.lessons.lessons", lambda: (Lesson(1, "Late"), Lesson(12, "A title " * 6)))
    for name, found in (("prediction_mistake", ""), ("check", 0)):
        monkeypatch.setattr(f"fbvm.testing.course.lessons.{name}",
                            lambda lesson, folder, name=name, found=found: made.append((name, lesson.number, folder)) or found)
    return made


def learned(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(learn.command, arguments)
    return result.exit_code, result.output


def test_lessons_are_listed_with_what_is_begun_and_done(course: list[Any]) -> None:
    end = "\nfbvm learn 1 begins with the first one\n"
    long = f"  12  {'A title ' * 6}"
    assert learned() == (0, f"   1  Late\n{long.rstrip()}\n{end}")
    Path("mine/01-slug").mkdir(parents=True)
    Path("mine/12-slug").mkdir()
    Path("mine/12-slug/.done").touch()
    assert learned("--folder", "mine") == (0, f"   1  Late{' ' * 36}begun\n{long}done\n{end}")
    assert learned("--folder", "other") == (0, f"   1  Late\n{long.rstrip()}\n{end}")
    assert course == []


@each_of("arguments, status, said, checked, begun", [
    (("1",), 0, "# Late\nYour files are in lessons/01-slug.  When you are ready: fbvm learn 1 --check\n", [], True),
    (("1", "--solution"), 0, "solution of 1\n", [], False), (("12", "--solution", "--check"), 0, "solution of 12\n", [], False),
    (("1", "--check"), 0, "lesson 1 is done; the next one: fbvm learn 2\n", [("prediction_mistake", 1), ("check", 1)], True),
    (("12", "--check"), 0, "lesson 12 is done; that was the last one\n", [("prediction_mistake", 12), ("check", 12)], True),
    (("2",), 2, "there are lessons 1 to 2\n", [], False),
    (("--check",), 2, "say which lesson: fbvm learn 1 --check\n", [], False),
    (("--solution",), 2, "say which lesson: fbvm learn 1 --check\n", [], False),
])
def test_what_is_said_of_a_lesson(arguments: tuple[str, ...], status: int, said: str, checked: list[tuple[str, int]], begun: bool,
                                  course: list[Any]) -> None:
    course.clear()
    for path in (Path("lessons/01-slug"), Path("lessons/12-slug")):
        if path.exists():
            path.rmdir()
    found, output = learned(*arguments)
    assert found == status and output.endswith(said) and (status or output == said)
    assert [(name, number) for name, number, _ in course] == checked and {folder for *_, folder in course} <= {Path("lessons")}
    assert any(path.is_dir() for path in Path("lessons").glob("*")) is begun


def test_a_folder_that_cannot_be_made_is_told(course: list[Any]) -> None:
    Path("lessons").touch()
    status, said = learned("1", "--folder", "lessons/deep")
    assert status == 2 and "lessons/deep cannot be written: " in said


def test_a_plc_of_a_lesson_is_in_memory_and_scans_every_ten_milliseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[Any] = []
    network = SimpleNamespace(close=lambda: done.append("closed"))
    monkeypatch.setattr(learn, "LoopNetwork", lambda: network)
    monkeypatch.setattr(learn, "usual_units", lambda names: ["one", "two"])
    monkeypatch.setattr(Plc, "attach", lambda plc, unit, to: done.append((unit, to is network)))
    plc, close = learn._wired(counter_image())
    assert (plc.cycle_ns, done) == (10_000_000, [("one", True), ("two", True)])
    close()
    assert done[-1] == "closed"


def test_a_project_of_a_lesson_runs_without_end_with_its_writes() -> None:
    plc = Plc(counter_image())
    rows = [TimedWrite(plc.find("D5"), 7, 0)]
    made = learn._endless(Running(plc, scans=3, writes=rows))
    assert (made.plc, made.scans_left, list(made.writes)) == (plc, ENDLESS, rows)
