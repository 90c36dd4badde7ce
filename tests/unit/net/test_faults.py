"""Faults of a network in memory: what each does, and when it holds."""

from __future__ import annotations

import itertools
from random import Random

import pytest
from rows import each_of

from fbvm.net.faults import KINDS, NAMED, Fault, fault, random_faults
from fbvm.net.loop import LoopLink, LoopNetwork
from fbvm.net.peers import ModbusPeer, Say, ScriptedPeer
from fbvm.wire import modbus
from fbvm.wire.link import Broken, Close, Connect, Event, Failed, Grant, Opened, Peer, Received, Send, Sent
from fbvm.wire.modbus import Adu
from fbvm.wire.tap import TapKind

SERVER = Peer("10.0.0.1", 502)
REQUEST = Adu(1, 1, modbus.read(3, 0, 2)).to_bytes()
MS = 1_000_000
OPENED = Opened(1, 49152, SERVER)


class Line:
    """A link whose scans are 10 ms apart, and what it was told in each."""

    def __init__(self, *faults: Fault, seed: int = 0) -> None:
        self.network = LoopNetwork(seed, faults=faults)
        self.network.place(SERVER, ModbusPeer())
        self.link: LoopLink = self.network.attach("10.0.0.2")
        self.scans = 0

    def scan(self, *requests: object) -> list[Event]:
        """One refresh: events first, then what the unit asks for."""
        now_ns = self.scans * 10 * MS
        events = self.link.events(now_ns)
        self.link.submit(requests, now_ns)  # type: ignore[arg-type]
        self.scans += 1
        return events

    def open(self) -> None:
        self.scan(Connect(1, SERVER), Grant(1, 4096))
        assert self.scan() == [OPENED]

    def arrivals(self, scans: int) -> list[tuple[int, int]]:
        """Scans from now on in which bytes come, and how many."""
        events = [(scan, event) for scan in range(scans) for event in self.scan()]
        return [(scan, len(event.data)) for scan, event in events if isinstance(event, Received)]


def test_a_row_holds_during_some_scans() -> None:
    line = Line(Fault(error="ECONNREFUSED", from_scan=2, until_scan=4))
    told = [line.scan(Connect(scan + 1, SERVER)) for scan in range(6)]
    assert [[type(event) for event in events] for events in told] == [
        [], [Opened], [Opened], [Failed], [Failed], [Opened]
    ]  # fmt: skip
    assert line.link.scan == 5


def test_a_row_holds_during_some_time() -> None:
    line = Line(Fault(error="EHOSTUNREACH", from_ns=20 * MS, until_ns=40 * MS))
    told = [type(event) for scan in range(6) for event in line.scan(Connect(scan + 1, SERVER))]
    assert told == [Opened, Opened, Failed, Failed, Opened]


def test_the_first_row_that_holds_counts() -> None:
    line = Line(Fault(latency_ns=50 * MS, until_scan=1), Fault(latency_ns=0, until_scan=1), Fault(latency_ns=20 * MS))
    assert line.network.fault(SERVER, line_peer(line)).latency_ns == 50 * MS
    line.scan()
    line.scan()
    assert line.network.fault(SERVER, line_peer(line)).latency_ns == 20 * MS


def line_peer(line: Line) -> Peer:
    return Peer(line.link.address, 1)


def test_what_is_open_breaks_in_the_scan_of_a_reset() -> None:
    line = Line(Fault(reset=True, from_scan=5, until_scan=6))
    taps: list[TapKind] = []
    line.network.tap = lambda now_ns, unit, event: taps.append(event.kind)
    line.open()
    told = [line.scan() for _ in range(5)]
    assert told == [[], [], [], [Broken(1, "ECONNRESET")], []]
    assert taps == [TapKind.SYN, TapKind.OPEN, TapKind.RST]
    assert line.scan(Connect(2, SERVER)) == []
    assert [type(event) for event in line.scan()] == [Opened]
    assert line.scan() == []


def test_the_peer_learns_of_a_reset_too() -> None:
    line = Line(Fault(reset=True, from_scan=4))
    line.open()
    line.scan(Send(1, REQUEST))
    line.scan()
    assert line.scan() == [Broken(1, "ECONNRESET")]
    assert line.arrivals(50) == []


def test_jitter_is_seeded_and_bounded() -> None:
    def times(seed: int) -> list[tuple[int, int]]:
        line = Line(Fault(jitter_ns=100 * MS), seed=seed)
        line.scan(Connect(1, SERVER), Grant(1, 4096))
        for _ in range(25):
            line.scan()
        line.scan(*[Send(1, REQUEST)] * 9)
        arrivals = line.arrivals(40)
        assert max(scan for scan, _ in arrivals) <= 20
        return arrivals

    assert times(1) == times(1) != times(2)
    assert sum(size for _, size in times(1)) == 9 * 13
    assert len(times(1)) > 3


def test_joined_segments_come_together() -> None:
    line = Line(Fault(join_ns=100 * MS, from_scan=2))
    line.open()
    for _ in range(3):
        line.scan(Send(1, REQUEST))
    assert line.arrivals(20) == [(5, 39)]


def test_lost_parts_are_seeded() -> None:
    def received(seed: int) -> bytes:
        line = Line(Fault(lose_percent=30, segment_bytes=1, gap_ns=0), seed=seed)
        line.network.place(SERVER, ScriptedPeer(greeting=[Say(bytes(range(200)))]))
        line.scan(Connect(1, SERVER), Grant(1, 4096))
        return b"".join(event.data for _ in range(3) for event in line.scan() if isinstance(event, Received))

    assert received(1) == received(1) != received(2)
    assert 100 < len(received(1)) < 180
    assert list(received(1)) == sorted(received(1))


def test_a_part_may_be_lost_and_may_come_twice() -> None:
    lost = Line(Fault(lose_percent=100))
    lost.open()
    lost.scan(Send(1, REQUEST))
    assert lost.arrivals(20) == []
    doubled = Line(Fault(duplicate_percent=100))
    doubled.open()
    doubled.scan(Send(1, REQUEST))
    assert sum(size for _, size in doubled.arrivals(5)) == 4 * 13, "the request came twice, and each reply"


def test_a_connection_breaks_in_the_middle_of_a_reply() -> None:
    line = Line(Fault(reset_after_bytes=len(REQUEST) + 5))
    for _ in range(2):  # every new connection begins to count anew
        line.scan(Connect(1, SERVER), Grant(1, 4096))
        assert isinstance(line.scan()[0], Opened)
        line.scan(Send(1, REQUEST))
        told = [event for _ in range(3) for event in line.scan()]
        assert [type(event) for event in told] == [Sent, Received, Broken]
        assert told[1:] == [Received(1, told[1].data[:5]), Broken(1, "ECONNRESET")]  # type: ignore[union-attr]
        line.scan(Close(1))
        line.scan()


def test_a_side_that_has_not_noticed_is_told_when_it_speaks() -> None:
    line, peer = Line(), ScriptedPeer(greeting=[Say(b"late", 100_000 * MS)])
    line.network.place(SERVER, peer)
    line.scan(Connect(1, SERVER), Grant(1, 99))
    line.scan()
    line.network.faults.append(Fault(silent=True))
    line.link.submit([Send(1, REQUEST)], line.network.now_ns)
    assert line.link.events(80_000 * MS)[-1] == Broken(1, "ETIMEDOUT")
    line.network.faults.clear()
    assert peer.log == []
    line.link.events(110_000 * MS)
    assert (peer.log, peer.received) == (["ECONNRESET"], []), "what was on the way is lost"


def test_a_kind_needs_what_it_is_about() -> None:
    assert fault("slow", latency_ns=MS) == Fault(latency_ns=MS)
    assert fault("silent", until_scan=3) == Fault(silent=True, until_scan=3)
    for name, kind in NAMED.items():
        if kind.needed:
            with pytest.raises(ValueError, match=f"{name} needs {kind.needed[0]}"):
                fault(name)
    with pytest.raises(ValueError, match="none of slow"):
        fault("odd")


def test_two_plcs_have_scans_of_their_own() -> None:
    """The scan is that of the unit that speaks."""
    line = Line(Fault(silent=True, from_scan=3))
    other = line.network.attach("10.0.0.3")
    for _ in range(9):
        other.events(0)
    assert (other.scan, line.link.scan) == (8, 0)
    assert line.network.fault(Peer("10.0.0.3", 1), SERVER).silent
    assert line.network.fault(Peer("10.0.0.3", 1), Peer("10.0.0.2", 1)).silent
    assert not line.network.fault(Peer("10.0.0.2", 1), Peer("10.0.0.3", 1)).silent


@pytest.mark.slow
@each_of("kind", KINDS)
def test_after_each_kind_all_is_well(kind: str) -> None:
    row = KINDS[kind]
    line = Line(Fault(row.peer, row.latency_ns, row.silent, row.error, row.segment_bytes, row.random_cut,
                      row.gap_ns, row.jitter_ns, row.join_ns, row.reset, 0, 30))  # fmt: skip
    line.scan(Connect(1, SERVER), Grant(1, 4096))
    for _ in range(40):
        line.scan(Send(1, REQUEST))
    for _ in range(300):
        line.scan()
    line.scan(Connect(2, SERVER), Grant(2, 4096))
    line.scan(Send(2, REQUEST))
    [sent, received] = line.scan()
    assert isinstance(sent, Sent)
    assert isinstance(received, Received)
    assert len(received.data) == 13


def test_random_faults_are_seeded() -> None:
    rows = random_faults(7, 5000, longest=50)
    assert rows == random_faults(7, 5000, longest=50) != random_faults(8, 5000, longest=50)
    assert len(rows) > 50
    for before, after in itertools.pairwise(rows):
        assert before.from_scan < before.until_scan <= before.from_scan + 50
        assert before.until_scan < after.from_scan <= before.until_scan + 50
    assert {row.silent for row in rows} == {True, False}
    begins = {random_faults(seed, 100, longest=3)[0].from_scan for seed in range(40)}
    assert begins == {1, 2, 3}, "the first scan, too"


def test_the_rows_of_the_faults_by_name() -> None:
    assert dict(KINDS) == {
        "slow": Fault(latency_ns=80 * MS), "unsteady": Fault(jitter_ns=60 * MS), "cut": Fault(segment_bytes=5, random_cut=True),
        "dripping": Fault(segment_bytes=1, gap_ns=12 * MS), "joined": Fault(join_ns=150 * MS), "lossy": Fault(lose_percent=10),
        "doubled": Fault(duplicate_percent=10), "silent": Fault(silent=True), "reset": Fault(reset=True),
        "refused": Fault(error="ECONNREFUSED", reset=True), "unreachable": Fault(error="EHOSTUNREACH", silent=True),
        "interrupted": Fault(reset_after_bytes=16)}  # fmt: skip


@pytest.mark.parametrize(("row", "copies"), [(Fault(duplicate_percent=7), 2), (Fault(lose_percent=7), 0)])
def test_so_many_of_a_hundred_parts_are_lost_or_come_twice(row: Fault, copies: int) -> None:
    class Dice(Random):
        drawn = 0

        def randrange(self, start: int, *_: object) -> int:  # type: ignore[override]
            return self.drawn

    dice, seen = Dice(), []
    for dice.drawn in range(100):
        seen.append(row.copies(dice))
    assert seen == [copies] * 7 + [1] * 93
