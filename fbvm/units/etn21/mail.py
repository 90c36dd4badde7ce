"""What an ETN21's processor and the network tell each other, as rows in the processor's memory.

The rows are ETN21_Event, ETN21_Request and ETN21_Move of fblib/omron/etn21/ETN21_Memory.st."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from struct import Struct

from fbvm.units.contract import AreaMemory, Processor
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.codes import code_of
from fbvm.units.etn21.data import fetch, store
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
EVENT = Struct("<7H2xII")
"""Kind, channel, error, local port, two words of host, port, size, the place behind the last byte that was received."""
REQUEST = Struct("<10H")
"""Kind, channel, option, local port, two words of host, port, two of data address, size."""
MOVE = Struct("<3I4H")
"""Target, ring, place, size, filler, two words of data address."""
COUNTER = 0xFFFF_FFFF
"""Places begin again after this."""
KEEP = 256
"""In place of a filler: what is there stays."""
RING_BYTES = 0x8000
"""Of each socket; a power of two."""
LARGEST = 9016
"""Bytes that a socket keeps at most, those of datagrams (W343 6-1-9 p111)."""
OPENED, FAILED, SENT, RECEIVED, PEER_CLOSED, BROKEN, CLOSED = range(1, 8)
CONNECT, LISTEN, BIND, SEND, SEND_TO, GRANT, CLOSE = range(1, 8)


def _opened(event: Opened) -> tuple[int, ...]:
    return OPENED, event.channel, 0, event.local_port, *at.words_of(event.remote.host), event.remote.port, 0


def _received(event: Received) -> tuple[int, ...]:
    high, low = at.words_of(event.remote.host)
    return RECEIVED, event.channel, 0, 0, high, low, event.remote.port, len(event.data)


_ROWS: dict[type, Callable[..., tuple[int, ...]]] = {
    Opened: _opened,
    Failed: lambda event: (FAILED, event.channel, code_of(event.error), 0, 0, 0, 0, 0),
    Sent: lambda event: (SENT, event.channel, 0, 0, 0, 0, 0, event.size),
    Received: _received,
    PeerClosed: lambda event: (PEER_CLOSED, event.channel, 0, 0, 0, 0, 0, 0),
    Broken: lambda event: (BROKEN, event.channel, code_of(event.error), 0, 0, 0, 0, 0),
    Closed: lambda event: (CLOSED, event.channel, 0, 0, 0, 0, 0, 0),
}
"""An event as a row."""


class Mail:
    """The tables of one processor, and the rings in which its sockets have what they received."""

    def __init__(self, processor: Processor, odd_filler: int | None) -> None:
        self._posted = processor.view("ETN21_Posted", "u32")
        self._behind = processor.view("ETN21_Behind", "u32")
        self._events = processor.view("ETN21_Events", "u8")
        self._requested = processor.view("ETN21_Requested", "u32")
        self._urgent = processor.view("ETN21_Urgent", "u32")
        self._requests = processor.view("ETN21_Requests", "u8")
        self._moved = processor.view("ETN21_Moved", "u32")
        self._moves = processor.view("ETN21_Moves", "u8")
        self._rings, self._rings_at = processor.beside, processor.beside_at
        processor.view("ETN21_Rings", "u32")[0] = self._rings_at
        processor.view("ETN21_Filler", "u16")[0] = KEEP if odd_filler is None else odd_filler
        self._most = len(self._events) // EVENT.size
        self._later: list[Event] = []
        """Events for which there is no room now."""
        self._ends = processor.view("ETN21_Ends", "u32")
        """Of what each socket has kept: the places behind the last bytes in their rings."""
        self._fresh: dict[int, int] = {}
        """How many bytes of the rows that are posted lie behind these, by socket."""

    @property
    def waits(self) -> bool:
        """True if there are events that the processor has not taken."""
        return self._posted[0] > 0

    def forget(self) -> None:
        """As after power-on."""
        self._posted[0] = self._requested[0] = self._urgent[0] = self._moved[0] = 0
        self._later.clear()
        self._behind[0] = 0

    def take_over(self, other: Mail) -> None:
        """Go on where this one is; the tables and rings are those of a copy of its processor."""
        self._later, self._fresh = [*other._later], {**other._fresh}

    def post(self, events: Iterable[Event]) -> None:
        """Give events to the processor; what does not fit waits for the refresh after, unknown channels are dropped."""
        posted: int = self._posted[0]
        if not posted:  # what the program has not kept gives way to the next
            self._fresh.clear()
        if self._later:
            events, self._later = [*self._later, *events], []
            self._behind[0] = 0
        for event in events:
            if posted == self._most:
                self._later.append(event)
                self._behind[0] = 1
                continue
            channel, place = event.channel, 0
            if channel not in at.SOCKETS:
                continue
            if isinstance(event, Received):
                place = self._keep(channel, event.data)
                if place < 0:
                    continue
            EVENT.pack_into(self._events, EVENT.size * posted, *_ROWS[type(event)](event), place)
            posted += 1
        self._posted[0] = posted

    def _keep(self, channel: int, data: bytes) -> int:
        """Put bytes into the ring of a socket; the place behind them, or -1: they are lost, and are more than it would keep.

        In the ring there may be a full buffer and, if it is not stored yet, what the last receive was handed."""
        fresh, size = self._fresh.get(channel, 0), len(data)
        if fresh + size > RING_BYTES - 2 * LARGEST:
            return -1
        self._fresh[channel] = fresh + size
        place = self._ends[channel - 1] + fresh
        begin = RING_BYTES * (channel - 1) + (place & RING_BYTES - 1)
        if (over := (place & RING_BYTES - 1) + size - RING_BYTES) <= 0:
            self._rings[begin : begin + size] = data
        else:
            ring = RING_BYTES * channel
            self._rings[begin:ring] = data[: size - over]
            self._rings[ring - RING_BYTES : ring - RING_BYTES + over] = data[size - over :]
        return place + size & COUNTER

    def collect(self, memory: AreaMemory) -> list[Request]:
        """After a refresh: what the processor asks of the network."""
        if self._later:
            self.post(())
        requests: list[Request] = []
        if count := self._requested[0]:
            self._requested[0] = self._urgent[0] = 0
            for row in REQUEST.iter_unpack(self._requests[: REQUEST.size * count]):
                kind, channel, _, _, _, _, _, high, low, size = row
                if kind == GRANT:
                    requests.append(Grant(channel, size))
                elif kind == SEND:
                    data = fetch(memory, high, low, size)
                    if size <= TCP_PART:
                        requests.append(Send(channel, data))
                    else:
                        requests += [Send(channel, data[at : at + TCP_PART]) for at in range(0, size, TCP_PART)]
                else:
                    requests.append(_rare(kind, channel, row, memory))
        return requests

    def move(self, memory: AreaMemory) -> None:
        """What was received goes to PLC memory, if that has not been done yet."""
        if not self._moved[0]:
            return
        for _, ring, place, size, filler, high, low in MOVE.iter_unpack(self._moves[: MOVE.size * self._moved[0]]):
            first, begin = ring - self._rings_at, place & RING_BYTES - 1
            data = bytes(self._rings[first + begin : first + min(begin + size, RING_BYTES)])
            data += bytes(self._rings[first : first + size - len(data)])
            store(memory, high, low, data, None if filler == KEEP else filler)
        self._moved[0] = 0


def _rare(kind: int, channel: int, row: tuple[int, ...], memory: AreaMemory) -> Request:
    """What is not asked for in each exchange."""
    if kind == CLOSE:
        return Close(channel, bool(row[2]))
    remote = Peer(at.host_of(row[4], row[5]), row[6])
    if kind == SEND_TO:
        return SendTo(channel, remote, fetch(memory, row[7], row[8], row[9]))
    if kind == CONNECT:
        return Connect(channel, remote, row[3], bool(row[2]))
    if kind == LISTEN:
        return Listen(channel, row[3], remote, bool(row[2]))
    return Bind(channel, row[3])
