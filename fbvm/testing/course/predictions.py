"""What learners are asked to predict, and what they predicted wrongly.

The first wrong prediction of a lesson is kept beside the learner's answers, which are right in the end: it shows the teacher what
was thought before."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fbvm.base.files import write_file
from fbvm.testing.lesson import FILE, answer_value

KEPT = ".first-wrong.toml"
"""The answers of a learner as they were when a check said for the first time that they are wrong."""
LARGEST_BYTES = 1 << 20
"""Of a learner's file; a larger one is left out."""
MOST_SHOWN = 200
"""Characters of an answer that are shown."""
ANSWER = re.compile(r"\s*(\w+)\s*=\s*(.*)")
"""A line of answers.toml."""


@dataclass(frozen=True)
class WrongAnswer:
    """A question, what a learner answered, and what happens."""

    question: str
    given: str
    right: str


def asked(text: str) -> Iterator[tuple[str, str]]:
    """The name and the question of each answer that `text`, an answers.toml, has room for."""
    question: list[str] = []
    for line in text.splitlines():
        if line.startswith("#"):
            question.append(line.lstrip("# ").strip())
        elif match := ANSWER.fullmatch(line):
            yield match[1], " ".join(question)
            question = []


def keep_first_wrong(folder: Path) -> None:
    """Keeps the answers in a learner's folder of a lesson, unless earlier wrong ones are kept there."""
    if not (folder / KEPT).exists() and (text := _text_of(folder / FILE)):
        write_file(folder / KEPT, text)


def first_wrong(folder: Path, lesson: Path, is_right: bool) -> list[WrongAnswer]:
    """What a learner first predicted wrongly in a lesson; none if everything was right from the beginning.

    `folder` is the learner's, `lesson` holds the lesson's own questions and its solution; if nothing is kept, the answers are
    taken as they are now, unless `is_right`.  What is still empty is not wrong."""
    text = _text_of(folder / KEPT) or ("" if is_right else _text_of(folder / FILE))
    given, right = _answers(text), _answers((lesson / "solution" / FILE).read_text(encoding="utf-8"))
    wrong = {name for name, value in given.items()
             if name in right and value != "" and answer_value(value) != answer_value(right[name])}  # fmt: skip
    questions = asked((lesson / FILE).read_text(encoding="utf-8"))
    return [WrongAnswer(question, _shown(given[name]), _shown(right[name])) for name, question in questions if name in wrong]


def _answers(text: str) -> dict[str, object]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError):  # ValueError also for numbers of thousands of digits
        return {}


def _shown(value: object) -> str:
    """An answer as text, written as in the lessons' files: truth values in small letters."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        return str(value)[:MOST_SHOWN]
    except (ValueError, RecursionError):
        return "a number of thousands of digits"


def _text_of(path: Path) -> str:
    """A learner's file; "" if there is none, or if it is no text or too large."""
    try:
        return path.read_text(encoding="utf-8") if path.stat().st_size <= LARGEST_BYTES else ""
    except (OSError, UnicodeDecodeError):
        return ""
