"""The vocabulary between a communication unit and a network: requests go out, events come back.

A unit never touches a connection of the host and a network never touches PLC memory; everything that passes between
them is one of these values.  A *channel* is a number that the unit chooses (its socket number); it is in use from
`Connect`, `Listen` or `Bind` until the network has answered `Close` with `Closed`, or the open has failed.

Flow control: a network hands over received bytes only as far as the unit has granted them with `Grant`.  What the unit
has no room for stays in the network, so that the TCP window closes instead of data being lost.

Nobody changes one of these values.  Those of which exchanges consist are not frozen all the same, since a frozen one takes three
times as long to make.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Peer:
    """An IPv4 endpoint: dotted address ("0.0.0.0" = any) and port (0 = any)."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


NOBODY = Peer("0.0.0.0", 0)
"""In place of a peer: anybody, or nobody in particular."""


def read_peer(host: object, port: object) -> Peer:
    """An endpoint as a file has it.  Raises ValueError for another one."""
    if type(port) is not int or not 0 <= port < 1 << 16:
        raise ValueError(f"{port!r} is no port")
    return Peer(str(IPv4Address(str(host))), port)


# --- requests: unit -> network -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Connect:
    """Open a TCP connection actively.  `local_port` 0 lets the network choose.  Answer: `Opened` or `Failed`."""

    channel: int
    remote: Peer
    local_port: int = 0
    keep_alive: bool = False


@dataclass(frozen=True, slots=True)
class Listen:
    """Wait for one TCP connection on `local_port` from a peer that fits `remote` (0 parts fit anything).

    Takes exactly one peer; other peers are refused.  Several channels may wait on one port: a peer goes to the lowest
    that it fits (assumed).  Answer: `Opened` or `Failed`; `Close` withdraws it."""

    channel: int
    local_port: int
    remote: Peer = NOBODY
    keep_alive: bool = False


@dataclass(frozen=True, slots=True)
class Bind:
    """Open a UDP channel on `local_port`.  Answer: `Opened` or `Failed`."""

    channel: int
    local_port: int


@dataclass(slots=True, unsafe_hash=True)
class Send:
    """Hand bytes to the TCP connection.  Answer: one `Sent` (all were taken) or `Failed`."""

    channel: int
    data: bytes


@dataclass(frozen=True, slots=True)
class SendTo:
    """Send one datagram.  Answer: one `Sent` or `Failed`."""

    channel: int
    remote: Peer
    data: bytes


@dataclass(slots=True, unsafe_hash=True)
class Grant:
    """Room for `size` bytes in all from now on (not added to an earlier grant).  No answer."""

    channel: int
    size: int


@dataclass(frozen=True, slots=True)
class Close:
    """Close the channel: by FIN, or by RST if `reset`.  Legal in every state.  Answer: `Closed`, always.

    After `Closed` the channel number may be used again; no event of the old connection follows."""

    channel: int
    reset: bool = False


Request = Connect | Listen | Bind | Send | SendTo | Grant | Close


# --- events: network -> unit ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Opened:
    """The channel is open (TCP: connected).  `remote` is the peer of a TCP connection, 0.0.0.0:0 for UDP."""

    channel: int
    local_port: int
    remote: Peer


@dataclass(frozen=True, slots=True)
class Failed:
    """The request named by `service` ("open", "send") failed.  `error` is the POSIX name of the errno ("ECONNREFUSED").

    After a failed open the channel is free again; after a failed send the connection still has to be closed."""

    channel: int
    service: str
    error: str


@dataclass(slots=True, unsafe_hash=True)
class Sent:
    """The network has taken all bytes of the last `Send` or `SendTo`."""

    channel: int
    size: int


@dataclass(slots=True, unsafe_hash=True)
class Received:
    """Bytes of the TCP stream, or one datagram with its sender.  Never more TCP bytes than granted."""

    channel: int
    data: bytes
    remote: Peer = NOBODY


@dataclass(frozen=True, slots=True)
class PeerClosed:
    """The peer sent FIN: nothing more will be received, sending may still be possible."""

    channel: int


@dataclass(frozen=True, slots=True)
class Broken:
    """The connection is gone (RST, time-out).  `error` is the POSIX name of the errno ("ECONNRESET", "ETIMEDOUT")."""

    channel: int
    error: str


@dataclass(frozen=True, slots=True)
class Closed:
    """`Close` is done; the channel number is free."""

    channel: int


Event = Opened | Failed | Sent | Received | PeerClosed | Broken | Closed


# --- the two sides -------------------------------------------------------------------------------------------------


class Link(Protocol):
    """The connection of one unit to a network."""

    address: str
    """IPv4 address of the unit on the network, as the program names it."""

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        """Take requests in order.  Never blocks; answers come as events of this or a later call of `events`."""

    def events(self, now_ns: int) -> Sequence[Event]:
        """The events up to `now_ns`, in order, each once.  Never blocks."""

    @property
    def is_quiet(self) -> bool:
        """True if `events` returns nothing before the next `submit`, so that it need not be called."""

    def pass_by(self, refreshes: int) -> None:
        """Counts I/O refreshes in which `events` was not called."""


class Network(Protocol):
    """A network: in memory (`net.loop`) or over the host's TCP (`net.tcp`)."""

    virtual_time: bool
    """True if time is virtual; real connections need real time."""

    def attach(self, address: str) -> Link:
        """The link of a new unit with this IPv4 address."""

    def close(self) -> None:
        """Closes all connections and frees the sockets of the host."""


class RealNetwork(Network, Protocol):
    """A network on which events happen at any time."""

    driven: bool
    """Set by a caller that calls `serve` for all links; otherwise each link calls `serve` in `events`."""

    def wait(self, timeout_s: float) -> bool:
        """Sleeps until an event happens or `timeout_s` seconds are over; True if there is an event."""

    def serve(self, now_ns: int) -> Sequence[Link]:
        """Handles all sockets that are ready; returns the links of these sockets."""
