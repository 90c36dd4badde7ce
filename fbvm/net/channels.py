"""What a channel of a `LoopLink` can be: a TCP line, a door that waits for one caller, a bound UDP port."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from fbvm.net.stream import End
from fbvm.wire.link import Broken, Event, Failed, Opened, Peer, PeerClosed, Received, Sent
from fbvm.wire.tap import What

SEND_BUFFER_BYTES = 262_144
"""What may wait on one line for the other side's window; more is ENOBUFS."""
MAX_DATAGRAM_BYTES = 65_507
MAX_DATAGRAMS = 64
"""Datagrams that wait to be fetched; what comes beyond is lost, as UDP loses."""


class Holder(Protocol):
    """What a channel needs of its link."""

    address: str
    told: list[Event]

    def free(self, channel: int, error: str) -> None:
        """An open has failed: the channel may be used again."""

    def remember(self, end: End) -> None:
        """Keep an end, so that its pair of endpoints is not used twice."""

    def tell(self, end: End, what: What, out: bool) -> None:
        """Pass a happening at an end on to the tap."""

    def post(self, sender: Peer, receiver: Peer, data: bytes) -> None:
        """Carry a datagram."""


class Channel:
    """What all have in common.  `send` and `send_to` give back the errno name of a failure, or ""."""

    def __init__(self, link: Holder, channel: int, port: int = 0) -> None:
        self.link = link
        self.channel = channel
        self.port = port
        """Local port."""
        self.granted = 0

    def close(self, reset: bool, now_ns: int) -> None:
        """The unit is done with it."""

    def send(self, data: bytes, now_ns: int) -> str:
        """Bytes for a TCP connection."""
        return "ENOTCONN"

    def send_to(self, remote: Peer, data: bytes) -> str:
        """One datagram."""
        return "ENOTCONN"

    def fetch(self, now_ns: int) -> list[Event]:
        """What the unit may be given now."""
        return []


class Door(Channel):
    """Waits on a port for one caller that fits `remote`."""

    def __init__(self, link: Holder, channel: int, port: int, remote: Peer) -> None:
        super().__init__(link, channel, port)
        self.remote = remote


class Line(Channel):
    """A TCP connection, or the wish for one while there is no `end`."""

    def __init__(self, link: Holder, channel: int, granted: int) -> None:
        super().__init__(link, channel)
        self.granted = granted
        self._end: End | None = None
        self._closed: str = ""
        self._told: set[str] = set()

    # The network's side.

    def refused(self, error: str, now_ns: int = 0) -> None:
        """The open has failed."""
        if not self._closed:
            self.link.free(self.channel, error)

    def answered(self, end: End, error: str, active: bool, now_ns: int) -> None:
        """The other side has answered; without an `error` the connection is open."""
        if error:
            self.link.tell(end, What.RST, False)
            self.refused(error)
            return
        self.link.tell(end, What.OPEN, active)
        if self._closed:
            (end.reset if self._closed == "rst" else end.leave)(now_ns)
            return
        self._end = end
        self.port = end.local.port
        self.link.remember(end)
        self.link.told.append(Opened(self.channel, end.local.port, end.remote))

    def sent(self, size_bytes: int) -> None:
        self.link.told.append(Sent(self.channel, size_bytes))

    def readable(self, now_ns: int) -> None:
        """Nothing to do: the unit fetches, as far as it has granted."""

    def finished(self, now_ns: int) -> None:
        """Nothing to do: told when everything before it has been fetched."""

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        self.link.told += [Failed(self.channel, "send", error)] * unsent

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

    def fetch(self, now_ns: int) -> list[Event]:
        end, events = self._end, list[Event]()
        if end is None:
            return events
        if end.inbox and self.granted > 0:
            data = end.take(self.granted, now_ns)
            self.granted -= len(data)
            events.append(Received(self.channel, data))
        if end.fin_arrived and not end.inbox and "fin" not in self._told:
            self._told.add("fin")
            events.append(PeerClosed(self.channel))
        if end.error and "rst" not in self._told:
            self._told.add("rst")
            end.inbox.clear()
            events.append(Broken(self.channel, end.error))
        return events


class Bound(Channel):
    """A UDP port.  Datagrams are handed over whole and need no grant: what has no room is the unit's to drop."""

    def __init__(self, link: Holder, channel: int, port: int) -> None:
        super().__init__(link, channel, port)
        self._arrived: deque[Received] = deque()
        link.told.append(Opened(channel, port, Peer("0.0.0.0", 0)))

    def take_in(self, sender: Peer, data: bytes) -> None:
        """A datagram has arrived."""
        if len(self._arrived) < MAX_DATAGRAMS:
            self._arrived.append(Received(self.channel, data, sender))

    def send_to(self, remote: Peer, data: bytes) -> str:
        if remote.host == "0.0.0.0" or remote.port == 0:
            return "EADDRNOTAVAIL"
        if len(data) > MAX_DATAGRAM_BYTES:
            return "EMSGSIZE"
        self.link.post(Peer(self.link.address, self.port), remote, data)
        self.link.told.append(Sent(self.channel, len(data)))
        return ""

    def fetch(self, now_ns: int) -> list[Event]:
        arrived = list[Event](self._arrived)
        self._arrived.clear()
        return arrived
