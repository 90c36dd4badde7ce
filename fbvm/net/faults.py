"""What may go wrong on the way, as rows of data: a `LoopNetwork` takes the first row that fits a connection.

Misbehaviour of the peer itself (late, silent, wrong answers) is written as a peer, see `net.peers`."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fbvm.net.addresses import fits
from fbvm.wire.link import Peer

ANY = Peer("0.0.0.0", 0)


@dataclass(frozen=True, slots=True)
class Fault:
    """One row: connections with an endpoint that fits `peer`, and what their way does to them.

    `latency_ns` each way instead of the network's; `silent`: nothing passes (a dead host, a pulled cable) while the
    row is in the table; `error`: opening fails at once with this errno name.  `segment_bytes`: data arrive in pieces
    of this size, `gap_ns` apart; with `random_cut` in pieces of 1 up to this size, from the network's seed."""

    peer: Peer = ANY
    latency_ns: int | None = None
    silent: bool = False
    error: str = ""
    segment_bytes: int = 0
    random_cut: bool = False
    gap_ns: int = 10_000_000

    def pieces(self, data: bytes, dice: random.Random) -> Iterator[bytes]:
        """The data as they arrive."""
        start = 0
        while start < len(data):
            size = self.segment_bytes or len(data)
            if self.random_cut and self.segment_bytes:
                size = dice.randint(1, self.segment_bytes)
            yield data[start : start + size]
            start += size


NO_FAULT = Fault()


def find(faults: Sequence[Fault], one: Peer, other: Peer) -> Fault:
    """The first row that fits either endpoint, else a row without any fault."""
    return next((row for row in faults if fits(row.peer, one) or fits(row.peer, other)), NO_FAULT)
