"""One TCP connection in memory: two ends with windows, half close and reset, no sequence numbers and no loss.

Time is an argument of each call.  Data between the ends are in flight until they are due, in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

from fbvm.net.faults import Fault
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapKind

WINDOW_BYTES = 65_536
"""The receive window of an end: bytes that it accepts before its owner has fetched any."""
RETRANSMIT_NS = 1_000_000_000
RETRANSMIT_LIMIT_NS = 75_000_000_000
"""The interval of retransmissions on a silent network, and the time after which the connection breaks with ETIMEDOUT."""


class Carrier(Protocol):
    """The methods of a network that a connection calls."""

    def at(self, due_ns: int, call: Callable[[int], None]) -> None:
        """Schedules a call at `due_ns`."""

    def fault(self, one: Peer, other: Peer) -> Fault:
        """The fault that is in force between two endpoints."""

    def latency_ns(self, fault: Fault) -> int:
        """The latency in one direction."""

    def cut(self, fault: Fault, data: bytes) -> list[bytes]:
        """The pieces in which data arrive."""

    def tell(self, end: End, what: TapKind, out: bool, data: bytes) -> None:
        """Reports an event at an end to the tap."""


class Owner(Protocol):
    """The owner of an end, which receives its events."""

    def sent(self, size_bytes: int) -> None:
        """All bytes of one `send` have been transmitted."""

    def readable(self, now_ns: int) -> None:
        """Data are in the inbox."""

    def finished(self, now_ns: int) -> None:
        """The other side sends nothing more."""

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        """The connection is broken; the data of `unsent` calls of `send` have not been transmitted in full."""


class End:
    """One end of a connection.  Without an owner it is an orphan: it sends its data, then FIN, and answers data by RST."""

    def __init__(self, carrier: Carrier, local: Peer, remote: Peer, unit: str | None, owner: Owner) -> None:
        self.carrier = carrier
        self.local = local
        self.remote = remote
        self.unit = unit
        """Address of the unit's link for the tap; None for an end that belongs to a scripted peer."""
        self.owner: Owner | None = owner
        self.other: End = self
        self.inbox = bytearray()
        self.error = ""
        self.fin_arrived = False
        self._waiting: deque[bytes] = deque()
        self._taken = 0
        self._in_flight: deque[tuple[int, int, TapKind, bytes]] = deque()
        self._in_flight_bytes = 0
        self._last_arrival_ns = 0
        self._fin_asked = self._fin_sent = self._severed = False
        self._passed_bytes = 0

    @property
    def gone(self) -> bool:
        """True if the end is closed or broken, so that the pair of endpoints may be used again."""
        return bool(self.error) or (self.owner is None and self._fin_sent and self.fin_arrived)

    @property
    def waiting_bytes(self) -> int:
        """Bytes of `send` that have no room in the window of the other end yet."""
        return sum(map(len, self._waiting)) - self._taken

    def join(self, other: End) -> None:
        """Connects two ends."""
        self.other, other.other = other, self

    # Called by the owner.

    def send(self, data: bytes, now_ns: int) -> None:
        """Sends all of `data`, as the other end's window allows.  After FIN or a break the data are discarded."""
        if not self._fin_asked and not self.error:
            self._waiting.append(data)
            self._push(now_ns)

    def take(self, limit_bytes: int, now_ns: int) -> bytes:
        """Takes at most `limit_bytes` of arrived data, which opens the window."""
        data = bytes(self.inbox[:limit_bytes])
        del self.inbox[: len(data)]
        if data:
            self.other._push(now_ns)
        return data

    def finish(self, now_ns: int) -> None:
        """Sends FIN after all waiting data; receiving goes on (half close)."""
        self._fin_asked = True
        self._push(now_ns)

    def leave(self, now_ns: int) -> None:
        """Closes both directions: sends FIN, and answers further data by RST.  Data that its owner has not taken are thrown
        away, so that those which had no room behind them arrive, too."""
        self.owner = None
        self.finish(now_ns)
        if self.inbox:
            self.inbox.clear()
            self.other._push(now_ns)

    def reset(self, now_ns: int) -> None:
        """Closes the connection by RST."""
        self.owner = None
        if not self.error:
            self.error = "ECONNABORTED"
            self._waiting.clear()
            self._transmit(TapKind.RST, b"", now_ns)

    # Called by the network.

    def reset_both(self, now_ns: int) -> None:
        """Resets both ends, as a device between them may do."""
        for end in (self, self.other):
            if not end.error:
                self.carrier.tell(end, TapKind.RST, False, b"")
                end._break("ECONNRESET", now_ns)

    def _push(self, now_ns: int) -> None:
        while self._waiting and not self.error:
            head = self._waiting[0]
            room = WINDOW_BYTES - self._in_flight_bytes - len(self.other.inbox)
            if room <= 0 and head:
                return
            part = head[self._taken : self._taken + room]
            self._taken += len(part)
            for piece in self.carrier.cut(self.carrier.fault(self.local, self.remote), part):
                self._transmit(TapKind.DATA, piece, now_ns)
            if self._taken == len(head):
                self._waiting.popleft()
                self._taken = 0
                if self.owner:
                    self.owner.sent(len(head))
        if self._fin_asked and not self._fin_sent and not self.error:
            self._fin_sent = True
            self._transmit(TapKind.FIN, b"", now_ns)

    def _transmit(self, what: TapKind, data: bytes, now_ns: int) -> None:
        if self._severed:
            return
        fault = self.carrier.fault(self.local, self.remote)
        if fault.reset_after_bytes:
            data = self._sever(fault.reset_after_bytes, data)
        gap_ns = fault.gap_ns if fault.segment_bytes and what is TapKind.DATA else 0
        arrival_ns = max(now_ns + self.carrier.latency_ns(fault), self._last_arrival_ns + gap_ns)
        if fault.join_ns and what is TapKind.DATA:
            arrival_ns = -(-arrival_ns // fault.join_ns) * fault.join_ns
        self._last_arrival_ns = arrival_ns
        self._in_flight_bytes += len(data)
        self._in_flight.append((arrival_ns, now_ns, what, data))
        self.carrier.at(arrival_ns, self._deliver_due)
        self.carrier.tell(self, what, True, data)
        if self._severed:
            self.carrier.at(arrival_ns, self.reset_both)

    def _sever(self, after_bytes: int, data: bytes) -> bytes:
        """The part of `data` that passes before the connection breaks; counts bytes since the fault is in force."""
        left = max(0, after_bytes - self._passed_bytes - self.other._passed_bytes)
        self._severed = self.other._severed = len(data) >= left
        self._passed_bytes += len(data[:left])
        return data[:left]

    def _deliver_due(self, now_ns: int) -> None:
        while self._in_flight and self._in_flight[0][0] <= now_ns:
            _, sent_ns, what, data = self._in_flight[0]
            if self.carrier.fault(self.local, self.remote).silent:
                if now_ns - sent_ns < RETRANSMIT_LIMIT_NS:
                    self.carrier.at(now_ns + RETRANSMIT_NS, self._deliver_due)
                else:
                    self._in_flight.clear()
                    self._break("ETIMEDOUT", now_ns)
                return
            self._in_flight.popleft()
            self._in_flight_bytes -= len(data)
            self.other._arrive(what, data, now_ns)

    def _arrive(self, what: TapKind, data: bytes, now_ns: int) -> None:
        if self.error:
            if self.error == "ETIMEDOUT" and what is not TapKind.RST:  # the other side has not noticed, and is told so
                self._transmit(TapKind.RST, b"", now_ns)
            return
        self.carrier.tell(self, what, False, data)
        if what is TapKind.RST:
            self._break("ECONNRESET", now_ns)
        elif what is TapKind.FIN:
            self.fin_arrived = True
            if self.owner:
                self.owner.finished(now_ns)
        elif self.owner is None:
            self.reset(now_ns)
        else:
            self.inbox += data
            self.owner.readable(now_ns)

    def _break(self, error: str, now_ns: int) -> None:
        if self.error:
            return
        self.error = error
        unsent = len(self._waiting)
        self._waiting.clear()
        if self.owner:
            self.owner.broken(error, unsent, now_ns)
