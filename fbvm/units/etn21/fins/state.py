"""How the FINS service of a unit is set, and all that it knows between two scans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fbvm.units.contract import FinsAccess
from fbvm.wire.fins.frames import LAST_NODE, PORT
from fbvm.wire.link import Event, Peer, Send, SendTo

UDP_CHANNEL = 100
TCP_CHANNELS = range(101, 121)
"""More than there are connections: who finds all of them in use is told so."""
CONNECTIONS = range(1, 17)
"""Numbers of FINS/TCP connections, W420 3-2."""
ACCESS = {"full": FinsAccess(), "no-control": FinsAccess(may_control=False),
          "read-only": FinsAccess(may_write=False, may_control=False)}  # fmt: skip
"""What commands that come in may do, by the word that a project has for it."""


@dataclass(frozen=True)
class FinsSettings:
    """How the service is set.

    `node` None is the host part of the unit's address, as automatic address generation has it; 0 takes frames for every node.
    `nodes` is the IP address table: nodes with an endpoint of their own.  Raises ValueError for what cannot be."""

    address: str
    unit_number: int = 0
    port: int = PORT
    node: int | None = None
    nodes: Mapping[int, Peer] = field(default_factory=dict)
    access: FinsAccess = ACCESS["full"]

    def __post_init__(self) -> None:
        if not 0 < self.port < 65_536:
            raise ValueError(f"FINS port {self.port} is not in 1..65535")
        if self.node is not None and not 0 <= self.node <= LAST_NODE:
            raise ValueError(f"FINS node {self.node} is not in 1..{LAST_NODE}, nor 0 for every node")
        for node in self.nodes:
            if not 0 < node <= LAST_NODE:
                raise ValueError(f"FINS node {node} is not in 1..{LAST_NODE}")

    @property
    def host_part(self) -> int:
        """The last number of the unit's address."""
        return int(self.address.rpartition(".")[2])

    @property
    def own_node(self) -> int:
        """The unit's node."""
        return self.node or self.host_part

    @property
    def disagrees(self) -> bool:
        """True if the node is not the host part of the address, and no IP address table says why (W420 p97)."""
        return not self.nodes and self.own_node != self.host_part


def nodes_of(written: Mapping[str, str]) -> dict[int, Peer]:
    """An IP address table as projects write it: `{"2" = "192.168.250.2"}`, with a port where that is not 9600.

    Raises ValueError."""
    found = {}
    for node, endpoint in written.items():
        host, _, port = endpoint.partition(":")
        parts = host.split(".")
        if not node.isdecimal() or len(parts) != 4 or not all(part.isdecimal() and int(part) < 256 for part in parts) or (
                port and not (port.isdecimal() and 0 < int(port) < 65_536)):  # fmt: skip
            raise ValueError(f'"{node}" = "{endpoint}" is no node with its address; write "2" = "192.168.250.2"')
        found[int(node)] = Peer(host, int(port or PORT))
    return found


@dataclass
class Connection:
    """A FINS/TCP connection of which this unit is the server.

    `number` is 1 to 16, or 0 for a client for whom there is none; `node` is the client's, 0 until it is agreed on."""

    number: int
    remote: Peer
    since_ns: int
    """Since when the client owes its node, or the rest of a message."""
    node: int = 0
    held: bytes = b""
    """The beginning of a message."""


@dataclass
class FinsState:
    """What the service knows."""

    busy: set[int] = field(default_factory=set)
    """Channels in use, from the request to open on."""
    closing: set[int] = field(default_factory=set)
    """Those of them that were asked to close."""
    failed: set[int] = field(default_factory=set)
    """Channels that could not be opened: they stay shut until the unit restarts."""
    udp_open: bool = False
    connections: dict[int, Connection] = field(default_factory=dict)
    """By channel."""
    learned: dict[int, Peer] = field(default_factory=dict)
    """Endpoints from which nodes have sent by UDP."""
    events: list[Event] = field(default_factory=list)
    """What the network told and has not been served yet."""
    outgoing: list[Send | SendTo] = field(default_factory=list)
    """What network instructions send in the next servicing."""
    received: int = 0
    """Datagrams, and blocks of connections, that have come for the unit since it started; its sockets count, too."""
    sent: int = 0
    """Those that it has sent."""

    @property
    def plain(self) -> tuple[Any, ...]:
        """All of it as tuples, numbers, texts and events, as recordings keep it."""
        connections = tuple((channel, found.number, found.remote.host, found.remote.port, found.since_ns, found.node, found.held)
                            for channel, found in self.connections.items())  # fmt: skip
        learned = tuple((node, peer.host, peer.port) for node, peer in self.learned.items())
        outgoing = tuple((request.channel, request.remote.host, request.remote.port, request.data)
                         if isinstance(request, SendTo) else (request.channel, "", 0, request.data)
                         for request in self.outgoing)  # fmt: skip
        return (tuple(sorted(self.busy)), tuple(sorted(self.closing)), tuple(sorted(self.failed)), self.udp_open, connections,
                learned, tuple(self.events), outgoing, self.received, self.sent)  # fmt: skip

    @classmethod
    def of(cls, plain: tuple[Any, ...]) -> FinsState:
        """The state of which these are the `plain` values."""
        busy, closing, failed, udp_open, connections, learned, events, outgoing, received, sent = plain
        return cls(
            set(busy), set(closing), set(failed), udp_open,
            {channel: Connection(number, Peer(host, port), since_ns, node, held)
             for channel, number, host, port, since_ns, node, held in connections},
            {node: Peer(host, port) for node, host, port in learned}, list(events),
            [SendTo(channel, Peer(host, port), data) if host else Send(channel, data) for channel, host, port, data in outgoing],
            received, sent,
        )  # fmt: skip
