"""Endpoints: the addresses that a PLC program uses, and where on the host they really are.

Nothing here touches a connection; names of hosts have been resolved before."""

from __future__ import annotations

import errno
from collections.abc import Container, Mapping
from ipaddress import IPv4Address

from fbvm.wire.link import Peer


def fits(pattern: Peer, peer: Peer) -> bool:
    """True if `peer` is the pattern, where host 0.0.0.0 and port 0 of the pattern fit anything."""
    return pattern.host in ("0.0.0.0", peer.host) and pattern.port in (0, peer.port)


def impossible(local: Peer, remote: Peer) -> str:
    """The errno name of why nobody can connect from `local` to `remote`; "" if it may be tried.

    A broadcast address and the own port are refused by the unit's stack with these errors (W343-E1-1 p100-101)."""
    if remote.host == "255.255.255.255":
        return "EACCES"
    if not 0 < remote.port <= 0xFFFF or remote.host == "0.0.0.0" or remote == local:
        return "EADDRNOTAVAIL"
    return ""


def dotted(real: Peer) -> tuple[str, int]:
    """An endpoint for the host.  Raises OSError for a name, which would have to be looked up and so could block."""
    try:
        return str(IPv4Address(real.host)), real.port
    except ValueError:
        raise OSError(errno.EADDRNOTAVAIL, real.host) from None


class AddressMap:
    """Rows "what the program says" -> "where on the host".  What has no row is used as it is.

    A row for port 0 holds for every port of its address.  A row to port 0 keeps the port when connecting, and lets the
    system choose one when listening."""

    def __init__(self, rows: Mapping[Peer, Peer], bind: str) -> None:
        self._rows = dict(rows)
        self._bind = bind
        self._used: set[Peer] = set()

    @property
    def unused(self) -> list[Peer]:
        """What the program was said to name, and did not name until now."""
        return [said for said in self._rows if said not in self._used]

    def outward(self, remote: Peer) -> Peer:
        """Where to connect to, or send a datagram to."""
        real = self._row(remote)
        return Peer(real.host, real.port or remote.port) if real else remote

    def local(self, endpoint: Peer) -> Peer:
        """Where to listen for a unit's endpoint; port 0: the system has to choose one."""
        return self._row(endpoint) or Peer(self._bind, endpoint.port)

    def inward(self, caller: Peer, own: Container[str]) -> Peer:
        """What the program calls a caller from the host: by the first row that leads to just this endpoint, else by
        the first that leads to its whole address.  Rows for `own` addresses say where to listen, not who calls."""
        others = [(said, real) for said, real in self._rows.items() if said.host not in own]
        for said, real in others:
            if real == caller:
                self._used.add(said)
                return Peer(said.host, said.port or caller.port)
        for said, real in others:
            if real == Peer(caller.host, 0) and said.port == 0:
                self._used.add(said)
                return Peer(said.host, caller.port)
        return caller

    def _row(self, endpoint: Peer) -> Peer | None:
        for said in (endpoint, Peer(endpoint.host, 0)):
            if said in self._rows:
                self._used.add(said)
                return self._rows[said]
        return None
