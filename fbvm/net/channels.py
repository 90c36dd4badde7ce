"""What the links of both networks have in common: channels by number, requests in order, events in order."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

from fbvm.wire.link import Bind, Close, Closed, Connect, Event, Failed, Grant, Listen, Peer, Request, Send, SendTo

SEND_BUFFER_BYTES = 262_144
"""What may wait on one connection for the other side; more is ENOBUFS."""
MAX_DATAGRAM_BYTES = 65_507
MAX_DATAGRAMS = 64
"""Datagrams that are handed over at once, or kept in memory until then."""
ANYBODY = Peer("0.0.0.0", 0)


def undeliverable(remote: Peer, data: bytes) -> str:
    """The errno name of why no datagram can be sent there; "" if one can."""
    if remote.host == "0.0.0.0" or remote.port == 0:
        return "EADDRNOTAVAIL"
    return "EMSGSIZE" if len(data) > MAX_DATAGRAM_BYTES else ""


class Channel:
    """A channel in use.  `send` and `send_to` give back the errno name of a failure, or ""."""

    def __init__(self, link: ChannelLink, channel: int) -> None:
        self.link = link
        self.channel = channel
        self.granted = 0

    def grant(self, size_bytes: int) -> None:
        """The unit has room for so much."""
        self.granted = size_bytes

    def close(self, reset: bool, now_ns: int) -> None:
        """The unit is done with it."""

    def send(self, data: bytes, now_ns: int) -> str:
        """Bytes for a TCP connection."""
        return "ENOTCONN"

    def send_to(self, remote: Peer, data: bytes, now_ns: int) -> str:
        """One datagram."""
        return "ENOTCONN"

    def fetch(self, now_ns: int) -> None:
        """Tell the link what the unit may be given only now."""

    def failed(self, error: str) -> None:
        """The open has failed: the channel may be used again."""
        del self.link.channels[self.channel]
        self.link.told.append(Failed(self.channel, "open", error))


class ChannelLink(ABC):
    """One unit's place on a network; its children know how channels are opened."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.told: list[Event] = []
        """Events that wait to be fetched."""
        self.channels: dict[int, Channel] = {}

    @abstractmethod
    def open(self, request: Connect | Listen | Bind, now_ns: int) -> None:
        """Put the new channel into `channels`, or tell that it failed."""

    @abstractmethod
    def events(self, now_ns: int) -> Sequence[Event]:
        """What happened up to `now_ns`, in order, each once."""

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        """Take requests in order.  Raises ValueError if a unit opens a channel that is in use."""
        for request in requests:
            there = self.channels.get(request.channel)
            match request:
                case Send():
                    self._check(request.channel, there.send(request.data, now_ns) if there else "ENOTCONN")
                case Grant():
                    if there:
                        there.grant(request.size)
                case Connect() | Listen() | Bind():
                    if there:
                        raise ValueError(f"channel {request.channel} of {self.address} is in use")
                    self.open(request, now_ns)
                case Close(channel, reset):
                    if there:
                        del self.channels[channel]
                        there.close(reset, now_ns)
                    self.told.append(Closed(channel))
                case SendTo(channel, remote, data):
                    self._check(channel, there.send_to(remote, data, now_ns) if there else "ENOTCONN")
        if self.told:
            self.stir()

    def stir(self) -> None:  # noqa: B027
        """There is something to tell: nothing to do where nobody sleeps meanwhile."""

    @property
    def is_quiet(self) -> bool:
        """True if there is nothing to tell before the next `submit`: no channel is in use."""
        return not self.told and not self.channels

    def pass_by(self, refreshes: int) -> None:  # noqa: B027
        """So many refreshes have taken place in which nobody asked: nothing to do where nobody counts them."""

    def _check(self, channel: int, error: str) -> None:
        if error:
            self.told.append(Failed(channel, "send", error))
