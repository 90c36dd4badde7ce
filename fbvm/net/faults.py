"""Faults of a network, as rows of data: a `LoopNetwork` applies the first row that fits a connection.

A row is in force always, or during some scans or some time.  Misbehaviour of the peer itself (late, silent, wrong answers)
is a peer of its own, see `net.peers` and `net.misdeeds`.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fbvm.net.addresses import fits
from fbvm.wire.link import Peer

ANY = Peer("0.0.0.0", 0)
FOREVER = 1 << 62
"""The end of a row that is always in force."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One row: the faults of connections with an endpoint that fits `peer`.

    `latency_ns` is the latency in each direction instead of the network's, with up to `jitter_ns` more, from the network's
    seed; `silent`: nothing passes (a dead host, a pulled cable) while the row is in force; `error`: opening fails at once
    with this errno name; `reset`: open connections break.  `segment_bytes`: data arrive in pieces of this size, `gap_ns`
    apart; with `random_cut` in pieces of 1 up to this size, from the network's seed.  `join_ns`: data arrive together at
    multiples of this time.

    The row is in force in the scans of the PLC from `from_scan` (0 is the first) until before `until_scan`, and likewise in
    time; the row is looked up when something is sent, arrives or is opened.  A scan is one I/O refresh of the unit."""

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
        """True if the row is in force in this scan and at this time."""
        return self.from_scan <= scan < self.until_scan and self.from_ns <= now_ns < self.until_ns

    def pieces(self, data: bytes, dice: random.Random) -> Iterator[bytes]:
        """The pieces in which data arrive; `dice` gives their sizes for `random_cut`."""
        start = 0
        while start < len(data):
            size = self.segment_bytes or len(data)
            if self.random_cut and self.segment_bytes:
                size = dice.randint(1, self.segment_bytes)
            yield data[start : start + size]
            start += size


NO_FAULT = Fault()


def find(faults: Sequence[Fault], one: Peer, other: Peer, scan: int = 0, now_ns: int = 0) -> Fault:
    """The first row that is in force and fits either endpoint, else a row without any fault."""
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
"""Faults by name, among which `random_faults` chooses."""


def random_faults(seed: int, scans: int, *, longest: int = 100, peer: Peer = ANY) -> list[Fault]:
    """Rows for `scans` scans, one after the other with scans without a fault between them; `seed` decides kinds and times.

    >>> [(row.from_scan, row.until_scan) for row in random_faults(1, 100)] == [
    ...     (row.from_scan, row.until_scan) for row in random_faults(1, 100)]
    True
    """
    dice, rows = random.Random(seed), list[Fault]()
    scan = dice.randint(1, longest)
    while scan < scans:
        until = scan + dice.randint(1, longest)
        rows.append(replace(dice.choice(list(KINDS.values())), peer=peer, from_scan=scan, until_scan=until))
        scan = until + dice.randint(1, longest)
    return rows
