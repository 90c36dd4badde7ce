"""What is answered to whole questions, word for word, beside `verdicts/`: the sentence, its notes, the run as a chart and as a
test.  `FBVM_REWRITE=1 pytest` of this file writes the answers anew: read the difference before you keep it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.prove.prover import Limits, prove
from fbvm.prove.pytest_text import pytest_text
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, WITHIN, WRITTEN_ONCE, Question
from fbvm.prove.report import details, headline

HERE = Path(__file__).with_name("verdicts")
MS = 1_000_000

pytestmark = pytest.mark.slow

QUESTIONS: dict[str, tuple[Question, Limits]] = {
    "reach": (Question(REACH, "Out AND NOT Start", prefix="Main."), Limits()),
    "trap": (Question(NO_TRAP), Limits()),
    "always": (Question(ALWAYS, "n < 4", prefix="Main."), Limits()),
    "late": (Question(WITHIN, "Main.Out", ("NOT Main.Stop",), trigger="Main.Start", within_ns=10 * MS), Limits()),
    "twice": (Question(WRITTEN_ONCE, "Main.Lamp", ("Main.k < 1002",), free=("Main.k",)), Limits()),
    "free times": (Question(REACH, "Main.Lamp"), Limits(cycle_ns=10 * MS, longest_ns=30 * MS)),
    "few scans": (Question(NEVER, "Main.Lamp", title="The lamp stays dark"), Limits(scans=4, simulated_scans=4)),
    "expired": (Question(NEVER, "Main.Lamp"), Limits(expired=lambda: True)),
}  # fmt: skip
"""Of `pump.st`."""
PROVED: dict[str, Question] = {
    "assumed": Question(NO_TRAP, assumptions=("Main.Level < 200",)),
    "unreachable": Question(REACH, "State = Failed", prefix="Main."),
    "constant": Question(NEVER, "Main.Limit > 7"), "once": Question(WRITTEN_ONCE, "Main.Out"),
}  # fmt: skip
"""Of `door.st`."""


@cache
def image_of(name: str) -> Image:
    found = compile_text((HERE / name).read_text(encoding="utf-8"), lint=False).image
    assert found is not None
    return found


def answer(image: Image, question: Question, limits: Limits) -> Iterator[str]:
    said: list[str] = []
    verdict = prove(image, question, limits, said.append)
    yield headline(verdict)
    yield from details(image, verdict, 70)
    yield f"({verdict.scans} scans are certain; {'good' if verdict.is_good else 'not good'}; {', '.join(said)})"
    if verdict.run is not None:
        yield from pytest_text([verdict], [Path("pump.st")], {"dialect": "standard"}).splitlines()[6:]


@pytest.mark.parametrize("name", [*QUESTIONS, *PROVED])
def test_the_answer_to_a_question(name: str) -> None:
    kept = HERE / f"{name}.txt"
    asked = (image_of("pump.st"), *QUESTIONS[name]) if name in QUESTIONS else (image_of("door.st"), PROVED[name], Limits())
    came = "\n".join(line.rstrip() for line in answer(*asked)) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        kept.write_text(came, encoding="utf-8")
    assert came == kept.read_text(encoding="utf-8")
