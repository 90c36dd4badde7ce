"""Callers that wait at the host until a socket of their unit is free."""

from __future__ import annotations

import socket
from collections.abc import Callable, Collection

from fbvm.net.host_link import HostLink
from fbvm.net.notices import NoticeKind
from fbvm.net.switchboard import READ, Switchboard, Watcher
from fbvm.net.udp import reset_on_close
from fbvm.wire.link import Peer

MAX_HELD = 128
"""Callers that are held for a unit's endpoint; further ones are reset."""
PATIENCE_NS = 500_000_000
"""How long a caller has to wait until that is told."""


class WaitingCallers:
    """`backlog` says of which endpoints the host's port stays open while none of the unit's sockets waits, so that callers wait
    there: True for all."""

    def __init__(self, network: Switchboard, backlog: bool | Collection[Peer]) -> None:
        self._network, self._backlog = network, backlog
        self._kept: dict[Peer, tuple[socket.socket, _Bell]] = {}
        self.held: dict[Peer, list[tuple[socket.socket, Peer]]] = {}
        """Callers of a unit's endpoint whom the host has accepted beside the one that took its last listener."""

    def keeps(self, endpoint: Peer) -> bool:
        """True if callers of a unit's endpoint wait until a socket of the unit does."""
        return self._backlog if isinstance(self._backlog, bool) else endpoint in self._backlog

    def keep(self, link: HostLink, endpoint: Peer, sock: socket.socket) -> bool:
        """Keeps the listening socket of a unit's endpoint until its next listener opens; False if that is not wanted."""
        if keeps := self.keeps(endpoint):
            bell = _Bell(self._network, link, endpoint, sock)
            self._kept[endpoint] = sock, bell
            self._network.watch(sock, READ, bell)
        return keeps

    def take(self, endpoint: Peer) -> socket.socket | None:
        """The listening socket that was kept for a unit's endpoint, if there is one."""
        if endpoint not in self._kept:
            return None
        sock, bell = self._kept.pop(endpoint)
        bell.end()
        return sock

    def shut(self, is_shut: Callable[[Peer], bool]) -> None:
        """Turns away the callers of the endpoints that are shut, and closes their ports until their next listeners open."""
        for endpoint in filter(is_shut, {**self._kept, **self.held}):
            if sock := self.take(endpoint):
                sock.close()
            for conn, _ in self.held.pop(endpoint, []):
                reset_on_close(conn)
                conn.close()

    def close(self) -> None:
        """Closes all sockets."""
        while self._kept:
            self._kept.popitem()[1][0].close()
        while self.held:
            for conn, _ in self.held.popitem()[1]:
                conn.close()


class _Bell(Watcher):
    """Tells of a caller that waits while all sockets of a unit's endpoint are in use, if nobody lets the caller in soon."""

    def __init__(self, network: Switchboard, link: HostLink, endpoint: Peer, sock: socket.socket) -> None:
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
