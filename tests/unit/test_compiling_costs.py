"""What compiling costs, and what it leaves behind in the process: limits as they were, no garbage that piles up."""

from __future__ import annotations

import gc
import sys

import pytest

from fbvm.code.compiler import compile_text

TEXT = "PROGRAM Main\nVAR a : INT; END_VAR\na := a + 1;\nEND_PROGRAM\n"


def test_the_collector_and_the_limits_are_as_before() -> None:
    frames = sys.getrecursionlimit()
    assert compile_text(TEXT).image is not None
    assert gc.isenabled() and sys.getrecursionlimit() == frames


@pytest.mark.slow
def test_what_compilations_leave_is_collected_in_passing() -> None:
    counts = []
    for _ in range(4):
        for _ in range(8):
            compile_text(TEXT)
        counts.append(len(gc.get_objects()))
    assert counts[-1] < counts[0] + 20_000


def test_functions_that_call_the_next_twice_are_looked_at_once() -> None:
    text = "".join(f"FUNCTION F{n} : INT\nVAR_INPUT a : INT; END_VAR\nF{n} := F{n + 1}(a) + F{n + 1}(a);\nEND_FUNCTION\n"
                   for n in range(60))
    text += "FUNCTION F60 : INT\nVAR_INPUT a : INT; END_VAR\nF60 := a;\nEND_FUNCTION\nPROGRAM Main\nF0(1);\nEND_PROGRAM\n"
    assert [d.code for d in compile_text(text).diagnostics] == ["S0491"], "2 ** 60 ways through them"


def test_what_a_compilation_leaves_does_not_wait_for_the_collector() -> None:
    def left(statements: int) -> int:
        gc.collect()
        compile_text(TEXT.replace("a := a + 1;\n", "a := a + 1;\n" * statements))
        return gc.collect()

    left(1)  # what is made once
    assert left(400) < left(1) + 100
