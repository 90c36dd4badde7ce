"""`fbvm learn`: lessons about what a scan cycle really does, for one learner, and a teacher's run over many."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path

import click

from fbvm.base.files import resolved, write_file
from fbvm.cli.shared import status
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.networks import mailbox_names
from fbvm.cli.shared.options import CYCLE_NS, check_live_installed
from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.sources import compile_or_exit
from fbvm.cli.shared.terminal import named, say
from fbvm.code.image import Image
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.run.interactive import Control
from fbvm.run.plant import ENDLESS
from fbvm.run.running import Running
from fbvm.testing.course.lessons import PROGRAM, Lesson

FOLDER = "lessons"


@click.command("learn")
@click.argument("number", type=click.IntRange(min=1), required=False, metavar="[LESSON]")
@click.option("--check", "checked", is_flag=True, help="Check the prediction and the program.")
@click.option("--live", is_flag=True, help="Teach on a page: the text beside the PLC, until Ctrl-C.")
@click.option("--solution", "solved", is_flag=True, help="Show the solution, and why.")
@click.option("--folder", type=click.Path(file_okay=False, path_type=Path), default=FOLDER, show_default=True,
              help="Where your lessons are.")
@click.option("--class", "learners", type=ExistingPath(file_okay=False), metavar="DIR",
              help="For teachers: check all lessons in all folders of this folder, one a learner.")
@click.option("--report", "out", type=click.Path(file_okay=False, path_type=Path), metavar="DIR", default="report",
              show_default=True, help="With --class: where report.html, traces and pages go.")
def command(number: int | None, checked: bool, live: bool, solved: bool, folder: Path, learners: Path | None, out: Path) -> None:
    """Sixteen lessons: read, predict, look, change, check.

    Without LESSON, lists them.  `fbvm learn 1` shows the first one and makes a folder for it; there, write your prediction into
    answers.toml and change program.st, then `fbvm learn 1 --check`.  Status 1 if something is not right yet."""
    from fbvm.testing.course.lessons import check, lessons, prediction_mistake

    if live:
        check_live_installed()
    if (checked or live or learners) and find_spec("pytest") is None:
        raise click.UsageError("checks need pytest: pip install pytest")
    if learners is not None:
        _class(learners, out)
        return
    if number is None:
        if checked or solved or live:
            raise click.UsageError("say which lesson: fbvm learn 1 --check")
        _list(folder)
        return
    found = next((lesson for lesson in lessons() if lesson.number == number), None)
    if found is None:
        raise click.UsageError(f"there are lessons 1 to {len(lessons())}")
    if solved:
        say(found.solution())
        return
    with writing(folder):
        target = found.begin(folder)
    if live:
        _serve_page(found, folder, target)
        return
    if not checked:
        say(found.text)
        say(f"Your files are in {named(target)}.  When you are ready: fbvm learn {number} --check")
        return
    if mistake := prediction_mistake(found, folder):
        say(mistake, fg="yellow", err=True)
        say("The program is checked when the prediction is right.", err=True)
        sys.exit(status.FAILED)
    if check(found, folder):
        sys.exit(status.FAILED)
    following = f"; the next one: fbvm learn {number + 1}" if number < len(lessons()) else "; that was the last one"
    say(f"lesson {number} is done{following}", fg="green")


def _serve_page(lesson: Lesson, folder: Path, target: Path) -> None:
    """Teaches on a page; the learner's program runs beside the text, and is begun again when its file changes."""
    from fbvm.cli.shared.live.origins import FileOrigin, project_origin
    from fbvm.cli.shared.live.page import PageOptions, serve_page
    from fbvm.live.lesson import LiveLesson
    from fbvm.testing.course.lessons import answer, prediction_mistake, program_mistakes, questions

    def predict(values: Mapping[str, str]) -> str:
        answer(lesson, folder, values)
        return prediction_mistake(lesson, folder, "s executes one scan, n one statement").removeprefix("answers.toml: ")

    taught = LiveLesson(lesson.title, lesson.text, lambda: questions(lesson, folder), predict,
                        lambda: program_mistakes(lesson, folder), lesson.solution)  # fmt: skip
    say(f"Your files are in {named(target)}; the page follows when you change them.")
    if (target / "fbvm.toml").is_file():
        serve_page(project_origin(target / "fbvm.toml", None, _endless), Control(is_paused=True), PageOptions(), lesson=taught)
        return
    files = (target / PROGRAM,)
    image = compile_or_exit(files, None, (), runnable=True)
    origin = FileOrigin(files, (), image, _wired, lambda plc: Running(plc, scans=ENDLESS))
    serve_page(origin, Control(is_paused=True), PageOptions(), lesson=taught)


def _endless(run: Running) -> Running:
    return Running(run.plc, scans=ENDLESS, writes=run.writes)


def _wired(image: Image) -> tuple[Plc, Callable[[], None]]:
    """A PLC in memory, with its units."""
    plc, network = Plc(image, CYCLE_NS), LoopNetwork()
    for unit in usual_units(mailbox_names(image)):
        plc.attach(unit, network)
    return plc, network.close


def _list(folder: Path) -> None:
    from fbvm.testing.course.lessons import is_done, lessons

    for lesson in lessons():
        mark = "done" if is_done(lesson, folder) else "begun" if (folder / lesson.slug).is_dir() else ""
        say(f"{lesson.number:>4}  {lesson.title:<40}{mark}".rstrip())
    say("\nfbvm learn 1 begins with the first one")


def _class(learners: Path, out: Path) -> None:
    from fbvm.testing.course.class_report import report, summary
    from fbvm.testing.course.lessons import check_class, lessons

    if resolved(out).is_relative_to(resolved(learners)):
        raise click.UsageError(f"{named(out)} lies among the learners of {named(learners)}; choose another --report")
    with writing(out):
        results = check_class(learners, out)
    if not results:
        raise click.UsageError(f"{named(learners)} holds no folders of learners")
    page = out / "report.html"
    with writing(page):
        write_file(page, report(results, lessons(), out))
    for line in summary(results, lessons()):
        say(line)
    say(f"written to {page}")
