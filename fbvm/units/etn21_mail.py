"""What an ETN21's processor and the network tell each other, as rows in the processor's memory.

The rows are ETN21_Event and ETN21_Request of fblib/omron/etn21/ETN21_Memory.st."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import deepcopy
from struct import Struct

from fbvm.units import etn21_map as at
from fbvm.units.etn21_codes import code_of
from fbvm.units.etn21_data import fetch, store
from fbvm.units.etn21_inbox import Inbox
from fbvm.units.unit import AreaMemory, Processor
from fbvm.wire.link import (
    Bind,
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    SendTo,
    Sent,
)

TCP_PART = 1024  # sends are cut into these, W343 6-1-7 p108
EVENT = Struct("<7H?xI")
"""Kind, channel, error, local port, two words of host, port, whether it was taken, size."""
TAKEN = 14
"""Offset of the last but one."""
REQUEST = Struct("<10HI")
"""Kind, channel, option, local port, two words of host, port, two of data address, size, first number."""
OPENED, FAILED, SENT, RECEIVED, PEER_CLOSED, BROKEN, CLOSED = range(1, 8)
CONNECT, LISTEN, BIND, SEND, SEND_TO, GRANT, CLOSE, STORE = range(1, 9)


def _opened(event: Opened) -> tuple[int, ...]:
    return OPENED, event.channel, 0, event.local_port, *at.words_of(event.remote.host), event.remote.port, 0, 0


def _received(event: Received) -> tuple[int, ...]:
    high, low = at.words_of(event.remote.host)
    return RECEIVED, event.channel, 0, 0, high, low, event.remote.port, 0, len(event.data)


_ROWS: dict[type, Callable[..., tuple[int, ...]]] = {
    Opened: _opened,
    Failed: lambda event: (FAILED, event.channel, code_of(event.error), 0, 0, 0, 0, 0, 0),
    Sent: lambda event: (SENT, event.channel, 0, 0, 0, 0, 0, 0, event.size),
    Received: _received,
    PeerClosed: lambda event: (PEER_CLOSED, event.channel, 0, 0, 0, 0, 0, 0, 0),
    Broken: lambda event: (BROKEN, event.channel, code_of(event.error), 0, 0, 0, 0, 0, 0),
    Closed: lambda event: (CLOSED, event.channel, 0, 0, 0, 0, 0, 0, 0),
}
"""An event as a row."""


class Mail:
    """The two tables of one processor, and what its sockets have received."""

    def __init__(self, processor: Processor, odd_filler: int | None) -> None:
        self.odd_filler = odd_filler
        self._posted = processor.view("ETN21_Posted", "u32")
        self._events = processor.view("ETN21_Events", "u8")
        self._requested = processor.view("ETN21_Requested", "u32")
        self._urgent = processor.view("ETN21_Urgent", "u32")
        self._requests = processor.view("ETN21_Requests", "u8")
        self._most = len(self._events) // EVENT.size
        self._later: list[Event] = []
        """Events for which the table has no room now."""
        self._received: list[tuple[int, Received]] = []
        """What was received in the rows that are posted, with their offsets."""
        self._inboxes: dict[int, Inbox] = {}
        """Of the sockets that were opened at any time."""

    @property
    def waits(self) -> bool:
        """True if there are events that the processor has not taken."""
        return self._posted[0] > 0

    def forget(self) -> None:
        """As after power-on."""
        self._posted[0] = self._requested[0] = self._urgent[0] = 0
        self._later.clear()
        self._received.clear()
        for inbox in self._inboxes.values():
            inbox.forget()

    def take_over(self, other: Mail) -> None:
        """Go on where this one is; the tables are those of a copy of its processor."""
        self._later, self._received = [*other._later], [*other._received]
        self._inboxes = deepcopy(other._inboxes)

    def post(self, events: Iterable[Event]) -> None:
        """Give events to the processor; what does not fit waits for the refresh after, unknown channels are dropped."""
        posted: int = self._posted[0]
        if not posted and self._received:
            self._keep()
        if self._later:
            events, self._later = [*self._later, *events], []
        for event in events:
            if posted == self._most:
                self._later.append(event)
                continue
            if event.channel not in at.SOCKETS:
                continue
            offset = EVENT.size * posted
            EVENT.pack_into(self._events, offset, *_ROWS[type(event)](event))
            if isinstance(event, Received):
                self._received.append((offset, event))
            posted += 1
        self._posted[0] = posted

    def collect(self, memory: AreaMemory) -> list[Request]:
        """After a refresh: what the processor asks of the network; what it asks of the memory is done."""
        if self._received:
            self._keep()
        if self._later:
            self.post(())
        requests: list[Request] = []
        if count := self._requested[0]:
            self._requested[0] = self._urgent[0] = 0
            for row in REQUEST.iter_unpack(self._requests[: REQUEST.size * count]):
                kind, channel, _, _, _, _, _, high, low, size, first = row
                if kind == GRANT:
                    requests.append(Grant(channel, size))
                elif kind == STORE:
                    store(memory, high, low, self._inboxes[channel].take(first, size), self.odd_filler)
                elif kind == SEND:
                    data = fetch(memory, high, low, size)
                    requests += [Send(channel, data[at : at + TCP_PART]) for at in range(0, size, TCP_PART)]
                else:
                    requests.append(self._rare(kind, channel, row, memory))
        return requests

    def _keep(self) -> None:
        """What the processor has taken of what was received."""
        for offset, event in self._received:
            if self._events[offset + TAKEN]:
                self._inboxes[event.channel].add(event.data)
        self._received.clear()

    def _rare(self, kind: int, channel: int, row: tuple[int, ...], memory: AreaMemory) -> Request:
        """What is not asked for in each exchange."""
        if kind == CLOSE:
            return Close(channel, bool(row[2]))
        remote = Peer(at.host_of(row[4], row[5]), row[6])
        if kind == SEND_TO:
            return SendTo(channel, remote, fetch(memory, row[7], row[8], row[9]))
        self._inboxes.setdefault(channel, Inbox()).take(row[10], 0)
        if kind == CONNECT:
            return Connect(channel, remote, row[3], bool(row[2]))
        if kind == LISTEN:
            return Listen(channel, row[3], remote, bool(row[2]))
        return Bind(channel, row[3])
