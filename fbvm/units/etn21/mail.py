"""What an ETN21's program and the network tell each other, as rows in the memory of the unit's processor.

Rows, their fields and the numbers of what they say are declared in fblib/omron/etn21/ETN21_Memory.st.  This module says by
their names what an event becomes there, and which request a row is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from fbvm.processor.contract import Contract, Packer, Rows, Unpacker
from fbvm.units.addresses import host_of, words_of
from fbvm.units.contract import KEEP, MOVE_FIELDS, AreaMemory, Processor
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.codes import code_of
from fbvm.units.etn21.data import fetch, store
from fbvm.wire.link import (
    NOBODY,
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

COUNTER = 0xFFFF_FFFF
"""Places in a ring begin again after this: they are UDINT."""
Values = Callable[[Any], tuple[int, ...]]
"""Takes an event; the values of fields of its row."""


@dataclass(frozen=True)
class EventRow:
    """What an event is in ETN21_Events: its name among the program's ETN21_Told, and what goes into which fields."""

    kind: str
    fields: tuple[str, ...] = ()
    values: Values = lambda event: ()


def _opened(event: Opened) -> tuple[int, ...]:
    return event.local_port, *words_of(event.remote.host), event.remote.port


EVENTS: Mapping[type, EventRow] = {
    Opened: EventRow("opened", ("local_port", "host[0]", "host[1]", "port"), _opened),
    Failed: EventRow("failed", ("error",), lambda event: (code_of(event.error),)),
    Sent: EventRow("sent", ("size",)),
    Received: EventRow("received", ("host[0]", "host[1]", "port", "size", "place")),  # of a connection without the first three
    PeerClosed: EventRow("peer_closed"),
    Broken: EventRow("broken", ("error",), lambda event: (code_of(event.error),)),
    Closed: EventRow("closed"),
}
"""`Mail.post` finds the values of Sent and Received itself, because exchanges consist of them."""
NOTHING = "nothing"
"""The kind of a row that says nothing."""
EVERY_EVENT = ("kind", "channel")
"""Fields that each event fills; those that it does not name are 0."""
REQUEST_FIELDS = ("kind", "channel", "option", "local_port", "host[0]", "host[1]", "port", "data_address[0]", "data_address[1]",
                  "size")  # fmt: skip
"""Of a row of ETN21_Requests, for what is asked for rarely."""
SEND_FIELDS = ("kind", "channel", "data_address[0]", "data_address[1]", "size")
"""Those of them that exchanges consist of, in the order in which `Mail.collect` takes them."""
Row = Mapping[str, int]
RARE_REQUESTS: Mapping[str, Callable[[Row, AreaMemory], Request]] = {
    "connect": lambda row, memory: Connect(row["channel"], _remote(row), row["local_port"], bool(row["option"])),
    "listen": lambda row, memory: Listen(row["channel"], row["local_port"], _remote(row), bool(row["option"])),
    "bind": lambda row, memory: Bind(row["channel"], row["local_port"]),
    "send_to": lambda row, memory: SendTo(row["channel"], _remote(row), _data(row, memory)),
    "close": lambda row, memory: Close(row["channel"], bool(row["option"])),
}
"""What is not asked for in each exchange, by its name among the program's ETN21_Asked."""
SEND, GRANT = "send", "grant"
"""What `Mail.collect` does itself, because exchanges consist of it."""
MOVE = ("ring", "place", "size", "filler", "data_address[0]", "data_address[1]")
"""Fields of a row of ETN21_Moves that `Mail.move` takes; machine code takes `MOVE_FIELDS`."""


def _remote(row: Row) -> Peer:
    return Peer(host_of(row["host[0]"], row["host[1]"]), row["port"])


def _data(row: Row, memory: AreaMemory) -> bytes:
    return fetch(memory, row["data_address[0]"], row["data_address[1]"], row["size"])


@dataclass(frozen=True)
class Agreed:
    """What the tables of this module are in one program: numbers, sizes in bytes, functions that write and read rows."""

    event_bytes: int
    events_bytes: int
    """Of all rows together."""
    events: Mapping[type, tuple[Packer, int, Values]]
    pack_sent: Packer
    sent: int
    pack_received: Packer
    """Of bytes of a connection."""
    received: int
    request_rows: Sequence[int]
    """At which bytes the rows begin."""
    request: Unpacker
    """What `SEND_FIELDS` names."""
    rare_request: Unpacker
    send: int
    grant: int
    rare: Mapping[int, Callable[[Row, AreaMemory], Request]]
    move_bytes: int
    moves: Rows
    ring_bytes: int
    fresh_bytes: int
    """Bytes of a ring that may lie behind what the socket has kept: the rest is for a full buffer and, if it is not stored yet,
    for what the last receive was handed."""
    part_bytes: int
    """Sends are cut into parts of so many bytes, W343 6-1-7 p108."""


@cache
def agreed(contract: Contract) -> Agreed:
    """What this module and a program have in common.  Raises ContractError if they do not name the same rows and kinds."""
    event, request, move = (contract.record(name) for name in ("ETN21_Events", "ETN21_Requests", "ETN21_Moves"))
    told, asked = event.enumeration("kind"), request.enumeration("kind")
    event.require([*EVERY_EVENT, *(name for row in EVENTS.values() for name in row.fields)], __name__)
    told.require([NOTHING, *(row.kind for row in EVENTS.values())], __name__)
    request.require(REQUEST_FIELDS, __name__)
    asked.require([NOTHING, SEND, GRANT, *RARE_REQUESTS], __name__)
    move.require([*MOVE, *MOVE_FIELDS], __name__)
    _, _, ring_bytes = contract.array("ETN21_Rings")
    return Agreed(
        event_bytes=event.size,
        events_bytes=contract.array("ETN21_Events")[1] * event.size,
        events={type_: (event.packer(*EVERY_EVENT, *row.fields), told[row.kind], row.values) for type_, row in EVENTS.items()},
        pack_sent=event.packer(*EVERY_EVENT, "size"),
        sent=told[EVENTS[Sent].kind],
        pack_received=event.packer(*EVERY_EVENT, "size", "place"),
        received=told[EVENTS[Received].kind],
        request_rows=tuple(range(0, contract.array("ETN21_Requests")[1] * request.size, request.size)),
        request=request.unpacker(*SEND_FIELDS),
        rare_request=request.unpacker(*REQUEST_FIELDS),
        send=asked[SEND],
        grant=asked[GRANT],
        rare={asked[name]: make for name, make in RARE_REQUESTS.items()},
        move_bytes=move.size,
        moves=move.rows(*MOVE),
        ring_bytes=ring_bytes,
        fresh_bytes=ring_bytes - 2 * contract.constant("ETN21_UDP_BUFFER"),
        part_bytes=contract.constant("ETN21_TCP_PART"),
    )


class Mail:
    """The tables of one processor, and the rings in which its sockets have what they received."""

    def __init__(self, processor: Processor, odd_filler: int | None) -> None:
        self._agreed = agreed(processor.contract)
        self._posted = processor.view("ETN21_Posted")
        self._behind = processor.view("ETN21_Behind")
        self._events = processor.view("ETN21_Events")
        self._requested = processor.view("ETN21_Requested")
        self._urgent = processor.view("ETN21_Urgent")
        self._requests = processor.view("ETN21_Requests")
        self._moved = processor.view("ETN21_Moved")
        self._moves = processor.view("ETN21_Moves")
        rings, ring_bytes = processor.view("ETN21_Rings"), self._agreed.ring_bytes
        self._rings = [rings[first : first + ring_bytes] for first in range(0, len(rings), ring_bytes)]
        """Of each socket its ring."""
        processor.view("ETN21_Filler")[0] = KEEP if odd_filler is None else odd_filler
        self._later: list[Event] = []
        """Events for which there is no room now."""
        self._ends = processor.view("ETN21_Ends")
        """Of what each socket has kept: the places behind the last bytes in their rings."""
        self._fresh: dict[int, int] = {}
        """How many bytes of the rows that are posted lie behind these, by socket."""

    @property
    def has_events(self) -> bool:
        """True if there are events that the processor has not taken."""
        return self._posted[0] > 0

    def forget(self) -> None:
        """As after power-on."""
        self._posted[0] = self._requested[0] = self._urgent[0] = self._moved[0] = 0
        self._later.clear()
        self._behind[0] = 0

    @property
    def state(self) -> tuple[tuple[Event, ...], dict[int, int]]:
        """What is not in the memory of the processor."""
        return tuple(self._later), {**self._fresh}

    def resume(self, later: tuple[Event, ...], fresh: dict[int, int]) -> None:
        """Goes on from a `state` of the processor whose memory this one's has by now."""
        self._later, self._fresh = [*later], {**fresh}

    def post(self, events: Iterable[Event]) -> None:
        """Gives events to the program.  Those that do not fit wait for the refresh after, those of unknown channels are lost."""
        posted: int = self._posted[0]
        if not posted and self._fresh:  # what the program has not kept gives way to the next
            self._fresh.clear()
        if self._later:
            events, self._later = [*self._later, *events], []
            self._behind[0] = 0
        agreed, rows, row = self._agreed, self._events, self._agreed.event_bytes * posted
        for event in events:
            if row == agreed.events_bytes:
                self._later.append(event)
                self._behind[0] = 1
                continue
            channel = event.channel
            if channel not in at.SOCKETS:
                continue
            if isinstance(event, Sent):
                agreed.pack_sent(rows, row, agreed.sent, channel, event.size)
            elif not isinstance(event, Received):
                pack, kind, values = agreed.events[type(event)]
                pack(rows, row, kind, channel, *values(event))
            elif (place := self._keep(channel, event.data)) is None:
                continue
            elif (remote := event.remote) is NOBODY:
                agreed.pack_received(rows, row, agreed.received, channel, len(event.data), place)
            else:
                pack, kind, _ = agreed.events[Received]
                pack(rows, row, kind, channel, *words_of(remote.host), remote.port, len(event.data), place)
            row += agreed.event_bytes
        self._posted[0] = row // agreed.event_bytes

    def _keep(self, channel: int, data: bytes) -> int | None:
        """Puts bytes into the ring of a socket.  Returns the place behind them, or None: there were more than the socket would
        keep, and they are lost."""
        agreed, size = self._agreed, len(data)
        fresh = self._fresh.get(channel, 0) + size
        if fresh > agreed.fresh_bytes:
            return None
        self._fresh[channel] = fresh
        ring, ring_bytes, place = self._rings[channel - 1], agreed.ring_bytes, self._ends[channel - 1] + fresh
        begin = place - size & ring_bytes - 1
        if begin + size <= ring_bytes:
            ring[begin : begin + size] = data
        else:
            first = ring_bytes - begin
            ring[begin:], ring[: size - first] = data[:first], data[first:]
        return place & COUNTER

    def collect(self, memory: AreaMemory) -> list[Request]:
        """After a refresh: what the program asks of the network.  Data to be sent are taken from `memory`, the PLC's."""
        if self._later:
            self.post(())
        agreed, rows = self._agreed, self._requests
        requests: list[Request] = []
        for row in agreed.request_rows[: self._requested[0]]:
            kind, channel, high, low, size = agreed.request(rows, row)
            if kind == agreed.send:
                data, part = fetch(memory, high, low, size), agreed.part_bytes
                if size <= part:
                    requests.append(Send(channel, data))
                else:
                    requests += [Send(channel, data[first : first + part]) for first in range(0, size, part)]
            elif kind == agreed.grant:
                requests.append(Grant(channel, size))
            else:
                fields = dict(zip(REQUEST_FIELDS, agreed.rare_request(rows, row), strict=True))
                requests.append(agreed.rare[kind](fields, memory))
        self._requested[0] = self._urgent[0] = 0
        return requests

    def move(self, memory: AreaMemory) -> None:
        """Stores what receives were handed in `memory`, the PLC's, if machine code has not done so yet."""
        if not self._moved[0]:
            return
        agreed = self._agreed
        for number, place, size, filler, high, low in agreed.moves(self._moves[: agreed.move_bytes * self._moved[0]]):
            ring, begin = self._rings[number - 1], place & agreed.ring_bytes - 1
            data = bytes(ring[begin : begin + size])
            data += bytes(ring[: size - len(data)])
            store(memory, high, low, data, None if filler == KEEP else filler)
        self._moved[0] = 0
