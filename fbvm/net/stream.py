"""One TCP connection in memory: two ends with windows, half close and reset, no sequence numbers and no loss.

The ends know time only as they are told it.  What passes between them waits in `flight` until it is due, in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

from fbvm.net.faults import Fault
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapKind

WINDOW_BYTES = 65_536
"""What an end takes in before its owner has fetched anything."""
RETRANSMIT_NS = 1_000_000_000
RETRANSMIT_LIMIT_NS = 75_000_000_000
"""How often, and for how long, a silent way is tried again before the connection breaks with ETIMEDOUT."""


class Way(Protocol):
    """What a connection needs of its network."""

    def at(self, due_ns: int, call: Callable[[int], None]) -> None:
        """Call back with the time when it is due."""

    def fault(self, one: Peer, other: Peer) -> Fault:
        """What holds now between two endpoints."""

    def latency_ns(self, fault: Fault) -> int:
        """Time for one way."""

    def cut(self, fault: Fault, data: bytes) -> list[bytes]:
        """Data in the pieces in which they arrive."""

    def tell(self, end: End, what: TapKind, out: bool, data: bytes) -> None:
        """Pass a happening at an end on to the tap."""


class Owner(Protocol):
    """Who holds an end; told what happens to it."""

    def sent(self, size_bytes: int) -> None:
        """All bytes of one `send` are on their way."""

    def readable(self, now_ns: int) -> None:
        """There is something in the inbox."""

    def finished(self, now_ns: int) -> None:
        """The other side sends nothing more."""

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        """The connection is gone; `unsent` calls of `send` had not been taken in full."""


class End:
    """One end of a connection.  Without an owner it is an orphan: it sends what it has, then FIN, and wants nothing."""

    def __init__(self, way: Way, local: Peer, remote: Peer, unit: str | None, owner: Owner) -> None:
        self.way = way
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
        self._flight: deque[tuple[int, int, TapKind, bytes]] = deque()
        self._flying_bytes = 0
        self._last_arrival_ns = 0
        self._fin_asked = self._fin_sent = False

    @property
    def gone(self) -> bool:
        """True when nothing can happen here any more, so that the pair of endpoints may be used again."""
        return bool(self.error) or (self.owner is None and self._fin_sent and self.fin_arrived)

    @property
    def waiting_bytes(self) -> int:
        """What has been given to `send` and has no room in the other side's window yet."""
        return sum(map(len, self._waiting)) - self._taken

    def join(self, other: End) -> None:
        """Make two ends one connection."""
        self.other, other.other = other, self

    # What the owner does.

    def send(self, data: bytes, now_ns: int) -> None:
        """Send all of it, as fast as the other side's window allows.  After FIN or a break it goes nowhere."""
        if not self._fin_asked and not self.error:
            self._waiting.append(data)
            self._push(now_ns)

    def take(self, limit_bytes: int, now_ns: int) -> bytes:
        """Fetch what has arrived, at most so much; room in the window comes of it."""
        data = bytes(self.inbox[:limit_bytes])
        del self.inbox[: len(data)]
        if data:
            self.other._push(now_ns)
        return data

    def finish(self, now_ns: int) -> None:
        """Send FIN after everything that waits; receiving goes on (half close)."""
        self._fin_asked = True
        self._push(now_ns)

    def leave(self, now_ns: int) -> None:
        """Close in both directions: FIN, and data that still come are answered by RST."""
        self.owner = None
        self.finish(now_ns)

    def reset(self, now_ns: int) -> None:
        """Tear the connection down by RST."""
        self.owner = None
        if not self.error:
            self.error = "ECONNABORTED"
            self._waiting.clear()
            self._fly(TapKind.RST, b"", now_ns)

    # What the way does.

    def tear(self, now_ns: int) -> None:
        """Something between the two ends resets both of them."""
        for end in (self, self.other):
            if not end.error:
                self.way.tell(end, TapKind.RST, False, b"")
                end._break("ECONNRESET", now_ns)

    def _push(self, now_ns: int) -> None:
        while self._waiting and not self.error:
            head = self._waiting[0]
            room = WINDOW_BYTES - self._flying_bytes - len(self.other.inbox)
            if room <= 0 and head:
                return
            part = head[self._taken : self._taken + room]
            self._taken += len(part)
            for piece in self.way.cut(self.way.fault(self.local, self.remote), part):
                self._fly(TapKind.DATA, piece, now_ns)
            if self._taken == len(head):
                self._waiting.popleft()
                self._taken = 0
                if self.owner:
                    self.owner.sent(len(head))
        if self._fin_asked and not self._fin_sent and not self.error:
            self._fin_sent = True
            self._fly(TapKind.FIN, b"", now_ns)

    def _fly(self, what: TapKind, data: bytes, now_ns: int) -> None:
        fault = self.way.fault(self.local, self.remote)
        gap_ns = fault.gap_ns if fault.segment_bytes and what is TapKind.DATA else 0
        arrival_ns = max(now_ns + self.way.latency_ns(fault), self._last_arrival_ns + gap_ns)
        if fault.join_ns and what is TapKind.DATA:
            arrival_ns = -(-arrival_ns // fault.join_ns) * fault.join_ns
        self._last_arrival_ns = arrival_ns
        self._flying_bytes += len(data)
        self._flight.append((arrival_ns, now_ns, what, data))
        self.way.at(arrival_ns, self._land)
        self.way.tell(self, what, True, data)

    def _land(self, now_ns: int) -> None:
        while self._flight and self._flight[0][0] <= now_ns:
            _, sent_ns, what, data = self._flight[0]
            if self.way.fault(self.local, self.remote).silent:
                if now_ns - sent_ns < RETRANSMIT_LIMIT_NS:
                    self.way.at(now_ns + RETRANSMIT_NS, self._land)
                else:
                    self._flight.clear()
                    self._break("ETIMEDOUT", now_ns)
                return
            self._flight.popleft()
            self._flying_bytes -= len(data)
            self.other._arrive(what, data, now_ns)

    def _arrive(self, what: TapKind, data: bytes, now_ns: int) -> None:
        if self.error:
            return
        self.way.tell(self, what, False, data)
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
