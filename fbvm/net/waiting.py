"""Callers that wait at the host until a socket of their unit is free."""

from __future__ import annotations

from collections.abc import Collection
from typing import Generic, Protocol, TypeVar

from fbvm.net.host_link import HostLink
from fbvm.net.notices import NoticeKind
from fbvm.net.switchboard import READ, HasFileno, Switchboard, Watcher
from fbvm.wire.link import Peer

MAX_HELD = 128
"""Callers that are held for a unit's endpoint; further ones are reset."""
PATIENCE_NS = 500_000_000
"""How long a caller has to wait until that is told."""


class Closable(HasFileno, Protocol):
    """A socket of the host, as far as it is used here."""

    def close(self) -> None:
        """Closes it."""


Socket = TypeVar("Socket", bound=Closable)


class WaitingCallers(Generic[Socket]):
    """`backlog` says of which endpoints the host's port stays open while none of the unit's sockets waits, so that callers wait
    there: True for all."""

    def __init__(self, network: Switchboard, backlog: bool | Collection[Peer]) -> None:
        self._network, self._backlog = network, backlog
        self._kept: dict[Peer, tuple[Socket, _Bell]] = {}
        self.held: dict[Peer, list[tuple[Socket, Peer]]] = {}
        """Callers of a unit's endpoint whom the host has accepted beside the one that took its last listener."""

    def keeps(self, endpoint: Peer) -> bool:
        """True if callers of a unit's endpoint wait until a socket of the unit does."""
        return self._backlog if isinstance(self._backlog, bool) else endpoint in self._backlog

    def keep(self, link: HostLink, endpoint: Peer, sock: Socket) -> bool:
        """Keeps the listening socket of a unit's endpoint until its next listener opens; False if that is not wanted."""
        if keeps := self.keeps(endpoint):
            bell = _Bell(self._network, link, endpoint, sock)
            self._kept[endpoint] = sock, bell
            self._network.watch(sock, READ, bell)
        return keeps

    def take(self, endpoint: Peer) -> Socket | None:
        """The listening socket that was kept for a unit's endpoint, if there is one."""
        if endpoint not in self._kept:
            return None
        sock, bell = self._kept.pop(endpoint)
        bell.end()
        return sock

    @property
    def endpoints(self) -> set[Peer]:
        """The units' endpoints whose ports are kept, or whose callers are held."""
        return {*self._kept, *self.held}

    def forget(self, endpoint: Peer) -> list[Socket]:
        """The callers that are held for a unit's endpoint, and its listening socket, which nothing keeps any more."""
        sockets = [conn for conn, _ in self.held.pop(endpoint, [])]
        return [*sockets, sock] if (sock := self.take(endpoint)) else sockets

    def close(self) -> None:
        """Closes all sockets."""
        while self._kept:
            self._kept.popitem()[1][0].close()
        while self.held:
            for conn, _ in self.held.popitem()[1]:
                conn.close()


class _Bell(Watcher):
    """Tells of a caller that waits while all sockets of a unit's endpoint are in use, if nobody lets the caller in soon."""

    def __init__(self, network: Switchboard, link: HostLink, endpoint: Peer, sock: HasFileno) -> None:
        self._network, self.link, self._endpoint, self._sock = network, link, endpoint, sock
        self._over = False

    def ready(self, ready: int, now_ns: int) -> None:
        self._network.watch(self._sock, 0, self)
        self._network.call_at(now_ns + PATIENCE_NS, self._tell)

    def end(self) -> None:
        """The socket is kept no longer."""
        self._over = True
        self._network.watch(self._sock, 0, self)

    def _tell(self) -> None:
        if not self._over:
            self._network.notices.note(NoticeKind.FULL, self._endpoint, self._network.host_endpoint(self._endpoint))
