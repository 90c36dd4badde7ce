"""How the processor time of some work grows with its size."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable


def least_s(work: Callable[[], object]) -> float:
    """The processor time that the work takes in s: the least of three times, none of which looks for garbage: that
    takes time by what other tests have left."""
    took = []
    for _ in range(3):
        gc.disable()
        began_s = time.process_time()
        try:
            work()
        finally:
            took.append(time.process_time() - began_s)
            gc.enable()
    return min(took)
