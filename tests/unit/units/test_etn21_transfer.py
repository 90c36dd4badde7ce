"""Sending and receiving: bytes in words, parts on the wire, counters, buffer and grant, FIN and RST, UDP."""

from __future__ import annotations

import pytest
from etn21_rig import Rig
from rows import each_of

from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Bind, Broken, Closed, Failed, Grant, Opened, Peer, PeerClosed, Received, Send, SendTo, Sent


def opened() -> Rig:
    rig = Rig()
    rig.open()
    return rig


def put(rig: Rig, *words: int) -> None:
    for offset, word in enumerate(words):
        rig.d[1000 + offset] = word


def got(rig: Rig, words: int) -> list[int]:
    return rig.d[1000 : 1000 + words].tolist()


# --- send ---


def test_the_high_byte_is_sent_first() -> None:
    rig = opened()
    put(rig, 0xAB12, 0x3456)
    rig.parameters(count=4)
    assert rig.scan(Switch.SEND) == [Send(1, b"\xab\x12\x34\x56")]


def test_an_odd_send_ends_with_a_high_byte() -> None:
    rig = opened()
    put(rig, 0xAB12, 0x3456)
    rig.parameters(count=3)
    assert rig.scan(Switch.SEND) == [Send(1, b"\xab\x12\x34")]


@each_of(
    ("count", "parts"),
    [(1, [1]), (1023, [1023]), (1024, [1024]), (1025, [1024, 1]), (1984, [1024, 960])],
)
def test_a_send_is_cut_into_1024_bytes_and_ends_when_all_are_taken(count: int, parts: list[int]) -> None:
    rig = opened()
    rig.parameters(count=count)
    requests = rig.scan(Switch.SEND)
    assert requests == [Send(1, bytes(size)) for size in parts]
    for size in parts:
        assert rig.is_on(Switch.SEND)
        rig.scan(Sent(1, size))
    assert (rig.is_on(Switch.SEND), rig.code(), rig.result(5)) == (False, "0000", count)


def test_the_data_are_those_of_the_cycle_that_turned_the_switch_on() -> None:
    rig = opened()
    put(rig, 0x1111)
    rig.parameters(count=2)
    assert rig.scan(Switch.SEND) == [Send(1, b"\x11\x11")]
    put(rig, 0x2222)
    assert rig.scan() == []


def test_a_send_of_nothing_sends_nothing_assumed() -> None:
    rig = opened()
    rig.parameters(count=0)
    assert rig.scan(Switch.SEND) == []
    rig.scan()
    assert (rig.code(), rig.result(5)) == ("0000", 0)


def test_a_failed_send_tells_how_much_went_out() -> None:
    rig = opened()
    rig.parameters(count=1984)
    rig.scan(Switch.SEND)
    rig.scan(Sent(1, 1024), Failed(1, "send", "ETIMEDOUT"))
    assert (rig.code(), rig.result(5)) == ("0053", 1024)


def test_a_send_after_a_failed_one_is_0020_assumed() -> None:
    rig = opened()
    rig.parameters(count=2)
    assert rig.ask(Switch.SEND, Failed(1, "send", "EPIPE")) == "0020"
    rig.parameters(count=2)
    assert rig.scan(Switch.SEND) == []
    rig.scan()
    assert rig.code() == "0020"


def test_a_send_after_the_peers_fin_is_left_to_the_network_assumed() -> None:
    rig = opened()
    rig.scan(PeerClosed(1))
    rig.parameters(count=2)
    assert rig.scan(Switch.SEND) == [Send(1, bytes(2))]
    rig.scan(Sent(1, 2))
    assert rig.code() == "0000"


# --- receive ---


def test_received_bytes_fill_words_from_the_high_byte_and_leave_the_rest() -> None:
    rig = opened()
    put(rig, 1, 2, 3)
    rig.scan(Received(1, b"\xab\x12\x34\x56"))
    rig.parameters(count=100)
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert rig.result(5) == 4
    assert got(rig, 3) == [0xAB12, 0x3456, 3]


def test_an_odd_receive_ends_with_00_assumed() -> None:
    rig = opened()
    put(rig, 1, 0xFFFF, 3)
    rig.scan(Received(1, b"abc"))
    rig.parameters(count=100)
    rig.ask(Switch.RECEIVE)
    assert got(rig, 3) == [0x6162, 0x6300, 3]


@pytest.mark.parametrize(("filler", "last"), [(None, 0x63FE), (0xA5, 0x63A5)])
def test_an_odd_receive_can_keep_or_spoil_the_low_byte(filler: int | None, last: int) -> None:
    rig = Rig(Etn21(odd_filler=filler))
    rig.open()
    put(rig, 1, 0xFFFE, 3)
    rig.scan(Received(1, b"abc"))
    rig.parameters(count=100)
    rig.ask(Switch.RECEIVE)
    assert got(rig, 3) == [0x6162, last, 3]


def test_bytes_that_are_not_taken_stay() -> None:
    rig = opened()
    rig.scan(Received(1, b"abcdef"))
    rig.parameters(count=4)
    rig.scan(Switch.RECEIVE)
    assert (rig.waiting(), rig.status()) == (0, 0x8002)
    rig.scan()
    assert (rig.waiting(), rig.status(), rig.result(5)) == (2, 0xA000, 4)
    rig.parameters(count=4)
    rig.ask(Switch.RECEIVE)
    assert (rig.waiting(), rig.status(), rig.result(5)) == (0, 0x8000, 2)


def test_joined_and_split_messages_are_one_stream() -> None:
    rig = opened()
    rig.scan(Received(1, b"ab"), Received(1, b"cd"))
    rig.parameters(count=3)
    rig.ask(Switch.RECEIVE)
    assert got(rig, 2) == [0x6162, 0x6300]


def test_a_receive_does_not_wait_for_its_full_count() -> None:
    rig = opened()
    rig.parameters(count=1984)
    assert rig.ask(Switch.RECEIVE, Received(1, bytes(1024))) == "0000"
    assert rig.result(5) == 1024


def test_a_receive_of_nothing_ends_at_once_assumed() -> None:
    rig = opened()
    rig.parameters(count=0)
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert rig.result(5) == 0


def test_the_counter_shows_1984_at_most() -> None:
    rig = opened()
    rig.scan(Received(1, bytes(4096)))
    assert rig.waiting() == 0x7C0
    rig.parameters(count=1984)
    rig.ask(Switch.RECEIVE)
    assert rig.waiting() == 0x7C0
    rig.parameters(count=1984)
    rig.ask(Switch.RECEIVE)
    assert rig.waiting() == 4096 - 2 * 1984


def test_taking_bytes_grants_the_room_that_they_leave_by_segments() -> None:
    """RFC 1122 4.2.3.3: the window does not open by less than a segment, 1,024 bytes."""
    rig = opened()
    assert rig.scan(Received(1, bytes(4096))) == []
    rig.parameters(count=100)
    assert rig.scan(Switch.RECEIVE) == []
    rig.scan()
    rig.parameters(count=924)
    assert rig.scan(Switch.RECEIVE) == [Grant(1, 1024)]
    rig.scan()
    rig.parameters(count=1984)
    assert rig.scan(Switch.RECEIVE) == [Grant(1, 3008)]


def test_short_messages_are_granted_room_for_now_and_then() -> None:
    rig = opened()
    rig.parameters(count=100)
    granted = []
    for _ in range(22):
        rig.scan(Received(1, bytes(100)))
        granted += rig.scan(Switch.RECEIVE)
        rig.scan()
    assert granted == [Grant(1, 4096)] * 2


@pytest.mark.parametrize("timeout", [1, 3])
def test_a_receive_times_out_and_the_socket_stays_open(timeout: int) -> None:
    rig = opened()
    rig.parameters(count=4, timeout=timeout)
    rig.scan(Switch.RECEIVE)
    rig.wait(timeout / 10 - 0.01)
    assert rig.is_on(Switch.RECEIVE)
    rig.scan()
    assert (rig.is_on(Switch.RECEIVE), rig.code(), rig.is_open()) == (False, "0080", True)


def test_the_count_of_a_receive_that_failed_is_0_assumed() -> None:
    rig = opened()
    rig.parameters(count=4, timeout=3)
    rig.scan(Switch.RECEIVE)
    rig.wait(1)
    assert rig.result(5) == 0


def test_data_win_over_the_timeout_of_the_same_refresh_assumed() -> None:
    rig = opened()
    rig.parameters(count=4, timeout=1)
    rig.scan(Switch.RECEIVE)
    rig.now_ns += 10**9
    rig.scan(Received(1, b"ab"))
    assert rig.code() == "0000"


def test_a_receive_without_a_timeout_waits_for_ever() -> None:
    rig = opened()
    rig.parameters(count=4)
    rig.scan(Switch.RECEIVE)
    rig.wait(1e6)
    assert rig.is_on(Switch.RECEIVE)


def test_send_from_a_second_area_while_the_first_receives_assumed() -> None:
    rig = opened()
    rig.parameters(1, count=4)
    rig.scan(Switch.RECEIVE, area=1)
    rig.parameters(2, count=2, address=(0x82, 2000, 0))
    assert rig.scan(Switch.SEND, area=2) == [Send(1, bytes(2))]
    assert rig.status() == 0x8006
    rig.scan(Sent(1, 2))
    assert (rig.code(2), rig.is_on(Switch.RECEIVE)) == ("0000", True)


# --- the peer goes ---


def test_after_a_fin_the_buffer_comes_first_and_then_0_bytes_assumed() -> None:
    rig = opened()
    rig.scan(Received(1, b"ab"), PeerClosed(1))
    assert (rig.waiting(), rig.status(), rig.state()) == (2, 0xA000, 5)
    rig.parameters(count=4)
    assert (rig.ask(Switch.RECEIVE), rig.result(5)) == ("0000", 2)
    rig.parameters(count=4)
    assert (rig.ask(Switch.RECEIVE), rig.result(5)) == ("0000", 0)


def test_a_fin_ends_a_pending_receive_assumed() -> None:
    rig = opened()
    rig.parameters(count=4)
    assert (rig.ask(Switch.RECEIVE, PeerClosed(1)), rig.result(5)) == ("0000", 0)


def test_a_rst_takes_the_buffer_along_assumed() -> None:
    rig = opened()
    rig.scan(Received(1, b"ab"), Broken(1, "ECONNRESET"))
    assert (rig.waiting(), rig.status(), rig.state()) == (0, 0x8000, 0)


def test_a_rst_is_reported_once_by_a_receive_and_then_0_bytes_assumed() -> None:
    rig = opened()
    rig.scan(Broken(1, "ECONNRESET"))
    rig.parameters(count=4)
    assert rig.ask(Switch.RECEIVE) == "004B"
    rig.parameters(count=4)
    assert (rig.ask(Switch.RECEIVE), rig.result(5)) == ("0000", 0)


def test_a_rst_is_reported_once_by_a_send_and_then_0020_assumed() -> None:
    rig = opened()
    rig.scan(Broken(1, "ECONNRESET"))
    codes = []
    for _ in range(3):
        rig.parameters(count=4)
        codes.append(rig.ask(Switch.SEND))
    assert codes == ["004B", "0020", "0020"]


def test_a_rst_ends_pending_services() -> None:
    rig = opened()
    rig.parameters(1, count=4)
    rig.scan(Switch.RECEIVE, area=1)
    rig.parameters(2, count=4)
    rig.scan(Switch.SEND, area=2)
    rig.scan(Broken(1, "ETIMEDOUT"))
    assert (rig.code(1), rig.code(2)) == ("0053", "0053")


# --- UDP ---

STATION = Peer("192.168.250.9", 4000)


def bound() -> Rig:
    rig = Rig()
    rig.parameters(local_port=3000)
    assert rig.scan(Switch.UDP_OPEN) == [Bind(1, 3000)]
    assert rig.status(protocol="UDP") == 1
    assert rig.scan(Opened(1, 3000, Peer("0.0.0.0", 0))) == []
    assert (rig.code(), rig.status(protocol="UDP"), rig.status()) == ("0000", 0x8000, 0)
    return rig


def test_udp_send() -> None:
    rig = bound()
    put(rig, 0x6162)
    rig.parameters(count=2, remote=STATION)
    assert rig.scan(Switch.SEND) == [SendTo(1, STATION, b"ab")]
    rig.scan(Sent(1, 2))
    assert (rig.code(), rig.result(5)) == ("0000", 2)


@pytest.mark.parametrize("remote", [Peer("0.0.0.0", 4000), Peer("192.168.250.9", 0)])
def test_1100_udp_send_to_nobody(remote: Peer) -> None:
    rig = bound()
    rig.parameters(count=2, remote=remote)
    assert rig.ask(Switch.SEND) == "1100"


@pytest.mark.parametrize(("count", "code"), [(1472, "0000"), (1473, "0042")])
def test_0042_udp_broadcast_is_one_frame_at_most(count: int, code: str) -> None:
    rig = bound()
    rig.parameters(count=count, remote=Peer("255.255.255.255", 4000))
    assert rig.ask(Switch.SEND, Sent(1, count)) == code


def test_udp_receive_takes_one_datagram_and_drops_the_rest_of_it() -> None:
    rig = bound()
    rig.scan(Received(1, b"abcdef", STATION), Received(1, b"gh", Peer("192.168.250.10", 4001)))
    assert rig.status(protocol="UDP") == 0x8000
    rig.parameters(count=4, remote=Peer("0.0.0.0", 0))
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert [rig.result(offset) for offset in (2, 3, 4, 5)] == [0xC0A8, 0xFA09, 4000, 4]
    assert got(rig, 2) == [0x6162, 0x6364]
    rig.parameters(count=4)
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert [rig.result(offset) for offset in (3, 4, 5)] == [0xFA0A, 4001, 2]


def test_udp_receive_of_one_byte() -> None:
    rig = bound()
    rig.scan(Received(1, b"abcdef", STATION), Received(1, b"gh", STATION))
    for first in (0x6100, 0x6700):
        rig.parameters(count=1)
        assert rig.ask(Switch.RECEIVE) == "0000"
        assert (rig.result(5), got(rig, 1)) == (1, [first])


def test_udp_receive_tells_the_host_of_a_sender_without_port() -> None:
    """A datagram may have port 0 as its source (RFC 768)."""
    rig = bound()
    rig.scan(Received(1, b"ab", Peer("192.168.250.9", 0)))
    rig.parameters(count=4)
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert [rig.result(offset) for offset in (2, 3, 4, 5)] == [0xC0A8, 0xFA09, 0, 2]


def test_udp_datagrams_past_the_buffer_are_lost() -> None:
    rig = bound()
    rig.scan(*[Received(1, bytes(1400), STATION)] * 7)
    counts = []
    for _ in range(7):
        rig.parameters(count=1984, timeout=1)
        rig.scan(Switch.RECEIVE)
        rig.scan()
        rig.wait(1)
        counts.append((rig.code(), rig.result(5)))
    assert counts == [("0000", 1400)] * 6 + [("0080", 0)]


def test_a_socket_keeps_128_datagrams_assumed() -> None:
    rig = bound()
    rig.scan(*[Received(1, bytes([number]), STATION) for number in range(140)])
    for _ in range(3):
        rig.scan()
    taken = []
    for _ in range(129):
        rig.parameters(count=2, timeout=1)
        rig.scan(Switch.RECEIVE)
        rig.wait(1)
        if rig.code() == "0000":
            taken.append(rig.d[1000] >> 8)
    assert taken == [*range(128)]
    assert rig.code() == "0080"


def test_udp_datagrams_that_are_lost_leave_those_that_wait_as_they_are() -> None:
    rig = bound()
    rig.scan(Received(1, b"first", STATION), Received(1, bytes(4506), STATION), Received(1, bytes(4505), STATION))
    for number in range(60):
        rig.scan(*[Received(1, bytes([number]) * 1472, STATION)] * (number % 5))
    counts = []
    for _ in range(3):
        rig.parameters(count=5)
        assert rig.ask(Switch.RECEIVE) == "0000"
        counts.append((rig.result(5), got(rig, 2)))
    assert counts == [(5, [0x6669, 0x7273]), (5, [0, 0]), (5, [0, 0])]


@pytest.mark.parametrize("size", [1, 700, 4096, 9016, 9017])
def test_bytes_past_the_buffer_leave_those_that_wait_as_they_are(size: int) -> None:
    """No network should send what it has no room for.  What comes next is whole again."""
    rig = opened()
    rig.scan(Received(1, b"abcd" + bytes(4090)))
    for number in range(60):
        rig.scan(*[Received(1, bytes([number]) * size)] * (number % 5), Received(1, bytes(3)))
    taken = 0
    while rig.waiting():
        rig.parameters(count=1984)
        assert rig.ask(Switch.RECEIVE) == "0000"
        assert taken or got(rig, 3) == [0x6162, 0x6364, 0]
        taken += rig.result(5)
    assert taken in (4094, 4096)
    rig.parameters(count=4)
    rig.scan(Received(1, b"next"))
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert got(rig, 2) == [0x6E65, 0x7874]


def test_udp_close() -> None:
    rig = bound()
    rig.parameters()
    assert rig.ask(Switch.CLOSE, Closed(1)) == "0000"
    assert rig.status(protocol="UDP") == 0


def test_udp_and_tcp_take_turns_on_one_socket_number() -> None:
    rig = bound()
    rig.parameters()
    rig.ask(Switch.CLOSE, Closed(1))
    rig.open()
    assert (rig.status(), rig.status(protocol="UDP")) == (0x8000, 0)
