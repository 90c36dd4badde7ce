"""The host's own network: units talk to real devices and programs over real TCP and UDP, and nothing ever blocks.

One selector serves all links; sockets are handled in `events` and `submit` of a link, here and in `net.udp` only.
"""

from __future__ import annotations

import errno
import socket
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress

from fbvm.net.addresses import AddressMap, dotted, fits, impossible, why_unusable
from fbvm.net.channels import SEND_BUFFER_BYTES
from fbvm.net.faults import Fault
from fbvm.net.host_link import HostLink
from fbvm.net.notices import NoticeKind
from fbvm.net.relays import Relays
from fbvm.net.switchboard import MAX_CALLERS, READ, TCP, UDP, WRITE, Switchboard, errno_name
from fbvm.net.udp import BUFFER_BYTES, HostChannel, SocketLink, UdpPort, has_left, reserve, reset_on_close, try_to_listen
from fbvm.net.waiting import MAX_HELD, WaitingCallers
from fbvm.wire.link import Bind, Broken, Connect, Event, Failed, Listen, Opened, Peer, PeerClosed, Received, Sent
from fbvm.wire.tap import DATA, TapKind


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
        for there in list(self.waiting):
            there.fetch(now_ns)
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
            connection = listener.link.channels[listener.channel] = _Connection(listener.link, request)
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
        if fault.error and holder and holder.sock and not fault.silent:
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


class _Connection(HostChannel):
    """A TCP connection, open once it is `_connected`.

    An `_orphan` has been closed by its unit: it sends its data, then FIN, and waits for the peer's FIN."""

    _connected = _active = _orphan = _stalled = _fin_sent = _fin_seen = False
    _taken = 0

    def __init__(self, link: SocketLink, request: Connect) -> None:
        super().__init__(link, request)
        self.remote = request.remote
        self._keep_alive = request.keep_alive
        self._outbox: deque[bytes] = deque()

    def open(self, now_ns: int) -> None:
        self._active = True
        error = impossible(self.local, self.remote)
        if error:
            raise OSError(getattr(errno, error), error)
        where = dotted(self.network.outward(self.remote))
        port = self.network.host_endpoint(self.local).port if self.local.port else 0
        sock = self.make(socket.SOCK_STREAM, Peer("0.0.0.0", port) if port else None)
        self._tune(sock)
        code = sock.connect_ex(where)
        self.real = Peer(*sock.getsockname())
        self.local = Peer(self.local.host, self.local.port or self.real.port)
        self.network.own(TCP, self.real, self.local)
        self._tap(now_ns, TapKind.SYN, True)
        if code in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._watch()
        else:
            self._refused(code, now_ns)

    def accept(self, conn: socket.socket, now_ns: int) -> None:
        """Takes over a connection that a listener has accepted."""
        self.sock = conn
        conn.setblocking(False)
        self._tune(conn)
        self._tap(now_ns, TapKind.SYN, False)
        self._opened(now_ns, False)

    def _tune(self, sock: socket.socket) -> None:
        with suppress(OSError):  # some hosts refuse once the peer has reset the connection
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, self._keep_alive)

    def _refused(self, code: int, now_ns: int) -> None:
        self.network.notices.note(NoticeKind.UNREACHED, self.remote, self.network.outward(self.remote), errno_name(code))
        if code == errno.ECONNREFUSED:
            self._tap(now_ns, TapKind.RST, False)
        self.failed(errno_name(code))

    def _opened(self, now_ns: int, active: bool) -> None:
        self._connected = True
        self._tap(now_ns, TapKind.OPEN, active)
        self._report(Opened(self.channel, self.local.port, self.remote))
        self._watch()

    def _answered(self, sock: socket.socket, now_ns: int) -> None:
        code = sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        with suppress(OSError):  # a port of the host can be connected to itself while nobody listens there
            code = code or (errno.ECONNREFUSED if sock.getpeername() == sock.getsockname() else 0)
        if code:
            self._refused(code, now_ns)
        else:
            self._opened(now_ns, True)

    def ready(self, ready: int, now_ns: int) -> None:
        if self.sock and not self._connected:
            self._answered(self.sock, now_ns)
            return
        if ready & READ and self.sock:
            if self._orphan:
                self._receive(self.sock, now_ns)
            else:
                self.link.waiting[self] = None
        if ready & WRITE and self.sock:
            self._flush(self.sock, now_ns)

    def grant(self, size_bytes: int) -> None:
        self.granted = size_bytes
        if self._stalled:
            self._stalled = False
            self._watch()

    def fetch(self, now_ns: int) -> None:
        """Reads the socket now and no earlier, since the unit may change its grant until it asks for events."""
        if self.sock and not self._stalled and not self._fin_seen:
            self._receive(self.sock, now_ns)
        elif self.sock and (code := self.sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)):
            self._broke(code, now_ns)
        if not self._stalled and not self._fin_seen:  # else the selector does not tell that it breaks
            self.link.waiting.pop(self, None)

    def send(self, data: bytes, now_ns: int) -> str:
        if not self._connected or self.sock is None:
            return "EPIPE" if self._connected else "ENOTCONN"
        if self._outbox and sum(map(len, self._outbox)) + len(data) > SEND_BUFFER_BYTES:
            return "ENOBUFS"
        self._outbox.append(data)
        self._flush(self.sock, now_ns)
        return ""

    def close(self, reset: bool, now_ns: int) -> None:
        if not self._connected:
            self.end()
        elif reset:
            self.give_up(now_ns)
        elif self.sock:
            self._orphan, self._stalled = True, False
            self.link.waiting.pop(self, None)
            with suppress(OSError):  # what the unit has not fetched is thrown away, so that FIN goes out and no RST
                for _ in range(16):
                    if not self.sock.recv(BUFFER_BYTES):
                        break
            self._flush(self.sock, now_ns)
            self._watch()
            if self.sock:
                self.network.adopt(self, now_ns)

    def give_up(self, now_ns: int) -> None:
        """End by RST."""
        if self.sock:
            self._tap(now_ns, TapKind.RST, True)
            with suppress(OSError):
                reset_on_close(self.sock)
            self.end()

    def meet_faults(self, relays: Relays, now_ns: int) -> None:
        if self._connected and relays.concern(self.local, self.remote) and (self._active or not relays.is_unit(self.remote)):
            relays.take_over(self, self.local, self.remote, len(self._outbox), self._fin_seen)

    def _receive(self, sock: socket.socket, now_ns: int) -> None:
        wanted = min(self.granted, BUFFER_BYTES)
        try:
            # Without a grant only look, whether FIN has come; data stay in the host.
            data = sock.recv(wanted) if wanted > 0 else sock.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return
        except OSError as error:
            self._broke(error, now_ns)
            return
        if not data:
            self._fin_seen = True
            self._tap(now_ns, TapKind.FIN, False)
            self._report(PeerClosed(self.channel))
            self._finish(sock, now_ns)
            self._watch()
        elif self._orphan:
            self.give_up(now_ns)
        elif wanted <= 0:
            self._stalled = True
            self._watch()
        else:
            self.granted -= len(data)
            self._tap(now_ns, DATA, False, data)
            self.link.pending.append(Received(self.channel, data))

    def _flush(self, sock: socket.socket, now_ns: int) -> None:
        try:
            while self._outbox:
                rest = self._outbox[0][self._taken :]
                size = sock.send(rest) if rest else 0
                if size and self.network.tap:
                    self._tap(now_ns, DATA, True, rest[:size])
                self._taken += size
                if size == len(rest):
                    self._taken = 0
                    self._report(Sent(self.channel, len(self._outbox.popleft())))
        except BlockingIOError:
            pass
        except OSError as error:
            self._broke(error, now_ns)
            return
        self._finish(sock, now_ns)
        if self._outbox or self.watched & WRITE:
            self._watch()

    def _finish(self, sock: socket.socket, now_ns: int) -> None:
        """Sends FIN once an orphan has sent its data, and closes the socket after the peer's FIN."""
        if self._orphan and not self._outbox and not self._fin_sent:
            self._fin_sent = True
            self._tap(now_ns, TapKind.FIN, True)
            with suppress(OSError):
                sock.shutdown(socket.SHUT_WR)
        if self._fin_sent and self._fin_seen:
            self.end()

    def _broke(self, error: OSError | int, now_ns: int) -> None:
        name = errno_name(error)
        if name in ("ECONNRESET", "EPIPE"):
            self._tap(now_ns, TapKind.RST, False)
        for _ in self._outbox:
            self._report(Failed(self.channel, "send", name))
        self._outbox.clear()
        self._report(Broken(self.channel, "ECONNRESET" if name == "EPIPE" else name))
        self.end()

    def _watch(self) -> None:
        if self.sock:
            wanted = READ if self._connected and not self._fin_seen and not self._stalled else 0
            self.network.watch(self.sock, wanted | (WRITE if self._outbox or not self._connected else 0), self)

    def _report(self, event: Event) -> None:
        if not self._orphan:
            self.link.pending.append(event)

    def _tap(self, now_ns: int, what: TapKind, out: bool, data: bytes = b"") -> None:
        self.tell(now_ns, what, self.remote, out, data)


_KINDS: dict[type, Callable[..., HostChannel]] = {Connect: _Connection, Listen: _Listener, Bind: UdpPort}
