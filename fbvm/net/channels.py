"""The common part of the links of both networks: channels by number, requests and events in order."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

from fbvm.wire.link import Bind, Close, Closed, Connect, Event, Failed, Grant, Listen, Peer, Request, Send, SendTo

SEND_BUFFER_BYTES = 262_144
"""Bytes that may wait on a connection to be sent; `Send` of more fails with ENOBUFS."""
MAX_DATAGRAM_BYTES = 65_507
MAX_DATAGRAMS = 64
"""Datagrams that are handed over in one call, or kept in memory until then."""
ANYBODY = Peer("0.0.0.0", 0)


def undeliverable(remote: Peer, data: bytes) -> str:
    """The errno name with which a datagram to `remote` fails, "" if it can be sent."""
    if remote.host == "0.0.0.0" or remote.port == 0:
        return "EADDRNOTAVAIL"
    return "EMSGSIZE" if len(data) > MAX_DATAGRAM_BYTES else ""


class Channel:
    """A channel in use.  `send` and `send_to` return the errno name of a failure, or ""."""

    _connected = False

    def __init__(self, link: ChannelLink, channel: int) -> None:
        self.link = link
        self.channel = channel
        self.granted = 0

    @property
    def is_connected(self) -> bool:
        """True for a TCP connection that is open."""
        return self._connected

    def grant(self, size_bytes: int) -> None:
        """Sets the number of bytes that the unit has room for."""
        self.granted = size_bytes

    def close(self, reset: bool, now_ns: int) -> None:
        """Closes the channel, by RST if `reset`."""

    def send(self, data: bytes, now_ns: int) -> str:
        """Sends bytes on a TCP connection."""
        return "ENOTCONN"

    def send_to(self, remote: Peer, data: bytes, now_ns: int) -> str:
        """Sends one datagram."""
        return "ENOTCONN"

    def fetch(self, now_ns: int) -> None:
        """Appends the events that depend on the unit's grant, such as received bytes, to those of the link."""

    def failed(self, error: str) -> None:
        """Reports that the open has failed, and frees the channel."""
        del self.link.channels[self.channel]
        self.link.pending.append(Failed(self.channel, "open", error))


class ChannelLink(ABC):
    """The link of one unit; a subclass for each network opens the channels."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.pending: list[Event] = []
        """Events that the unit has not fetched."""
        self.channels: dict[int, Channel] = {}

    @abstractmethod
    def open(self, request: Connect | Listen | Bind, now_ns: int) -> None:
        """Opens a channel: puts it into `channels`, or appends `Failed` to the events."""

    @abstractmethod
    def events(self, now_ns: int) -> Sequence[Event]:
        """The events up to `now_ns`, in order, each once."""

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        """Carries out requests in order.  Raises ValueError for an open of a channel that is in use."""
        for request in requests:
            channel = request.channel
            there = self.channels.get(channel)
            if isinstance(request, Send):  # `match` takes longer, and exchanges consist of sends
                error = there.send(request.data, now_ns) if there else "ENOTCONN"
                if error:
                    self._fail(channel, error)
            elif isinstance(request, Grant):
                if there:
                    there.grant(request.size)
            elif isinstance(request, SendTo):
                error = there.send_to(request.remote, request.data, now_ns) if there else "ENOTCONN"
                if error:
                    self._fail(channel, error)
            elif isinstance(request, Close):
                if there:
                    del self.channels[channel]
                    there.close(request.reset, now_ns)
                self.pending.append(Closed(channel))
            else:
                if there:
                    raise ValueError(f"channel {channel} of {self.address} is in use")
                self.open(request, now_ns)
        if self.pending:
            self.mark_pending()

    def mark_pending(self) -> None:  # noqa: B027
        """Called when events are pending; a network that sleeps in `wait` overrides it."""

    @property
    def is_quiet(self) -> bool:
        """True if there are no events before the next `submit`: none is pending, and no channel is in use."""
        return not self.pending and not self.channels

    def pass_by(self, refreshes: int) -> None:  # noqa: B027
        """Counts refreshes in which `events` was not called; a network with faults by scan overrides it."""

    def _fail(self, channel: int, error: str) -> None:
        self.pending.append(Failed(channel, "send", error))
