"""A network in memory with virtual time: units and scripted peers talk to one another, the same way in every run.

Nothing happens by itself.  Time moves when a link is told a later one; whatever was due until then is done in order of
time, and at one moment in the order in which it was asked for.  An answer is never seen in the `submit` that asked.
"""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable, Iterable, Sequence
from functools import partial

from fbvm.net.addresses import fits, impossible
from fbvm.net.faults import NO_FAULT, Fault, find
from fbvm.net.loop_channels import Bound, Door, Line, MemoryLink
from fbvm.net.peers import Action, Actions, Conversation, Fin, Leave, Reset, Say, Station, Wake
from fbvm.net.stream import End
from fbvm.wire.link import Bind, Connect, Event, Failed, Listen, Peer, Request
from fbvm.wire.tap import Tap, TapEvent, TapKind

CONNECT_TIMEOUT_NS = 75_000_000_000
"""When opening towards a silent host gives up, as BSD stacks do.  The unit's own limit is not known: assumed."""
FIRST_EPHEMERAL_PORT, LAST_PORT = 49_152, 65_535


class LoopNetwork:
    """The network of tests and lessons.  `faults` is a list that may be changed at any time, see `net.faults`."""

    virtual_time = True

    def __init__(self, seed: int = 0, *, latency_ns: int = 0, faults: Iterable[Fault] = ()) -> None:
        self.faults = list(faults)
        self.tap: Tap | None = None
        self.now_ns = 0
        self._latency_ns = latency_ns
        self._dice = random.Random(seed)
        self._due: list[tuple[int, int, Callable[[int], None]]] = []
        self._count = 0
        self._links: dict[str, LoopLink] = {}
        self._stations: dict[Peer, Station] = {}

    def attach(self, address: str) -> LoopLink:
        """A place for one unit.  Raises ValueError if the address is taken."""
        if address in self._links:
            raise ValueError(f"{address} is attached already")
        link = self._links[address] = LoopLink(self, address)
        return link

    def place(self, endpoint: Peer, station: Station) -> None:
        """Put a scripted peer at an endpoint; a former one there takes no new connections any more."""
        self._stations[endpoint] = station

    def remove(self, endpoint: Peer) -> None:
        """Let nobody listen there any more.  Open conversations go on."""
        self._stations.pop(endpoint, None)

    def next_due_ns(self) -> int | None:
        """When something will happen by itself next, so that a run may skip the time until then; None if never."""
        return self._due[0][0] if self._due else None

    def close(self) -> None:
        """Forget everything that is open or under way."""
        self._due.clear()
        self._links.clear()
        self._stations.clear()

    def run(self, now_ns: int) -> None:
        """Do what is due until `now_ns`.  Links call this; a test may."""
        while self._due and self._due[0][0] <= now_ns:
            due_ns, _, call = heapq.heappop(self._due)
            self.now_ns = max(self.now_ns, due_ns)
            call(self.now_ns)
        self.now_ns = max(self.now_ns, now_ns)

    # What a connection needs (stream.Way).

    def at(self, due_ns: int, call: Callable[[int], None]) -> None:
        """Call back when it is due."""
        self._count += 1
        heapq.heappush(self._due, (due_ns, self._count, call))

    def fault(self, one: Peer, other: Peer) -> Fault:
        """The row of the fault table that holds now between two endpoints; the scan is the first one's, if it is a unit."""
        if not self.faults:
            return NO_FAULT
        link = self._links.get(one.host) or self._links.get(other.host)
        return find(self.faults, one, other, link.scan if link else 0, self.now_ns)

    def latency_ns(self, fault: Fault) -> int:
        """Time for one way."""
        latency_ns = self._latency_ns if fault.latency_ns is None else fault.latency_ns
        return latency_ns + (self._dice.randint(0, fault.jitter_ns) if fault.jitter_ns else 0)

    def cut(self, fault: Fault, data: bytes) -> list[bytes]:
        """Data in the pieces in which they arrive."""
        return list(fault.pieces(data, self._dice))

    def tell(self, end: End, what: TapKind, out: bool, data: bytes = b"") -> None:
        """Pass a happening at a unit's end on to the tap; a scripted peer has none."""
        if end.unit is not None:
            self.tell_unit(end.unit, what, end.local, end.remote, out, data)

    def tell_unit(self, unit: str, what: TapKind, local: Peer, remote: Peer, out: bool, data: bytes = b"") -> None:
        """Pass a happening at a unit on to the tap."""
        if self.tap:
            self.tap(self.now_ns, unit, TapEvent(what, local, remote, out, data, remote.host in self._links))

    # Opening, and datagrams.

    def dial(self, line: Line, local: Peer, remote: Peer) -> None:
        """Begin an active open for a unit's channel."""
        fault = self.fault(local, remote)
        self.tell_unit(local.host, TapKind.SYN, local, remote, True)
        station = self._stations.get(remote)
        if fault.silent or (station and station.deaf):
            self.at(self.now_ns + CONNECT_TIMEOUT_NS, partial(line.refused, "ETIMEDOUT"))
            return
        end = End(self, local, remote, local.host, line)
        self.at(self.now_ns + self.latency_ns(fault), partial(self._knock, line, end))

    def _knock(self, line: Line, end: End, now_ns: int) -> None:
        """The SYN has arrived."""
        back_ns = now_ns + self.latency_ns(self.fault(end.local, end.remote))
        link = self._links.get(end.remote.host)
        other = (link.admit(end, now_ns) if link else None) or self._converse(end)
        self.at(back_ns, partial(line.answered, end, "" if other else "ECONNREFUSED", True))
        if other:
            end.join(other)
            if isinstance(other.owner, _Talk):
                other.owner.greet(other, now_ns)

    def _converse(self, end: End) -> End | None:
        station = self._stations.get(end.remote)
        conversation = station.accept(end.local) if station else None
        if conversation is None:
            return None
        return End(self, end.remote, end.local, None, _Talk(self, conversation))

    def post(self, sender: Peer, receiver: Peer, data: bytes) -> None:
        """Carry a datagram from a unit to whoever is there."""
        self.tell_unit(sender.host, TapKind.UDP, sender, receiver, True, data)
        self._carry(sender, receiver, data)

    def _carry(self, sender: Peer, receiver: Peer, data: bytes) -> None:
        fault = self.fault(sender, receiver)
        if not fault.silent:
            self.at(self.now_ns + self.latency_ns(fault), partial(self._deliver, sender, receiver, data))

    def _deliver(self, sender: Peer, receiver: Peer, data: bytes, now_ns: int) -> None:
        everybody = receiver.host.endswith(".255")
        for address, link in self._links.items():
            if address == receiver.host or (everybody and address != sender.host):
                link.drop_in(sender, receiver.port, data)
        for endpoint, station in list(self._stations.items()):
            if endpoint == receiver or (everybody and endpoint.port == receiver.port):
                for answer in station.datagram(data, sender):
                    self._carry(endpoint, sender, answer)


class LoopLink(MemoryLink):
    """One unit's place on a `LoopNetwork`."""

    def __init__(self, network: LoopNetwork, address: str) -> None:
        super().__init__(address)
        self.network = network
        self.scan = 0
        """Number of the scan in which the unit was refreshed last."""
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
                    end.tear(now_ns)
        for there in list(self.channels.values()):
            there.fetch(now_ns)
        told, self.told = self.told, []
        return told

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
            self.told.append(Failed(channel, "open", error))
            return
        port = request.local_port or self._ephemeral_port()
        if isinstance(request, Listen):
            self.channels[channel] = Door(self, channel, port, request.remote)
        elif isinstance(request, Bind):
            self.channels[channel] = Bound(self, channel, port)
        else:
            line = self.channels[channel] = Line(self, channel, port)
            self.network.dial(line, Peer(self.address, port), request.remote)

    # For the network and for the channels.

    def admit(self, caller: End, now_ns: int) -> End | None:
        """A connection from elsewhere: its end at the lowest-numbered door that is open to it (assumed), or None."""
        for channel, there in sorted(self.channels.items()):
            if isinstance(there, Door) and there.port == caller.remote.port and fits(there.remote, caller.local):
                line = self.channels[channel] = Line(self, channel, there.port)
                line.granted = there.granted
                end = End(self.network, caller.remote, caller.local, self.address, line)
                self.tell(end, TapKind.SYN, False)
                line.answered(end, "", False, now_ns)
                return end
        return None

    def drop_in(self, sender: Peer, port: int, data: bytes) -> None:
        """A datagram for this address has arrived; lost if nobody is bound to its port."""
        for there in self.channels.values():
            if isinstance(there, Bound) and there.port == port:
                there.take_in(sender, data)
                self.network.tell_unit(self.address, TapKind.UDP, Peer(self.address, port), sender, False, data)

    def remember(self, end: End) -> None:
        self._ends[end.local.port, end.remote] = end

    def tell(self, end: End, what: TapKind, out: bool) -> None:
        self.network.tell(end, what, out)

    def post(self, port: int, receiver: Peer, data: bytes) -> None:
        self.network.post(Peer(self.address, port), receiver, data)

    def _conflict(self, request: Connect | Listen | Bind) -> str:
        """The errno name of what cannot be opened, "" if it can."""
        if isinstance(request, Listen):
            return ""
        kind, port = Bound if isinstance(request, Bind) else Door, request.local_port
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
        used |= {there.port for there in self.channels.values() if isinstance(there, Door | Line | Bound)}
        while True:
            port = self._next_port
            self._next_port = FIRST_EPHEMERAL_PORT if port == LAST_PORT else port + 1
            if port not in used:
                return port


class _Talk:
    """Owner of a scripted peer's end: asks the conversation, does what it says."""

    def __init__(self, network: LoopNetwork, conversation: Conversation) -> None:
        self._network = network
        self._conversation = conversation
        self._end: End

    def greet(self, end: End, now_ns: int) -> None:
        """The connection is open."""
        self._end = end
        self._perform(self._conversation.connected(now_ns), now_ns)

    def sent(self, size_bytes: int) -> None:
        """Nothing to do: a scripted peer does not wait for that."""

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
