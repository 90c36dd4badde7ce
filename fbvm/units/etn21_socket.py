"""One of the eight sockets: takes the network's events, says what the network has to do and what the words show.

Knows neither memory nor cycles.  States follow W421 6-6-2 p112, the reactions to a peer a BSD-like stack.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any

from fbvm.units import etn21_codes as codes
from fbvm.units import etn21_map as at
from fbvm.units.etn21_map import PASSIVE_OPEN, TcpState
from fbvm.units.etn21_service import Area, Service
from fbvm.wire.link import (
    Bind,
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    SendTo,
    Sent,
)

SERVICE_LIMIT = 1984  # bytes in one send or receive, W421 6-6-2 p111
TCP_BUFFER = 4096  # W421 6-6-2 p111
UDP_BUFFER = 9016  # W343 6-1-9 p111
TCP_PART = 1024  # sends are cut into these, W343 6-1-7 p108

AFTER_CLOSE = {TcpState.ESTABLISHED: TcpState.FIN_WAIT_1, TcpState.CLOSE_WAIT: TcpState.LAST_ACK}
"""State once this side has sent its FIN."""
AFTER_CLOSED = {TcpState.FIN_WAIT_1: TcpState.TIME_WAIT, TcpState.LAST_ACK: TcpState.CLOSED}
"""State that stays in the D word after the close, until the next open (W421 6-6-2 p112)."""


class Phase(Enum):
    """How far the socket's channel is."""

    CLOSED = "closed"
    OPENING = "opening"
    OPEN = "open"
    CLOSING = "closing"


CLOSED, OPENING, OPEN, CLOSING = Phase  # Python 3.11 finds the member of an Enum by a call


class Socket:
    """Socket 1..8; its number is its channel on the network."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.protocol = "TCP"
        self.state = TcpState.CLOSED
        self.phase = CLOSED
        self.services: dict[int, Service] = {}
        """What runs, by the flag that it shows."""
        self.settled_cycle = -1
        """Refresh in which bit 15 last changed; a program cannot have seen it before the next one."""
        self.area: Area | None = None
        self._unanswered_closes = 0
        self._deferred: Request | None = None
        self._forget()

    def _forget(self) -> None:
        self.connected = False
        """What bit 15 says."""
        self.local_port = 0
        self.local_port_fixed = False
        self.linger = False
        self._closed_here = False
        self._stream = bytearray()
        self._datagrams: list[Received] = []
        self._peer_closed = False
        self._broken = False
        self._send_ended = False
        self._unreported = 0
        """Code of a break that no service has reported yet."""

    # --- what the words show -----------------------------------------------------------------------------------------

    def shown(self) -> tuple[int, int]:
        """The status word n+1..n+16, and m+1..m+8: 0 while a receive runs, at most 1,984 (W420 4-2 p88)."""
        word = sum(self.services, at.OPEN if self.connected else 0)
        if not self._stream or not self.connected or word & at.RECEIVING:
            return word, 0
        return word | at.DATA_RECEIVED, min(len(self._stream), SERVICE_LIMIT)

    @property
    def is_open(self) -> bool:
        """True if a send or a receive makes sense: bit 15 is ON and nobody closes."""
        return self.connected and self.phase is OPEN

    @property
    def holds_port(self) -> bool:
        """True if this side sent the first FIN from a local port that the program chose (W421 6-9-3 p156)."""
        return self._closed_here and self.local_port_fixed

    # --- services begin ----------------------------------------------------------------------------------------------

    def prepare_open(self, service: Service, request: Connect | Listen | Bind) -> None:
        """Forget the last connection and take over what an open sets."""
        self._forget()
        self.protocol = "UDP" if isinstance(request, Bind) else "TCP"
        self.local_port_fixed = request.local_port != 0
        self.linger = service.parameters is not None and bool(service.parameters.option & at.LINGER)

    def begin_open(self, service: Service, request: Connect | Listen | Bind) -> list[Request]:
        """Start opening; the request waits while the network still closes what was open before."""
        self._run(service)
        self.phase = OPENING
        if not isinstance(request, Bind):
            self.state = TcpState.LISTEN if isinstance(request, Listen) else TcpState.SYN_SENT
        if self._unanswered_closes:
            self._deferred = request
            return []
        return [request]

    def fail(self, service: Service, code: int) -> list[Request]:
        """Run a service that ends with `code` without the network being asked."""
        self._run(service)
        service.code = code
        return []

    def begin_send_to(self, service: Service, remote: Peer, data: bytes) -> list[Request]:
        """Start sending a datagram; nothing goes out for no bytes."""
        self._run(service)
        if not data:
            service.code = codes.NORMAL_END
            return []
        service.unanswered = 1
        return [SendTo(self.number, remote, data)]

    def begin_send(self, service: Service, data: bytes) -> list[Request]:
        """Start sending on a connection; nothing goes out for no bytes, nor if it is known to be broken."""
        self._run(service)
        if not data:
            service.code = codes.NORMAL_END
            return []
        if self._broken or self._send_ended:
            service.code = self._unreported or codes.ERRNO["EPIPE"]
            self._unreported = 0
            return []
        service.unanswered = -(-len(data) // TCP_PART)
        if service.unanswered == 1:
            return [Send(self.number, data)]
        parts = [data[start : start + TCP_PART] for start in range(0, len(data), TCP_PART)]
        return [Send(self.number, part) for part in parts]

    def begin_receive(self, service: Service) -> list[Request]:
        """Start receiving; ends at once if something is there or nothing can come any more."""
        self._run(service)
        return self._serve_receive()

    def begin_close(self, service: Service) -> list[Request]:
        """Start closing, by RST if the linger option was set at the open."""
        self._run(service)
        self.phase = CLOSING
        if self.protocol == "UDP":
            return self._close(False)
        after = TcpState.CLOSED if self.linger else AFTER_CLOSE.get(self.state, TcpState.CLOSED)
        self._closed_here = after is TcpState.FIN_WAIT_1
        self.state = after
        return self._close(self.linger)

    def withdraw(self) -> list[Request]:
        """Give up an open that took too long; the network's answers to it no longer count."""
        self.phase = CLOSED
        self.state = TcpState.CLOSED
        return self._close(False)

    def reset(self) -> list[Request]:
        """Restart of the unit: everything is forgotten, the connection breaks."""
        was_in_use = self.phase is not CLOSED
        self.services.clear()
        self.area = None
        self.settled_cycle = -1
        self._forget()
        self.phase = CLOSED
        self.state = TcpState.CLOSED
        self.protocol = "TCP"
        return self._close(True) if was_in_use else []

    # --- services end ------------------------------------------------------------------------------------------------

    def end(self, service: Service) -> None:
        """The service's result is being written: its flag goes OFF, bit 15 follows an open or a close."""
        del self.services[service.flag]
        if service.flag == at.OPENING:
            self.connected = service.code == codes.NORMAL_END
            if self.connected and service.area is not None:
                service.area.bound, self.area = self, service.area
        elif service.flag == at.CLOSING:
            if self.protocol == "TCP":
                self.state = AFTER_CLOSED.get(self.state, self.state)
            if self.area is not None:
                self.area.bound, self.area = None, None
            self._forget()

    # --- events ------------------------------------------------------------------------------------------------------

    def take(self, event: Event) -> list[Request]:
        """Take one event of this channel.  What was told before a `Close` was answered is out of date."""
        if isinstance(event, Closed):
            return self._take_closed()
        if self._unanswered_closes:
            return []
        if self.phase is OPEN:
            if taken := _WHILE_OPEN.get(type(event)):
                taken(self, event)
            return self._serve_receive() if at.RECEIVING in self.services else []
        if self.phase is OPENING:
            return self._take_while_opening(event)
        return []

    def _take_closed(self) -> list[Request]:
        if not self._unanswered_closes:
            return []
        self._unanswered_closes -= 1
        if self._unanswered_closes:
            return []
        if self.phase is CLOSING:
            self.phase = CLOSED
            self.services[at.CLOSING].code = codes.NORMAL_END
        deferred, self._deferred = self._deferred, None
        return [] if deferred is None else [deferred]

    def _take_while_opening(self, event: Event) -> list[Request]:
        service = self.services[at.OPENING]
        if isinstance(event, Opened):
            return self._take_opened(service, event)
        if isinstance(event, Failed | Broken):
            self.phase = CLOSED
            self.state = TcpState.CLOSED
            service.code = codes.code_of(event.error)
        return []

    def _take_opened(self, service: Service, event: Opened) -> list[Request]:
        self.phase = OPEN
        self.local_port = event.local_port
        service.code = codes.NORMAL_END
        if self.protocol == "UDP":
            return []
        self.state = TcpState.ESTABLISHED
        if service.switch is PASSIVE_OPEN:
            service.results = results_of(event.remote)
        elif not self.local_port_fixed:
            service.results = {at.LOCAL_PORT: event.local_port}
        return [Grant(self.number, TCP_BUFFER)]

    def _take_received(self, event: Received) -> None:
        if self.protocol == "TCP":
            self._stream += event.data
        elif sum(len(datagram.data) for datagram in self._datagrams) + len(event.data) <= UDP_BUFFER:
            self._datagrams.append(event)

    def _take_sent(self, event: Sent) -> None:
        service = self.services.get(at.SENDING)
        if service is not None and service.code is None:
            service.count += event.size
            service.unanswered -= 1
            if not service.unanswered:
                service.code = codes.NORMAL_END

    def _take_failed_send(self, event: Failed) -> None:
        service = self.services.get(at.SENDING)
        if service is not None and service.code is None:
            service.code = codes.code_of(event.error)
            self._send_ended = self.protocol == "TCP"

    def _take_peer_closed(self, event: PeerClosed) -> None:
        if self.state is TcpState.ESTABLISHED:
            self._peer_closed = True
            self.state = TcpState.CLOSE_WAIT

    def _take_broken(self, event: Broken) -> None:
        """The buffer is lost with the connection (assumed); who waits is told why, or else the next service is."""
        self._broken = True
        self._stream.clear()
        self.state = TcpState.CLOSED
        self._unreported = codes.code_of(event.error)
        for flag in (at.SENDING, at.RECEIVING):
            service = self.services.get(flag)
            if service is not None and service.code is None:
                service.code = codes.code_of(event.error)
                self._unreported = 0

    # --- parts -------------------------------------------------------------------------------------------------------

    def _run(self, service: Service) -> None:
        service.socket = self
        self.services[service.flag] = service

    def _close(self, reset: bool) -> list[Request]:
        self._unanswered_closes += 1
        self._deferred = None
        return [Close(self.number, reset)]

    def _serve_receive(self) -> list[Request]:
        service = self.services.get(at.RECEIVING)
        if service is None or service.code is not None or service.parameters is None:
            return []
        limit = service.parameters.size_bytes
        if self._datagrams and limit:
            datagram = self._datagrams.pop(0)
            self._hand_over(service, datagram.data[:limit])
            service.results |= results_of(datagram.remote)
        elif self._stream and limit:
            self._hand_over(service, bytes(self._stream[:limit]))
            del self._stream[:limit]
            left = TCP_BUFFER - len(self._stream)
            return [] if self._peer_closed else [Grant(self.number, left if left > 0 else 0)]
        elif self._unreported:
            service.code, self._unreported = self._unreported, 0
        elif self._peer_closed or self._broken or not limit:
            self._hand_over(service, b"")  # after a FIN: 0000 with 0 bytes, assumed
        return []

    def _hand_over(self, service: Service, data: bytes) -> None:
        service.data = data
        service.count = len(data)
        service.code = codes.NORMAL_END


_WHILE_OPEN: dict[type, Callable[[Socket, Any], None]] = {
    Received: Socket._take_received,
    Sent: Socket._take_sent,
    Failed: Socket._take_failed_send,
    PeerClosed: Socket._take_peer_closed,
    Broken: Socket._take_broken,
}
"""What an event does to an open socket."""


def results_of(remote: Peer) -> dict[int, int]:
    """A peer as the result words +2..+4."""
    high, low = at.words_of(remote.host)
    return {at.REMOTE_HOST: high, at.REMOTE_HOST + 1: low, at.REMOTE_PORT: remote.port}
