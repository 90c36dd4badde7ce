"""What `TcpNetwork` keeps in mind: the links, who is where, which connections the host is ready for.

No sockets in here; they pass through as things with a file number.
"""

from __future__ import annotations

import errno
import select
import selectors
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Protocol

from fbvm.net.addresses import AddressMap
from fbvm.net.host_link import HostLink
from fbvm.wire.link import Peer
from fbvm.wire.tap import Tap, TapEvent, TapKind

READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE
TCP, UDP = "tcp", "udp"
FD_SETSIZE = 1024
COARSE_S = 0.001
"""To what epoll rounds a timeout up, which is long for a short cycle time: the rest of it is waited for by select."""
MAX_CALLERS = 64
"""Callers that a listener looks at in one scan; the others wait in the host."""
MAX_ORPHANS = 64
ORPHAN_LIMIT_NS = 10_000_000_000
"""A closed connection gets so long to send its rest and to hear the peer's FIN, then it is reset."""


def errno_name(error: OSError | int) -> str:
    """The POSIX name of an error of the host."""
    number = error if isinstance(error, int) else error.errno or errno.EIO
    return errno.errorcode.get(number, "EIO").removeprefix("WSA")


def _number(selector: selectors.BaseSelector) -> int | None:
    """File number by which a selector itself can be waited for; None if it has none, or one too high for select."""
    fileno: Callable[[], int] | None = getattr(selector, "fileno", None)
    number = fileno() if fileno else -1
    return number if 0 <= number < FD_SETSIZE else None


class HasFileno(Protocol):
    """A socket, as far as a selector is concerned."""

    def fileno(self) -> int:
        """Its number on the host."""


class Watcher(ABC):
    """Somebody who is told when the host is ready, and who can let go of what the host lent."""

    link: HostLink
    """Whose it is."""
    watched = 0
    """What of the host it waits for at the moment."""

    @abstractmethod
    def ready(self, ready: int, now_ns: int) -> None:
        """The host is ready for what was wanted (READ, WRITE)."""

    @abstractmethod
    def end(self) -> None:
        """Give everything back to the host."""


class Orphan(Protocol):
    """A connection that its unit has closed, and that has not ended yet."""

    @property
    def sock(self) -> HasFileno | None:
        """None when it has ended."""

    def give_up(self, now_ns: int) -> None:
        """End it by RST."""

    def end(self) -> None:
        """Give everything back to the host."""


class Switchboard(ABC):
    """One selector, the map of addresses, and the bookkeeping around them."""

    def __init__(self, address_map: AddressMap) -> None:
        self.tap: Tap | None = None
        self.map = address_map
        self.links: dict[str, HostLink] = {}
        self._selector = selectors.DefaultSelector()
        self._number = _number(self._selector)
        self.watched = 0
        """How many sockets the selector has."""
        self._found: list[tuple[selectors.SelectorKey, int]] = []
        """What the host was ready for when somebody waited."""
        self._own: dict[tuple[str, Peer], Peer] = {}
        self._orphans: deque[tuple[int, Orphan]] = deque()
        self.unheard: set[HostLink] = set()
        """Links that may have something to tell, besides what the host is ready for."""
        self.closed = False
        self._driven = False

    @abstractmethod
    def host_endpoint(self, endpoint: Peer, transport: str = TCP) -> Peer:
        """Where on the host a unit's own endpoint is."""

    @property
    def driven(self) -> bool:
        """True while somebody else calls `serve` whenever time goes on, for all links at once."""
        return self._driven

    @driven.setter
    def driven(self, driven: bool) -> None:
        self._driven = driven
        for link in self.links.values():
            link.is_quiet = False

    def wait(self, timeout_s: float) -> bool:
        """Sleep until a connection wants attention or the time is over; True if there is something to fetch."""
        if self.closed:
            return True
        for link in self.unheard:
            if link.told:
                return True
        self.unheard.clear()
        timeout_s = max(timeout_s, 0.0)
        coarse_s = timeout_s if self._number is None else timeout_s // COARSE_S * COARSE_S
        if coarse_s or self._number is None:
            self._found = self._selector.select(coarse_s)
        if self._found or self._number is None:
            return bool(self._found)
        return bool(select.select([self._number], [], [], timeout_s - coarse_s)[0])

    def serve(self, now_ns: int) -> list[HostLink]:
        """Do everything that the host is ready for; whose connections that was."""
        if self.closed:
            return []
        woken: list[HostLink] = []
        found, self._found = self._found, []
        if not found and self.watched:
            found = self._selector.select(0)
        for key, ready in found:
            watcher: Watcher = key.data
            watcher.ready(ready, now_ns)
            link = watcher.link
            link.is_quiet = False
            if link.told:
                link.stir()
            woken.append(link)
        while self._orphans and (self._orphans[0][1].sock is None or self._orphans[0][0] <= now_ns):
            self._orphans.popleft()[1].give_up(now_ns)
        return woken

    def close(self) -> None:
        """End all connections and free what the host lent."""
        for link in self.links.values():
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

    # For links and their channels.

    def watch(self, sock: HasFileno, wanted: int, channel: Watcher) -> None:
        """Be told when the host is ready for what is wanted: READ, WRITE, both or nothing."""
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
        """Keep a closed connection until it has ended."""
        self._orphans.append((now_ns + ORPHAN_LIMIT_NS, orphan))
        if len(self._orphans) > MAX_ORPHANS:
            self._orphans.popleft()[1].give_up(now_ns)

    def own(self, transport: str, real: Peer, said: Peer | None) -> None:
        """Note, or forget with None, that an endpoint of the host is a unit's."""
        where = transport, Peer("127.0.0.1", real.port) if real.host == "0.0.0.0" else real
        if said:
            self._own[where] = said
        else:
            self._own.pop(where, None)

    def outward(self, remote: Peer, transport: str = TCP) -> Peer:
        """Where on the host the program's peer is."""
        if remote.host not in self.links:
            return self.map.outward(remote)
        real = self.host_endpoint(remote, transport)
        return Peer("127.0.0.1", real.port) if real.host == "0.0.0.0" else real

    def inward(self, transport: str, real: Peer) -> Peer:
        """What the program calls a peer that came by itself."""
        return self._own.get((transport, real)) or self.map.inward(real, self.links)

    def tell(self, now_ns: int, what: TapKind, local: Peer, remote: Peer, out: bool, data: bytes = b"") -> None:
        """Pass a happening on to the tap."""
        if self.tap:
            self.tap(now_ns, local.host, TapEvent(what, local, remote, out, data, remote.host in self.links))
