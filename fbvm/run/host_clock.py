"""The host's clock as machine code reads it: the function of C that Python's own clock calls."""

from __future__ import annotations

import ctypes

_FUNCTIONS = {"clock_gettime(CLOCK_MONOTONIC)": "clock_gettime"}
"""What Python says of a clock, and the function that machine code calls with the clock's number; no other ones."""


def function_at(implementation: str) -> int:
    """The address of the function behind a clock, by what `time.get_clock_info` says of that; 0 if there is none."""
    name = _FUNCTIONS.get(implementation)
    if name is None or ctypes.sizeof(ctypes.c_long) != 8:  # else its seconds may have 32 bits
        return 0
    function = getattr(ctypes.CDLL(None), name, None)
    return ctypes.cast(function, ctypes.c_void_p).value or 0 if function else 0
