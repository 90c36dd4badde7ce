"""The parameters of the machine code of scans: what Python and machine code tell each other, 64 bits each.

A `ctypes.Structure` and no enumeration of indices: Python reads a field of it as fast as an item of an array, and four times as
fast as an item whose index is an IntEnum.  Behind the structure follow the rows of tasks, of watched words and of units."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator


class Parameters(ctypes.Structure):
    """The parameters that every call of `@scans` and `@burst` has.  Times are in nanoseconds of the PLC's clock."""

    memory: int
    """Address of the PLC's memory."""
    context: int
    """Address of the context in which traps leave their values."""
    most_scans: int
    """`@scans`: how many scans there may be."""
    time_ns: int
    """Time of the first scan; after a burst, time of its last scan."""
    step_ns: int
    """`@scans`: how much later than the one before each scan is."""
    scan_budget: int
    """How many statements one scan may execute."""
    spend: int
    """`@scans`: no further scan begins when all together have executed so many statements."""
    done: int
    """`@scans`: how many scans there were."""
    changed: int
    """Without units: 1 if watched words differ from what is expected.  With units: a bit for each unit whose program ran in
    the last refresh."""
    unfinished: int
    """A bit for each unit that has requests for its network, until Python sets the parameter to 0."""
    again: int
    """Why another scan should follow at once: bits CHANGED_WORDS and MORE_TO_DO of `scans.units`, after the last refresh."""
    faulty: int
    """The bit of a unit whose program has ended in a trap; 0 if none has."""
    point: int
    """The point of that trap."""
    refresh_first: int
    """`@burst`: 1 if the burst begins with an I/O refresh that was left out before; set to 0 when the refresh is done."""
    is_time_known: int
    """`@burst`: 1 if `time_ns` is the time of the next scan, 0 if machine code has to read the clock."""
    is_single: int
    """`@burst`: 1 if control comes back after one refresh; set to 0 at the start."""
    events_collected: int
    """`@burst`: 1 if Python collected network events for the refresh that is next; set to 0 when that refresh is over."""
    times: int
    """`@burst`: address at which the time of the next scan is stored."""
    times_end: int
    """`@burst`: address behind the last time that there is room for."""
    clock_function: int
    """`@burst`: `Clock.function_at`."""
    clock_number: int
    """`@burst`: `Clock.number`."""
    clock_zero_ns: int
    """`@burst`: `Clock.zero_ns`."""

    _fields_ = tuple((name, ctypes.c_int64) for name in __annotations__)


COUNT = len(Parameters._fields_)
"""How many numbers of 64 bits lie before the first row."""


def addresses() -> Iterator[str]:
    """Instructions of LLVM by which a function whose argument %p is the address of the parameters names where each of them is:
    `%budget_at` is where `budget` is."""
    for number, (name, *_) in enumerate(Parameters._fields_):
        yield f"%{name}_at = getelementptr inbounds i8, ptr %p, i64 {8 * number}"
