"""A network in memory with virtual time, between units and scripted peers: every run gives the same events.

Time advances when a link is called with a later time; everything that is due until then is done in order of time, and at
one time in the order in which it was scheduled.  The answer to a request never comes in the same `submit`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from fbvm.net.addresses import fits, impossible
from fbvm.net.faults import Fault
from fbvm.net.loop_channels import Connection, Listener, MemoryLink, UdpPort
from fbvm.net.peers import Action, Actions, Conversation, Fin, Leave, Reset, Say, Station, Wake
from fbvm.net.stream import End
from fbvm.net.wires import CONNECT_TIMEOUT_NS, Wires
from fbvm.wire.link import Bind, Connect, Event, Failed, Listen, Peer, Request
from fbvm.wire.tap import Tap, TapEvent, TapKind

FIRST_EPHEMERAL_PORT, LAST_PORT = 49_152, 65_535


class LoopNetwork(Wires):
    """The network in memory.

    `seed` starts its random numbers, `latency_ns` is the latency in each direction, `faults` is a list of rows that may be
    changed at any time (see `net.faults`)."""

    virtual_time = True

    def __init__(self, seed: int = 0, *, latency_ns: int = 0, faults: Iterable[Fault] = ()) -> None:
        super().__init__(seed, latency_ns, faults)
        self.tap: Tap | None = None
        self._links: dict[str, LoopLink] = {}
        self._stations: dict[Peer, Station] = {}

    def attach(self, address: str) -> LoopLink:
        """The link of a new unit.  Raises ValueError if the address is in use."""
        if address in self._links:
            raise ValueError(f"{address} is attached already")
        link = self._links[address] = LoopLink(self, address)
        return link

    def place(self, endpoint: Peer, station: Station) -> None:
        """Puts a scripted peer at an endpoint; new connections go to this peer, open ones stay with the former."""
        self._stations[endpoint] = station

    def remove(self, endpoint: Peer) -> None:
        """Removes the peer at an endpoint.  Its open connections stay."""
        self._stations.pop(endpoint, None)

    def close(self) -> None:
        """Discards all connections and data."""
        self._due.clear()
        self._links.clear()
        self._stations.clear()

    def scan_of(self, one: Peer, other: Peer) -> int:
        link = self._links.get(one.host) or self._links.get(other.host)
        return link.scan if link else 0

    def tell_unit(self, unit: str, what: TapKind, local: Peer, remote: Peer, out: bool, data: bytes = b"") -> None:
        if self.tap:
            self.tap(self.now_ns, unit, TapEvent(what, local, remote, out, data, remote.host in self._links))

    # Opening, and datagrams.

    def connect(self, connection: Connection, local: Peer, remote: Peer) -> None:
        """Starts an active open for a unit's channel."""
        fault = self.fault(local, remote)
        self.tell_unit(local.host, TapKind.SYN, local, remote, True)
        station = self._stations.get(remote)
        if fault.silent or (station and station.deaf):
            self.at(self.now_ns + CONNECT_TIMEOUT_NS, partial(connection.refused, "ETIMEDOUT"))
            return
        end = End(self, local, remote, local.host, connection)
        self.at(self.now_ns + self.latency_ns(fault), partial(self._syn_arrived, connection, end))

    def _syn_arrived(self, connection: Connection, end: End, now_ns: int) -> None:
        """Called when the SYN has arrived at the other endpoint: accepts or refuses the connection."""
        back_ns = now_ns + self.latency_ns(self.fault(end.local, end.remote))
        link = self._links.get(end.remote.host)
        other = (link.accept(end, now_ns) if link else None) or self._accept(end)
        self.at(back_ns, partial(connection.answered, end, "" if other else "ECONNREFUSED", True))
        if other:
            end.join(other)
            if isinstance(other.owner, _PeerOwner):
                other.owner.opened(other, now_ns)

    def _accept(self, end: End) -> End | None:
        station = self._stations.get(end.remote)
        conversation = station.accept(end.local) if station else None
        if conversation is None:
            return None
        return End(self, end.remote, end.local, None, _PeerOwner(self, conversation))

    def send_datagram(self, sender: Peer, receiver: Peer, data: bytes) -> None:
        """Sends a datagram of a unit."""
        self.tell_unit(sender.host, TapKind.UDP, sender, receiver, True, data)
        self._schedule_datagram(sender, receiver, data)

    def _schedule_datagram(self, sender: Peer, receiver: Peer, data: bytes) -> None:
        self.pass_datagram(sender, receiver, data, partial(self._deliver, sender, receiver))

    def _deliver(self, sender: Peer, receiver: Peer, data: bytes, now_ns: int) -> None:
        everybody = receiver.host.endswith(".255")
        for address, link in self._links.items():
            if address == receiver.host or (everybody and address != sender.host):
                link.deliver_datagram(sender, receiver.port, data)
        for endpoint, station in list(self._stations.items()):
            if endpoint == receiver or (everybody and endpoint.port == receiver.port):
                for answer in station.datagram(data, sender):
                    self._schedule_datagram(endpoint, sender, answer)


class LoopLink(MemoryLink):
    """The link of one unit of a `LoopNetwork`."""

    def __init__(self, network: LoopNetwork, address: str) -> None:
        super().__init__(address)
        self.network = network
        self.scan = 0
        """The number of the scan of the unit's last refresh."""
        self._refreshes = 0
        self._ends: dict[tuple[int, Peer], End] = {}
        self._next_port = FIRST_EPHEMERAL_PORT

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        self.network.run(now_ns)
        super().submit(requests, now_ns)

    def events(self, now_ns: int) -> Sequence[Event]:
        self.scan = self._refreshes
        self._refreshes += 1
        self.network.run(now_ns)
        if any(row.reset for row in self.network.faults):
            for end in list(self._ends.values()):
                if self.network.fault(end.local, end.remote).reset:
                    end.reset_both(now_ns)
        for there in list(self.channels.values()):
            there.fetch(now_ns)
        events, self.pending = self.pending, []
        return events

    @property
    def is_quiet(self) -> bool:
        return super().is_quiet and all(end.gone for end in self._ends.values())

    def pass_by(self, refreshes: int) -> None:
        self._refreshes += refreshes
        self.scan = self._refreshes - 1

    def open(self, request: Connect | Listen | Bind, now_ns: int) -> None:
        channel = request.channel
        self._ends = {where: end for where, end in self._ends.items() if not end.gone}
        error = self._conflict(request)
        if error:
            self.pending.append(Failed(channel, "open", error))
            return
        port = request.local_port or self._ephemeral_port()
        if isinstance(request, Listen):
            self.channels[channel] = Listener(self, channel, port, request.remote)
        elif isinstance(request, Bind):
            self.channels[channel] = UdpPort(self, channel, port)
        else:
            connection = self.channels[channel] = Connection(self, channel, port)
            self.network.connect(connection, Peer(self.address, port), request.remote)

    # For the network and for the channels.

    def accept(self, caller: End, now_ns: int) -> End | None:
        """Accepts a connection on the lowest-numbered listener that fits the caller (assumed); its end here, or None."""
        for channel, there in sorted(self.channels.items()):
            if isinstance(there, Listener) and there.port == caller.remote.port and fits(there.remote, caller.local):
                connection = self.channels[channel] = Connection(self, channel, there.port)
                connection.granted = there.granted
                end = End(self.network, caller.remote, caller.local, self.address, connection)
                self.network.tell(end, TapKind.SYN, False)
                connection.answered(end, "", False, now_ns)
                return end
        return None

    def deliver_datagram(self, sender: Peer, port: int, data: bytes) -> None:
        """Delivers a datagram to the channel that is bound to its port; without one the datagram is lost."""
        for there in self.channels.values():
            if isinstance(there, UdpPort) and there.port == port:
                there.take_in(sender, data)
                self.network.tell_unit(self.address, TapKind.UDP, Peer(self.address, port), sender, False, data)

    def remember(self, end: End) -> None:
        self._ends[end.local.port, end.remote] = end

    def send_datagram(self, port: int, receiver: Peer, data: bytes) -> None:
        self.network.send_datagram(Peer(self.address, port), receiver, data)

    def _conflict(self, request: Connect | Listen | Bind) -> str:
        """The errno name with which an open fails at once, "" if none."""
        if isinstance(request, Listen):
            return ""
        kind, port = UdpPort if isinstance(request, Bind) else Listener, request.local_port
        if port and any(isinstance(there, kind) and there.port == port for there in self.channels.values()):
            return "EADDRINUSE"
        if isinstance(request, Bind):
            return ""
        local, remote = Peer(self.address, port), request.remote
        if (port, remote) in self._ends:
            return "EADDRINUSE"
        return impossible(local, remote) or self.network.fault(local, remote).error

    def _ephemeral_port(self) -> int:
        used = {port for port, _ in self._ends}
        used |= {there.port for there in self.channels.values() if isinstance(there, Listener | Connection | UdpPort)}
        while True:
            port = self._next_port
            self._next_port = FIRST_EPHEMERAL_PORT if port == LAST_PORT else port + 1
            if port not in used:
                return port


class _PeerOwner:
    """The owner of a scripted peer's end: reports events to the conversation and performs its actions."""

    def __init__(self, network: LoopNetwork, conversation: Conversation) -> None:
        self._network = network
        self._conversation = conversation
        self._end: End

    def opened(self, end: End, now_ns: int) -> None:
        """The connection is open."""
        self._end = end
        self._perform(self._conversation.connected(now_ns), now_ns)

    def sent(self, size_bytes: int) -> None:
        """Nothing to do: a scripted peer does not wait for its data to be sent."""

    def readable(self, now_ns: int) -> None:
        if self._conversation.reads:
            data = self._end.take(len(self._end.inbox), now_ns)
            self._perform(self._conversation.received(data, now_ns), now_ns)

    def finished(self, now_ns: int) -> None:
        self._perform(self._conversation.peer_closed(now_ns), now_ns)

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        self._conversation.lost(error, now_ns)

    def _perform(self, actions: Actions, now_ns: int) -> None:
        for action in actions:
            if action.after_ns or isinstance(action, Wake):
                self._network.at(now_ns + max(action.after_ns, 1), partial(self._do, action))
            else:
                self._do(action, now_ns)

    def _do(self, action: Action, now_ns: int) -> None:
        end = self._end
        if end.owner is not self or end.error:
            return
        match action:
            case Say(data):
                end.send(data, now_ns)
            case Fin():
                end.finish(now_ns)
            case Leave():
                end.leave(now_ns)
            case Reset():
                end.reset(now_ns)
            case Wake():
                self._perform(self._conversation.woken(now_ns), now_ns)
