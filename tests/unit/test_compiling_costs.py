"""What compiling leaves behind in the process: limits and the collector of garbage as they were."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator

import pytest

from fbvm.code.compiler import compile_text


@pytest.fixture
def thawed() -> Iterator[None]:
    """Without what the test run itself has frozen."""
    before = gc.get_freeze_count()
    gc.unfreeze()
    yield
    gc.unfreeze()
    if before:
        gc.freeze()


def test_the_collector_and_the_limits_are_as_before_and_what_was_made_counts_as_old(thawed: None) -> None:
    frames = sys.getrecursionlimit()
    gc.collect()
    old = len(gc.get_objects(generation=2))
    compilation = compile_text("PROGRAM Main\nVAR a : INT; END_VAR\na := a + 1;\nEND_PROGRAM\n")
    assert compilation.image is not None and gc.isenabled() and sys.getrecursionlimit() == frames
    assert gc.get_freeze_count() == 0 and len(gc.get_objects(generation=2)) > old


def test_objects_that_somebody_froze_stay_frozen(thawed: None) -> None:
    gc.freeze()
    count = gc.get_freeze_count()
    compile_text("PROGRAM Main\nEND_PROGRAM\n")
    assert 0 < count - 100 < gc.get_freeze_count() <= count
