"""What every emulated unit offers to the machine, and what it may see of the PLC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from fbvm.wire.link import Event, Request


class AreaMemory(Protocol):
    """The part of a PLC's memory that a unit exchanges: whole areas as 16-bit words."""

    def words(self, area: str) -> memoryview:
        """The words of an area ("CIO", "D", "W", "H", "A", "E0" ...) as a writable memoryview of format "H".

        Raises KeyError for an area that this PLC does not have."""


class Processor(Protocol):
    """A unit's own processor: runs the unit's program over a memory of its own."""

    @property
    def machine(self) -> Any:
        """What runs it as machine code (a `NativeEngine`), or None."""

    @property
    def beside(self) -> memoryview:
        """Bytes of its memory that its program does not use."""

    @property
    def beside_at(self) -> int:
        """Where these begin, in bytes."""

    def view(self, variable: str, machine: str) -> memoryview:
        """A global variable of the program as a writable memoryview of a machine type (u8, u16, i64 ...)."""

    def offset(self, variable: str) -> int:
        """Where the variable lies in that memory, in bytes."""

    def run(self, now_ns: int) -> None:
        """One execution of the program."""


@dataclass(frozen=True)
class Moves:
    """Blocks of bytes that a processor leaves to be moved into the CPU unit's memory, the high byte of a word first."""

    count: str
    """UDINT variable: how many there are; whoever has moved them sets it 0."""
    rows: str
    """Variable with a row for each, in 32 bits: offset of the first word in the CPU unit's memory, offset of a ring in the
    processor's, place of the first byte in it; in 16 bits: how many bytes, the low byte beside an odd last one (above 255:
    what is there stays), and two words that only the unit knows."""
    ring_bytes: int
    """Places in a ring begin again after so many, a power of two."""
    targets: tuple[str, Mapping[int, str]]
    """Variable that wants to know the offsets of areas in the CPU unit's memory, and which it wants by index."""


@dataclass(frozen=True)
class Exchanged:
    """Words that a unit's processor exchanges with the CPU unit in each refresh, and where it says what it wants."""

    processor: Processor
    words: tuple[tuple[str, int, str, int], ...]
    """Area, first word, variable of the processor's program, how many words."""
    posted: str
    """UDINT variable: how many events of the network wait for the program, which sets it 0 when it took them."""
    requested: str
    """UDINT variable: how many requests that cannot wait for the end of a burst it has left."""
    left: tuple[str, ...]
    """UDINT variables: if all are 0 after a run, `finish` has nothing to do."""
    wake: str
    """64-bit variable: time in ns (of the PLC) from which on the program wants to run although nothing changed."""
    moves: Moves | None = None


class Unit(Protocol):
    """One unit on the backplane.  The machine calls `refresh` once per cycle, in the I/O refresh."""

    name: str
    """Short name with the unit number for charts and messages, such as "ETN21 0"."""

    address: str
    """IPv4 address of the unit, by which it is attached to a network."""

    @property
    def wake_ns(self) -> int:
        """When the unit has something to do by itself: 0 in the next refresh, far away if nothing is timed.  What the
        program asks for, or a network tells, comes besides."""

    @property
    def changed_words(self) -> bool:
        """True if the last refresh changed words, so that the program should look at them soon."""

    @property
    def watched(self) -> Sequence[tuple[str, int]] | None:
        """Area and first word of groups of four words: a refresh changes nothing while these are as the last one left
        them, the network has nothing to tell and `wake_ns` has not come.  None if each refresh has to take place."""

    @property
    def exchanged(self) -> Exchanged | None:
        """How the words of a unit with a processor of its own (a `ProcessorUnit`) are exchanged; None for any other."""

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


@runtime_checkable
class ProcessorUnit(Unit, Protocol):
    """A unit of which a processor of its own does all that a refresh does, but for what a network has to know.

    The machine may copy the words and run the program itself, between `post` and `finish`."""

    def exchange(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> bool:
        """The first part of `refresh`: posts the events, copies the words in, runs, copies them out.  False if nothing of
        this was needed; else `finish` comes after the other units have exchanged their words."""

    def move(self, memory: AreaMemory) -> None:
        """The second part of `refresh`: has moved what the program left to be moved."""

    def post(self, events: Sequence[Event]) -> None:
        """Events of the network for the next run of its program, behind those that wait already.  If it has left something,
        `finish` comes before."""

    def finish(self) -> list[Request]:
        """After a run of the program: what the network has to do.  At once if it requested something, else if something is
        left, at the latest before something is posted."""
