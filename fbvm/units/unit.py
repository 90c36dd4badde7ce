"""What every emulated unit offers to the machine, and what it may see of the PLC."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from fbvm.wire.link import Event, Request


class AreaMemory(Protocol):
    """The part of a PLC's memory that a unit exchanges: whole areas as 16-bit words."""

    def words(self, area: str) -> memoryview:
        """The words of an area ("CIO", "D", "W", "H", "A", "E0" ...) as a writable memoryview of format "H".

        Raises KeyError for an area that this PLC does not have."""


class Unit(Protocol):
    """One unit on the backplane.  The machine calls `refresh` once per cycle, in the I/O refresh."""

    name: str
    """Short name with the unit number for charts and messages, such as "ETN21 0"."""

    address: str
    """IPv4 address of the unit, by which it is attached to a network."""

    wake_ns: int
    """When the unit has something to do by itself: 0 in the next refresh, far away if nothing is timed.  What the program
    asks for, or a network tells, comes besides."""

    news: bool
    """True if the last refresh changed words, so that the program should look at them soon."""

    @property
    def watched(self) -> Sequence[tuple[str, int]] | None:
        """Area and first word of groups of four words: a refresh changes nothing while these are as the last one left
        them, the network has nothing to tell and `wake_ns` has not come.  None if each refresh has to take place."""

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which the unit's class makes the same unit; plain data, as a journal keeps it."""

    @property
    def settings(self) -> dict[str, Any]:
        """What may be set on the unit while it runs (faults, cable), as plain data; assigning it sets all of it."""

    @settings.setter
    def settings(self, given: dict[str, Any]) -> None: ...

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """Exchange the unit's words once: read what the program set, write what the unit reports.

        `events` are what the network told since the last refresh, `now_ns` is the time of this refresh.  Returns
        what the network has to do.  Raises nothing that a program or a peer could cause."""

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on or unit restart: words to their initial state; returns what closes connections left open."""
