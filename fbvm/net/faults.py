"""Faults of a network, as rows of data: both networks apply the first row that fits a connection.

A row is in force always, or during some scans or some time.  Misbehaviour of the peer itself (late, silent, wrong answers)
is a peer of its own, see `net.peers` and `net.misdeeds`.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

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
    multiples of this time.  `lose_percent` of the pieces and datagrams vanish and `duplicate_percent` come twice, by the
    network's seed.  `reset_after_bytes`: a connection breaks as soon as so many bytes have passed on it, both ways together.

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
    lose_percent: int = 0
    duplicate_percent: int = 0
    reset_after_bytes: int = 0

    def holds(self, scan: int, now_ns: int) -> bool:
        """True if the row is in force in this scan and at this time."""
        return self.from_scan <= scan < self.until_scan and self.from_ns <= now_ns < self.until_ns

    def pieces(self, data: bytes, dice: random.Random) -> Iterator[bytes]:
        """The pieces in which data arrive; `dice` gives their sizes for `random_cut`, and what is lost or comes twice."""
        start = 0
        while start < len(data):
            size = self.segment_bytes or len(data)
            if self.random_cut and self.segment_bytes:
                size = dice.randint(1, self.segment_bytes)
            for _ in range(self.copies(dice)):
                yield data[start : start + size]
            start += size

    def copies(self, dice: random.Random) -> int:
        """How often a piece or a datagram arrives: 0, 1 or 2 times."""
        if self.lose_percent and dice.randrange(100) < self.lose_percent:
            return 0
        return 2 if self.duplicate_percent and dice.randrange(100) < self.duplicate_percent else 1


NO_FAULT = Fault()


def find(faults: Sequence[Fault], one: Peer, other: Peer, scan: int = 0, now_ns: int = 0) -> Fault:
    """The first row that is in force and fits either endpoint, else a row without any fault."""
    for row in faults:
        if row.holds(scan, now_ns) and (fits(row.peer, one) or fits(row.peer, other)):
            return row
    return NO_FAULT


@dataclass(frozen=True, slots=True)
class Kind:
    """A fault by name: what happens, and its row.  `needed` are the fields that whoever names the kind has to set."""

    meaning: str
    fault: Fault
    needed: tuple[str, ...] = ()


NAMED: dict[str, Kind] = {
    "slow": Kind("data take longer each way", Fault(latency_ns=80_000_000), ("latency_ns",)),
    "unsteady": Kind("data take longer by chance", Fault(jitter_ns=60_000_000), ("jitter_ns",)),
    "cut": Kind("data arrive in pieces of 1 byte up to a size", Fault(segment_bytes=5, random_cut=True)),
    "dripping": Kind("data arrive byte by byte", Fault(segment_bytes=1, gap_ns=12_000_000)),
    "joined": Kind("what is sent arrives together, at multiples of a time", Fault(join_ns=150_000_000), ("join_ns",)),
    "lossy": Kind("parts of the data are lost", Fault(lose_percent=10), ("lose_percent",)),
    "doubled": Kind("parts of the data arrive twice", Fault(duplicate_percent=10), ("duplicate_percent",)),
    "silent": Kind("nothing passes: a dead host, a pulled cable", Fault(silent=True)),
    "refused": Kind("no connection can be opened, and open ones break", Fault(error="ECONNREFUSED", reset=True)),
    "unreachable": Kind("no connection can be opened, and nothing passes", Fault(error="EHOSTUNREACH", silent=True)),
    "reset": Kind("open connections break", Fault(reset=True)),
    "interrupted": Kind("connections break in the middle of what is said", Fault(reset_after_bytes=16), ("reset_after_bytes",)),
}
KINDS: dict[str, Fault] = {name: kind.fault for name, kind in NAMED.items()}
"""The rows of the faults by name."""


def fault(kind: str, **fields: Any) -> Fault:
    """The fault of that name, with some of its fields set.  Raises ValueError for an unknown name or a missing field.

    >>> fault("slow", latency_ns=20_000_000).latency_ns
    20000000
    """
    if kind not in NAMED:
        raise ValueError(f"{kind!r} is none of {', '.join(NAMED)}")
    for name in NAMED[kind].needed:
        if name not in fields:
            raise ValueError(f"{kind} needs {name}: {NAMED[kind].meaning}")
    return replace(NAMED[kind].fault, **fields)


def random_faults(seed: int, scans: int, *, longest: int = 100, peer: Peer = ANY) -> list[Fault]:
    """Rows for `scans` scans, one after the other with scans without a fault between them; `seed` decides kinds and times.

    None of them loses or doubles a part of a stream, which TCP itself never does.

    >>> [(row.from_scan, row.until_scan) for row in random_faults(1, 100)] == [
    ...     (row.from_scan, row.until_scan) for row in random_faults(1, 100)]
    True
    """
    dice, rows = random.Random(seed), list[Fault]()
    kinds = [row for row in KINDS.values() if not row.lose_percent and not row.duplicate_percent]
    scan = dice.randint(1, longest)
    while scan < scans:
        until = scan + dice.randint(1, longest)
        rows.append(replace(dice.choice(kinds), peer=peer, from_scan=scan, until_scan=until))
        scan = until + dice.randint(1, longest)
    return rows
