"""The wires between the endpoints of a network: what is on its way, in order of time, and the faults that delay or change it.

The network in memory is made of wires; real connections are led through them while a fault fits their endpoints.
"""

from __future__ import annotations

import heapq
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable

from fbvm.net.faults import NO_FAULT, Fault, find
from fbvm.net.stream import End
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapKind

CONNECT_TIMEOUT_NS = 75_000_000_000
"""The time after which an open to a silent host fails, as in BSD stacks.  The unit's own limit is not known: assumed."""


class Wires(ABC):
    """`seed` starts the random numbers, `latency_ns` is the latency in each direction without a fault, `faults` is a list of
    rows that may be changed at any time (see `net.faults`)."""

    def __init__(self, seed: int = 0, latency_ns: int = 0, faults: Iterable[Fault] = ()) -> None:
        self.faults = list(faults)
        self.now_ns = 0
        self._latency_ns = latency_ns
        self._dice = random.Random(seed)
        self._due: list[tuple[int, int, Callable[[int], None]]] = []
        self._count = 0

    def reseed(self, seed: int) -> None:
        """Starts the random numbers anew."""
        self._dice = random.Random(seed)

    @abstractmethod
    def scan_of(self, one: Peer, other: Peer) -> int:
        """The number of the present scan of the unit at `one`, or, if there is none, at `other`; 0 without either."""

    @abstractmethod
    def tell_unit(self, unit: str, what: TapKind, local: Peer, remote: Peer, out: bool, data: bytes = b"") -> None:
        """Reports an event at a unit to the tap."""

    def next_due_ns(self) -> int | None:
        """The time at which the next scheduled event is due, up to which a run may skip; None if there is none."""
        return self._due[0][0] if self._due else None

    def run(self, now_ns: int) -> None:
        """Does everything that is due until `now_ns`."""
        while self._due and self._due[0][0] <= now_ns:
            due_ns, _, call = heapq.heappop(self._due)
            self.now_ns = max(self.now_ns, due_ns)
            call(self.now_ns)
        self.now_ns = max(self.now_ns, now_ns)

    # The methods of `stream.Carrier`.

    def at(self, due_ns: int, call: Callable[[int], None]) -> None:
        """Schedules a call at `due_ns`."""
        self._count += 1
        heapq.heappush(self._due, (due_ns, self._count, call))

    def fault(self, one: Peer, other: Peer) -> Fault:
        """The fault between two endpoints that is in force now; the scan is that of `one`, if a unit, else of `other`."""
        return find(self.faults, one, other, self.scan_of(one, other), self.now_ns) if self.faults else NO_FAULT

    def latency_ns(self, fault: Fault) -> int:
        """The latency in one direction, with jitter."""
        latency_ns = self._latency_ns if fault.latency_ns is None else fault.latency_ns
        return latency_ns + (self._dice.randint(0, fault.jitter_ns) if fault.jitter_ns else 0)

    def cut(self, fault: Fault, data: bytes) -> list[bytes]:
        """The pieces in which data arrive."""
        return list(fault.pieces(data, self._dice))

    def tell(self, end: End, what: TapKind, out: bool, data: bytes = b"") -> None:
        """Reports an event at an end to the tap, if the end is a unit's."""
        if end.unit is not None:
            self.tell_unit(end.unit, what, end.local, end.remote, out, data)

    # Datagrams.

    def pass_datagram(self, one: Peer, other: Peer, data: bytes, deliver: Callable[[bytes, int], None]) -> None:
        """Calls `deliver` with the datagram and the time of its arrival: never, once or twice, as the fault between the two
        endpoints wants it."""
        fault = self.fault(one, other)
        if not fault.silent:
            for _ in range(fault.copies(self._dice)):
                self.at(self.now_ns + self.latency_ns(fault), lambda now_ns: deliver(data, now_ns))
