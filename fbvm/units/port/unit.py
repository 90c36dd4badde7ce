"""A unit that programs meet through a mailbox: what all vendors' units do, over a table of what one of them is.

The unit moves bytes between its network and the lines of the mailbox, and shows in the head of the mailbox what its table says.
It knows no protocol.  The words are those that the vendor's library in `fblib/` declares."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, ClassVar, cast

from fbvm.base.areas import NEVER
from fbvm.units.addresses import words_of
from fbvm.units.contract import AreaMemory
from fbvm.units.front import Front, Lamp
from fbvm.units.port.port import Port
from fbvm.units.port.words import mailbox
from fbvm.wire.link import Broken, Close, Connect, Event, Failed, Opened, PeerClosed, Received, Request, Send

INCOMING, OUTGOING, FAILING = {Opened, Received, PeerClosed}, {Connect, Send, Close}, (Failed, Broken)
"""Events and requests that are traffic, and events that have an error."""
Values = int | tuple[int, ...]
"""A number for a word, or numbers for several words in a row."""
Head = Mapping[str, Callable[[Any], Values | str]]
"""What words of the head show, by their names in the library, each worked out for a unit: numbers, or a name of the word's
enumeration."""


@dataclass(slots=True)
class Traffic:
    """What passed between a unit and its network in one refresh."""

    received: int
    """Connections, data and ends of connections that came."""
    sent: int
    """Connections, data and ends of connections that went out."""
    errors: Sequence[str]
    """POSIX errno names of what failed."""


@dataclass(frozen=True, kw_only=True)
class Restart:
    """How a unit restarts when its program asks for it."""

    asked: str
    """The word that is not 0 if the program asks for it; the unit clears it."""
    count: str
    """The counter of restarts, which goes on."""
    restores: Head
    """Words that are then as at power-on."""
    lasts_ns: Callable[[Any], int]


@dataclass(frozen=True, kw_only=True)
class Table:
    """What a vendor's unit is, beside the words that its library declares.  A function takes the unit."""

    name: str
    """For charts and messages; `{unit.…}` stands for an argument of the unit."""
    area: str
    """The mailbox, as `library.toml` calls it."""
    block: str
    """A function block of the library."""
    lines: str
    """The library's variable with the lines."""
    libraries: tuple[Path, ...] = ()
    """Folders of libraries beside `fblib/` in which the block may be."""
    number: Callable[[Any], int] = lambda unit: 1
    """By which number a line names the unit."""
    head: str = ""
    """What stands before the names of words of the unit's own head; `{number}` stands for the unit's number."""
    begins: Head = field(default_factory=dict)
    """Words that are written at power-on, and later by whoever may."""
    shows: Head = field(default_factory=dict)
    """Words that show something in each refresh.  The first is not 0 while the unit is there."""
    counts: Mapping[str, Callable[[Any, Traffic], int]] = field(default_factory=dict)
    """Counters of 32 bits, the low word first, and how much traffic adds to each."""
    counters: Sequence[str] = ()
    """All counters of the head, also those that nothing is added to."""
    restart: Restart | None = None
    serves: Callable[[Any], bool] = lambda unit: True
    """False while the unit does nothing about connections."""
    errors: Mapping[str, int] = field(default_factory=dict)
    """The unit's numbers for POSIX errno names."""
    other_error: int = 1
    """The number of an error that it does not know."""
    settings: Mapping[str, Callable[[Any], str]] = field(default_factory=dict)
    """What stands on the unit's front, by its name."""
    lamps: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    """Its lamps: the word of the head and the bits of it that each shows."""
    told: Mapping[str, str] = field(default_factory=dict)
    """Counters that are told to people, by what they count."""
    refusals: Sequence[tuple[Callable[[Any], bool], str]] = ()
    """When an argument of the unit is wrong, and what is said then."""


class MailboxUnit:
    """Base of the units of all vendors, which are dataclasses: their fields are the unit's arguments; those that `__init__`
    does not take are booleans that may be set while the unit runs.

    Raises ValueError for a wrong argument."""

    table: ClassVar[Table]
    address: str
    watched = None
    """Its mailbox is looked at in each refresh."""
    exchanged = None
    """It has no processor of its own."""

    def __post_init__(self) -> None:
        table = self.table
        for is_wrong, said in table.refusals:
            if is_wrong(self):
                raise ValueError(said.format(unit=self))
        self.name = table.name.format(unit=self)
        self.wake_ns = NEVER
        self.changed_words = False
        self.own_ip = words_of(self.address)
        self._ready_ns: int | None = None
        """When a restart ends."""
        self._area, self._serves = table.area, table.serves
        self._mailbox = mailbox(table.block, table.area, table.lines, table.libraries)
        number = table.number(self)
        self._port = Port(number, self._mailbox.lines, lambda error: table.errors.get(error, table.other_error))
        self._prefix = table.head.format(number=number)
        first, size = self._mailbox.word(self._prefix) if self._prefix else (0, self._mailbox.head_words)
        self._own_head = slice(first, first + size)
        self._begins, self._shows = self._placed(table.begins), self._placed(table.shows)
        self._counts = [(self._word(name), added) for name, added in table.counts.items()]
        self._restart_asked = self._word(table.restart.asked) if table.restart else None
        """The word by which the program asks for a restart."""
        self._settings = tuple(each.name for each in fields(self) if not each.init)  # type: ignore[arg-type]
        self._settings_now: Callable[[MailboxUnit], object] = attrgetter(*self._settings or ("address",))
        """Takes the unit; says how it is set."""
        self._before = b""
        """The unit's head as the last refresh left it."""
        self._seen = b""
        """The mailbox as the last refresh left it."""
        self._seen_settings: object = None
        """The settings that it knew."""

    @property
    def is_restarting(self) -> bool:
        """True from a restart until the unit is there again."""
        return self._ready_ns is not None

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which the class makes the same unit."""
        return {each.name: getattr(self, each.name) for each in fields(self) if each.init}  # type: ignore[arg-type]

    @property
    def settings(self) -> dict[str, Any]:
        """What may be set on the unit while it runs, as plain data."""
        return {name: getattr(self, name) for name in self._settings}

    @settings.setter
    def settings(self, given: dict[str, Any]) -> None:
        for name in self._settings:
            setattr(self, name, bool(given[name]))

    def front(self, memory: AreaMemory) -> Front:
        """What it shows, as the words in `memory` tell it."""
        table = self.table
        settings = tuple((name, said(self)) for name, said in table.settings.items())
        try:
            words = memory.words(self._area)
        except KeyError:
            return Front(settings=(*settings, ("mailbox", f"no block of this program uses {self._area}")))
        lamps = [(name, bool(words[self._word(word)] & bits)) for name, (word, bits) in table.lamps.items()]
        names = {number: error for error, number in table.errors.items()}
        return Front(
            settings=(*settings, *((name, str(_counter(words, self._word(word)))) for name, word in table.told.items())),
            lamps=tuple(Lamp(name, is_on, "on" if is_on else "off") for name, is_on in lamps),
            sockets=tuple(self._port.sockets(words, names)),
            restart=(self._variable(table.restart.asked), "1") if table.restart else None)  # fmt: skip

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on: the head as the table says, counters 0, connections broken by RST."""
        try:
            words = memory.words(self._area)
        except KeyError:
            words = None
        requests = self._port.reset(words)
        self._ready_ns, self._before, self._seen = None, b"", b""
        self.wake_ns = 0 if words else NEVER
        if words:
            for number in range(self._own_head.start, self._own_head.stop):
                words[number] = 0
            self._show(words)
        return requests

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh: restart, head, connections, counters.  A PLC whose program has no mailbox leaves the unit idle."""
        try:
            words = memory.words(self._area)
        except KeyError:
            return []
        before, settings = words.tobytes(), self._settings_now(self)
        if not events and before == self._seen and settings == self._seen_settings and (
                self._ready_ns is None or now_ns < self._ready_ns):
            self.wake_ns, self.changed_words = self._next_ns(), False
            return []
        if self._ready_ns is not None or self._restart_asked is not None and words[self._restart_asked]:
            self._go_on_with_restart(words, now_ns)
        self._show(words)
        self._port.take(words, events)
        requests = self._port.exchange(words) if self._serves(self) else self._port.reset(words)
        self._count(words, events, requests)
        if self._begins:
            self._before = words[self._own_head].tobytes()
        self._seen, self._seen_settings = words.tobytes(), settings
        self.wake_ns, self.changed_words = self._next_ns(), self._seen != before
        return requests

    def _next_ns(self) -> int:
        """When something happens by itself."""
        return NEVER if self._ready_ns is None else self._ready_ns

    def _go_on_with_restart(self, words: memoryview, now_ns: int) -> None:
        """A restart begins if the program asks for one, or ends when its time is over.  Counters begin anew but for that of
        restarts (assumed)."""
        restart = self.table.restart
        if restart and words[self._word(restart.asked)]:
            words[self._word(restart.asked)] = 0
            count = self._word(restart.count)
            restarts = _counter(words, count)
            for name in self.table.counters:
                _set_counter(words, self._word(name), 0)
            _set_counter(words, count, restarts + 1)
            self._write(words, self._placed(restart.restores))
            self._ready_ns = now_ns + restart.lasts_ns(self)
        elif self._ready_ns is not None and now_ns >= self._ready_ns:
            self._ready_ns = None

    def _show(self, words: memoryview) -> None:
        """What the head says of the unit.  A mode change clears the mailbox, but not what the unit knows."""
        if not words[self._shows[0][0]]:
            if self._before:
                words[self._own_head] = memoryview(self._before).cast("H")
            else:
                self._write(words, self._begins)
        self._write(words, self._shows)

    def _count(self, words: memoryview, events: Sequence[Event], requests: Sequence[Request]) -> None:
        """Adds to the counters what came over the wire and what goes out."""
        if not self._counts or not events and not requests:
            return
        traffic = Traffic(
            len([event for event in events if type(event) in INCOMING]),
            len([request for request in requests if type(request) in OUTGOING]),
            [event.error for event in events if isinstance(event, FAILING)] if events else ())  # fmt: skip
        for word, added in self._counts:
            if more := added(self, traffic):
                _set_counter(words, word, _counter(words, word) + more)

    # --- words of the head by their names --------------------------------------------------------------------------------

    def _variable(self, name: str) -> str:
        return f"{self._prefix}.{name}" if self._prefix else name

    def _word(self, name: str) -> int:
        return self._mailbox.word(self._variable(name))[0]

    def _placed(self, head: Head) -> list[tuple[int, Callable[[Any], Values]]]:
        """The words of a table by their numbers; what names a value of an enumeration is made to say its number."""
        return [(self._word(name), self._numbered(name, shown)) for name, shown in head.items()]

    def _numbered(self, name: str, shown: Callable[[Any], Values | str]) -> Callable[[Any], Values]:
        if not isinstance(shown(self), str):
            return cast(Callable[[Any], Values], shown)
        number = cache(self._mailbox.enumeration(self._variable(name)).__getitem__)
        return lambda unit: number(str(shown(unit)))

    def _write(self, words: memoryview, placed: Sequence[tuple[int, Callable[[Any], Values]]]) -> None:
        for word, shown in placed:
            value = shown(self)
            if isinstance(value, tuple):
                for number, each in enumerate(value, word):
                    words[number] = each
            else:
                words[word] = value


def _counter(words: memoryview, word: int) -> int:
    return words[word] | words[word + 1] << 16


def _set_counter(words: memoryview, word: int, value: int) -> None:
    words[word], words[word + 1] = value & 0xFFFF, value >> 16 & 0xFFFF
