"""Runs that execute every statement: what a run does on the engine counts, and nothing else."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.prove.cover import Covered, cover
from fbvm.prove.encoding import statements
from fbvm.prove.prover import Limits

pytest.importorskip("bitwuzla")
pytestmark = pytest.mark.slow

HEAD = "PROGRAM Main VAR_INPUT Go : BOOL; Level : INT; END_VAR VAR n, i : INT; r : REAL; END_VAR\n"


def image(body: str) -> Image:
    made = compile_text(HEAD + body + "\nEND_PROGRAM").image
    assert made is not None
    return made


def words(made: Image, found: Covered) -> tuple[list[str], list[str]]:
    """What no run ever does, and what is missed."""
    return [spot.words(made) for spot in found.never], [spot.words(made) for spot in found.missed]


def test_a_statement_that_always_traps_is_executed_by_a_run_that_ends_in_the_trap() -> None:
    made = image("IF Go THEN\nn := 7 / i;\nEND_IF;")
    found = cover(made, Limits(scans=20), free=("Main.Go",))
    assert words(made, found) == ([], []) and [run.run.trap is not None for run in found.runs] == [False, True]


def test_a_statement_that_also_runs_without_a_trap_is_executed_without_one() -> None:
    made = image("IF Go THEN\nn := 7 / Level;\nEND_IF;")
    found = cover(made, Limits(scans=20), free=("Main.Go", "Main.Level"))
    assert words(made, found) == ([], []) and not any(run.run.trap for run in found.runs)


def test_a_run_that_only_the_solver_believes_in_meets_nothing() -> None:
    made = image("IF Go THEN\nr := r + 0.5;\nEND_IF;\nIF r > 2.1 AND r < 2.2 THEN\nn := 4;\nEND_IF;")
    found = cover(made, Limits(scans=20), free=("Main.Go",))
    assert words(made, found) == ([], ["text.st:6"]) and found.met == 5
    assert list(found.missed.values()) == [0], "the solver believes in a run of one scan"
    assert all(run.spots for run in found.runs)


def test_what_stands_behind_a_loop_that_cannot_be_followed_is_not_said_to_be_never_executed(
        monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    monkeypatch.setattr(statements, "MOST_SYMBOLIC_ROUNDS", 5)
    made = image("i := 0;\nWHILE i < Level DO\ni := i + 1;\nEND_WHILE;\nIF i > 20 THEN\nn := 1;\nEND_IF;")
    found = cover(made, Limits(scans=4), free=("Main.Level",))
    assert words(made, found) == ([], ["text.st:7"])


def test_it_ends_when_the_time_is_over() -> None:
    made = image("IF n > 20000 THEN\ni := 1;\nEND_IF;\nn := n + 1;")
    asked = iter(range(40))
    found = cover(made, Limits(scans=100_000, expired=lambda: next(asked, None) is None))
    assert words(made, found) == ([], ["text.st:3"])
