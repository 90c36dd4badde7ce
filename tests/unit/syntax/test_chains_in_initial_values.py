"""A chain of operators is as deep as it may be, and an array, a structure or a repetition around it makes it deeper."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.st import builder

LIMIT = 20


@each_of(("around", "deeper"), [
    ("{}", 0), ("({})", 0), ("[{}]", 1), ("[1, {}, 2]", 1), ("(a := {})", 1), ("[[{}]]", 2), ("[(a := {})]", 2), ("-({})", 1),
    ("[2({})]", 1), ("[3(), {}]", 1),
])  # fmt: skip
def test_what_stands_around_a_chain_counts(around: str, deeper: int) -> None:
    for operators in (LIMIT - 2 - deeper, LIMIT - 1 - deeper, LIMIT - deeper):
        chain = "1" + " + 1" * operators
        text = f"PROGRAM Main\nVAR x : Some := {around.format(chain)}; END_VAR\nEND_PROGRAM\n"
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(builder, "CHAIN_LIMIT", LIMIT)
            codes = [each.code for each in parse(Source("a.st", text))[1]]
        assert codes == ([] if operators + deeper < LIMIT else ["S0106"]), operators
