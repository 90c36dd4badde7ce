"""Parameters in brackets behind the name of a POU, as other languages have them: one message, and what follows is read."""

from __future__ import annotations

import pytest

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import Pou

HEADS = {
    # the head and what stands behind it: what is said besides, variables and statements that are read
    "(): INT VAR x : INT; END_VAR f := x;": ([], 1, 1), "(a : INT) : INT f := 1;": ([], 0, 1), "(a : INT) f := 1;": ([], 0, 1),
    "(a : INT; b : INT) : INT VAR x, y : INT; END_VAR f := x;": ([], 1, 1),
    "(a, b : INT; c, d : ARRAY[1..2] OF INT) f := 1;": ([], 0, 1),
    "(VAR x : INT; END_VAR f := x;": ([], 1, 1), "(a : INT VAR_INPUT x : INT; END_VAR f := x;": ([], 1, 1),
    "(a : INT; b : INT; f := 1; g := 2;": ([], 0, 2), "(a : INT; f := 1;": ([], 0, 1),
}  # fmt: skip


@pytest.mark.parametrize("head", HEADS)
def test_parameters_in_brackets_are_told_once_and_the_rest_is_read(head: str) -> None:
    said, variables, statements = HEADS[head]
    tree, diagnostics = parse(Source("x.st", f"FUNCTION f{head} END_FUNCTION\nPROGRAM p z := 1; END_PROGRAM\n"))
    first, *more = diagnostics
    assert (first.message, first.hint) == ("`(` behind the name `f` of a POU", "parameters are declared in VAR_INPUT .. END_VAR")
    assert [each.message for each in more] == said
    pou, other = tree.declarations
    assert isinstance(pou, Pou) and isinstance(other, Pou) and len(other.body) == 1
    assert (sum(len(section.variables) for section in pou.sections), len(pou.body)) == (variables, statements)


@pytest.mark.parametrize("head", ["(", "(a", "(a : INT", "(a : INT; b : INT", "(a : INT; b : INT;", "(a : INT) : INT"])
def test_a_text_may_end_within_or_behind_the_brackets(head: str) -> None:
    _, diagnostics = parse(Source("x.st", f"FUNCTION f{head}"))
    assert [each.message for each in diagnostics] == [
        "`(` behind the name `f` of a POU",
        "END_FUNCTION expected before the end of the text: the FUNCTION `f` of line 1 is still open"]
