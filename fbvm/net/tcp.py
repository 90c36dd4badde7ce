"""The host's own network: units talk to real devices and programs over real TCP and UDP, and nothing ever blocks.

One selector serves all links; sockets are handled in `events` and `submit` of a link: here, in `net.connections`, `net.udp`.
"""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress

from fbvm.net.addresses import AddressMap, fits, why_unusable
from fbvm.net.connections import Connection
from fbvm.net.faults import Fault
from fbvm.net.host_link import HostLink
from fbvm.net.notices import NoticeKind
from fbvm.net.relays import Relays
from fbvm.net.switchboard import MAX_CALLERS, READ, TCP, UDP, Switchboard, errno_name
from fbvm.net.udp import HostChannel, SocketLink, UdpPort, has_left, reserve, reset_on_close, try_to_listen
from fbvm.net.waiting import MAX_HELD, WaitingCallers
from fbvm.wire.link import Bind, Connect, Event, Listen, Peer


class TcpNetwork(Switchboard):
    """Real connections.  `address_map` maps endpoints of the program to hosts and ports (see `AddressMap`).

    A unit without a row listens on the host's address `bind`, on the port of its request if that is 1024 or above; the first
    one listens at `door`, if given.  Host names of the map are resolved here, once.

    With `backlog`, True or the endpoints of units, the host keeps a port open on which a unit has listened: who calls while no
    socket of the unit waits is let in as soon as one does.  Without, the unit refuses such a caller, unless the host accepted it
    together with the last one.  `faults` are rows of `net.faults`, `seed` seeds them.  Raises OSError for a bad name."""

    virtual_time = False

    def __init__(self, address_map: Mapping[Peer, tuple[str, int]] | None = None, bind: str = "127.0.0.1", *,
                 door: Peer | None = None, backlog: bool | Collection[Peer] = False, seed: int = 0,
                 faults: Iterable[Fault] = ()) -> None:  # fmt: skip
        rows = {said: Peer(socket.gethostbyname(host), port) for said, (host, port) in (address_map or {}).items()}
        super().__init__(AddressMap(rows, bind, door), seed, faults)
        self.waiting: WaitingCallers[socket.socket] = WaitingCallers(self, backlog)
        """Callers for whom no socket of their unit is free."""
        self._reserved: dict[tuple[str, Peer], tuple[Peer, socket.socket | None]] = {}

    def attach(self, address: str) -> TcpLink:
        """The link of a new unit.  Raises ValueError if the address is in use."""
        if address in self.links:
            raise ValueError(f"{address} is attached already")
        link = self.links[address] = TcpLink(self, address)
        link.driven = self.driven
        return link

    def link_behind(self, address: str) -> HostLink:
        return _LinkBehind(self, address)

    def host_endpoint(self, endpoint: Peer, transport: str = TCP) -> Peer:
        """The endpoint of the host for a unit's own endpoint, also before the unit listens.

        A port that the system has to choose is chosen now, for TCP and UDP, and stays.  Raises OSError if there is none."""
        real = self.map.local(endpoint)
        if real.port:
            return real
        if (transport, endpoint) not in self._reserved:
            other, _ = self._reserved.get((UDP if transport == TCP else TCP, endpoint), (None, None))
            self._reserved[transport, endpoint] = (other, None) if other else reserve(real.host, transport)
        return self._reserved[transport, endpoint][0]

    def try_door(self, real: Peer, transport: str = TCP) -> None:
        try_to_listen(real, transport)

    def _serve_relays(self, now_ns: int) -> list[HostLink]:
        woken = super()._serve_relays(now_ns)
        for endpoint in filter(self.relays.shuts, self.waiting.endpoints):
            for sock in self.waiting.forget(endpoint):
                with suppress(OSError), sock:
                    reset_on_close(sock)
        return woken

    def close(self) -> None:
        """Closes all connections and sockets."""
        super().close()
        self.waiting.close()
        for _, keeper in self._reserved.values():
            if keeper:
                keeper.close()
        self._reserved.clear()


class TcpLink(SocketLink):
    """The link of one unit of a `TcpNetwork`."""

    network: TcpNetwork

    def open(self, request: Connect | Listen | Bind, now_ns: int) -> None:
        if isinstance(request, Connect) and self._is_under_faults(request):
            self.network.relays.open(self, request, now_ns)
            self.is_quiet = False
            return
        channel = self.channels[request.channel] = _KINDS[type(request)](self, request)
        self.is_quiet = False
        try:
            if self.network.closed:
                raise OSError(errno.ENETDOWN, "closed")
            channel.open(now_ns)
        except OSError as error:
            channel.failed(errno_name(error))

    def _is_under_faults(self, request: Connect) -> bool:
        relays, local = self.network.relays, Peer(self.address, request.local_port)
        return bool(relays.faults) and self.is_seen and not self.network.closed and relays.concern(local, request.remote)


class _LinkBehind(TcpLink):
    """The link of connections of the host behind those of a unit, which the relays ask for events."""

    is_seen = False

    def events(self, now_ns: int) -> Sequence[Event]:
        self.fetch(now_ns)
        events, self.pending = self.pending, []
        return events


# --- channels ------------------------------------------------------------------------------------------------------


class _Listener(HostChannel):
    """Listens for one connection from a peer that fits; other connections are reset.

    Several listeners may share a port: one has the host's socket, the lowest-numbered takes the connection (assumed)."""

    link: TcpLink
    _has_caller = False

    def __init__(self, link: TcpLink, request: Listen) -> None:
        super().__init__(link, request)
        self._request = request

    def open(self, now_ns: int) -> None:
        if self.network.relays.shuts(self.local):
            return
        if not any(listener.sock for listener in self._listeners()):
            self.sock = sock = self.link.network.waiting.take(self.local)
            if sock is None:
                sock = self._listen()
            self.network.watch(sock, READ, self)
        if waiting := self.link.network.waiting.held.pop(self.local, []):
            while waiting and self._listeners():
                self._let_in(*waiting.pop(0), now_ns, has_waited=True)
            self.link.network.waiting.held[self.local] = waiting + self.link.network.waiting.held.get(self.local, [])

    def _listen(self) -> socket.socket:
        """The host's socket for this endpoint.  Raises OSError."""
        real = self.network.listening_endpoint(self.local)
        try:
            sock = self.make(socket.SOCK_STREAM, real)
            sock.listen()
        except OSError as error:
            self.network.notices.note(NoticeKind.UNUSABLE, self.local, real, why_unusable(error))
            raise
        self.network.notices.note(NoticeKind.LISTENING, self.local, real)
        return sock

    def end(self) -> None:
        heir = next(iter(self._listeners()), None)
        sock, self.sock = self.sock, None
        if sock:
            self.network.watch(sock, 0, self)
        if sock and heir:
            heir.sock = sock
            self.network.watch(sock, READ, heir)
        elif sock and not self.link.network.waiting.keep(self.link, self.local, sock):
            if self._has_caller:
                self._hold(sock)
            sock.close()
        super().end()

    def _hold(self, sock: socket.socket) -> None:
        """Holds the callers that the host has accepted beside the one who takes the last listener; the others would be reset
        when the socket is closed, and this is the last moment before that."""
        held = self.link.network.waiting.held.setdefault(self.local, [])
        with suppress(OSError):
            while len(held) < MAX_HELD:
                conn, name = sock.accept()
                held.append((conn, Peer(*name)))

    def ready(self, ready: int, now_ns: int) -> None:
        for _ in range(MAX_CALLERS):
            if self.sock is None:
                return
            try:
                conn, name = self.sock.accept()
            except OSError as error:
                if not isinstance(error, BlockingIOError | ConnectionAbortedError):
                    self.failed(errno_name(error))
                return
            self._let_in(conn, Peer(*name), now_ns, has_waited=self.link.network.waiting.keeps(self.local))

    def _let_in(self, conn: socket.socket, real: Peer, now_ns: int, has_waited: bool) -> None:
        """Gives a caller that the host has accepted to the first listener that it fits; resets a stranger.  Who `has_waited` may
        have left in the meantime."""
        network, listeners = self.link.network, self._listeners()
        remote = network.inward(TCP, real)
        if has_waited and has_left(conn):
            conn.close()
        elif (listener := next((listener for listener in listeners if fits(listener._request.remote, remote)), None)) and not (
            network.relays.refuse(self.local, remote)
        ):
            listener._has_caller = True
            del listener.link.channels[listener.channel]
            listener.end()
            request = Connect(listener.channel, remote, listener.local.port, listener._request.keep_alive)
            connection = listener.link.channels[listener.channel] = Connection(listener.link, request)
            connection.granted = listener.granted
            connection.accept(conn, now_ns)
        else:
            network.notices.note(NoticeKind.TURNED_AWAY, self.local, real)
            with suppress(OSError), conn:
                reset_on_close(conn)

    def meet_faults(self, relays: Relays, now_ns: int) -> None:
        """A fault that refuses every caller shuts the host's socket; a silent one leaves callers waiting in the host."""
        listeners = self._listeners()
        if listeners[0] is not self:
            return
        fault = relays.door(self.local)
        holder = next((listener for listener in listeners if listener.sock), None)
        if holder and holder.sock and relays.shuts(self.local):
            self.network.watch(holder.sock, 0, holder)
            holder.sock.close()
            holder.sock = None
        elif holder and holder.sock:
            self.network.watch(holder.sock, 0 if fault.silent else READ, holder)
        elif not fault.error:
            try:
                self.open(now_ns)
            except OSError as error:
                self.failed(errno_name(error))

    def _listeners(self) -> list[_Listener]:
        """The listeners on the same port, by number."""
        there = (channel for _, channel in sorted(self.link.channels.items()))
        return [listener for listener in there if isinstance(listener, _Listener) and listener.local == self.local]


_KINDS: dict[type, Callable[..., HostChannel]] = {Connect: Connection, Listen: _Listener, Bind: UdpPort}
