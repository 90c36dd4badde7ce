"""What compiling leaves behind in the process: limits and the collector as they were, and no garbage that piles up."""

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
