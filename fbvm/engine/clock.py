"""The clock of a PLC in real time, which Python and machine code read alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class Clock:
    """Tells the time of a PLC."""

    now: Callable[[], int]
    function_at: int = 0
    """Address of a function such as POSIX `clock_gettime`, whose time less `zero_ns` is that of `now`; 0 if there is none:
    then machine code comes back to be told the time."""
    number: int = 0
    """Which clock that function is to read."""
    zero_ns: int = 0
