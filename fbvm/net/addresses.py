"""Endpoints: the addresses that a PLC program uses, and the endpoints of the host that they are mapped to.

No connections are made here; host names have been resolved before."""

from __future__ import annotations

import errno
from collections.abc import Container, Mapping
from ipaddress import IPv4Address

from fbvm.wire.link import Peer

FIRST_FREE_PORT = 1024
"""Ports below belong to services of the host."""


def fits(pattern: Peer, peer: Peer) -> bool:
    """True if `peer` is the pattern, where host 0.0.0.0 and port 0 of the pattern fit anything."""
    return pattern.host in ("0.0.0.0", peer.host) and pattern.port in (0, peer.port)


def impossible(local: Peer, remote: Peer) -> str:
    """The errno name with which a connection from `local` to `remote` fails at once, "" if none.

    A broadcast address and the own port are refused by the unit's stack with these errors (W343-E1-1 p100-101)."""
    if remote.host == "255.255.255.255":
        return "EACCES"
    if not 0 < remote.port <= 0xFFFF or remote.host == "0.0.0.0" or remote == local:
        return "EADDRNOTAVAIL"
    return ""


def dotted(real: Peer) -> tuple[str, int]:
    """An endpoint as the socket functions take it.  Raises OSError for a host name, whose resolution could block."""
    try:
        return str(IPv4Address(real.host)), real.port
    except ValueError:
        raise OSError(errno.EADDRNOTAVAIL, real.host) from None


def why_unusable(error: OSError) -> str:
    """Why a port of the host cannot be listened on, in words."""
    known = {
        errno.EADDRINUSE: "somebody else listens there",
        errno.EADDRNOTAVAIL: "it is not an address of this host",
        errno.EACCES: "the system does not allow it; ports from 1024 on need no rights",
        errno.EPERM: "the system does not allow it; ports from 1024 on need no rights",
    }  # fmt: skip
    return known.get(error.errno or 0) or (error.strerror or str(error)).lower()


def is_reachable(host: str) -> bool:
    """True if other computers can reach a port that is bound to this address of the host."""
    try:
        return not IPv4Address(host).is_loopback
    except ValueError:
        return host != "localhost"


class AddressMap:
    """Maps endpoints of the program to endpoints of the host; an endpoint without a row is mapped to itself.

    `rows` are pairs of an endpoint of the program and one of the host.  A row for port 0 is for every port of its address.
    A row to port 0 keeps the port when connecting, and lets the system choose one when listening.  Units listen on the
    host's address `bind` where no row says another, but not on a port below 1024: those belong to the host.  `door` is where on
    the host the first endpoint listens that has no row."""

    def __init__(self, rows: Mapping[Peer, Peer], bind: str, door: Peer | None = None) -> None:
        self._rows = dict(rows)
        self._bind = bind
        self._door = door
        self._used: set[Peer] = set()

    @property
    def unused(self) -> list[Peer]:
        """The endpoints of the program whose rows have not been used so far."""
        return [endpoint for endpoint in self._rows if endpoint not in self._used]

    def outward(self, remote: Peer) -> Peer:
        """The endpoint of the host to which to connect, or to send a datagram."""
        real = self._row(remote)
        return Peer(real.host, real.port or remote.port) if real else remote

    def local(self, endpoint: Peer) -> Peer:
        """The endpoint of the host on which to listen for a unit's endpoint; port 0 lets the system choose one."""
        return self._row(endpoint) or Peer(self._bind, endpoint.port)

    def is_mapped(self, endpoint: Peer) -> bool:
        """True if a unit may listen at this endpoint: it has a row, gets the door now, or its port is none of the host's own."""
        if self._row(endpoint):
            return True
        if self._door and endpoint.port:
            self._rows[endpoint], self._door = self._door, None
            return True
        return not 0 < endpoint.port < FIRST_FREE_PORT

    def inward(self, caller: Peer, own: Container[str]) -> Peer:
        """The endpoint of the program for a caller from the host: by the first row to this very endpoint, else by the
        first row to its address.  Rows for `own` addresses, those of units, are for listening and are left out."""
        others = [(endpoint, real) for endpoint, real in self._rows.items() if endpoint.host not in own]
        for endpoint, real in others:
            if real == caller:
                self._used.add(endpoint)
                return Peer(endpoint.host, endpoint.port or caller.port)
        for endpoint, real in others:
            if real == Peer(caller.host, 0) and endpoint.port == 0:
                self._used.add(endpoint)
                return Peer(endpoint.host, caller.port)
        return caller

    def _row(self, endpoint: Peer) -> Peer | None:
        for known in (endpoint, Peer(endpoint.host, 0)):
            if known in self._rows:
                self._used.add(known)
                return self._rows[known]
        return None
