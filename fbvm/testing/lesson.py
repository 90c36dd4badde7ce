"""What the checks of lessons need besides the fixtures: the predictions that a learner has written down."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

FILE = "answers.toml"


def predicted(test_file: str, name: str) -> object:
    """The answer of that name beside a test; a number or a truth value also if it stands in quotes.

    Raises AssertionError if there is none yet."""
    __tracebackhide__ = True
    path = Path(test_file).parent / FILE
    try:
        answers = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise AssertionError(f"{FILE} cannot be read: {error}") from None
    if answers.get(name, "") == "":
        raise AssertionError(f"{FILE}: {name} is still empty; predict first, then look")
    return answer_value(answers[name])


def answer_value(written: object) -> object:
    """What an answer means: a number or a truth value also if it stands in quotes."""
    if not isinstance(written, str):
        return written
    if re.fullmatch(r"\s*[+-]?[0-9]{1,9}\s*", written):
        return int(written)
    return {"true": True, "false": False}.get(written.strip().lower(), written)
