"""How long work may take on the host's clock, for those who compute and do not scan."""

from __future__ import annotations

import time
from collections.abc import Callable


def time_limit(limit_ns: int) -> Callable[[], bool]:
    """A function that answers True when `limit_ns` have passed from now on."""
    end_ns = time.monotonic_ns() + limit_ns
    return lambda: time.monotonic_ns() > end_ns


def stopwatch() -> Callable[[], int]:
    """A function that answers how many nanoseconds have passed from now on."""
    began_ns = time.monotonic_ns()
    return lambda: time.monotonic_ns() - began_ns


def pause(time_ns: int) -> None:
    """Waits for so many nanoseconds, which Ctrl-C ends."""
    time.sleep(time_ns / 1e9)
