"""Lemmas: they are proved with the property, those that a scan breaks are said to be no help, and inputs have none."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, Question, Verdict

TEXT = """PROGRAM Main
VAR
    In AT %IX0.0 : BOOL;
    n, m : DINT;
END_VAR
    IF In THEN
        n := n + 1;
        m := m + 2;
    END_IF
    IF n > 1000 THEN
        n := 0;
        m := 0;
    END_IF
END_PROGRAM
"""
DOUBLE = "Main.m = 2 * Main.n AND Main.n >= 0 AND Main.n <= 1000"


def image() -> Image:
    found = compile_text(TEXT, lint=False).image
    assert found is not None
    return found


def asked(kind: str, text: str, *lemmas: str) -> Verdict:
    return prove(image(), Question(kind, text, lemmas=lemmas), Limits(scans=20, simulated_scans=20))


@pytest.mark.slow
def test_a_lemma_makes_a_proof() -> None:
    assert asked(NEVER, "Main.m > 2001").word == "undecided"
    verdict = asked(NEVER, "Main.m > 2001", DOUBLE)
    assert (verdict.word, verdict.how) == ("proved", "by induction over 1 scan with 2 invariants")
    assert [note for note in verdict.notes if "no help" in note] == []
    assert asked(ALWAYS, "Main.m <= 2001", DOUBLE).word == "proved"
    assert asked(REACH, "Main.m > 2001", DOUBLE).word == "unreachable"
    assert asked(NO_TRAP, "", DOUBLE).word == "proved"


@pytest.mark.slow
@pytest.mark.parametrize("wrong", ["Main.m = 0", "Main.m < 1990", "Main.m = 3 * Main.n"])
def test_a_lemma_that_does_not_hold_is_no_help_and_proves_nothing(wrong: str) -> None:
    verdict = asked(NEVER, "Main.m > 2001", wrong)
    assert (verdict.word, verdict.notes) == ("undecided", (f"no help, because a scan may break it: {wrong}",))
    assert asked(NEVER, "Main.m = 4", wrong).word == "broken"
    assert asked(NEVER, "Main.m > 2001", wrong, DOUBLE).word == "proved"


def test_a_lemma_about_inputs_is_refused() -> None:
    with pytest.raises(Refused, match=r"the lemma Main.In is about inputs"):
        asked(NEVER, "Main.m > 2001", "Main.In")
