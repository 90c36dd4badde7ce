"""The channels of the host: what each with a socket has in common, and a UDP port."""

from __future__ import annotations

import socket
import struct
from abc import abstractmethod

from fbvm.base.host import keeps_ports, linger_format, shares_ports
from fbvm.net.addresses import dotted, why_unusable
from fbvm.net.channels import ANYBODY, MAX_DATAGRAMS, Channel, undeliverable
from fbvm.net.host_link import HostLink
from fbvm.net.notices import NoticeKind
from fbvm.net.relays import FaultyChannel, Relays
from fbvm.net.switchboard import READ, TCP, UDP, Switchboard, Watcher, errno_name
from fbvm.wire.link import Bind, Connect, Listen, Opened, Peer, Received, Sent
from fbvm.wire.tap import TapKind

BUFFER_BYTES = 65_536
"""The host's buffers of each connection: small, so that the TCP window closes soon if the unit grants nothing."""
_RST_ON_CLOSE = struct.pack(linger_format(), 1, 0)


def share_port(sock: socket.socket) -> None:
    """Let a port be listened on again while old connections of it linger (elsewhere than on Windows)."""
    if shares_ports():
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)


def try_to_listen(real: Peer, transport: str = TCP) -> None:
    """Listens at an endpoint of the host for a moment.  Raises OSError that names the endpoint and says why not."""
    try:
        with socket.socket(type=socket.SOCK_STREAM if transport == TCP else socket.SOCK_DGRAM) as sock:
            if transport == TCP:
                share_port(sock)
            sock.bind(dotted(real))
            if transport == TCP:
                sock.listen()
    except OSError as error:
        raise OSError(error.errno, f"{real} cannot be used: {why_unusable(error)}") from None


def reserve(host: str, transport: str) -> tuple[Peer, socket.socket | None]:
    """A port of the host that the system chooses, and the socket that keeps it where others may listen beside it."""
    keeper = socket.socket(socket.AF_INET, socket.SOCK_STREAM if transport == TCP else socket.SOCK_DGRAM)
    share_port(keeper)
    keeper.bind((host, 0))
    real = Peer(*keeper.getsockname())
    if keeps_ports() and transport == TCP:
        return real, keeper
    keeper.close()
    return real, None


def reset_on_close(sock: socket.socket) -> None:
    """Lets a connection end by RST when it is closed.  Raises OSError."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RST_ON_CLOSE)


def has_left(conn: socket.socket) -> bool:
    """True if a caller has ended the connection before anybody took it, and has said nothing."""
    conn.setblocking(False)
    try:
        return not conn.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except OSError:
        return True


class SocketLink(HostLink):
    """The link of one unit whose channels have sockets."""

    is_seen = True
    """True for the link of a unit, False for one behind it (see `net.relays`)."""

    def __init__(self, network: Switchboard, address: str) -> None:
        super().__init__(network, address)
        self.network = network


class HostChannel(Channel, Watcher, FaultyChannel):
    """A channel that has a socket of the host."""

    link: SocketLink
    sock: socket.socket | None = None
    transport = TCP
    real = ANYBODY
    """The endpoint of the host at which peers reach the channel."""

    def __init__(self, link: SocketLink, request: Connect | Listen | Bind) -> None:
        super().__init__(link, request.channel)
        self.network = link.network
        self.local = Peer(link.address, request.local_port)
        """The unit's endpoint, as the program sees it."""

    @abstractmethod
    def open(self, now_ns: int) -> None:
        """Opens the channel.  Raises OSError."""

    def end(self) -> None:
        """Closes the socket."""
        self.link.waiting.pop(self, None)
        if self.sock:
            if self.transport == TCP:  # a datagram may still be under way, and the port stays this unit's
                self.network.own(TCP, self.real, None)
            self.network.watch(self.sock, 0, self)
            self.sock.close()
            self.sock = None

    def failed(self, error: str) -> None:
        super().failed(error)
        self.end()

    def close(self, reset: bool, now_ns: int) -> None:
        self.end()

    def tell(self, now_ns: int, what: TapKind, remote: Peer, out: bool, data: bytes = b"") -> None:
        """Reports an event to the tap; under faults the unit's side is reported instead."""
        if self.network.tap and self.link.is_seen:
            self.network.tell(now_ns, what, self.local, remote, out, data)

    def make(self, kind: int, bind: Peer | None) -> socket.socket:
        """A socket that never blocks.  Raises OSError."""
        self.sock = sock = socket.socket(socket.AF_INET, kind)
        sock.setblocking(False)
        if kind == socket.SOCK_STREAM:
            share_port(sock)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        if bind:
            sock.bind((bind.host, bind.port))
        return sock


class UdpPort(HostChannel):
    """A UDP port.  Datagrams are handed over whole and need no grant; the unit drops those that it has no room for."""

    transport = UDP

    def open(self, now_ns: int) -> None:
        real = self.network.listening_endpoint(self.local, UDP)
        try:
            sock = self.make(socket.SOCK_DGRAM, real)
        except OSError as error:
            self.network.notices.note(NoticeKind.UNUSABLE, self.local, real, why_unusable(error))
            raise
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self.real = Peer(*sock.getsockname())
        self.local = Peer(self.local.host, self.local.port or self.real.port)
        self.network.own(UDP, self.real, self.local)
        self.network.watch(sock, READ, self)
        self.link.pending.append(Opened(self.channel, self.local.port, ANYBODY))

    def ready(self, ready: int, now_ns: int) -> None:
        for _ in range(MAX_DATAGRAMS):
            try:
                data, name = self.sock.recvfrom(BUFFER_BYTES) if self.sock else (b"", ("", 0))
            except OSError:
                return
            remote = self.network.inward(UDP, Peer(*name))
            self.tell(now_ns, TapKind.UDP, remote, False, data)
            self.link.pending.append(Received(self.channel, data, remote))

    def send_to(self, remote: Peer, data: bytes, now_ns: int) -> str:
        if refusal := undeliverable(remote, data):
            return refusal
        try:
            if self.sock:
                self.sock.sendto(data, dotted(self.network.outward(remote, UDP)))
        except BlockingIOError:
            return "ENOBUFS"
        except OSError as error:
            return errno_name(error)
        self.tell(now_ns, TapKind.UDP, remote, True, data)
        self.link.pending.append(Sent(self.channel, len(data)))
        return ""

    def meet_faults(self, relays: Relays, now_ns: int) -> None:
        if relays.faults:
            relays.take_over_port(self, self.local)
