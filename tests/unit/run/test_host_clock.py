"""The host's clock as machine code reads it: what Python's own clock tells."""

from __future__ import annotations

import ctypes
import sys
import time

import pytest

from fbvm.run.host_clock import function_at


def test_a_clock_without_such_a_function_is_told_by_python() -> None:
    assert [function_at(name) for name in ("a stand-in", "mach_absolute_time()", "")] == [0, 0, 0]


@pytest.mark.skipif(sys.platform != "linux" or ctypes.sizeof(ctypes.c_long) != 8, reason="its clock is another")
def test_the_function_tells_what_python_tells() -> None:
    at = function_at(time.get_clock_info("monotonic").implementation)
    read = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))(at)
    parts = (ctypes.c_int64 * 2)()
    before_ns = time.monotonic_ns()
    assert read(time.CLOCK_MONOTONIC, parts) == 0
    assert before_ns <= parts[0] * 1_000_000_000 + parts[1] <= time.monotonic_ns()
