"""The journal of one PLC: every input of every scan, a line each, so that a run can be done again to the same memory.

Inputs are the time, the events of the network for each unit, memory that was written from outside, forces, changes of
mode, power-on, and settings of units.  Each scan ends with a fingerprint of the memory.  Lines are JSON.
`fbvm.record.recording.journal_replay` executes a journal again.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from functools import lru_cache
from operator import attrgetter
from typing import Any, Protocol, TextIO

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.memory import Memory, compare
from fbvm.wire.link import Broken, Closed, Event, Failed, Opened, Peer, PeerClosed, Received, Sent, read_peer

FORMAT = 1
"""The version of the format that this module writes and reads."""
EVENTS: dict[str, type[Event]] = {
    kind.__name__: kind for kind in (Opened, Failed, Sent, Received, PeerClosed, Broken, Closed)
}
ZERO_PAGE = bytes(PAGE_BYTES)
Writes = tuple[tuple[int, bytes], ...]
"""Bytes written from outside: the offset in the flat memory, and the new bytes."""


class JournalError(ValueError):
    """A file that is no journal or a damaged one; the message names the line and what is wrong with it."""


class Recordable(Protocol):
    """What a journal needs of a unit, to construct it again."""

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which its class makes the same unit."""

    @property
    def settings(self) -> dict[str, Any]:
        """The attributes of the unit that may be changed while it runs."""


# --- what a journal holds ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """The program of a run: fingerprint of its image, cycle, step budget, and `about`, the data that the writer has added."""

    image: str
    cycle_ns: int
    budget: int
    about: dict[str, Any]


@dataclass(frozen=True)
class Act:
    """A change of the PLC between scans: "mode" with its name, "start" with "warm" or "cold", "unit" with a unit's class
    and configuration.  `writes` were made before it."""

    what: str
    value: Any
    writes: Writes = ()


@dataclass(frozen=True)
class Scan:
    """One scan with its inputs, in the order in which they are applied: settings, forces, writes, time, events."""

    number: int
    now_ns: int
    fingerprint: str
    writes: Writes = ()
    forced: dict[str, Any] = field(default_factory=dict)
    unforced: tuple[str, ...] = ()
    settings: dict[int, dict[str, Any]] = field(default_factory=dict)
    events: dict[int, tuple[Event, ...]] = field(default_factory=dict)
    budget: int | None = None
    watch: tuple[int, int] | None = None
    """For a scan that took longer than the watch cycle time: the steps that it had charged, and that time in ns."""


@dataclass(frozen=True)
class End:
    """The end of a journal that was closed, with the number of its scans.  A journal without it was cut off."""

    scans: int


Entry = Header | Act | Scan | End


class Fingerprint:
    """The changes of a memory since the last call, and a checksum over its whole history."""

    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self._known = self._settled = memory.snapshot()
        self._sum = 0

    def changes(self) -> Writes:
        """The bytes that have changed since the last call of `changes` or `settle`."""
        now = self._memory.snapshot()
        runs = compare(self._known, now)
        self._known = now
        return tuple((offset, bytes(self._memory.u8[offset : offset + size])) for offset, size in runs)

    def settle(self) -> str:
        """The checksum of the memory and of all its former contents, in hexadecimal."""
        now = self._memory.snapshot()
        for number, (old, new) in enumerate(zip(self._settled.pages, now.pages, strict=True)):
            if old is not new and old != new:
                self._sum = zlib.crc32(new or ZERO_PAGE, zlib.crc32(b"%d" % number, self._sum))
        self._known = self._settled = now
        return f"{self._sum:08x}"


# --- writing ----------------------------------------------------------------------------------------------------------


class Journal:
    """Writes a journal to a text file while a PLC runs: `Plc(image, journal=Journal(file))`.

    `about` is data for readers, which JSON can write.  `close` ends the journal, not the file."""

    def __init__(self, file: TextIO, about: Mapping[str, Any] | None = None) -> None:
        self._file = file
        self._about = dict(about or {})
        self._units: list[tuple[Recordable, dict[str, Any]]] = []
        self._forces: dict[str, Any] = {}
        self._remarks: list[str] = []
        self._line: dict[str, Any] = {}
        self._scans = 0
        self._budget: int
        self._fingerprint: Fingerprint

    # Called by the PLC.

    def begin(self, image: str, cycle_ns: int, budget: int, memory: Memory) -> None:
        """Writes the header for a PLC at power-on."""
        self._fingerprint, self._budget = Fingerprint(memory), budget
        self._write({"journal": FORMAT, "image": image, "cycle_ns": cycle_ns, "budget": budget, "about": self._about})

    def remark(self, text: str) -> None:
        """Adds a text for people who read the journal to the next line."""
        self._remarks.append(text)

    @contextmanager
    def acting(self, what: str, value: object) -> Iterator[None]:
        """Writes an `Act` that is carried out in the `with` block; its changes of memory are not written."""
        line = {what: value, **self._outside()}
        yield
        self._settle()
        self._write(line)

    def unit(self, unit: Recordable) -> dict[str, Any]:
        """The class, configuration and settings of a new unit, for an `Act`.  Raises TypeError if it has no configuration."""
        try:
            described = {"class": type(unit).__name__, "with": unit.configuration, "settings": unit.settings}
            self._units.append((unit, unit.settings))
        except AttributeError:
            raise TypeError(f"{type(unit).__name__} has no configuration to be written to a journal") from None
        return described

    def before(self, number: int, now_ns: int, budget: int, forces: Mapping[str, Any]) -> None:
        """Starts the line of a scan; called before the scan."""
        line: dict[str, Any] = {"scan": number, "now_ns": now_ns, **self._outside()}
        if budget != self._budget:
            line["budget"] = self._budget = budget
        changed = {name: value for name, value in forces.items() if self._forces.get(name, ...) is not value}
        gone = [name for name in self._forces if name not in forces]
        settings = {str(at): now for at, (unit, was) in enumerate(self._units) if (now := unit.settings) != was}
        for key, found in (("force", changed), ("unforce", gone), ("settings", settings)):
            if found:
                line[key] = found
        self._forces = dict(forces)
        self._line = line

    def told(self, unit: int, events: Sequence[Event]) -> None:
        """Adds the events of the network for a unit to the line of the scan."""
        if events:
            self._line.setdefault("events", {})[str(unit)] = [from_event(event) for event in events]

    def after(self, watch: tuple[int, int] | None = None) -> None:
        """Writes the line of a scan; called after the scan.  `watch` is that of `Scan`."""
        if watch is not None:
            self._line["watch"] = watch
        self._scans += 1
        self._write({**self._line, "memory": self._settle()})

    def close(self) -> None:
        """Writes the end of the journal and flushes the file."""
        self._write({"end": self._scans})
        self._file.flush()

    def _settle(self) -> str:
        self._units = [(unit, unit.settings) for unit, _ in self._units]
        return self._fingerprint.settle()

    def _outside(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        if self._remarks:
            found["by"], self._remarks = self._remarks, []
        if writes := self._fingerprint.changes():
            found["write"] = [[offset, data.hex()] for offset, data in writes]
        return found

    def _write(self, line: dict[str, Any]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":"), ensure_ascii=False) + "\n")


# --- reading ----------------------------------------------------------------------------------------------------------


def open_journal(lines: Iterable[str]) -> tuple[Header, Iterator[Entry]]:
    """The header of a journal and, one after the other, its entries.

    `lines` are the lines of the file.  Raises JournalError for a damaged line, when it is read.  An incomplete last line,
    which a killed run leaves, is left out."""
    entries = _read(lines)
    header = next(entries)
    assert isinstance(header, Header)
    return header, entries


def _read(lines: Iterable[str]) -> Iterator[Entry]:
    number, scans = 0, 0
    for number, text in enumerate(lines, 1):
        if not text.endswith("\n") and number > 1:
            return
        try:
            entry = _entry(json.loads(text))
            _check_order(entry, number == 1, scans)
        except json.JSONDecodeError as error:
            raise JournalError(f"line {number}: {error.msg} at column {error.colno}") from None
        except KeyError as error:
            raise JournalError(f"line {number}: {error} is missing") from None
        except (ArithmeticError, TypeError, ValueError, AttributeError, RecursionError) as error:
            raise JournalError(f"line {number}: {error}") from None
        scans += isinstance(entry, Scan)
        yield entry
        if isinstance(entry, End):
            return
    if not number:
        raise JournalError("the file is empty")


def _check_order(entry: Entry, first: bool, scans: int) -> None:
    if isinstance(entry, Header) != first:
        raise ValueError("no journal of fbvm: it begins without a header" if first else "a second header")
    told = entry.number if isinstance(entry, Scan) else entry.scans if isinstance(entry, End) else scans
    if told != scans:
        raise ValueError(f"scan {told} where {scans} should be: lines are missing, or not in their order")


def _entry(line: dict[str, Any]) -> Entry:
    """The entry of one line.  Raises errors of several classes for a line of another form."""
    if not isinstance(line, dict):
        raise TypeError("no entry of a journal")
    if "journal" in line:
        if line["journal"] != FORMAT:
            raise ValueError(f"a journal of format {line['journal']}; this version of fbvm reads format {FORMAT}")
        return Header(str(line["image"]), int(line["cycle_ns"]), int(line["budget"]), dict(line["about"]))
    if "end" in line:
        return End(int(line["end"]))
    writes = tuple((int(offset), bytes.fromhex(data)) for offset, data in line.get("write", ()))
    if "scan" in line:
        return Scan(
            int(line["scan"]), int(line["now_ns"]), str(line["memory"]), writes,
            dict(line.get("force", {})), tuple(map(str, line.get("unforce", ()))),
            {int(unit): dict(given) for unit, given in line.get("settings", {}).items()},
            {int(unit): tuple(map(to_event, told)) for unit, told in line.get("events", {}).items()},
            int(line["budget"]) if "budget" in line else None,
            _watch(*line["watch"]) if "watch" in line else None,
        )  # fmt: skip
    for what in ("mode", "start", "unit"):
        if what in line:
            return Act(what, line[what], writes)
    raise ValueError("no entry of a journal")


def _watch(steps: int, watch_ns: int) -> tuple[int, int]:
    return int(steps), int(watch_ns)


def from_event(event: Event) -> list[Any]:
    """An event as plain data, `["Received", 1, "0A0B", "192.168.250.1:502"]`: the class, then its fields in order."""
    kind = type(event)
    return [kind.__name__, *map(_plain, _VALUES[kind](event))]


def _values(kind: type[Event]) -> Callable[[Event], Iterable[Any]]:
    """A function that gives the values of the fields of such an event, in order."""
    names = [row.name for row in fields(kind)]
    get = attrgetter(*names)
    return get if len(names) > 1 else lambda event: (get(event),)


_VALUES = {kind: _values(kind) for kind in EVENTS.values()}


def _plain(value: int | str | bytes | Peer) -> int | str:
    return value.hex() if isinstance(value, bytes) else str(value) if isinstance(value, Peer) else value


def to_event(told: list[Any]) -> Event:
    """The event that `from_event` was given.  Raises ValueError, TypeError, LookupError or AttributeError for other data."""
    kind, *values = told
    readers = _READERS.get(kind)
    if readers is None or len(values) != len(readers):
        raise ValueError(f"{kind!r} with {len(values)} values is no event")
    return EVENTS[kind](*[read(value) for read, value in zip(readers, values, strict=True)])


@lru_cache
def _peer(text: str) -> Peer:
    host, _, port = text.rpartition(":")
    return read_peer(host, int(port))


_READ: dict[str, Callable[[Any], Any]] = {"int": int, "str": str, "bytes": bytes.fromhex, "Peer": _peer}
"""From JSON to the type of a field."""
_READERS = {name: tuple(_READ[str(row.type)] for row in fields(kind)) for name, kind in EVENTS.items()}
