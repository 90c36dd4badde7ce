"""The lessons of `fbvm learn`, the check of a learner's files, and a teacher's check of all learners.

A lesson is a folder of `examples/lessons/`: `lesson.md` is its text, `given.st` a program, `answers.toml` asks for a prediction,
`test_lesson.py` checks it and the learner's `program.st`; `solution/` is not copied.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from fbvm.base.data import data_folder
from fbvm.base.files import resolved, write_file
from fbvm.testing.course.predictions import ANSWER, LARGEST_BYTES, WrongAnswer, asked, first_wrong, keep_first_wrong
from fbvm.testing.lesson import FILE as ANSWERS
from fbvm.testing.pages import FOLDER
from fbvm.testing.pytest_process import run_pytest

PROGRAM, GIVEN, TEXT, SOLUTION = "program.st", "given.st", "lesson.md", "solution"
OF_THE_LEARNER = (PROGRAM, ANSWERS)
DONE = ".done"
QUIET = ("-q", "-rN", "--tb=short", "--import-mode=importlib", "-p", "no:cacheprovider", "-p", "no:hypothesispytest",
         "--fbvm-no-warn", "all")  # fmt: skip
"""Without the plugin of hypothesis, where that is installed: it imports all of hypothesis at the end of a session, which takes
a fifth of the time of a check."""
WORDS = ("-p", "fbvm.testing.course.words")
PREDICTION = "test_prediction"


@dataclass(frozen=True)
class Lesson:
    """One lesson; `slug` is the name of its folder, `03-level-against-edge`."""

    number: int
    slug: str
    folder: Path

    @property
    def text(self) -> str:
        """Its text, Markdown."""
        return (self.folder / TEXT).read_text(encoding="utf-8")

    @property
    def title(self) -> str:
        return self.text.split("\n", 1)[0].removeprefix("# ")

    def solution(self) -> str:
        """The right answers, the program, and why."""
        parts = ((ANSWERS, ANSWERS), (PROGRAM, PROGRAM), ("why.md", ""))
        texts = [(name, (self.folder / SOLUTION / file).read_text(encoding="utf-8")) for file, name in parts]
        return "\n".join(f"--- {name}\n\n{text}" if name else text for name, text in texts)

    def begin(self, folder: Path) -> Path:
        """The learner's own folder for it; what is there already stays as it is."""
        target = folder / self.slug
        target.mkdir(parents=True, exist_ok=True)
        for path in self._files():
            if not (target / path.name).exists():
                shutil.copyfile(path, target / path.name)
        if not (target / PROGRAM).exists():
            shutil.copyfile(self.folder / GIVEN, target / PROGRAM)
        return target

    def gather(self, source: Path, target: Path) -> None:
        """A fresh folder for a check: the lesson's own files, and of the learner's the program and the answers only."""
        target.mkdir(parents=True, exist_ok=True)
        for path in self._files():
            if path.name not in OF_THE_LEARNER:
                shutil.copyfile(path, target / path.name)
        for name in OF_THE_LEARNER:
            if (source / name).is_file() and (source / name).stat().st_size <= LARGEST_BYTES:
                shutil.copyfile(source / name, target / name)

    def _files(self) -> list[Path]:
        return sorted(path for path in self.folder.iterdir() if path.is_file() and path.name != TEXT)


@cache
def lessons() -> tuple[Lesson, ...]:
    """All lessons in order."""
    folders = sorted(path for path in (data_folder("examples") / "lessons").iterdir() if (path / TEXT).is_file())
    return tuple(Lesson(int(path.name.partition("-")[0]), path.name, path) for path in folders)


def prediction_mistake(lesson: Lesson, folder: Path, look: str = "fbvm step shows every statement") -> str:
    """What is wrong with a learner's prediction, without the right one; "" if it is right.  `look` says how to look again.

    The report of a failed test would show the answer, and so would a test of a program that is still the given one."""
    target = folder / lesson.slug
    with tempfile.TemporaryDirectory() as temporary:
        listing = Path(temporary) / "results.xml"
        status = run_pytest([*QUIET, "--rootdir", str(target), "-c", str(_ini(target)), f"--junitxml={listing}",
                             "--fbvm-pages", "0", "-k", PREDICTION, str(target)], quiet=True)  # fmt: skip
        if status == 0:
            return ""
        cases = list(ElementTree.parse(listing).iter("failure")) if listing.is_file() else []
    said = (cases[0].get("message") or "") if cases else ""
    if f"AssertionError: {ANSWERS}" in said:
        return said.split("\n", 1)[0].removeprefix("AssertionError: ")
    if not said or not said.startswith(("assert ", "AssertionError")):
        return ""  # given.st is broken, or the test: the check shows how
    keep_first_wrong(target)
    return f"{ANSWERS}: this is not what the program does; read the text again, and look: {look}"


def check(lesson: Lesson, folder: Path) -> int:
    """Checks a learner's files of a lesson; returns pytest's status, and marks the lesson as done if the status is 0."""
    target = folder / lesson.slug
    status = run_pytest([*QUIET, *WORDS, "--rootdir", str(target), "-c", str(_ini(target)), str(target)])
    if status == 0:
        (target / DONE).touch()
    return status


def program_mistakes(lesson: Lesson, folder: Path) -> list[str]:
    """What a learner's program does not do yet, a sentence for each test that fails: which scan, which value, which rule.  Marks
    the lesson as done if none does."""
    target = folder / lesson.slug
    with tempfile.TemporaryDirectory() as temporary:
        listing = Path(temporary) / "results.xml"
        status = run_pytest([*QUIET, "--rootdir", str(target), "-c", str(_ini(target)), f"--junitxml={listing}",
                             "--fbvm-pages", "0", str(target)], quiet=True)  # fmt: skip
        if status == 0:
            (target / DONE).touch()
            return []
        cases = list(ElementTree.parse(listing).iter("testcase")) if listing.is_file() else []
    wrong = [(case.get("name", ""), found) for case in cases
             for found in [case.find("failure") if case.find("failure") is not None else case.find("error")] if found is not None]
    said: dict[str, str] = {}
    for name, found in wrong:  # of a test with several examples the first that fails
        said.setdefault(name.partition("[")[0], mistake(name, found.get("message") or ""))
    return list(said.values()) or [f"{PROGRAM} could not be checked"]


def mistake(name: str, said: str) -> str:
    """A failed test in a sentence, with what it said if that is one."""
    sentence = name.partition("[")[0].removeprefix("test_").replace("_", " ")
    first = said.split("\n", 1)[0].removeprefix("AssertionError: ")
    if not first or first.startswith("assert "):
        return sentence
    return first if sentence == "program" else f"{sentence}: {first}"


def questions(lesson: Lesson, folder: Path) -> list[tuple[str, str, str]]:
    """What a learner is asked to predict: name, question, and the answer so far."""
    text = (folder / lesson.slug / ANSWERS).read_text(encoding="utf-8")
    try:
        given = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        given = {}
    return [(name, question, str(given.get(name, ""))) for name, question in asked(text)]


def answer(lesson: Lesson, folder: Path, values: Mapping[str, str]) -> None:
    """Writes predictions into a learner's file, each as the text that it is given as."""
    path = folder / lesson.slug / ANSWERS
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        match = ANSWER.fullmatch(line)
        known = match is not None and match[1] in values
        lines.append(f"{match[1]} = {json.dumps(values[match[1]], ensure_ascii=False)}" if match and known else line)
    write_file(path, "\n".join(lines) + "\n")


def is_done(lesson: Lesson, folder: Path) -> bool:
    """True if a check has passed."""
    return (folder / lesson.slug / DONE).exists()


def _ini(folder: Path) -> Path:
    path = folder / "pytest.ini"
    if not path.exists():
        path.write_text("[pytest]\n", encoding="utf-8")
    return path


# --- a class ----------------------------------------------------------------------------------------------------------


@dataclass
class Result:
    """The result of one lesson: whether the prediction is right, what was first predicted wrongly, checks of the program, and
    failed tests with their messages."""

    prediction: bool = False
    passed: int = 0
    checks: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    first_wrong: list[WrongAnswer] = field(default_factory=list)

    @property
    def is_complete(self) -> bool:
        return self.prediction and self.passed == self.checks


def learners(folder: Path) -> list[tuple[str, dict[str, Path]]]:
    """Each learner's name, and the folders of the lessons that were begun."""
    slugs = {lesson.slug for lesson in lessons()}
    found = []
    for path in sorted(each for each in folder.iterdir() if each.is_dir() and not each.name.startswith(".")):
        begun = {each.name: each for each in sorted(path.rglob("*")) if each.is_dir() and each.name in slugs}
        found.append((path.name, begun))
    return found


def check_class(folder: Path, out: Path) -> dict[str, dict[str, Result]]:
    """Checks all lessons of all learners with the lessons' own tests; traces and pages of failures stay in `out`."""
    results: dict[str, dict[str, Result]] = {}
    works = learners(folder)
    out = resolved(out)
    listing = out / "results.xml"
    for old in (out / FOLDER, out / "traces"):
        shutil.rmtree(old, ignore_errors=True)
    listing.unlink(missing_ok=True)
    out.mkdir(parents=True, exist_ok=True)
    for name, begun in works:
        results[name] = {}
        for lesson in lessons():
            if lesson.slug in begun:
                shutil.rmtree(out / name / lesson.slug, ignore_errors=True)
                lesson.gather(begun[lesson.slug], out / name / lesson.slug)
                results[name][lesson.slug] = Result()
    working = [f"./{name}" for name, begun in results.items() if begun]
    if working:
        run_pytest([*QUIET, "-c", str(_ini(out)), "--rootdir", str(out), f"--junitxml={listing}", "-o", "junit_family=xunit1",
                    "--fbvm-traces", str(out / "traces"), "--fbvm-pages", "1000000", *working], cwd=out, quiet=True)  # fmt: skip
    for name, slug, test, why in _rows(listing) if working else ():
        result = results[name][slug]
        if test == PREDICTION:
            result.prediction = not why
        else:
            result.checks += 1
            result.passed += not why
        if why:
            result.failed.append((test, why))
    for name, begun in works:
        for lesson in lessons():
            if lesson.slug in begun:
                result = results[name][lesson.slug]
                result.first_wrong = first_wrong(begun[lesson.slug], lesson.folder, result.prediction)
    return results


def _rows(listing: Path) -> Iterator[tuple[str, str, str, str]]:
    """Learner, lesson, test and why it failed, "" if it did not."""
    for case in ElementTree.parse(listing).iter("testcase"):
        name, slug, *_ = Path(case.get("file", "")).parts
        wrong = case.find("failure") if case.find("failure") is not None else case.find("error")
        said = "" if wrong is None else (wrong.get("message") or "failed").split("\n")[0]
        yield name, slug, case.get("name", ""), said
