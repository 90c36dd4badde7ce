"""When an ETN21 accepts a request and how its words change at the end: a strategy, chosen by name.

Counts are refreshes; a strategy decides nothing but delays.  From etn21 timing facts: W421 6-6-2 p112, 6-9-5 p157.
"""

from __future__ import annotations

from random import Random
from typing import NamedTuple, Protocol


class Skew(NamedTuple):
    """How many refreshes after the end of a service each group of words changes."""

    switch: int = 0
    """Response code and request switch."""
    flag: int = 0
    """Opening, Receiving, Sending, Closing."""
    open: int = 0
    """Bit 15."""
    data: int = 0
    """Bit 13 and the D words m+1..m+16."""


TOGETHER = Skew()


class Delay(NamedTuple):
    """What a service takes at least, from its acceptance on."""

    refreshes: int
    time_ns: int


NEXT = Delay(1, 0)


class Timing(Protocol):
    """Delays of one unit."""

    accept_refreshes: int
    """Refreshes between the one that finds a switch ON and the one that accepts it."""

    def delay(self) -> Delay:
        """For a service that is accepted now."""

    def skew(self) -> Skew:
        """For a service that ends now."""

    def start_up(self) -> Delay:
        """From a restart until the unit sees requests."""


class Exact:
    """A switch is accepted by the refresh that finds it ON, and finished by the next one at the earliest."""

    accept_refreshes = 0

    def delay(self) -> Delay:
        return NEXT

    def skew(self) -> Skew:
        return TOGETHER

    def start_up(self) -> Delay:
        return NEXT


class Real:
    """Seeded delays like those of the device (assumed): 3..7 refreshes and 5..21 ms, words out of step by -1..+3.

    A restart takes 1 to 3 s."""

    accept_refreshes = 1

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)

    def delay(self) -> Delay:
        return Delay(self._random.randint(3, 7), self._random.randint(5_000_000, 21_000_000))

    def skew(self) -> Skew:
        return Skew(1, *(self._random.randint(0, 4) for _ in range(3)))

    def start_up(self) -> Delay:
        return Delay(self._random.randint(3, 7), self._random.randint(1_000_000_000, 3_000_000_000))


def timing_of(name: str, seed: int) -> Timing:
    """The strategy called "exact" or "real"; ValueError for another name."""
    if name == "exact":
        return Exact()
    if name == "real":
        return Real(seed)
    raise ValueError(f"timing {name!r} is neither 'exact' nor 'real'")
