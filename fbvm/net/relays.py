"""Real connections under faults: each is led through wires in memory, the same as those of the network in memory.

A relay has two ends in memory.  One is the unit's connection; the other belongs to the relay, which hands over to a connection
of the host what arrives there, and back.  The connection of the host is a channel of a second link, `behind`, of which the unit
knows nothing.  A connection that no fault fits stays as it is; one that is open already is led through wires when a fault
comes that fits.  It stays there until it ends.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import count

from fbvm.net.addresses import fits, impossible
from fbvm.net.channels import ANYBODY, Channel, undeliverable
from fbvm.net.faults import FOREVER, NO_FAULT, Fault, find
from fbvm.net.host_link import HostLink
from fbvm.net.loop_channels import WiredConnection
from fbvm.net.stream import WINDOW_BYTES, End
from fbvm.net.wires import CONNECT_TIMEOUT_NS, Wires
from fbvm.wire.link import (
    Broken,
    Close,
    Connect,
    Event,
    Failed,
    Grant,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Send,
    SendTo,
    Sent,
)
from fbvm.wire.tap import TapKind

HostTap = Callable[[int, TapKind, Peer, Peer, bool, bytes], None]
DOORS = -1
"""The number of `ClosedDoor`, which is no channel."""


class RelayedConnection(WiredConnection):
    """The unit's connection under faults."""

    link: HostLink

    def readable(self, now_ns: int) -> None:
        self._wake()

    def finished(self, now_ns: int) -> None:
        self._wake()

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        super().broken(error, unsent, now_ns)
        self._wake()

    def grant(self, size_bytes: int) -> None:
        super().grant(size_bytes)
        self._wake()

    def fetch(self, now_ns: int) -> None:
        super().fetch(now_ns)
        self.link.waiting.pop(self, None)

    def close(self, reset: bool, now_ns: int) -> None:
        self.link.waiting.pop(self, None)
        super().close(reset, now_ns)

    def take_over(self, end: End, granted: int, fin_seen: bool) -> None:
        """The unit's connection is open already, and goes on over wires from `end`."""
        self._end, self.granted, self._fin_told = end, granted, fin_seen
        end.fin_arrived = fin_seen

    def answer(self, event: Sent | Failed) -> None:
        """Tells the unit the answer to a `Send`, if it still has the connection."""
        if self.link.channels.get(self.channel) is self:
            self.link.pending.append(replace(event, channel=self.channel))

    def _wake(self) -> None:
        if self.link.channels.get(self.channel) is self:
            self.link.waiting[self] = None
            self.link.is_quiet = False


class Relay:
    """The owner of the end in memory that belongs to a connection of the host; `behind` is the link of that connection."""

    def __init__(self, relays: Relays, behind: HostLink, channel: int, unit_end: End) -> None:
        self._behind, self._channel, self._unit_end = behind, channel, unit_end
        self._end = End(relays, unit_end.remote, unit_end.local, None, self)
        self._unit_end.join(self._end)
        self._unsent_bytes = 0
        self._owed = 0
        self._connection: RelayedConnection | None = None
        self.closed = False

    @property
    def is_over(self) -> bool:
        """True if nothing passes any more."""
        return self.closed and self._unit_end.gone

    @property
    def endpoints(self) -> tuple[Peer, Peer]:
        """The unit's endpoint and its peer's."""
        return self._unit_end.local, self._unit_end.remote

    def owe(self, answers: int, connection: RelayedConnection) -> None:
        """The next `answers` to `Send` are the unit's, which has sent before there were wires."""
        self._owed, self._connection = answers, connection

    def break_if(self, broken: bool, now_ns: int) -> None:
        """Resets both sides if `broken`."""
        if broken:
            self._unit_end.reset_both(now_ns)

    # The owner's side of the end.

    def sent(self, size_bytes: int) -> None:
        """Room for data of the host has come free."""

    def readable(self, now_ns: int) -> None:
        if self._unsent_bytes < WINDOW_BYTES and not self.closed:
            data = self._end.take(WINDOW_BYTES, now_ns)
            if data:
                self._unsent_bytes += len(data)
                self._behind.submit([Send(self._channel, data)], now_ns)

    def finished(self, now_ns: int) -> None:
        """The unit has closed: the host's connection sends what is left, then FIN."""
        if not self.closed:
            rest = self._end.take(len(self._end.inbox), now_ns)
            self._close([Send(self._channel, rest)] if rest else [], False, now_ns)
            self._end.leave(now_ns)

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        if not self.closed:
            self._close([], True, now_ns)

    # The host's side.

    def told(self, event: Event, now_ns: int) -> None:
        """Called with an event of the host's connection."""
        match event:
            case Received(data=data):
                self._end.send(data, now_ns)
            case PeerClosed():
                self._end.finish(now_ns)
            case Broken():
                if not self.closed:
                    self._close([], True, now_ns)
                self._end.reset(now_ns)
            case Sent() | Failed() if self._owed and self._connection:
                self._owed -= 1
                self._connection.answer(event)
            case Sent(size=size):
                self._unsent_bytes -= size
                self.readable(now_ns)
            case _:
                pass

    def refresh(self, now_ns: int) -> None:
        """Lets the host's connection receive as much as there is room for."""
        if self._unit_end.error == "ETIMEDOUT" and not self.closed:
            self._close([], True, now_ns)
        if not self.closed:
            self._behind.submit([Grant(self._channel, max(0, WINDOW_BYTES - self._end.waiting_bytes))], now_ns)

    def _close(self, before: list[Send], reset: bool, now_ns: int) -> None:
        self.closed = True
        self._behind.submit([*before, Close(self._channel, reset)], now_ns)


class RelayedPort(Channel):
    """The unit's UDP port under faults."""

    link: HostLink

    def __init__(self, relays: Relays, link: HostLink, channel: int, behind: HostLink, behind_channel: int, local: Peer) -> None:
        super().__init__(link, channel)
        self._relays, self._behind, self._behind_channel, self._local = relays, behind, behind_channel, local
        self.is_over = False

    def close(self, reset: bool, now_ns: int) -> None:
        self.is_over = True
        self._behind.submit([Close(self._behind_channel)], now_ns)

    def send_to(self, remote: Peer, data: bytes, now_ns: int) -> str:
        if refusal := undeliverable(remote, data):
            return refusal
        self._relays.run(now_ns)
        self._relays.pass_datagram(self._local, remote, data, partial(self._send, remote))
        self.link.pending.append(Sent(self.channel, len(data)))
        return ""

    def _send(self, remote: Peer, data: bytes, now_ns: int) -> None:
        if not self.is_over:
            self._behind.submit([SendTo(self._behind_channel, remote, data)], now_ns)

    def told(self, event: Event, now_ns: int) -> None:
        """Called with an event of the host's port."""
        if isinstance(event, Received) and self._relays.is_unit(event.remote):  # the faults are at its own port
            self._arrive(event.remote, event.data, now_ns)
        elif isinstance(event, Received):
            self._relays.pass_datagram(event.remote, self._local, event.data, partial(self._arrive, event.remote))

    def _arrive(self, remote: Peer, data: bytes, now_ns: int) -> None:
        if not self.is_over:
            self.link.pending.append(Received(self.channel, data, remote))

    def refresh(self, now_ns: int) -> None:
        """Nothing to do: datagrams need no grant."""


class Opening:
    """An active open under faults: until the host's connection is open, or has failed."""

    is_over = False

    def __init__(self, relays: Relays, connection: RelayedConnection, local: Peer, remote: Peer) -> None:
        self._relays, self._connection, self._local, self._remote = relays, connection, local, remote

    def told(self, event: Event, now_ns: int) -> None:
        """Called with the answer of the host."""
        back_ns = now_ns + self._relays.latency_ns(self._relays.fault(self._local, self._remote))
        if isinstance(event, Failed):
            self._relays.at(back_ns, partial(self._failed, event.error))
        elif isinstance(event, Opened):
            local = Peer(self._local.host, event.local_port)
            end = End(self._relays, local, self._remote, local.host, self._connection)
            self._relays.lead(event.channel, self._connection.link, end)
            self._relays.at(back_ns, partial(self._connection.answered, end, "", True))

    def time_out(self, now_ns: int) -> None:
        """Nobody has answered."""
        self.is_over = True
        self._connection.refused("ETIMEDOUT", now_ns)

    def _failed(self, error: str, now_ns: int) -> None:
        self.is_over = True
        if error == "ECONNREFUSED":
            self._relays.tell_unit(self._local.host, TapKind.RST, self._local, self._remote, False)
        self._connection.refused(error, now_ns)

    def refresh(self, now_ns: int) -> None:
        """Nothing to do before the connection is open."""


class ClosedDoor:
    """Stands for the doors that a fault keeps shut, so that they are opened again when there is no fault any more."""

    is_over = False

    def told(self, event: Event, now_ns: int) -> None:
        """Nothing is told to a door."""

    def refresh(self, now_ns: int) -> None:
        """Nothing to do."""


class FaultyChannel(ABC):
    """A channel of the host that faults can befall."""

    @abstractmethod
    def meet_faults(self, relays: Relays, now_ns: int) -> None:
        """Called before and after sockets are handled while there are faults: an open connection goes over to wires if one
        fits, a listener opens or shuts its door."""


class Relays(Wires):
    """All that is under faults on one network of the host.

    `links` are the links of the units by address; `make_link` makes a link for connections of the host behind one of them;
    `tap` is told what happens at the units."""

    def __init__(self, links: dict[str, HostLink], make_link: Callable[[str], HostLink], tap: HostTap, seed: int,
                 faults: Iterable[Fault]) -> None:  # fmt: skip
        super().__init__(seed, faults=faults)
        self._links, self._make_link, self._tap = links, make_link, tap
        self._behind: dict[str, HostLink] = {}
        self._numbers = count()
        self._doors = ClosedDoor()
        self._before_refresh = False
        self.carried: dict[int, Relay | Opening | RelayedPort | ClosedDoor] = {}
        """What is under faults, by the channel of the host's side."""

    def scan_of(self, one: Peer, other: Peer) -> int:
        link = self._links.get(one.host) or self._links.get(other.host)
        return max(0, link.refreshes - (not self._before_refresh)) if link else 0

    def tell_unit(self, unit: str, what: TapKind, local: Peer, remote: Peer, out: bool, data: bytes = b"") -> None:
        self._tap(self.now_ns, what, local, remote, out, data)

    def concern(self, local: Peer, remote: Peer) -> bool:
        """True if some fault fits the endpoints, now or at another time."""
        return any(fits(row.peer, local) or fits(row.peer, remote) for row in self.faults)

    def is_unit(self, endpoint: Peer) -> bool:
        """True if a unit of this network has the endpoint's address."""
        return endpoint.host in self._links

    # What units ask for.

    def open(self, link: HostLink, request: Connect, now_ns: int) -> None:
        """An active open to an endpoint that a fault fits, now or at another time."""
        self.run(now_ns)
        local, remote = Peer(link.address, request.local_port), request.remote
        fault = self.fault(local, remote)
        connection = link.channels[request.channel] = RelayedConnection(link, request.channel)
        if error := impossible(local, remote) or fault.error:
            connection.failed(error)
            return
        self.tell_unit(link.address, TapKind.SYN, local, remote, True)
        number = next(self._numbers)
        self.carried[number] = opening = Opening(self, connection, local, remote)
        if fault.silent:
            self.at(now_ns + CONNECT_TIMEOUT_NS, opening.time_out)
            return
        asked = Connect(number, remote, request.local_port, request.keep_alive)
        self.at(now_ns + self.latency_ns(fault), lambda now_ns: self.behind(link.address).submit([asked], now_ns))

    def refuse(self, local: Peer, caller: Peer) -> bool:
        """True if a fault refuses this very caller at a unit's endpoint."""
        return bool(self.fault(local, caller).error)

    # What channels of the host ask for.

    def take_over(self, channel: Channel, local: Peer, remote: Peer, unanswered: int, fin_seen: bool) -> None:
        """Leads an open connection of a unit through wires.  `unanswered` calls of `Send` have no answer yet; with `fin_seen`
        the unit knows that the peer has sent FIN."""
        link, number = self._link_of(channel), channel.channel
        connection = RelayedConnection(link, number)
        end = End(self, local, remote, local.host, connection)
        relay = self.lead(self._put_behind(channel), link, end)
        relay.owe(unanswered, connection)
        connection.take_over(end, channel.granted, fin_seen)
        link.channels[number] = connection

    def take_over_port(self, channel: Channel, local: Peer) -> None:
        """Leads the datagrams of a unit's UDP port through wires."""
        link, number = self._link_of(channel), channel.channel
        behind = self._put_behind(channel)
        port = RelayedPort(self, link, number, self.behind(link.address), behind, local)
        link.channels[number] = self.carried[behind] = port

    def door(self, local: Peer) -> Fault:
        """The fault that is in force for every caller of a unit's endpoint; notes a door that has to be shut."""
        fault = find(self.faults, local, ANYBODY, self.scan_of(local, local), self.now_ns) if self.faults else NO_FAULT
        if fault.error or fault.silent:
            self._doors.is_over = False
            self.carried[DOORS] = self._doors
        return fault

    def shuts(self, local: Peer) -> bool:
        """True if a fault refuses every caller of a unit's endpoint, as far as it can be heard."""
        fault = self.door(local)
        return bool(fault.error) and not fault.silent

    def behind(self, address: str) -> HostLink:
        """The link of the host's side for the unit at an address."""
        if address not in self._behind:
            self._behind[address] = self._make_link(address)
        return self._behind[address]

    def lead(self, channel: int, link: HostLink, end: End) -> Relay:
        """Connects the unit's end with a channel of the host's side."""
        relay = self.carried[channel] = Relay(self, self.behind(link.address), channel, end)
        return relay

    def _link_of(self, channel: Channel) -> HostLink:
        assert isinstance(channel.link, HostLink), "channels of the host have links of the host"
        return channel.link

    def _put_behind(self, channel: Channel) -> int:
        """Moves a channel of a unit's link to the link behind; returns its number there."""
        link, number = self._link_of(channel), next(self._numbers)
        behind = self.behind(link.address)
        if channel in link.waiting:
            del link.waiting[channel]
            behind.waiting[channel] = None
        channel.link, channel.channel = behind, number
        behind.channels[number] = channel
        return number

    # Called by the network.

    def meet(self, now_ns: int) -> None:
        """Lets every channel of the units meet the faults, before and after sockets are handled."""
        self._before_refresh = True
        self.run(now_ns)
        self._doors.is_over = True
        by_scan = any(row.from_scan or row.until_scan != FOREVER for row in self.faults)
        for link in self._links.values():
            link.is_quiet = link.is_quiet and not by_scan
            for channel in list(link.channels.values()):
                if isinstance(channel, FaultyChannel):
                    channel.meet_faults(self, now_ns)

    def serve(self, now_ns: int) -> list[HostLink]:
        """Does all that is due, and fetches what the connections of the host have received; returns the links with events."""
        for behind in self._behind.values():
            for event in behind.events(now_ns):
                if carried := self.carried.get(event.channel):
                    carried.told(event, now_ns)
        self.run(now_ns)
        for number, carried in list(self.carried.items()):
            if isinstance(carried, Relay):
                carried.break_if(self.fault(*carried.endpoints).reset, now_ns)
            carried.refresh(now_ns)
            if carried.is_over and self.carried.get(number) is carried:
                del self.carried[number]
        self._before_refresh = False
        return [link for link in self._links.values() if link.pending or link.waiting]

    @property
    def channels_behind(self) -> int:
        """How many channels of the host the relays hold."""
        return sum(len(behind.channels) for behind in self._behind.values())

    def until_due_s(self) -> float | None:
        """How many seconds after the last `serve` something is due; None if nothing is."""
        due_ns = self.next_due_ns()
        return None if due_ns is None else max(0, due_ns - self.now_ns) / 1e9

    def close(self) -> list[HostLink]:
        """Forgets everything; returns the links whose channels have to be closed."""
        behind = list(self._behind.values())
        self._due.clear()
        self.carried.clear()
        self._behind.clear()
        return behind
