"""The parameters of the machine code of scans: numbers of 64 bits in a row, by which it and Python tell each other things."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum, auto


class Slot(IntEnum):
    """Parameters of the functions of scans by their numbers, 64 bits each.  Rows of tasks, of what is watched, of units
    follow them."""

    MEMORY = 0  # address of the PLC's memory
    CONTEXT = auto()  # address of what the program's machine code keeps beside that memory
    LEFT = auto()  # how many scans there are to be
    FIRST = auto()  # time of the first of them in ns; of a burst, when it returns, of the last one
    STEP = auto()  # ns from one scan to the next
    BUDGETED = auto()  # statements that a scan may execute
    SPEND = auto()  # statements after which no other scan begins
    DONE = auto()  # how many scans there were
    CHANGED = auto()  # not 0 if something that is watched has changed; with units: which of them ran, a bit each
    UNFINISHED = auto()  # units that have left something for the network, or have trapped, a bit each
    AGAIN = auto()  # why there should be another scan soon: CHANGED_WORDS, AT_ONCE
    FAULTY = auto()  # the bit of a unit whose program has trapped, 0 if none has
    POINT = auto()  # the point of that trap
    # of a burst only:
    DEFERRED = auto()  # 1: a refresh that was left out comes before the first scan; becomes 0
    KNOWN = auto()  # 1: FIRST is the time of the next scan, the clock is not asked; becomes 0
    ALONE = auto()  # 1: machine code returns after one refresh; becomes 0
    COLLECTED = auto()  # 1: events were collected from the links for the last refresh
    TIMES = auto()  # address where the time of the next scan goes
    ENDS = auto()  # address behind the last place for such a time
    CLOCK = auto()  # address of the host's function that tells the time, see `fbvm.engine.clock.Clock`
    NUMBER = auto()  # which of the host's clocks it is asked for
    ZERO = auto()  # its time in ns that is 0 for the PLC


ROWS = len(Slot)
"""The number of the first parameter of the rows."""


def addresses_of_slots() -> Iterator[str]:
    """Instructions by which a function with the address %p of the parameters names the addresses of all slots: %first_at."""
    for slot in Slot:
        yield f"%{slot.name.lower()}_at = getelementptr inbounds i8, ptr %p, i64 {8 * slot}"
