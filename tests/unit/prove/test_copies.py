"""The property of what a variable is copied from: which conditions are tried, and what is proved with them."""

from __future__ import annotations

import re

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.prove.copies import copied
from fbvm.prove.prover import Limits, Prover, prove
from fbvm.prove.question import NEVER, Question
from fbvm.watch.names import Names

pytestmark = pytest.mark.slow


def image_of(code: str) -> Image:
    image = compile_text(f"PROGRAM Main VAR In AT %IX0.0 : BOOL; n, a, b : DINT; x, y : BOOL; END_VAR\n{code}\nEND_PROGRAM",
                         lint=False).image  # fmt: skip
    assert image is not None
    return image


@each_of(("code", "never", "tried"), (
    ("a := n;", "a = 5", ["(eq n 5)"]), ("IF In THEN a := n; END_IF", "a = 5", ["(eq n 5)"]),
    ("x := n > 4; y := x;", "y AND n = 3", ["(and (eq 3 n) x)"]),
    ("a := n; b := n + 1;", "a = b", ["(eq (sext b) (sext n))"]),
    ("a := n + 1;", "a = 5", []),  # it is no copy
    ("a := n;", "In AND a = 5", []),  # nothing is known of inputs
    ("IF In THEN a := n; END_IF IF x THEN b := a; END_IF x := NOT x;", "b = 5", ["(eq a 5)", "(eq n 5)"]),
    ("IF In THEN a := n; ELSE b := n; END_IF", "a = 5", ["(eq n 5)"]),
))  # fmt: skip
def test_a_condition_is_tried_of_what_its_variables_are_copied_from(code: str, never: str, tried: list[str]) -> None:
    image = image_of(f"IF In THEN n := n + 3; END_IF {code}")
    prover, names = Prover(image, Question(NEVER, never, prefix="Main."), Limits(), str), Names.of(image, image.layout.areas)

    def name(found: re.Match[str]) -> str:
        place = names.at(int(found[1]))
        assert place is not None
        return place.name.removeprefix("Main.")

    assert [re.sub(r"\('state', Cell\(offset=(\d+)[^)]*\)\)", name, f"{kept.condition}")
            for kept in copied(prover.summary, prover.condition)] == tried  # fmt: skip


def test_what_holds_of_a_copy_is_proved_together_with_what_holds_of_the_original() -> None:
    said: list[str] = []
    image = image_of("IF In AND n < 4 THEN n := n + 1; END_IF IF In THEN a := n; END_IF")
    verdict = prove(image, Question(NEVER, "Main.a > 4"), Limits(), said.append)
    assert (verdict.word, verdict.how) == ("proved", "by induction over 2 scans with 1 invariant")
    assert "trying the property of what was copied" in said


def test_a_copy_of_a_copy_is_proved_with_both_that_it_is_made_of() -> None:
    image = image_of("IF In AND n < 400 THEN n := n + 1; END_IF IF In THEN a := n; END_IF\n"
                     "IF In AND x THEN b := a; END_IF x := NOT x;")  # fmt: skip
    verdict = prove(image, Question(NEVER, "Main.b > 400"))
    assert (verdict.word, verdict.how) == ("proved", "by induction over 2 scans with 2 invariants")
