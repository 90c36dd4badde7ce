"""The tables of IEC 61131-3 ed. 3: a file a table, a program a feature; what is not executed is refused by its code."""

from __future__ import annotations

from pathlib import Path

import pytest
from lang_check import check
from lang_corpus import Program, programs

HERE = Path(__file__).parent


@pytest.mark.parametrize("program", [pytest.param(p, id=f"{p.path.stem}:{p.line}") for p in programs(HERE)])
def test_feature(program: Program) -> None:
    check(program)
