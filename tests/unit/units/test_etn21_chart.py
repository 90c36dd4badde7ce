"""Flags of area 1 and TCP socket 1, scan by scan: one column is the memory after the I/O refresh of that scan."""

from __future__ import annotations

from textwrap import dedent

from etn21_rig import SERVER, Rig

from fbvm.units.etn21.map import Switch
from fbvm.wire.link import Closed, Opened, Peer, PeerClosed, Received, Sent


def drawn(text: str) -> str:
    return dedent(text).strip()


def test_active_open() -> None:
    rig = Rig()
    rig.parameters()
    assert rig.chart([], [Switch.ACTIVE_OPEN], [], [], [Opened(1, 49152, SERVER)], []) == drawn("""
        ACTIVE_OPEN   .###..
        Opening       .###..
        Open          ....##
        state         022244
        code          ....*.  0000
    """)


def test_the_earliest_end_is_the_refresh_after_the_acceptance() -> None:
    rig = Rig()
    rig.parameters()
    assert rig.chart([Switch.ACTIVE_OPEN], [Opened(1, 49152, SERVER)], []) == drawn("""
        ACTIVE_OPEN   #..
        Opening       #..
        Open          .##
        state         244
        code          .*.  0000
    """)


def test_passive_open() -> None:
    rig = Rig()
    rig.parameters(local_port=502, remote=Peer("0.0.0.0", 0))
    assert rig.chart([Switch.PASSIVE_OPEN], [], [Opened(1, 502, SERVER)], []) == drawn("""
        PASSIVE_OPEN  ##..
        Opening       ##..
        Open          ..##
        state         1144
        code          ..*.  0000
    """)


def test_send() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=12)
    assert rig.chart([Switch.SEND], [], [Sent(1, 12)], []) == drawn("""
        SEND          ##..
        Sending       ##..
        Open          ####
        state         4444
        code          ..*.  0000
    """)


def test_receive_of_what_is_there() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=4)
    assert rig.chart([Received(1, b"abcdef")], [Switch.RECEIVE], [], []) == drawn("""
        RECEIVE       .#..
        Receiving     .#..
        Data          #.##
        Open          ####
        state         4444
        code          ..*.  0000
    """)


def test_receive_that_waits() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=4)
    assert rig.chart([Switch.RECEIVE], [], [Received(1, b"abcd")], []) == drawn("""
        RECEIVE       ##..
        Receiving     ##..
        Open          ####
        state         4444
        code          ..*.  0000
    """)


def test_close() -> None:
    rig = Rig()
    rig.open()
    rig.parameters()
    assert rig.chart([Switch.CLOSE], [], [Closed(1)], []) == drawn("""
        CLOSE         ##..
        Closing       ##..
        Open          ##..
        state         66AA
        code          ..*.  0000
    """)


def test_close_after_the_peer() -> None:
    rig = Rig()
    rig.open()
    rig.parameters()
    assert rig.chart([PeerClosed(1)], [], [Switch.CLOSE], [Closed(1)], []) == drawn("""
        CLOSE         ..#..
        Closing       ..#..
        Open          ###..
        state         55800
        code          ...*.  0000
    """)


def test_close_during_a_receive_gives_two_results_one_cycle_apart_assumed() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=4)
    assert rig.chart([Switch.RECEIVE], [], [Switch.CLOSE], [Closed(1)], [], []) == drawn("""
        RECEIVE       ###...
        CLOSE         ..##..
        Receiving     ###...
        Closing       ..##..
        Open          ####..
        state         4466AA
        code          ...**.  0081 0000
    """)


def test_refused_request_leaves_flags_alone_assumed() -> None:
    rig = Rig()
    rig.parameters()
    assert rig.chart([Switch.SEND], [], []) == drawn("""
        SEND          #..
        state         000
        code          .*.  2210
    """)


def test_switch_beside_a_running_receive_is_refused_and_the_receive_goes_on_assumed() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=4)
    assert rig.chart([Switch.RECEIVE], [Switch.SEND], [], [Received(1, b"ab")], []) == drawn("""
        SEND          .#...
        RECEIVE       ###..
        Receiving     ###..
        Open          #####
        state         44444
        code          ..**.  110C 0000
    """)
