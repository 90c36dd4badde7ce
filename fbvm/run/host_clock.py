"""The function of C by which machine code reads the host's clock: the one that Python's own clock calls."""

from __future__ import annotations

import ctypes

_FUNCTIONS = {"clock_gettime(CLOCK_MONOTONIC)": "clock_gettime"}
"""What `time.get_clock_info` calls a clock, and the function of C behind it.  Other clocks are not read by machine code."""


def function_at(implementation: str) -> int:
    """The address of the function of C behind a clock; 0 if the host has none that is known.

    `implementation` is what `time.get_clock_info` says of the clock."""
    name = _FUNCTIONS.get(implementation)
    if name is None or ctypes.sizeof(ctypes.c_long) != 8:  # else its seconds may have 32 bits
        return 0
    function = getattr(ctypes.CDLL(None), name, None)
    return ctypes.cast(function, ctypes.c_void_p).value or 0 if function else 0
