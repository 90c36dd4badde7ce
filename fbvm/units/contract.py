"""What every emulated unit offers to the machine, and what it may see of the PLC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeGuard, runtime_checkable

from fbvm.base.memory import Snapshot
from fbvm.processor.contract import Contract
from fbvm.wire.fins.frames import Command, Response
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
        """What runs the program as machine code (a `NativeEngine`); None if Python does."""

    @property
    def contract(self) -> Contract:
        """Where the program's variables lie in that memory, and what they are."""

    def view(self, variable: str) -> memoryview:
        """All values of a global variable, writable, in the form that the program declares; structures as bytes."""

    def run(self, now_ns: int) -> None:
        """Executes the program once at `now_ns`, the PLC's time in nanoseconds."""


@dataclass(frozen=True, kw_only=True)
class ExchangedWords:
    """Words of the CPU unit that are copied into a variable of a unit's program before it runs, and back behind it."""

    area: str
    """Of the CPU unit's memory: "CIO", "D", "A" ..."""
    first: int
    """Number of the first word in that area."""
    variable: str
    """Its size says how many words there are."""


@dataclass(frozen=True, kw_only=True)
class Moves:
    """Blocks of received bytes that a program leaves to be moved from its rings into the CPU unit's memory.

    A ring is an array of bytes, a power of two, in which bytes follow one another round and round.  Bytes go into words the
    high byte first."""

    count: str
    """UDINT variable: how many blocks there are.  Whoever has moved them sets it to 0."""
    rows: str
    """Array of structures, a row for each block, with the integer fields that `MOVE_FIELDS` names."""
    rings: str
    """Array of rings."""
    targets: str
    """Array of UDINT, by the subscripts of `areas`: the program is told in it at which byte an area begins."""
    areas: Mapping[int, str]
    """Which areas the program wants to know of."""


MOVE_FIELDS = ("target", "ring", "place", "size", "filler")
"""What a row of `Moves.rows` says to machine code: at which byte of the CPU unit's memory the block's first word lies;
the subscript of the ring; the number of the block's first byte, which counts on from round to round; how many bytes the
block has; the low byte beside an odd last byte, or `KEEP`.  Other fields are the unit's own."""
KEEP = 256
"""A filler that is no byte: what is beside an odd last byte stays."""


@dataclass(frozen=True, kw_only=True)
class Exchanged:
    """What a unit's processor exchanges with the CPU unit in each refresh, by the names of its program's variables."""

    processor: Processor
    words: tuple[ExchangedWords, ...]
    posted: str
    """UDINT variable: how many events of the network wait for the program, which sets it to 0 when it has taken them."""
    urgent: str
    """UDINT variable: how many requests the program has left that cannot wait for the end of a burst."""
    unfinished: tuple[str, ...]
    """UDINT variables: if all are 0 after a run, `finish` has nothing to do."""
    wake: str
    """TIME or LTIME variable: from when on the program wants to run although nothing changed, in the PLC's time."""
    moves: Moves | None = None


class Unit(Protocol):
    """One unit on the backplane.  The machine calls `refresh` once per cycle, in the I/O refresh."""

    name: str
    """Short name with the unit number for charts and messages, such as "ETN21 0"."""

    address: str
    """IPv4 address of the unit, by which it is attached to a network."""

    @property
    def wake_ns(self) -> int:
        """When the unit has something to do by itself, in ns of the PLC's time: 0 for the next refresh, NEVER if nothing is
        timed.  A request of the user's program or an event of the network may come before."""

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


@dataclass(frozen=True)
class UnitState:
    """All that a unit knows at one moment, beside its arguments: the memory of its processor, None if that is not switched on,
    and what it keeps elsewhere."""

    memory: Snapshot | None
    other: tuple[Any, ...]


@runtime_checkable
class ResumableUnit(Unit, Protocol):
    """A unit that can go on from a state it was in, so that a recording of its PLC needs only what the network told it."""

    @property
    def times_set(self) -> int:
        """How often something has been set on it that is in `settings`."""

    @property
    def state(self) -> UnitState:
        """Its state between two scans.  Pages of memory that did not change are shared with the state before."""

    def resume(self, state: UnitState, memory: AreaMemory) -> None:
        """Goes on from a state of a unit with the same arguments, in a PLC with this memory."""


@runtime_checkable
class ProcessorUnit(Unit, Protocol):
    """A unit whose own processor does all of a refresh but what concerns the network.

    The machine may copy the words and run the program itself, between `post` and `finish`."""

    def run_on(self, engine: str) -> None:
        """From now on the program of the unit runs on the engine of this name, that of its PLC; "python" never runs machine
        code."""

    def prepare(self) -> None:
        """Has the unit's program compiled and its code ready, so that no scan waits for that.  The unit's state stays."""

    def exchange(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> bool:
        """The first part of `refresh`: posts the events, copies the words in, runs the program, copies them out.  Returns False
        if none of this was needed; else `finish` comes when the other units have exchanged their words."""

    def move(self, memory: AreaMemory) -> None:
        """The second part of `refresh`: stores the bytes that the program left to be moved into the CPU unit's words."""

    def post(self, events: Sequence[Event]) -> None:
        """Gives events of the network to the next run of the program, behind those that wait already.  If the program has left
        requests, `finish` comes first."""

    def finish(self) -> list[Request]:
        """The requests that the program has left for the network.  To be called at once after a run that left an urgent one,
        else, if the run left any, before events are posted again."""


@dataclass(frozen=True)
class FinsAccess:
    """What commands that reach the CPU unit through a unit may do: write, and change the operating mode."""

    may_write: bool = True
    may_control: bool = True


class CpuUnit(Protocol):
    """The CPU unit as a unit with FINS meets it in peripheral servicing."""

    @property
    def memory(self) -> AreaMemory:
        """The PLC's memory, for the unit's own words."""

    def execute(self, command: Command, access: FinsAccess) -> tuple[int, bytes]:
        """Executes a command for the CPU unit in one piece, between two executions of the program; its end code and data."""

    def take_response(self, response: Response) -> None:
        """Takes the response to a command that a network instruction of the program has sent."""


@runtime_checkable
class FinsUnit(Unit, Protocol):
    """A unit that serves FINS in peripheral servicing, behind the I/O refresh in which it got the network's events."""

    @property
    def has_fins(self) -> bool:
        """True if FINS was asked for: without, no port is opened."""

    @property
    def unit_number(self) -> int:
        """Its number among the CPU bus units."""

    @property
    def node(self) -> int:
        """Its FINS node address."""

    def serve(self, cpu: CpuUnit, now_ns: int) -> list[Request]:
        """Serves the commands that have come, in the order of their arrival; returns what the network has to do."""

    def execute(self, command: Command, cpu: CpuUnit) -> tuple[int, bytes]:
        """Executes a command of this PLC's own program for a unit of the rack; its end code and data."""

    def send(self, command: Command) -> int:
        """Takes a command of a network instruction, which the next `serve` sends from the unit's node.

        Returns an end code, 0000 if it is taken."""


_KINDS: dict[type, tuple[bool, bool]] = {}
"""For each class of units whether it has a processor of its own and whether it serves FINS: Python looks up every name of a
protocol to find out, which takes longer than all else that attaching a unit takes."""


def _kind(unit: Unit) -> tuple[bool, bool]:
    kind = _KINDS.get(type(unit))
    if kind is None:
        kind = _KINDS[type(unit)] = isinstance(unit, ProcessorUnit), isinstance(unit, FinsUnit)
    return kind


def has_processor(unit: Unit) -> TypeGuard[ProcessorUnit]:
    """True for a unit with a processor of its own, switched on or not; units of one class are alike in this."""
    return _kind(unit)[0]


def serves_fins(unit: Unit) -> TypeGuard[FinsUnit]:
    """True for a unit that can serve FINS; units of one class are alike in this."""
    return _kind(unit)[1]
