"""The channels of a `LoopLink`: a TCP connection, a listener for one connection, a UDP port."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque

from fbvm.net.channels import ANYBODY, MAX_DATAGRAMS, SEND_BUFFER_BYTES, Channel, ChannelLink, undeliverable
from fbvm.net.stream import End
from fbvm.wire.link import Broken, Failed, Opened, Peer, PeerClosed, Received, Sent
from fbvm.wire.tap import TapKind


class MemoryLink(ChannelLink):
    """The methods of a link that these channels call."""

    @abstractmethod
    def remember(self, end: End) -> None:
        """Keeps an end, so that its pair of endpoints is not used twice."""

    @abstractmethod
    def send_datagram(self, port: int, receiver: Peer, data: bytes) -> None:
        """Sends a datagram from a local port."""


class _LocalChannel(Channel):
    link: MemoryLink

    def __init__(self, link: MemoryLink, channel: int, port: int) -> None:
        super().__init__(link, channel)
        self.port = port
        """Local port."""


class Listener(_LocalChannel):
    """Listens on a port for one connection from a peer that fits `remote`."""

    def __init__(self, link: MemoryLink, channel: int, port: int, remote: Peer) -> None:
        super().__init__(link, channel, port)
        self.remote = remote


class WiredConnection(Channel):
    """A TCP connection of a unit over wires; until it is open it has no end."""

    _end: End | None = None
    _closed = ""
    _fin_told = _break_told = False

    # The network's side.

    def refused(self, error: str, now_ns: int) -> None:
        """The open has failed."""
        if not self._closed:
            self.failed(error)

    def answered(self, end: End, error: str, active: bool, now_ns: int) -> None:
        """Called with the answer to the SYN; without an `error` the connection is open."""
        if error:
            end.carrier.tell(end, TapKind.RST, False, b"")
            self.refused(error, now_ns)
            return
        end.carrier.tell(end, TapKind.OPEN, active, b"")
        if self._closed:
            (end.reset if self._closed == "rst" else end.leave)(now_ns)
            return
        self._end = end
        self.link.pending.append(Opened(self.channel, end.local.port, end.remote))

    def sent(self, size_bytes: int) -> None:
        self.link.pending.append(Sent(self.channel, size_bytes))

    def readable(self, now_ns: int) -> None:
        """Nothing to do: `fetch` takes data as far as the unit has granted."""

    def finished(self, now_ns: int) -> None:
        """Nothing to do: `fetch` reports FIN after all data before it."""

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        self.link.pending += [Failed(self.channel, "send", error)] * unsent

    # The unit's side.

    def close(self, reset: bool, now_ns: int) -> None:
        self._closed = "rst" if reset else "fin"
        if self._end:
            (self._end.reset if reset else self._end.leave)(now_ns)

    def send(self, data: bytes, now_ns: int) -> str:
        if self._end is None:
            return "ENOTCONN"
        if self._end.error:
            return "EPIPE"
        if self._end.waiting_bytes + len(data) > SEND_BUFFER_BYTES:
            return "ENOBUFS"
        self._end.send(data, now_ns)
        return ""

    def fetch(self, now_ns: int) -> None:
        end, told = self._end, self.link.pending
        if end is None or self._break_told:
            return
        if end.inbox and self.granted > 0:
            data = end.take(self.granted, now_ns)
            self.granted -= len(data)
            told.append(Received(self.channel, data))
        if end.fin_arrived and not end.inbox and not self._fin_told:
            self._fin_told = True
            told.append(PeerClosed(self.channel))
        if end.error:
            self._break_told = True
            end.inbox.clear()
            told.append(Broken(self.channel, end.error))


class Connection(_LocalChannel, WiredConnection):
    """A TCP connection in memory."""

    def answered(self, end: End, error: str, active: bool, now_ns: int) -> None:
        super().answered(end, error, active, now_ns)
        if self._end:
            self.link.remember(end)


class UdpPort(_LocalChannel):
    """A UDP port.  Datagrams are handed over whole and need no grant; the unit drops those that it has no room for."""

    def __init__(self, link: MemoryLink, channel: int, port: int) -> None:
        super().__init__(link, channel, port)
        self._arrived: deque[Received] = deque()
        link.pending.append(Opened(channel, port, ANYBODY))

    def take_in(self, sender: Peer, data: bytes) -> None:
        """Keeps a datagram that has arrived; if MAX_DATAGRAMS are kept already, the datagram is lost."""
        if len(self._arrived) < MAX_DATAGRAMS:
            self._arrived.append(Received(self.channel, data, sender))

    def send_to(self, remote: Peer, data: bytes, now_ns: int) -> str:
        if error := undeliverable(remote, data):
            return error
        self.link.send_datagram(self.port, remote, data)
        self.link.pending.append(Sent(self.channel, len(data)))
        return ""

    def fetch(self, now_ns: int) -> None:
        self.link.pending += self._arrived
        self._arrived.clear()
