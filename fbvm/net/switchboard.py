"""The selector of `TcpNetwork`: its links, the map of addresses, and the sockets that are ready.

Sockets are not used here; they are only registered by their file numbers.
"""

from __future__ import annotations

import errno
import select
import selectors
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

from fbvm.base import host
from fbvm.net.addresses import AddressMap
from fbvm.net.faults import Fault
from fbvm.net.host_link import HostLink
from fbvm.net.notices import NoticeKind, Notices
from fbvm.net.relays import Relays
from fbvm.wire.link import Peer
from fbvm.wire.tap import Tap, TapEvent, TapKind

READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE
TCP, UDP = "tcp", "udp"
COARSE_S = 0.001
"""The resolution of epoll's timeout, too coarse for a short cycle time: the rest is waited for by select."""
MAX_CALLERS = 64
"""Connections that a listener accepts in one scan; further ones wait in the host."""
MAX_ORPHANS = 64
ORPHAN_LIMIT_NS = 10_000_000_000
"""The time in which a closed connection must have sent its data and received the peer's FIN; then it is reset."""


def errno_name(error: OSError | int) -> str:
    """The POSIX name of an error of the host."""
    number = error if isinstance(error, int) else error.errno or errno.EIO
    return errno.errorcode.get(number, "EIO").removeprefix("WSA")


class HasFileno(Protocol):
    """A socket as a selector takes it."""

    def fileno(self) -> int:
        """Its number on the host."""


class Watcher(ABC):
    """A channel whose socket is registered with the selector."""

    link: HostLink
    """The link of the channel."""
    watched = 0
    """READ and WRITE, as far as the socket is registered for them."""

    @abstractmethod
    def ready(self, ready: int, now_ns: int) -> None:
        """Called when the socket is ready to be read (READ) or written (WRITE)."""

    @abstractmethod
    def end(self) -> None:
        """Closes the socket."""


class Orphan(Protocol):
    """A connection that its unit has closed and whose data are still being sent."""

    @property
    def sock(self) -> HasFileno | None:
        """The socket, None when the connection has ended."""

    def give_up(self, now_ns: int) -> None:
        """Ends the connection by RST."""

    def end(self) -> None:
        """Closes the socket."""


class Switchboard(ABC):
    """A selector for the sockets of all links, and the map of addresses.  `seed` and `faults` as in the network in memory."""

    def __init__(self, address_map: AddressMap, seed: int = 0, faults: Iterable[Fault] = ()) -> None:
        self.tap: Tap | None = None
        self.map = address_map
        self.links: dict[str, HostLink] = {}
        self.doors: dict[Peer, Peer] = {}
        """What `try_doors` has found: endpoints of units with those of the host."""
        self.relays = Relays(self.links, self.link_behind, self.tell, seed, faults)
        """The connections that are under faults."""
        self.notices = Notices()
        """Set `notices.tell` to be told what no program is told."""
        self._selector = selectors.DefaultSelector()
        self._number = host.selector_number(self._selector)
        self.watched = 0
        """The number of sockets that are registered with the selector."""
        self._found: list[tuple[selectors.SelectorKey, int]] = []
        """The sockets that were ready in the last `wait`."""
        self._own: dict[tuple[str, Peer], Peer] = {}
        self._orphans: deque[tuple[int, Orphan]] = deque()
        self._calls: deque[tuple[int, Callable[[], None]]] = deque()
        self.links_pending: set[HostLink] = set()
        """Links that may have pending events although none of their sockets is ready."""
        self.closed = False
        self._driven = False

    @abstractmethod
    def host_endpoint(self, endpoint: Peer, transport: str = TCP) -> Peer:
        """The endpoint of the host for a unit's own endpoint."""

    def listening_endpoint(self, endpoint: Peer, transport: str = TCP) -> Peer:
        """The endpoint of the host for a unit that wants to listen.  Raises OSError if it may not."""
        if not self.map.is_mapped(endpoint):
            self.notices.note(NoticeKind.NOT_MAPPED, endpoint, self.map.local(endpoint))
            raise OSError(errno.EACCES, "not mapped")
        return self.host_endpoint(endpoint, transport)

    @property
    def connections(self) -> int:
        """How many connections of units are open."""
        return sum(channel.is_connected for link in self.links.values() for channel in link.channels.values())

    def try_doors(self, endpoints: Iterable[Peer]) -> dict[Peer, Peer]:
        """Tries whether units will be able to listen on their endpoints; returns where on the host each is.

        Raises OSError with a message that names endpoint and port: for an endpoint of no unit, for two on one port, and for a
        port that the host does not give."""
        found: dict[Peer, Peer] = {}
        by_port: dict[int, dict[str, Peer]] = {}
        """The endpoints by the port and the address of their doors."""
        for endpoint in endpoints:
            if endpoint.host not in self.links:
                there = ", ".join(sorted(self.links)) or "none"
                raise OSError(f"{endpoint} cannot be used: no unit has the address {endpoint.host}; units: {there}")
            self.try_door(self.map.local(endpoint))
            real = self.host_endpoint(endpoint)
            others = by_port.setdefault(real.port, {})
            every = next(iter(others.values()), None) if real.host == "0.0.0.0" else None
            if taken := others.get(real.host) or others.get("0.0.0.0") or every:
                raise OSError(f"{real} cannot be used for {endpoint}: it is the door of {taken}")
            others[real.host] = endpoint
            found[endpoint] = real
        self.doors |= found
        return found

    @abstractmethod
    def try_door(self, real: Peer, transport: str = TCP) -> None:
        """Tries whether a unit will be able to listen at an endpoint of the host.  Raises OSError that names it."""

    @abstractmethod
    def link_behind(self, address: str) -> HostLink:
        """A link for connections of the host behind those of a unit; the unit does not see its events."""

    @property
    def faults(self) -> list[Fault]:
        """The rows of `net.faults`, which may be changed at any time."""
        return self.relays.faults

    @faults.setter
    def faults(self, rows: Iterable[Fault]) -> None:
        self.relays.faults[:] = rows

    @property
    def driven(self) -> bool:
        """True if a caller calls `serve` for all links; else each link calls `serve` in `events`."""
        return self._driven

    @driven.setter
    def driven(self, driven: bool) -> None:
        self._driven = driven
        for link in self.links.values():
            link.driven, link.is_quiet = driven, False

    @property
    def is_idle(self) -> bool:
        """True if no socket is registered with the selector, and no connection is under faults."""
        return not self.watched and not self.relays.carried

    def wait(self, timeout_s: float) -> bool:
        """Sleeps until a socket is ready or `timeout_s` seconds are over; True if there are events to fetch."""
        if self.closed:
            return True
        for link in self.links_pending:
            if link.pending:
                return True
        self.links_pending.clear()
        timeout_s = max(timeout_s, 0.0)
        if self.relays.carried and (due_s := self.relays.until_due_s()) is not None and due_s < timeout_s:
            return self._wait(due_s) or True
        return self._wait(timeout_s)

    def _wait(self, timeout_s: float) -> bool:
        coarse_s = timeout_s if self._number is None else timeout_s // COARSE_S * COARSE_S
        if coarse_s or self._number is None:
            self._found = host.select(self._selector, coarse_s)
        if self._found or self._number is None:
            return bool(self._found)
        return bool(select.select([self._number], [], [], timeout_s - coarse_s)[0])

    def serve(self, now_ns: int) -> list[HostLink]:
        """Handles every socket that is ready; returns the links of these sockets."""
        if self.closed:
            return []
        woken: dict[HostLink, None] = {}
        under_faults = self.relays.faults or self.relays.carried
        if under_faults:
            self.relays.meet(now_ns)
        found, self._found = self._found, []
        if not found and self.watched:
            found = self._selector.select(0)
        for key, ready in found:
            watcher: Watcher = key.data
            watcher.ready(ready, now_ns)
            woken[watcher.link] = None
        for link in woken:
            link.is_quiet = False
            if link.pending:
                link.mark_pending()
        while self._orphans and (self._orphans[0][1].sock is None or self._orphans[0][0] <= now_ns):
            self._orphans.popleft()[1].give_up(now_ns)
        while self._calls and self._calls[0][0] <= now_ns:
            self._calls.popleft()[1]()
        return [*woken, *self._serve_relays(now_ns)] if under_faults else [*woken]

    def _serve_relays(self, now_ns: int) -> list[HostLink]:
        """Serves the connections under faults; returns the links that have events then."""
        self.relays.meet(now_ns)
        woken = self.relays.serve(now_ns)
        for link in woken:
            link.is_quiet = False
            if link.pending:
                link.mark_pending()
        return woken

    def close(self) -> None:
        """Closes all connections and sockets."""
        for link in (*self.links.values(), *self.relays.close()):
            while link.channels:
                _, there = link.channels.popitem()
                if isinstance(there, Watcher):
                    there.end()
        for _, orphan in self._orphans:
            orphan.end()
        self.links.clear()
        self._orphans.clear()
        self._selector.close()
        self.closed = True

    # Called by links and their channels.

    def watch(self, sock: HasFileno, wanted: int, channel: Watcher) -> None:
        """Registers a socket for READ, WRITE, both, or, with 0, no longer."""
        if wanted == channel.watched:
            return
        if not wanted:
            self._selector.unregister(sock)
            self.watched -= 1
        elif channel.watched:
            self._selector.modify(sock, wanted, channel)
        else:
            self._selector.register(sock, wanted, channel)
            self.watched += 1
        channel.watched = wanted

    def adopt(self, orphan: Orphan, now_ns: int) -> None:
        """Keeps a closed connection until it has ended."""
        self._orphans.append((now_ns + ORPHAN_LIMIT_NS, orphan))
        if len(self._orphans) > MAX_ORPHANS:
            self._orphans.popleft()[1].give_up(now_ns)

    def call_at(self, due_ns: int, call: Callable[[], None]) -> None:
        """Calls a function in the first `serve` at or after `due_ns`; calls have to be due in the order of their making."""
        self._calls.append((due_ns, call))

    def own(self, transport: str, real: Peer, endpoint: Peer | None) -> None:
        """Notes which endpoint of a unit an endpoint of the host belongs to; None removes the note."""
        where = transport, Peer("127.0.0.1", real.port) if real.host == "0.0.0.0" else real
        if endpoint:
            self._own[where] = endpoint
        else:
            self._own.pop(where, None)

    def outward(self, remote: Peer, transport: str = TCP) -> Peer:
        """The endpoint of the host for a peer that the program names."""
        if remote.host not in self.links:
            return self.map.outward(remote)
        real = self.host_endpoint(remote, transport)
        return Peer("127.0.0.1", real.port) if real.host == "0.0.0.0" else real

    def inward(self, transport: str, real: Peer) -> Peer:
        """The endpoint of the program for a peer that has connected or sent a datagram."""
        return self._own.get((transport, real)) or self.map.inward(real, self.links)

    def tell(self, now_ns: int, what: TapKind, local: Peer, remote: Peer, out: bool, data: bytes = b"") -> None:
        """Reports an event to the tap."""
        if self.tap:
            self.tap(now_ns, local.host, TapEvent(what, local, remote, out, data, remote.host in self.links))
