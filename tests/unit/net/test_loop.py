"""The network in memory: what a unit is told, and when, in virtual time."""

from __future__ import annotations

import itertools

import pytest
from growth import least_kept_bytes
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.net.faults import Fault
from fbvm.net.loop import LoopLink, LoopNetwork
from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS, RudePeer
from fbvm.net.peers import Action, Fin, Leave, ModbusPeer, Reset, Say, ScriptedPeer, Station
from fbvm.net.stream import RETRANSMIT_LIMIT_NS, WINDOW_BYTES
from fbvm.net.wires import CONNECT_TIMEOUT_NS
from fbvm.wire import modbus
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
    Send,
    SendTo,
    Sent,
)
from fbvm.wire.modbus import Adu
from fbvm.wire.modbus_server import ModbusServer
from fbvm.wire.tap import TapEvent, TapKind

SERVER = Peer("192.168.250.1", 502)
UNIT = "192.168.250.2"
MS = 1_000_000
ANYBODY = Peer("0.0.0.0", 0)


def opened(peer: Station | None = None, **options: object) -> tuple[LoopNetwork, LoopLink]:
    """A network with a peer, and a link that is connected to it on channel 1 with a large grant."""
    network = LoopNetwork(**options)  # type: ignore[arg-type]
    network.place(SERVER, peer or ModbusPeer())
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, 4096)], 0)
    assert link.events(0) == [Opened(1, 49152, SERVER)]
    return network, link


def data_of(events: list[Event]) -> bytes:
    return b"".join(event.data for event in events if isinstance(event, Received))


def test_a_modbus_exchange() -> None:
    peer = ModbusPeer()
    peer.server.holding_registers[1000] = 0xAB12
    _, link = opened(peer)
    request = Adu(1, 255, modbus.read(3, 1000, 1)).to_bytes()
    link.submit([Send(1, request)], 5)
    assert link.events(5) == [Sent(1, 12), Received(1, Adu(1, 255, b"\x03\x02\xab\x12").to_bytes())]
    link.submit([Close(1)], 6)
    assert link.events(6) == [Closed(1)]
    assert peer.received == [request]


def test_nobody_listens() -> None:
    network = LoopNetwork()
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER)], 0)
    assert link.events(0) == [Failed(1, "open", "ECONNREFUSED")]
    network.place(SERVER, ScriptedPeer(connections=1))
    link.submit([Connect(1, SERVER), Connect(2, SERVER)], 1)
    assert link.events(1) == [Opened(1, 49153, SERVER), Failed(2, "open", "ECONNREFUSED")]
    network.remove(SERVER)
    link.submit([Connect(2, SERVER)], 2)
    assert link.events(2) == [Failed(2, "open", "ECONNREFUSED")]


def test_latency_is_paid_each_way() -> None:
    network = LoopNetwork(latency_ns=3 * MS)
    network.place(SERVER, ScriptedPeer([Say(b"late", 10 * MS)]))
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, 100)], 0)
    assert link.events(6 * MS - 1) == []
    assert link.events(6 * MS) == [Opened(1, 49152, SERVER)]
    link.submit([Send(1, b"?")], 10 * MS)
    assert network.next_due_ns() == 13 * MS
    assert link.events(26 * MS - 1) == [Sent(1, 1)]
    assert link.events(26 * MS) == [Received(1, b"late")]
    assert network.next_due_ns() is None


def test_never_more_than_granted() -> None:
    network = LoopNetwork()
    network.place(SERVER, ScriptedPeer(greeting=[Say(b"abcdefgh"), Fin()]))
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER)], 0)
    assert link.events(0) == [Opened(1, 49152, SERVER)]
    assert link.events(1) == []
    link.submit([Grant(1, 3)], 1)
    assert link.events(1) == [Received(1, b"abc")]
    assert link.events(2) == []
    link.submit([Grant(1, 4), Grant(1, 2)], 2)
    assert link.events(2) == [Received(1, b"de")]
    link.submit([Grant(1, 100)], 3)
    assert link.events(3) == [Received(1, b"fgh"), PeerClosed(1)]
    assert link.events(4) == []


def test_half_close_by_the_peer_leaves_sending_possible() -> None:
    peer = ScriptedPeer([], greeting=[Fin(1)])
    _, link = opened(peer)
    assert link.events(1) == [PeerClosed(1)]
    link.submit([Send(1, b"still")], 1)
    assert link.events(1) == [Sent(1, 5)]
    assert peer.received == [b"still"]


def test_sending_to_a_peer_that_left_ends_in_a_reset() -> None:
    network = LoopNetwork()
    network.place(SERVER, ScriptedPeer(greeting=[Leave()]))
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER)], 0)
    assert link.events(0) == [Opened(1, 49152, SERVER), PeerClosed(1)]
    link.submit([Send(1, b"x")], 1)
    assert link.events(1) == [Sent(1, 1), Broken(1, "ECONNRESET")]
    link.submit([Send(1, b"y")], 2)
    assert link.events(2) == [Failed(1, "send", "EPIPE")]
    link.submit([Close(1)], 3)
    assert link.events(3) == [Closed(1)]


def test_reset_in_the_middle_of_an_answer() -> None:
    _, link = opened(ScriptedPeer([Say(b"half"), Reset(5)]))
    link.submit([Send(1, b"?")], 0)
    assert link.events(0) == [Sent(1, 1), Received(1, b"half")]
    assert link.events(5) == [Broken(1, "ECONNRESET")]
    link.submit([Close(1), Connect(1, SERVER)], 6)
    assert link.events(6) == [Closed(1), Opened(1, 49153, SERVER)]


def test_a_silent_host_times_out_assumed() -> None:
    network = LoopNetwork(faults=[Fault(SERVER, silent=True)])
    network.place(SERVER, ModbusPeer())
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER)], 0)
    assert link.events(CONNECT_TIMEOUT_NS - 1) == []
    assert link.events(CONNECT_TIMEOUT_NS) == [Failed(1, "open", "ETIMEDOUT")]


def test_closing_while_opening_is_only_closed() -> None:
    network = LoopNetwork(latency_ns=MS)
    peer = ScriptedPeer()
    network.place(SERVER, peer)
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Close(1, reset=True)], 0)
    assert link.events(10 * MS) == [Closed(1)]
    assert peer.log == ["ECONNRESET"]


def test_a_pulled_cable_is_noticed_only_by_retransmission() -> None:
    peer = ModbusPeer()
    network, link = opened(peer)
    network.faults.append(Fault(SERVER, silent=True))
    request = Adu(1, 255, modbus.read(3, 0, 1)).to_bytes()
    link.submit([Send(1, request)], 0)
    assert link.events(20_000 * MS) == [Sent(1, 12)]
    network.faults.clear()
    assert len(data_of(link.events(22_000 * MS))) == 11
    network.faults.append(Fault(SERVER, silent=True))
    link.submit([Send(1, request)], 30_000 * MS)
    assert link.events(30_000 * MS + RETRANSMIT_LIMIT_NS + 1000 * MS) == [Sent(1, 12), Broken(1, "ETIMEDOUT")]


@pytest.mark.parametrize("error", ["EHOSTUNREACH", "ENETUNREACH"])
def test_an_open_that_fails_at_once(error: str) -> None:
    link = LoopNetwork(faults=[Fault(Peer("192.168.250.1", 0), error=error)]).attach(UNIT)
    link.submit([Connect(1, SERVER)], 0)
    assert link.events(0) == [Failed(1, "open", error)]


@each_of(
    ("remote", "error"),
    [
        (Peer("255.255.255.255", 502), "EACCES"),
        (Peer("0.0.0.0", 502), "EADDRNOTAVAIL"),
        (Peer("192.168.250.1", 0), "EADDRNOTAVAIL"),
        (Peer(UNIT, 1000), "EADDRNOTAVAIL"),
    ],
)
def test_endpoints_that_cannot_be(remote: Peer, error: str) -> None:
    link = LoopNetwork().attach(UNIT)
    link.submit([Connect(1, remote, local_port=1000)], 0)
    assert link.events(0) == [Failed(1, "open", error)]


def test_two_units_talk_and_only_one_is_let_in() -> None:
    network = LoopNetwork()
    server, client, third = network.attach("10.0.0.1"), network.attach("10.0.0.2"), network.attach("10.0.0.3")
    server.submit([Listen(4, 502), Grant(4, 100)], 0)
    client.submit([Connect(1, Peer("10.0.0.1", 502), local_port=5000), Grant(1, 100)], 0)
    third.submit([Connect(1, Peer("10.0.0.1", 502))], 0)
    assert client.events(0) == [Opened(1, 5000, Peer("10.0.0.1", 502))]
    assert server.events(0) == [Opened(4, 502, Peer("10.0.0.2", 5000))]
    assert third.events(0) == [Failed(1, "open", "ECONNREFUSED")]
    client.submit([Send(1, b"ping")], 1)
    assert server.events(1) == [Received(4, b"ping")]
    server.submit([Send(4, b"pong"), Close(4)], 1)
    assert server.events(1) == [Sent(4, 4), Closed(4)]
    assert client.events(1) == [Sent(1, 4), Received(1, b"pong"), PeerClosed(1)]


def test_a_door_for_one_peer_only() -> None:
    network = LoopNetwork()
    server, friend, stranger = network.attach("10.0.0.1"), network.attach("10.0.0.2"), network.attach("10.0.0.3")
    server.submit([Listen(1, 502, Peer("10.0.0.2", 0))], 0)
    stranger.submit([Connect(1, Peer("10.0.0.1", 502))], 0)
    assert stranger.events(0) == [Failed(1, "open", "ECONNREFUSED")]
    friend.submit([Connect(1, Peer("10.0.0.1", 502))], 0)
    assert friend.events(0) == [Opened(1, 49152, Peer("10.0.0.1", 502))]
    assert server.events(0) == [Opened(1, 502, Peer("10.0.0.2", 49152))]


def test_a_withdrawn_door_is_shut() -> None:
    network = LoopNetwork()
    server, client = network.attach("10.0.0.1"), network.attach("10.0.0.2")
    server.submit([Listen(2, 502), Listen(1, 502), Close(2), Close(1)], 0)
    assert server.events(0) == [Closed(2), Closed(1)]
    client.submit([Connect(1, Peer("10.0.0.1", 502))], 0)
    assert client.events(0) == [Failed(1, "open", "ECONNREFUSED")]


def test_one_pair_of_endpoints_is_one_connection() -> None:
    _, link = opened()
    link.submit([Connect(2, SERVER, local_port=49152)], 1)
    assert link.events(1) == [Failed(2, "open", "EADDRINUSE")]
    link.submit([Close(1), Connect(2, SERVER, local_port=49152)], 2)
    assert link.events(2)[0] == Closed(1)
    link.submit([Close(2), Connect(3, SERVER, local_port=49152)], 3)
    assert link.events(3)[-1] == Opened(3, 49152, SERVER)


@each_of(("greeting", "close", "again"), [
    ([], Close(1), "EADDRINUSE"),  # the peer has not sent its FIN
    ([], Close(1, reset=True), ""),
    ([Leave()], Close(1), ""),
    ([Reset()], Close(1), ""),
    ([Fin()], Close(1, reset=True), ""),
])
def test_a_fixed_local_port_is_free_when_the_connection_has_ended_on_both_sides(
    greeting: list[Action], close: Close, again: str
) -> None:
    network = LoopNetwork()
    network.place(SERVER, peer := ScriptedPeer(greeting=greeting, farewell=[]))
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER, local_port=3000), Grant(1, 10)], 0)
    assert link.events(0)[0] == Opened(1, 3000, SERVER)
    link.submit([close], 1)
    assert link.events(1)[-1] == Closed(1)
    peer.greeting = []
    link.submit([Connect(1, SERVER, local_port=3000)], 2)
    assert link.events(2) == [Failed(1, "open", again) if again else Opened(1, 3000, SERVER)]


def test_a_reset_throws_away_what_waits_and_is_told_once() -> None:
    network, link = opened(ScriptedPeer(reads=False))
    told: list[TapKind] = []
    network.tap = lambda now_ns, unit, event: told.append(event.kind)
    link.submit([Send(1, bytes(WINDOW_BYTES + 1))], 1)
    link.submit([Close(1, reset=True), Close(1, reset=True)], 2)
    assert link.events(2)[-1] == Closed(1)
    assert told == [TapKind.DATA, TapKind.RST]


def test_a_peer_that_never_reads_closes_the_window() -> None:
    network, link = opened(ScriptedPeer(reads=False))
    link.submit([Send(1, bytes(1000))] * 400, 1)
    events = link.events(1)
    assert events.count(Sent(1, 1000)) == WINDOW_BYTES // 1000
    assert Failed(1, "send", "ENOBUFS") in events
    network.place(SERVER, ScriptedPeer())
    link.submit([Close(1, reset=True)], 2)
    assert link.events(2) == [Closed(1)]


def test_sends_that_were_not_taken_fail_when_the_connection_breaks() -> None:
    _, link = opened(ScriptedPeer(reads=False, greeting=[Reset(5)]))
    link.submit([Send(1, bytes(WINDOW_BYTES)), Send(1, b"waits")], 1)
    assert link.events(1) == [Sent(1, WINDOW_BYTES)]
    assert link.events(5) == [Failed(1, "send", "ECONNRESET"), Broken(1, "ECONNRESET")]


def test_what_waits_at_a_close_still_goes_out_before_the_fin() -> None:
    network = LoopNetwork()
    server, client = network.attach("10.0.0.1"), network.attach("10.0.0.2")
    server.submit([Listen(1, 502)], 0)
    client.submit([Connect(1, Peer("10.0.0.1", 502))], 0)
    client.events(0)
    client.submit([Send(1, bytes(WINDOW_BYTES + 10)), Close(1)], 1)
    server.submit([Grant(1, 2 * WINDOW_BYTES)], 1)
    events = server.events(1) + server.events(1) + server.events(1)
    assert len(data_of(events)) == WINDOW_BYTES + 10
    assert events[-1] == PeerClosed(1)


def test_datagrams() -> None:
    class Echo(Station):
        def datagram(self, data: bytes, caller: Peer) -> list[bytes]:
            return [data, data[::-1]]

    network = LoopNetwork()
    network.place(Peer("10.0.0.9", 9600), Echo())
    one, two = network.attach("10.0.0.1"), network.attach("10.0.0.2")
    one.submit([Bind(1, 9600), Bind(2, 9600)], 0)
    two.submit([Bind(1, 9601)], 0)
    assert one.events(0) == [Opened(1, 9600, ANYBODY), Failed(2, "open", "EADDRINUSE")]
    two.submit([SendTo(1, Peer("10.0.0.1", 9600), b"hello"), SendTo(1, Peer("10.0.0.1", 7), b"lost")], 0)
    assert two.events(0) == [Opened(1, 9601, ANYBODY), Sent(1, 5), Sent(1, 4)]
    assert one.events(0) == [Received(1, b"hello", Peer("10.0.0.2", 9601))]
    one.submit([SendTo(1, Peer("10.0.0.9", 9600), b"ab"), SendTo(1, Peer("10.0.0.9", 0), b"")], 1)
    assert one.events(1) == [
        Sent(1, 2),
        Failed(1, "send", "EADDRNOTAVAIL"),
        Received(1, b"ab", Peer("10.0.0.9", 9600)),
        Received(1, b"ba", Peer("10.0.0.9", 9600)),
    ]
    one.submit([SendTo(1, Peer("10.0.0.255", 9601), b"all"), SendTo(1, SERVER, bytes(70_000)), Send(1, b"")], 2)
    assert one.events(2) == [Sent(1, 3), Failed(1, "send", "EMSGSIZE"), Failed(1, "send", "ENOTCONN")]
    assert two.events(2) == [Received(1, b"all", Peer("10.0.0.1", 9600))]


def test_channels_that_are_not_open() -> None:
    link = LoopNetwork().attach(UNIT)
    link.submit([Send(1, b""), SendTo(2, SERVER, b""), Grant(3, 1), Close(4)], 0)
    assert link.events(0) == [Failed(1, "send", "ENOTCONN"), Failed(2, "send", "ENOTCONN"), Closed(4)]


def test_wrong_use_raises() -> None:
    network, link = opened()
    with pytest.raises(ValueError, match="channel 1"):
        link.submit([Connect(1, SERVER)], 0)
    with pytest.raises(ValueError, match="attached already"):
        network.attach(UNIT)


def test_pieces_come_one_after_another() -> None:
    reply = Adu(1, 255, b"\x03\x04\1\2\3\4").to_bytes()
    peer = ScriptedPeer([Say(reply)])
    _, link = opened(peer, faults=[Fault(SERVER, segment_bytes=4, gap_ns=MS)])
    link.submit([Send(1, b"?")], 10 * MS)
    times = {now_ms: data_of(link.events(now_ms * MS)) for now_ms in range(10, 15)}
    assert times == {10: reply[:4], 11: reply[4:8], 12: reply[8:12], 13: reply[12:], 14: b""}


@pytest.mark.slow
@given(st.integers(0, 2**32), st.integers(1, 20), st.integers(0, 300))
def test_any_cut_carries_the_same_bytes_and_the_seed_repeats_them(seed: int, segment: int, size: int) -> None:
    def pieces() -> list[bytes]:
        content = bytes(number % 251 for number in range(size))
        peer = ScriptedPeer(greeting=[Say(content), Leave()])
        network = LoopNetwork(seed, faults=[Fault(segment_bytes=segment, random_cut=True, gap_ns=1)])
        network.place(SERVER, peer)
        link = network.attach(UNIT)
        link.submit([Connect(1, SERVER), Grant(1, 4096)], 0)
        found = [data_of(link.events(now_ns)) for now_ns in range(size + 2)]
        assert b"".join(found) == content
        return found

    assert pieces() == pieces()


def test_a_modbus_peer_may_answer_wrong_on_purpose() -> None:
    peer = ModbusPeer(reply=lambda frame: [Say(b"\xff\xff" + frame[2:]), Say(frame[:5], 5), Say(frame[5:], 9)])
    _, link = opened(peer)
    link.submit([Send(1, Adu(1, 255, modbus.read(1, 0, 1)).to_bytes())], 0)
    right = Adu(1, 255, b"\1\1\0").to_bytes()
    assert data_of(link.events(0)) == b"\xff\xff" + right[2:]
    assert data_of(link.events(5)) == right[:5]
    assert data_of(link.events(9)) == right[5:]


def test_a_modbus_peer_hangs_up_on_a_stream_out_of_step() -> None:
    _, link = opened()
    link.submit([Send(1, b"GET / HTTP/1.1\r\n")], 0)
    assert link.events(0) == [Sent(1, 16), PeerClosed(1)]


def test_the_tap_hears_everything_with_the_programs_addresses() -> None:
    heard: list[tuple[int, str, str]] = []
    network = LoopNetwork(latency_ns=1)
    network.tap = lambda now_ns, address, event: heard.append((now_ns, address, str(event)))
    network.place(SERVER, ScriptedPeer([Say(b"\xca\xfe")]))
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, 10)], 0)
    link.events(5)
    link.submit([Send(1, b"\1\2")], 5)
    link.events(10)
    link.submit([Close(1)], 10)
    link.submit([Connect(1, Peer("192.168.250.1", 503))], 20)
    link.events(30)
    here, there = f"{UNIT}:49152", str(SERVER)
    assert heard == [
        (0, UNIT, f"syn {here} -> {there}"),
        (2, UNIT, f"open {here} -> {there}"),
        (5, UNIT, f"data {here} -> {there} 01 02"),
        (7, UNIT, f"data {here} <- {there} CA FE"),
        (10, UNIT, f"fin {here} -> {there}"),
        (12, UNIT, f"fin {here} <- {there}"),
        (20, UNIT, f"syn {UNIT}:49153 -> 192.168.250.1:503"),
        (22, UNIT, f"rst {UNIT}:49153 <- 192.168.250.1:503"),
    ]


def test_two_units_are_heard_twice_and_marked() -> None:
    heard: list[TapEvent] = []
    network = LoopNetwork()
    network.tap = lambda now_ns, address, event: heard.append(event)
    server, client = network.attach("10.0.0.1"), network.attach("10.0.0.2")
    server.submit([Listen(1, 502)], 0)
    client.submit([Connect(1, Peer("10.0.0.1", 502))], 0)
    client.events(0)
    client.submit([Send(1, b"x")], 1)
    client.events(1)
    assert all(event.mirrored for event in heard)
    assert [event.kind for event in heard if event.out] == [TapKind.SYN, TapKind.OPEN, TapKind.DATA]
    assert [event.kind for event in heard if not event.out] == [TapKind.SYN, TapKind.OPEN, TapKind.DATA]


def test_closing_the_network_forgets_everything() -> None:
    network, link = opened()
    link.submit([Send(1, b"?")], 1)
    assert network.next_due_ns() is not None
    network.close()
    assert network.next_due_ns() is None
    assert link.events(100) == [Sent(1, 1)]


def test_nothing_is_told_behind_a_break() -> None:
    """The server's last byte and its FIN wait unfetched when our own sending breaks the connection."""
    network = LoopNetwork(latency_ns=2)
    network.place(Peer("10.0.0.9", 502), ScriptedPeer([Say(b"x", 0), Leave(1)]))
    link = network.attach("10.0.0.1")
    link.submit([Connect(1, Peer("10.0.0.9", 502))], 0)
    told = list(link.events(20))
    for now_ns in (20, 40, 60):
        link.submit([Send(1, b"y")], now_ns)
        told += link.events(now_ns + 15)
    told += link.events(10**9)
    kinds = [type(event).__name__ for event in told]
    assert kinds.count("Broken") == 1 and {"PeerClosed", "Received"}.isdisjoint(kinds[kinds.index("Broken"):])


# --- what peers keep ----------------------------------------------------------------------------------------------------


def test_peers_keep_the_last_frames_callers_and_ends_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run may go on for days."""
    monkeypatch.setattr("fbvm.net.peers.MOST_KEPT", 50)
    caller = Peer(UNIT, 49152)
    rude = RudePeer(reply=MISDEEDS["right, then closed"])
    frames = [Adu(number, 255, modbus.read(3, 1000, 1)).to_bytes() for number in range(200)]
    for peer in (ModbusPeer(), rude, ScriptedPeer(connections=200)):
        for number, frame in enumerate(frames, 1):
            conversation = peer.accept(caller)
            assert conversation is not None
            list(conversation.received(frame, 0))
            list(conversation.peer_closed(0))
            conversation.lost("ECONNRESET", 0)
            assert len(peer.received) == min(number, 46 + (number - 46) % 5), "of 51 the oldest tenth of 50 goes"
            assert peer.received == frames[number - len(peer.received):number]
    assert peer.accept(caller) is None, "connections are counted, however many callers are kept"
    assert isinstance(peer, ScriptedPeer) and max(len(peer.callers), len(peer.log)) <= 50
    del conversation
    assert len(rude.callers) <= 50 and len(rude._conversations) == 0


@pytest.mark.slow
def test_a_reply_of_before_needs_no_more_than_that() -> None:
    peer = RUDE_PEERS["previous reply instead"](ModbusServer())
    conversation = peer.accept(Peer(UNIT, 49152))
    assert conversation is not None
    heard, numbers = getattr(peer, "received"), itertools.count()  # noqa: B009

    def replies(count: int) -> None:
        for number in itertools.islice(numbers, count):
            said = list(conversation.received(Adu(number, 255, modbus.read(3, 1000, 100)).to_bytes(), 0))
            assert [action.data[:2] for action in said if isinstance(action, Say)] == (
                [(number - 1).to_bytes(2, "big")] if number else [])  # fmt: skip
            heard.clear()

    replies(100)
    assert least_kept_bytes(lambda: replies(200)) <= 16_000, "200 replies are 48,000 bytes"
