"""TCP connections of units over sockets of the host; nothing ever blocks."""

from __future__ import annotations

import errno
import socket
from collections import deque
from contextlib import suppress

from fbvm.base import host
from fbvm.net.addresses import dotted, impossible
from fbvm.net.channels import SEND_BUFFER_BYTES
from fbvm.net.notices import NoticeKind
from fbvm.net.relays import Relays
from fbvm.net.switchboard import READ, TCP, WRITE, errno_name
from fbvm.net.udp import BUFFER_BYTES, HostChannel, SocketLink, reset_on_close
from fbvm.wire.link import Broken, Connect, Event, Failed, Opened, Peer, PeerClosed, Received, Sent
from fbvm.wire.tap import DATA, TapKind


class Connection(HostChannel):
    """A TCP connection, open once it is `_connected`.

    An `_orphan` has been closed by its unit: it sends its data, then FIN, and waits for the peer's FIN.  One that is `_resetting`
    ends by RST once the host has sent what the unit has given it before."""

    _connected = _active = _orphan = _resetting = _stalled = _fin_sent = _fin_seen = False
    _taken = 0

    def __init__(self, link: SocketLink, request: Connect) -> None:
        super().__init__(link, request)
        self.remote = request.remote
        self._keep_alive = request.keep_alive
        self._outbox: deque[bytes] = deque()
        self._sent = Sent(self.channel, 0)
        """What the last `Send` was answered with: the next one often has as many bytes, and nobody changes an event."""

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
        if self._connected and not self._orphan:
            if ready & READ and self.sock:
                self.link.waiting[self] = None
        elif self.sock and not self._connected:
            self._answered(self.sock, now_ns)
            return
        elif self._resetting:
            self.give_up(now_ns)
            return
        elif ready & READ:
            self.fetch(now_ns)
        if ready & WRITE and self.sock:
            self._flush(self.sock, now_ns)

    def grant(self, size_bytes: int) -> None:
        self.granted = size_bytes
        if self._stalled:
            self._stalled = False
            self._watch()

    def fetch(self, now_ns: int) -> None:
        """Reads the socket now and no earlier, since the unit may change its grant until it asks for events."""
        sock, granted = self.sock, self.granted
        if sock is None:
            return
        if self._stalled or self._fin_seen:
            if code := sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
                self._broke(code, now_ns)
            self._ask_again()
            return
        most = granted if granted < BUFFER_BYTES else BUFFER_BYTES
        try:
            # Without a grant only look, whether FIN has come; data stay in the host.
            data = sock.recv(most) if most > 0 else sock.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return
        except OSError as error:
            self._broke(error, now_ns)
            return
        if not data or granted <= 0 or self._orphan:
            self._hold(sock, not data, now_ns)
            return
        self.granted = granted - len(data)
        if self.network.tap:
            self._tap(now_ns, DATA, False, data)
        self.link.pending.append(Received(self.channel, data))

    def _hold(self, sock: socket.socket, is_end: bool, now_ns: int) -> None:
        """Takes no data any more: FIN has come, or data for which the unit has no room, or which nobody wants."""
        if is_end:
            self._fin_seen = True
            self._tap(now_ns, TapKind.FIN, False)
            self._report(PeerClosed(self.channel))
            self._finish(sock, now_ns)
        elif self._orphan:
            self.give_up(now_ns)
            return
        else:
            self._stalled = True
        self._watch()
        self._ask_again()

    def _ask_again(self) -> None:
        """Asks the socket in each refresh whether it has broken, since the selector does not tell that."""
        if self.sock and not self._orphan:
            self.link.waiting[self] = None

    def send(self, data: bytes, now_ns: int) -> str:
        sock, outbox = self.sock, self._outbox
        if not self._connected or sock is None:
            return "EPIPE" if self._connected else "ENOTCONN"
        if outbox and sum(map(len, outbox)) + len(data) > SEND_BUFFER_BYTES:
            return "ENOBUFS"
        outbox.append(data)
        self._flush(sock, now_ns)
        return ""

    def close(self, reset: bool, now_ns: int) -> None:
        if not self._connected:
            self.end()
        elif reset:
            self._reset(now_ns)
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

    def _reset(self, now_ns: int) -> None:
        """RST behind what the unit has sent: the host throws away what still waits for acknowledgements there."""
        if self.sock is None or not host.unsent_bytes(self.sock.fileno()):
            self.give_up(now_ns)
            return
        self._orphan = self._resetting = True
        self._outbox.clear()
        self.link.waiting.pop(self, None)
        self.sock.setsockopt(socket.IPPROTO_TCP, host.TCP_NOTSENT_LOWAT, 1)
        self.network.watch(self.sock, WRITE, self)
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

    def _flush(self, sock: socket.socket, now_ns: int) -> None:
        outbox, tap = self._outbox, self.network.tap
        try:
            while outbox:
                data = outbox[0]
                rest = data[self._taken :] if self._taken else data
                size = sock.send(rest) if rest else 0
                if tap and size:
                    self._tap(now_ns, DATA, True, rest[:size])
                if size < len(rest):
                    self._taken += size
                    continue
                del outbox[0]
                self._taken = 0
                if not self._orphan:
                    sent = self._sent
                    if sent.size != len(data) or sent.channel != self.channel:
                        sent = self._sent = Sent(self.channel, len(data))
                    self.link.pending.append(sent)
        except BlockingIOError:
            pass
        except OSError as error:
            self._broke(error, now_ns)
            return
        if self._orphan:
            self._finish(sock, now_ns)
        if outbox or self.watched & WRITE:
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
