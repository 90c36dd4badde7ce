"""The host's date, with which the clock of a PLC begins that runs in real time."""

from __future__ import annotations

import time
from calendar import timegm

YEAR_2000_S = 946_684_800
"""2000-01-01 in seconds since 1970."""


def local_date_ns() -> int:
    """The host's date and local time in nanoseconds since 2000-01-01 00:00, as the clock of a PLC has it."""
    now_ns = time.time_ns()
    return (timegm(time.localtime(now_ns // 1_000_000_000)) - YEAR_2000_S) * 1_000_000_000 + now_ns % 1_000_000_000
