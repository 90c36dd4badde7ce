"""Every program of the corpus does what its comments say, on every build of every engine, with the same memory."""

from __future__ import annotations

import pytest
from lang_check import check
from lang_corpus import Program, programs

from fbvm.base.codes import CODES


@pytest.mark.parametrize("program", [pytest.param(p, id=f"{p.name}:{p.line}") for p in programs()])
def test_program(program: Program) -> None:
    check(program)


ELSEWHERE = {"S0107", *(code for code in CODES if code.startswith(("P", "X")))}
"""Codes that no program here provokes: that of a file which is no text, those of project files and of PLCopen documents."""


def test_every_code_has_a_program() -> None:
    provoked = {m.code for p in programs() for m in (*p.diagnostics, *([p.trap] if p.trap else []))}
    assert set(CODES) - provoked - ELSEWHERE == set()
