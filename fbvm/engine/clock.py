"""The clock of a PLC in real time, as Python reads it and as machine code reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class Clock:
    """The time of a PLC in nanoseconds, for Python and for machine code: both read the same."""

    now: Callable[[], int]
    """The time for Python."""
    function_at: int = 0
    """Address of a function of C with the arguments of POSIX `clock_gettime`; 0 if the host has none.  Without it machine
    code returns to Python before each scan to be told the time."""
    number: int = 0
    """The first argument of that function: which of the host's clocks to read."""
    zero_ns: int = 0
    """What machine code subtracts from the time of that function to have the time of `now`."""
