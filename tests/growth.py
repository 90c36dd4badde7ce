"""How the processor time of some work grows with its size."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable

TRIES = 3


def assert_linear(prepared: Callable[[int], Callable[[], object]], few: int) -> None:
    """Asserts that the work on four times as many parts as `few` takes less than eight times the time, in one of three tries.

    `prepared` makes the work on a number of parts; only the work itself is timed."""
    work = prepared(few)
    most_s = 8 * min(_took_s(work) for _ in range(TRIES))
    work = prepared(4 * few)
    took_s: list[float] = []
    while not took_s or took_s[-1] >= most_s:
        assert len(took_s) < TRIES, (took_s, most_s)
        took_s.append(_took_s(work))


def _took_s(work: Callable[[], object]) -> float:
    """Processor time without looks for garbage, which take time by what other tests have left."""
    gc.disable()
    began_s = time.process_time()
    try:
        work()
    finally:
        took_s = time.process_time() - began_s
        gc.enable()
    return took_s
