"""A unit's connection over wires: what it tells the unit, in which order, and when the unit has to ask again."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from test_stream import CLIENT, SERVER, Carrier, Owner

from fbvm.net.channels import SEND_BUFFER_BYTES
from fbvm.net.loop_channels import UdpPort, WiredConnection
from fbvm.net.relays import RelayedConnection
from fbvm.net.stream import WINDOW_BYTES, End
from fbvm.wire.link import Broken, Failed, Opened, Peer, PeerClosed, Received, Sent
from fbvm.wire.tap import TapKind


class Taps(Carrier):
    """A network that notes what is told of ends."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[tuple[TapKind, bool]] = []

    def tell(self, end: End, what: TapKind, out: bool, data: bytes) -> None:
        self.told.append((what, out))


class Rig:
    """A connection of channel 4, its link, and the end of the other side, which an owner has."""

    def __init__(self, kind: type[WiredConnection] = WiredConnection, *, active: bool = True, opened: bool = True) -> None:
        self.link: Any = SimpleNamespace(pending=[], channels={}, waiting={}, is_quiet=True)
        self.made = self.link.channels[4] = kind(self.link, 4)
        self.net, self.owner = Taps(), Owner()
        self.end = End(self.net, CLIENT, SERVER, CLIENT.host, self.made)
        self.other = End(self.net, SERVER, CLIENT, None, self.owner)
        self.end.join(self.other)
        if opened:
            self.made.answered(self.end, "", active, 0)
            assert self.told() == [Opened(4, CLIENT.port, SERVER)]

    def told(self) -> list[Any]:
        """What the unit has been told since the last call."""
        found = list(self.link.pending)
        self.link.pending.clear()
        return found

    def fetched(self) -> list[Any]:
        self.net.run()
        self.made.fetch(0)
        return self.told()


@pytest.mark.parametrize("active", [True, False])
def test_an_open_connection_is_told_and_tapped(active: bool) -> None:
    assert Rig(active=active).net.told == [(TapKind.OPEN, active)]


def test_before_it_is_open_a_connection_sends_and_tells_nothing() -> None:
    rig = Rig(opened=False)
    assert rig.made.send(b"x", 0) == "ENOTCONN" and rig.fetched() == []
    rig.made.answered(rig.end, "ECONNREFUSED", True, 0)
    assert rig.told() == [Failed(4, "open", "ECONNREFUSED")] and rig.link.channels == {}
    assert rig.net.told == [(TapKind.RST, False)]


def test_data_come_as_far_as_the_unit_has_room_and_the_end_behind_them() -> None:
    rig = Rig()
    rig.other.send(b"abcdef", 0)
    rig.other.finish(0)
    assert rig.fetched() == []
    rig.made.grant(4)
    assert rig.fetched() == [Received(4, b"abcd")] and rig.made.granted == 0
    assert rig.fetched() == []
    rig.made.grant(9)
    assert rig.fetched() == [Received(4, b"ef"), PeerClosed(4)] and rig.made.granted == 7
    assert rig.fetched() == [], "the end is told once"
    assert rig.made.send(b"still", 0) == "" and rig.fetched() == [Sent(4, 5)]


def test_a_break_is_told_once_and_behind_it_nothing_is_sent() -> None:
    rig = Rig()
    assert rig.made.send(bytes(SEND_BUFFER_BYTES + 1), 0) == "ENOBUFS" and rig.made.send(bytes(WINDOW_BYTES + 5), 0) == ""
    rig.other.send(b"late", 0)
    rig.net.run()
    rig.other.reset(0)
    rig.net.run()
    assert rig.told() == [Failed(4, "send", "ECONNRESET")], "one that was not sent whole"
    assert rig.fetched() == [Broken(4, "ECONNRESET")] and rig.fetched() == []
    assert rig.made.send(b"x", 0) == "EPIPE"
    rig.made.grant(9)
    assert rig.fetched() == [], "what came before the break is lost"


@pytest.mark.parametrize(("reset", "error", "owner"), [(True, "ECONNRESET", ["ECONNRESET 0"]), (False, "", ["finished"])])
def test_a_unit_closes_in_either_way_before_and_behind_the_answer(reset: bool, error: str, owner: list[str]) -> None:
    rig, early = Rig(), Rig(opened=False)
    rig.made.close(reset, 0)
    early.made.close(reset, 0)
    early.made.answered(early.end, "", True, 0)
    for each in (rig, early):
        each.net.run()
        assert each.owner.told == owner and each.told() == [] and each.other.error == error
    early = Rig(opened=False)
    early.made.close(reset, 0)
    early.made.answered(early.end, "ECONNREFUSED", True, 0)
    assert early.told() == [] and 4 in early.link.channels, "a unit that has closed is not told that the open has failed"


@pytest.mark.parametrize("what", ["readable", "finished", "broken", "grant"])
def test_under_faults_a_unit_is_asked_again_whenever_something_has_come(what: str) -> None:
    rig = Rig(RelayedConnection)
    made: Any = rig.made
    calls = {"readable": lambda: made.readable(0), "finished": lambda: made.finished(0), "grant": lambda: made.grant(5),
             "broken": lambda: made.broken("EPIPE", 2, 0)}  # fmt: skip
    calls[what]()
    assert list(rig.link.waiting) == [made] and rig.link.is_quiet is False
    assert rig.told() == [Failed(4, "send", "EPIPE")] * 2 * (what == "broken") and made.granted == 5 * (what == "grant")
    made.fetch(0)
    assert rig.link.waiting == {}
    calls[what]()
    made.close(False, 0)
    assert rig.link.waiting == {}
    rig.link.channels.clear()
    rig.link.is_quiet = True
    calls[what]()
    assert rig.link.waiting == {} and rig.link.is_quiet, "the unit has the channel no more"


def test_a_connection_that_was_open_goes_on_over_wires() -> None:
    for seen in (False, True):
        rig = Rig(RelayedConnection, opened=False)
        made: Any = rig.made
        made.take_over(rig.end, 3, seen)
        rig.other.send(b"abcd", 0)
        assert rig.fetched() == [Received(4, b"abc")] and made.granted == 0
        made.grant(9)
        rig.other.finish(0)
        assert rig.fetched() == [Received(4, b"d"), *([] if seen else [PeerClosed(4)])]
        made.answer(Sent(77, 5))
        assert rig.told() == [Sent(4, 5)]
        rig.link.channels[4] = None
        made.answer(Sent(77, 5))
        assert rig.told() == []


def test_a_udp_port_keeps_64_datagrams() -> None:
    sent: list[Any] = []
    link: Any = SimpleNamespace(pending=[], channels={}, send_datagram=lambda *datagram: sent.append(datagram))
    port = UdpPort(link, 2, 9600)
    assert link.pending == [Opened(2, 9600, Peer("0.0.0.0", 0))]
    link.pending.clear()
    for number in range(65):
        port.take_in(SERVER, bytes([number]))
    port.fetch(0)
    assert link.pending == [Received(2, bytes([number]), SERVER) for number in range(64)]
    link.pending.clear()
    port.fetch(0)
    assert link.pending == []
    assert [port.send_to(Peer(*to), bytes(size), 0) for to, size in (
        (("0.0.0.0", 5), 1), (("10.0.0.1", 0), 1), (("10.0.0.1", 5), 65_508))] == ["EADDRNOTAVAIL", "EADDRNOTAVAIL", "EMSGSIZE"]
    assert link.pending == sent == []
    assert port.send_to(SERVER, bytes(65_507), 0) == "" and link.pending == [Sent(2, 65_507)]
    assert sent == [(9600, SERVER, bytes(65_507))]
