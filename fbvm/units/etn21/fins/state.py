"""How the FINS service of a unit is set, and all that it knows between two scans."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
BEFORE_CLIENTS = 130
"""The channel of connection k, where this unit is the client, is this and k."""
ACCESS = {"full": FinsAccess(), "no-control": FinsAccess(may_control=False),
          "read-only": FinsAccess(may_write=False, may_control=False)}  # fmt: skip
"""What commands that come in may do, by the word that a project has for it."""


@dataclass(frozen=True)
class FinsSettings:
    """How the service is set.

    `node` None is the host part of the unit's address, as automatic address generation has it; 0 takes frames for every node.
    `nodes` is the IP address table: nodes with an endpoint of their own.  `clients` are the FINS/TCP connections of which this
    unit is the client, by number, each with its server; all others wait for clients, of which `permitted` are the addresses, all
    if it is empty.  With `error_flags` end codes of the CPU unit say whether it has an error.  Raises ValueError for what cannot
    be."""

    address: str
    unit_number: int = 0
    port: int = PORT
    node: int | None = None
    nodes: Mapping[int, Peer] = field(default_factory=dict)
    clients: Mapping[int, Peer] = field(default_factory=dict)
    permitted: tuple[str, ...] = ()
    error_flags: bool = False
    access: FinsAccess = ACCESS["full"]

    def __post_init__(self) -> None:
        if not 0 < self.port < 65_536:
            raise ValueError(f"FINS port {self.port} is not in 1..65535")
        if self.node is not None and not 0 <= self.node <= LAST_NODE:
            raise ValueError(f"FINS node {self.node} is not in 1..{LAST_NODE}, nor 0 for every node")
        for node in self.nodes:
            if not 0 < node <= LAST_NODE:
                raise ValueError(f"FINS node {node} is not in 1..{LAST_NODE}")
        for number, server in self.clients.items():
            if number not in CONNECTIONS:
                raise ValueError(f"FINS/TCP connection {number} is not in 1..{CONNECTIONS[-1]}")
            if server.host == self.address:
                raise ValueError(f"FINS/TCP connection {number} leads to the unit itself, {server.host}")

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


def endpoints_of(written: Mapping[str, str], what: str = "node") -> dict[int, Peer]:
    """Endpoints by node, or by number of connection (`what` names it), as projects write them: `{"2" = "192.168.250.2"}`, with a
    port where that is not 9600.  Raises ValueError."""
    found = {}
    for number, endpoint in written.items():
        host, _, port = endpoint.partition(":")
        parts = host.split(".")
        if not number.isdecimal() or len(parts) != 4 or not all(part.isdecimal() and int(part) < 256 for part in parts) or (
                port and not (port.isdecimal() and 0 < int(port) < 65_536)):  # fmt: skip
            raise ValueError(f'"{number}" = "{endpoint}" is no {what} with its address; write "2" = "192.168.250.2"')
        found[int(number)] = Peer(host, int(port or PORT))
    return found


@dataclass
class Connection:
    """A FINS/TCP connection that is open.

    `number` is 1 to 16, or 0 for a client for whom there is none; `node` is that of the other side, 0 until it is agreed on.
    `is_client` says whether this unit has opened it."""

    number: int
    local_port: int
    remote: Peer
    is_client: bool
    since_ns: int
    """Since when the other side owes its node, or the rest of a message."""
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
    dialled: dict[int, Peer] = field(default_factory=dict)
    """Where connections of which this unit is the client lead or are to lead, by channel."""
    retry_ns: dict[int, int] = field(default_factory=dict)
    """When such a channel is opened again at the earliest."""
    changed_servers: dict[int, Peer] = field(default_factory=dict)
    """Servers that 2730 has given to such connections, by number, until the unit restarts."""

    @property
    def plain(self) -> tuple[Any, ...]:
        """All of it as tuples, numbers, texts and events, as recordings keep it."""
        connections = tuple(
            (channel, found.number, found.local_port, found.remote.host, found.remote.port, found.is_client, found.since_ns,
             found.node, found.held)
            for channel, found in self.connections.items())  # fmt: skip
        outgoing = tuple((request.channel, request.remote.host, request.remote.port, request.data)
                         if isinstance(request, SendTo) else (request.channel, "", 0, request.data)
                         for request in self.outgoing)  # fmt: skip
        return (tuple(sorted(self.busy)), tuple(sorted(self.closing)), tuple(sorted(self.failed)), self.udp_open, connections,
                _rows(self.learned), tuple(self.events), outgoing, self.received, self.sent, _rows(self.dialled),
                tuple(self.retry_ns.items()), _rows(self.changed_servers))  # fmt: skip

    @classmethod
    def of(cls, plain: tuple[Any, ...]) -> FinsState:
        """The state of which these are the `plain` values."""
        (busy, closing, failed, udp_open, connections, learned, events, outgoing, received, sent, dialled, retry_ns,
         changed) = plain  # fmt: skip
        return cls(
            set(busy), set(closing), set(failed), udp_open,
            {channel: Connection(number, local_port, Peer(host, port), is_client, since_ns, node, held)
             for channel, number, local_port, host, port, is_client, since_ns, node, held in connections},
            _peers(learned), list(events),
            [SendTo(channel, Peer(host, port), data) if host else Send(channel, data) for channel, host, port, data in outgoing],
            received, sent, _peers(dialled), dict(retry_ns), _peers(changed),
        )  # fmt: skip


def _rows(peers: Mapping[int, Peer]) -> tuple[tuple[int, str, int], ...]:
    return tuple((key, peer.host, peer.port) for key, peer in peers.items())


def _peers(rows: Iterable[tuple[int, str, int]]) -> dict[int, Peer]:
    return {key: Peer(host, port) for key, host, port in rows}
