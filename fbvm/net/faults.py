"""What may go wrong on the way, as rows of data: a `LoopNetwork` takes the first row that fits a connection.

A row holds always, or during some scans or some time.  Misbehaviour of the peer itself (late, silent, wrong answers)
is written as a peer, see `net.peers` and `net.misdeeds`.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fbvm.net.addresses import fits
from fbvm.wire.link import Peer

ANY = Peer("0.0.0.0", 0)
FOREVER = 1 << 62
"""The end of what has none."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One row: connections with an endpoint that fits `peer`, and what their way does to them.

    `latency_ns` each way instead of the network's, and up to `jitter_ns` more, from the network's seed; `silent`:
    nothing passes (a dead host, a pulled cable) while the row holds; `error`: opening fails at once with this errno
    name; `reset`: what is open breaks.  `segment_bytes`: data arrive in pieces of this size, `gap_ns` apart; with
    `random_cut` in pieces of 1 up to this size, from the network's seed.  `join_ns`: what is sent arrives together at
    multiples of this time.

    The row holds in the scans of the PLC from `from_scan` (0 is the first) until before `until_scan`, and likewise in
    time; it is asked when something is sent, arrives or is opened.  A scan is one I/O refresh of the unit."""

    peer: Peer = ANY
    latency_ns: int | None = None
    silent: bool = False
    error: str = ""
    segment_bytes: int = 0
    random_cut: bool = False
    gap_ns: int = 10_000_000
    jitter_ns: int = 0
    join_ns: int = 0
    reset: bool = False
    from_scan: int = 0
    until_scan: int = FOREVER
    from_ns: int = 0
    until_ns: int = FOREVER

    def holds(self, scan: int, now_ns: int) -> bool:
        """Whether the row counts now."""
        return self.from_scan <= scan < self.until_scan and self.from_ns <= now_ns < self.until_ns

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


def find(faults: Sequence[Fault], one: Peer, other: Peer, scan: int = 0, now_ns: int = 0) -> Fault:
    """The first row that holds and fits either endpoint, else a row without any fault."""
    for row in faults:
        if row.holds(scan, now_ns) and (fits(row.peer, one) or fits(row.peer, other)):
            return row
    return NO_FAULT


KINDS: dict[str, Fault] = {
    "slow": Fault(latency_ns=80_000_000),
    "unsteady": Fault(jitter_ns=60_000_000),
    "cut": Fault(segment_bytes=5, random_cut=True),
    "dripping": Fault(segment_bytes=1, gap_ns=12_000_000),
    "joined": Fault(join_ns=150_000_000),
    "silent": Fault(silent=True),
    "refused": Fault(error="ECONNREFUSED", reset=True),
    "unreachable": Fault(error="EHOSTUNREACH", silent=True),
    "reset": Fault(reset=True),
}
"""What may befall a network, by name."""


def random_faults(seed: int, scans: int, *, longest: int = 100, peer: Peer = ANY) -> list[Fault]:
    """Rows for so many scans, one after the other with good times between them: kinds and times by the seed."""
    dice, rows = random.Random(seed), list[Fault]()
    scan = dice.randint(1, longest)
    while scan < scans:
        until = scan + dice.randint(1, longest)
        rows.append(replace(dice.choice(list(KINDS.values())), peer=peer, from_scan=scan, until_scan=until))
        scan = until + dice.randint(1, longest)
    return rows
