"""How the processor time of some work grows with its size, and the memory that it leaves taken."""

from __future__ import annotations

import gc
import itertools
import time
import tracemalloc
from collections.abc import Callable

TRIES = 3


def assert_linear(prepared: Callable[[int], Callable[[], object]], few: int) -> None:
    """Asserts that the work on four times as many parts as `few` takes less than eight times the time.

    `prepared` makes the work on a number of parts; only the work itself is timed."""
    assert_within_s(prepared(4 * few), 8 * least_s(prepared(few)))


def assert_within_s(work: Callable[[], object], most_s: float) -> None:
    """Asserts that the work takes less than some processor time in one of three tries; those behind it are not made."""
    took_s: list[float] = []
    while not took_s or took_s[-1] >= most_s:
        assert len(took_s) < TRIES, (took_s, most_s)
        took_s.append(_took_s(work))


def least_s(work: Callable[[], object]) -> float:
    """The processor time that the work takes in s: the least of three times."""
    return min(_took_s(work) for _ in range(TRIES))


def least_kept_bytes(work: Callable[[], object]) -> int:
    """The memory in bytes that Python takes more behind the work than before it: the least of three times.

    Other threads count, too: those that compile code or receive the names of tests take memory at any time, not each time."""
    tracemalloc.start()
    try:
        taken_bytes = [_taken_bytes()]
        for _ in range(TRIES):
            work()
            taken_bytes.append(_taken_bytes())
    finally:
        tracemalloc.stop()
    return min(after - before for before, after in itertools.pairwise(taken_bytes))


def _taken_bytes() -> int:
    gc.collect()
    return tracemalloc.get_traced_memory()[0]


def _took_s(work: Callable[[], object]) -> float:
    """Processor time of this thread, without looks for garbage, which take time by what other tests have left."""
    gc.disable()
    began_s = time.thread_time()
    try:
        work()
    finally:
        took_s = time.thread_time() - began_s
        gc.enable()
    return took_s
