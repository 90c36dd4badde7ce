"""Every program of the corpus does what its comments say; in the long run on every build of every engine, with the same
memory (those of machine code are in tests/property/test_engines_agree.py)."""

from __future__ import annotations

from functools import partial
from itertools import groupby

import pytest
from lang_check import BUILDS, REFERENCE, check
from lang_corpus import Program, programs
from rows import go_through

from fbvm.base.codes import CODES
from fbvm.engine.native import engine as native

each_file = pytest.mark.parametrize(
    "file", [pytest.param(list(inside), id=name) for name, inside in groupby(programs(), lambda p: p.name)])


@each_file
def test_programs(file: list[Program]) -> None:
    go_through((f"{p.name}:{p.line} {p.title}", partial(check, p, REFERENCE)) for p in file)


if not native.available():  # where it is, machine code is compared with both of these

    @pytest.mark.slow
    @each_file
    def test_programs_on_both_builds_of_python(file: list[Program]) -> None:
        if not any(p.runs for p in file):
            pytest.skip("all of its programs have errors")
        go_through((f"{p.name}:{p.line} {p.title}", partial(check, p, BUILDS)) for p in file if p.runs)


ELSEWHERE = {"S0107", "R0112", *(code for code in CODES if code.startswith(("P", "X")))}
"""Codes that no program here provokes: that of a file which is no text, that of the watch cycle
time, which is real time, those of project files and of PLCopen documents."""


def test_every_code_has_a_program() -> None:
    provoked = {m.code for p in programs() for m in (*p.diagnostics, *([p.trap] if p.trap else []))}
    assert set(CODES) - provoked - ELSEWHERE == set()
