"""Opening and closing: requests and result words, filters, time limits, socket options, the held port, force-close."""

from __future__ import annotations

import pytest
from etn21_rig import SERVER, Rig
from rows import each_of

from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import (
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
    Sent,
)

ANYBODY = Peer("0.0.0.0", 0)


# --- active ---


def test_active_open_asks_for_a_connection_and_grants_the_buffer() -> None:
    rig = Rig()
    rig.parameters()
    assert rig.scan(Switch.ACTIVE_OPEN) == [Connect(1, SERVER)]
    assert rig.scan(Opened(1, 49152, SERVER)) == [Grant(1, 4096)]


def test_active_open_writes_the_local_port_that_was_chosen() -> None:
    rig = Rig()
    rig.open()
    assert rig.result(1) == 49152


def test_active_open_leaves_a_fixed_local_port_alone() -> None:
    rig = Rig()
    rig.parameters(local_port=3000)
    assert rig.scan(Switch.ACTIVE_OPEN) == [Connect(1, SERVER, 3000)]
    rig.scan(Opened(1, 3000, SERVER))
    assert rig.result(1) == 3000


def test_active_open_ignores_the_timeout_word() -> None:
    rig = Rig()
    rig.parameters(timeout=5)
    rig.scan(Switch.ACTIVE_OPEN)
    assert rig.wait(74) == []
    assert rig.is_on(Switch.ACTIVE_OPEN)


def test_active_open_gives_up_after_75_s_assumed() -> None:
    rig = Rig()
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    assert rig.wait(75) == [Close(1)]
    assert (rig.code(), rig.is_on(Switch.ACTIVE_OPEN), rig.status(), rig.state()) == ("0053", False, 0, 0)


def test_an_answer_after_the_end_of_the_open_counts_no_more() -> None:
    rig = Rig()
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    rig.wait(75)
    assert rig.scan(Opened(1, 49152, SERVER), Received(1, b"late")) == []
    assert rig.status() == 0
    rig.parameters()
    assert rig.scan(Switch.ACTIVE_OPEN) == []
    assert rig.scan(Closed(1)) == [Connect(1, SERVER)]


# --- passive ---


@each_of(
    "remote", [ANYBODY, Peer("0.0.0.0", 5000), Peer("192.168.250.7", 0), Peer("192.168.250.7", 5000)]
)
def test_passive_open_passes_its_filter_on_and_writes_the_peer(remote: Peer) -> None:
    rig = Rig()
    rig.parameters(local_port=502, remote=remote)
    assert rig.scan(Switch.PASSIVE_OPEN) == [Listen(1, 502, remote)]
    rig.scan(Opened(1, 502, Peer("192.168.250.7", 5000)))
    assert [rig.result(offset) for offset in (1, 2, 3, 4)] == [502, 0xC0A8, 0xFA07, 5000]


@pytest.mark.parametrize("timeout", [1, 25])
def test_passive_open_times_out(timeout: int) -> None:
    """In units of 100 ms."""
    rig = Rig()
    rig.parameters(local_port=502, remote=ANYBODY, timeout=timeout)
    rig.scan(Switch.PASSIVE_OPEN)
    assert rig.wait(timeout / 10 - 0.01) == []
    assert rig.scan() == [Close(1)]
    assert (rig.code(), rig.is_on(Switch.PASSIVE_OPEN), rig.status(), rig.state()) == ("0080", False, 0, 0)


def test_passive_open_without_a_timeout_waits_for_ever() -> None:
    rig = Rig()
    rig.parameters(local_port=502, remote=ANYBODY)
    rig.scan(Switch.PASSIVE_OPEN)
    assert rig.wait(1e6) == []
    assert rig.is_on(Switch.PASSIVE_OPEN)


# --- options ---


@each_of(("option", "keep_alive"), [(0, False), (1, True), (2, False), (3, True)])
def test_keep_alive_assumed(option: int, keep_alive: bool) -> None:
    rig = Rig()
    rig.parameters(1, 1, option=option)
    rig.parameters(2, 2, option=option, local_port=502)
    assert rig.scan(Switch.ACTIVE_OPEN, area=1) == [Connect(1, SERVER, 0, keep_alive)]
    assert rig.scan(Switch.PASSIVE_OPEN, area=2) == [Listen(2, 502, SERVER, keep_alive)]


@each_of(("option", "reset"), [(0, False), (1, False), (2, True), (3, True)])
def test_linger_of_the_open_closes_by_rst(option: int, reset: bool) -> None:
    rig = Rig()
    rig.open(option=option)
    rig.parameters(option=0)
    assert rig.scan(Switch.CLOSE) == [Close(1, reset)]
    assert rig.state() == (0 if reset else 6)
    rig.scan(Closed(1))
    assert rig.state() == (0 if reset else 0xA)


# --- close ---


def test_close_throws_the_buffer_away() -> None:
    rig = Rig()
    rig.open()
    rig.scan(Received(1, b"abc"))
    assert rig.waiting() == 3
    rig.close()
    assert (rig.waiting(), rig.status()) == (0, 0)


@each_of(
    ("switch", "flag"), [(Switch.ACTIVE_OPEN, 0), (Switch.PASSIVE_OPEN, 0), (Switch.SEND, 2), (Switch.RECEIVE, 1)]
)
def test_close_ends_a_service_with_0081_a_cycle_before_its_own_result_assumed(switch: Switch, flag: int) -> None:
    rig = Rig()
    if switch in (Switch.SEND, Switch.RECEIVE):
        rig.open()
    rig.parameters(local_port=502, count=4)
    rig.scan(switch)
    assert rig.scan(Switch.CLOSE) == [Close(1)]
    assert (rig.code(), rig.status() & 0xF) == ("FFFF", 1 << flag | 8)
    rig.scan(Closed(1))
    assert (rig.code(), rig.is_on(switch), rig.is_on(Switch.CLOSE)) == ("0081", False, True)
    rig.scan()
    assert (rig.code(), rig.is_on(Switch.CLOSE), rig.status()) == ("0000", False, 0)


def test_close_of_a_service_of_another_area_ends_it_too_assumed() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(2, count=4)
    rig.scan(Switch.RECEIVE, area=2)
    rig.parameters(1)
    assert rig.ask(Switch.CLOSE, Closed(1)) == "0000"
    assert (rig.code(2), rig.is_open()) == ("0081", False)


@pytest.mark.parametrize("event", [PeerClosed(1), Broken(1, "ECONNRESET")])
def test_bit_15_stays_until_the_program_closes(event: Event) -> None:
    rig = Rig()
    rig.open()
    rig.scan(event)
    rig.wait(100)
    assert rig.is_open()
    assert rig.state() == (5 if isinstance(event, PeerClosed) else 0)
    rig.close()
    assert rig.state() == 0


def test_the_last_state_stays_until_the_next_open() -> None:
    rig = Rig()
    rig.open()
    rig.close()
    rig.wait(100)
    assert rig.state() == 0xA
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    assert rig.state() == 2


@pytest.mark.parametrize("last", [
    [Received(1, b"old")], [PeerClosed(1)], [Broken(1, "ECONNRESET")], [Switch.SEND, Failed(1, "send", "EPIPE")]])
def test_nothing_of_a_connection_is_left_for_the_next_one(last: list[Event | Switch]) -> None:
    """Neither its bytes nor its end nor an error that nobody has been told."""
    rig = Rig()
    rig.open()
    rig.parameters(count=4)
    for step in last:
        rig.scan(step)
    rig.scan()
    rig.close()
    rig.open()
    rig.parameters(count=4)
    rig.scan(Switch.RECEIVE)
    rig.scan()
    assert (rig.is_on(Switch.RECEIVE), rig.waiting(), rig.state()) == (True, 0, 4)
    rig.scan(Received(1, b"new!"))
    rig.scan()
    assert (rig.code(), rig.d[1000], rig.d[1001]) == ("0000", 0x6E65, 0x7721)
    assert rig.ask(Switch.SEND, Sent(1, 4)) == "0000"


def test_no_datagram_of_before_is_left_for_the_next_port() -> None:
    rig = Rig()
    for said in (b"old", b"new!"):
        rig.parameters(local_port=3000)
        rig.scan(Switch.UDP_OPEN)
        rig.scan(Opened(1, 3000, ANYBODY))
        rig.parameters(count=4)
        if said == b"new!":
            rig.scan(Switch.RECEIVE)
            rig.scan()
            assert rig.is_on(Switch.RECEIVE)
        rig.scan(Received(1, said, SERVER))
        rig.scan()
        if said == b"old":
            rig.scan(Switch.CLOSE)
            rig.scan(Closed(1))
    assert (rig.code(), rig.d[1000], rig.d[1001]) == ("0000", 0x6E65, 0x7721)


# --- the held port ---


def reopened(rig: Rig, switch: Switch = Switch.ACTIVE_OPEN) -> str:
    rig.parameters(local_port=3000)
    return rig.ask(switch, Opened(1, 3000, SERVER))


@pytest.mark.parametrize("switch", [Switch.ACTIVE_OPEN, Switch.PASSIVE_OPEN])
def test_0049_for_60_s_after_a_close_from_this_side_assumed(switch: Switch) -> None:
    rig = Rig()
    rig.open(local_port=3000)
    rig.close()
    assert reopened(rig, switch) == "0049"
    rig.wait(59.8)
    assert reopened(rig, switch) == "0049"
    rig.wait(0.2)
    assert reopened(rig, switch) == "0000"


@pytest.mark.parametrize(("early_ns", "code"), [(1, "0049"), (0, "0000"), (-1, "0000")])
def test_the_last_instant_of_the_60_s(early_ns: int, code: str) -> None:
    """The port is free in the refresh that comes exactly 60 s after the one that ended the close."""
    rig = Rig()
    rig.open(local_port=3000)
    rig.close()
    rig.now_ns += 60_000_000_000 - rig.cycle_ns - early_ns
    assert reopened(rig) == code


@pytest.mark.parametrize("end", [PeerClosed(1), Broken(1, "ECONNRESET")])
def test_the_port_is_free_at_once_after_a_close_from_the_peer(end: Event) -> None:
    rig = Rig()
    rig.open(local_port=3000)
    rig.scan(end)
    rig.close()
    assert reopened(rig) == "0000"


def test_the_port_is_free_at_once_with_linger() -> None:
    rig = Rig()
    rig.open(local_port=3000, option=2)
    rig.close()
    assert reopened(rig) == "0000"


def test_of_more_than_64_held_ports_the_first_is_free_again_assumed() -> None:
    rig = Rig()
    for port in range(3000, 3065):
        rig.open(local_port=port)
        rig.close()
    codes = []
    for port in (3001, 3064, 3000):
        rig.parameters(local_port=port)
        codes.append(rig.ask(Switch.ACTIVE_OPEN, Opened(1, port, SERVER)))
    assert codes == ["0049", "0049", "0000"]


def test_a_port_that_the_unit_chose_is_not_held() -> None:
    rig = Rig()
    rig.open(local_port=0)
    rig.close()
    rig.parameters(local_port=49152)
    assert rig.ask(Switch.ACTIVE_OPEN, Opened(1, 49152, SERVER)) == "0000"


def test_the_hold_can_be_switched_off() -> None:
    rig = Rig(Etn21(time_wait_ns=0))
    rig.open(local_port=3000)
    rig.close()
    assert reopened(rig) == "0000"


def test_an_open_that_never_connected_holds_no_port() -> None:
    rig = Rig()
    rig.parameters(local_port=3000)
    rig.scan(Switch.PASSIVE_OPEN)
    rig.scan(Switch.CLOSE)
    rig.scan(Closed(1))
    rig.scan()
    assert reopened(rig) == "0000"


# --- force-close ---


def test_force_close_ends_everything_that_is_open_assumed() -> None:
    rig = Rig()
    rig.open(1, 1)
    rig.open(2, 2)
    rig.parameters(2, 2, count=4)
    rig.scan(Switch.RECEIVE, area=2)
    rig.parameters(3, 3)
    rig.scan(Switch.ACTIVE_OPEN, area=3)
    rig.cio[1500] = 1 << 2
    assert rig.scan() == [Close(1), Close(2), Close(3)]
    rig.scan(Closed(1), Closed(2), Closed(3))
    assert (rig.code(1), rig.code(2), rig.code(3)) == ("0000", "0081", "0081")
    assert (rig.is_open(1), rig.is_open(2), rig.cio[1500]) == (False, True, 4)
    rig.scan()
    assert (rig.is_open(2), rig.status(3), rig.cio[1500]) == (False, 0, 0)
    rig.open(4, 2)
    assert rig.is_open(4)


@pytest.mark.parametrize("was_used", [False, True])
def test_force_close_with_nothing_open_goes_off_in_the_next_refresh_assumed(was_used: bool) -> None:
    rig = Rig()
    if was_used:
        rig.open()
        rig.unit.reset(rig.memory)
    rig.cio[1500] = 1 << 2
    assert rig.scan() == []
    assert rig.cio[1500] == 4
    assert rig.scan() == []
    assert rig.cio[1500] == 0


@pytest.mark.parametrize("switch", [Switch.ACTIVE_OPEN, Switch.UDP_OPEN, Switch.PASSIVE_OPEN])
def test_force_close_ends_a_request_that_was_not_accepted_yet_assumed(switch: Switch) -> None:
    """With the delays of a device the request is accepted a refresh after its switch was seen."""
    rig = Rig(Etn21(timing="real", seed=3))
    rig.parameters(local_port=3000)
    rig.cio[1500] |= 4
    assert rig.scan(switch) == []
    for _ in range(10):
        assert rig.scan() == []
    assert (rig.code(), rig.is_on(switch), rig.cio[1500]) == ("0081", False, 0)


def test_force_close_ends_a_service_that_starts_in_the_same_cycle_assumed() -> None:
    rig = Rig()
    rig.parameters()
    rig.cio[1500] = 1 << 2
    assert rig.scan(Switch.ACTIVE_OPEN) == [Connect(1, SERVER), Close(1)]
    rig.scan(Closed(1))
    assert rig.code() == "0081"


def test_other_bits_of_n_are_left_alone() -> None:
    rig = Rig()
    rig.cio[1500] = 0xFFFF
    rig.scan()
    rig.scan()
    assert rig.cio[1500] == 0xFFFB


# --- several answers at once ---


def test_an_open_and_its_first_data_in_one_refresh() -> None:
    rig = Rig()
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    rig.scan(Opened(1, 49152, SERVER), Received(1, b"hello"), PeerClosed(1))
    assert (rig.status(), rig.waiting(), rig.state()) == (0xA000, 5, 5)


def test_stray_events_change_nothing() -> None:
    rig = Rig()
    before = rig.memory.snapshot()
    strays = (Opened(1, 1, SERVER), Sent(1, 1), Received(1, b"a"), Closed(1), PeerClosed(1), Failed(9, "open", "EPIPE"))
    assert rig.scan(*strays) == []
    assert list(rig.memory.differences(before)) == []
