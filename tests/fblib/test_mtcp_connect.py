"""MTCP_ETN_Connect, scan by scan: one column is the memory at the end of a scan, after its I/O refresh."""

from __future__ import annotations

import pytest
from mtcp_rig import SERVER, Rig

from fbvm.machine.plc import Mode
from fbvm.net.faults import Fault
from fbvm.net.peers import Action, Fin, Reset, ScriptedPeer

PINS = ("Connect", "conn.ENO", "conn.Waiting_Server", "conn.Error")
WORDS = ("CIO 1519.02", "CIO 1519.05", "CIO 1509.15", "D30009")


def test_each_try_closes_the_socket_and_opens_it() -> None:
    assert (
        Rig().chart(7, *PINS, *WORDS)
        == """
        Main.Connect              #######
        Main.conn.ENO             ....###
        Main.conn.Waiting_Server  ####...
        Main.conn.Error           .......
        CIO1519.02                ..#....   TCP Active Open Request Switch
        CIO1519.05                #......   Close Request Switch
        CIO1509.15                ...####   TCP Open Flag
        D30009                    0 ||4     = 0, 2, 4   TCP Connection State
    """
    )


def test_the_request_to_open_in_the_parameter_area() -> None:
    rig = Rig()
    rig.scan(3)
    assert rig.frame(30018, 10) == "00 01 00 00 C0 A8 FA 02 01 F6"
    rig.connect()
    assert rig.words(30019, 1) == [49152], "the unit chose the local port"


def test_connect_falls() -> None:
    """One scan lies between the end of use and the close, because another block may have requested a service."""
    rig = Rig().connect()
    rig.set("Connect", False)
    assert (
        rig.chart(5, *PINS, *WORDS)
        == """
        Main.Connect              .....
        Main.conn.ENO             .....
        Main.conn.Waiting_Server  .....
        Main.conn.Error           .....
        CIO1519.02                .....   TCP Active Open Request Switch
        CIO1519.05                .#...   Close Request Switch
        CIO1509.15                ##...   TCP Open Flag
        D30009                    4||10   = 4, 6, 10   TCP Connection State
    """
    )


def test_connect_falls_while_the_socket_opens() -> None:
    rig = Rig()
    rig.network.faults.append(Fault(silent=True))
    rig.scan(4)
    rig.set("Connect", False)
    assert (
        rig.chart(5, *PINS, *WORDS, "D30027")
        == """
        Main.Connect              .....
        Main.conn.ENO             .....
        Main.conn.Waiting_Server  .....
        Main.conn.Error           .....
        CIO1519.02                #....   TCP Active Open Request Switch
        CIO1519.05                ##...   Close Request Switch
        CIO1509.15                .....   TCP Open Flag
        D30009                    0       TCP Connection State
        D30027                    |||0    = 8720, 129, 0   Response Code
    """
    )


def test_connect_returns_without_a_pause() -> None:
    rig = Rig().connect()
    rig.set("Connect", False)
    rig.scan()
    rig.set("Connect", True)
    assert rig.run_until("Main.conn.ENO") == pytest.approx(0.05)


def test_a_refused_connection_is_tried_again_after_a_second() -> None:
    rig = Rig(refused=True)
    assert (
        rig.chart(8, *PINS, *WORDS)
        == """
        Main.Connect              ########
        Main.conn.ENO             ........
        Main.conn.Waiting_Server  ########
        Main.conn.Error           ....####
        CIO1519.02                ..#.....   TCP Active Open Request Switch
        CIO1519.05                #...#...   Close Request Switch
        CIO1509.15                ........   TCP Open Flag
        D30009                    0 ||0      = 0, 2, 0   TCP Connection State
    """
    )
    assert rig.code("conn") == "004A"
    assert rig.run_until("CIO 1519.02", 2) == pytest.approx(1.0)


def test_error_and_code_hold_until_the_next_success() -> None:
    rig = Rig(refused=True)
    rig.run_until("Main.conn.Error")
    rig.scan(50)
    assert rig.code("conn") == "004A"
    rig.network.place(SERVER, rig.peer)
    rig.connect()
    assert (rig.code("conn"), rig.get("conn.Error_Code")) == ("", 0)


@pytest.mark.slow
def test_nobody_answers() -> None:
    """The unit ends the open with 0081 because it is closed; the block says 0053."""
    rig = Rig()
    rig.network.faults.append(Fault(silent=True))
    rig.run_until("CIO 1519.02")
    assert rig.run_until("Main.conn.Error", 11) == pytest.approx(10.01)
    assert rig.code("conn") == "0053"
    rig.network.faults.clear()
    assert rig.run_until("Main.conn.ENO", 2) == pytest.approx(1.06, abs=0.03)


@pytest.mark.parametrize(("end", "expected"), [(Fin(100_000_000), "0081"), (Reset(100_000_000), "004B")])
def test_a_lost_connection_is_opened_again(end: Action, expected: str) -> None:
    peer = ScriptedPeer(greeting=[end])
    rig = Rig(peer).connect()
    rig.run_until("Main.conn.Error", 1)
    assert (rig.code("conn"), rig.get("conn.ENO")) == (expected, False)
    assert (
        rig.chart(5, *PINS, *WORDS[:3])
        == """
        Main.Connect              #####
        Main.conn.ENO             .....
        Main.conn.Waiting_Server  #####
        Main.conn.Error           #####
        CIO1519.02                .....   TCP Active Open Request Switch
        CIO1519.05                #....   Close Request Switch
        CIO1509.15                #....   TCP Open Flag
    """
    )
    rig.run_until("Main.conn.ENO", 2)
    assert (rig.code("conn"), len(peer.callers)) == ("", 2)


def test_a_server_that_closes_at_once() -> None:
    rig = Rig(ScriptedPeer(greeting=[Fin()]))
    rig.run_until("Main.conn.Error", 2)
    assert rig.code("conn") == "0081"
    rig.run_until("CIO 1519.02", 2)


def test_a_socket_left_open_by_a_mode_change() -> None:
    """The change of mode clears the flags but not the socket: without the close the open would give 220F."""
    rig = Rig().connect()
    rig.plc.mode = Mode.PROGRAM
    rig.scan(2)
    rig.plc.mode = Mode.RUN
    assert (
        rig.chart(6, *PINS, *WORDS)
        == """
        Main.Connect              ######
        Main.conn.ENO             ....##
        Main.conn.Waiting_Server  ####..
        Main.conn.Error           ......
        CIO1519.02                ..#...   TCP Active Open Request Switch
        CIO1519.05                #.....   Close Request Switch
        CIO1509.15                ...###   TCP Open Flag
        D30009                    6|||4    = 6, 10, 2, 4   TCP Connection State
    """
    )


@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_restart_of_the_unit(timing: str) -> None:
    rig = Rig(timing=timing, seed=2).connect()
    rig.plc.write("A501.00", True)
    rig.run_until("Main.conn.Error", 1)
    assert rig.get("conn.ENO") is False
    rig.run_until("NOT A501.00 AND NOT A302.00", 4)
    rig.run_until("Main.conn.ENO", 2)
    assert rig.code("conn") == ""


RIVAL = """
    IF Go THEN
        Number := Rival_Socket; Port := 6000; IP[0] := 0; IP[1] := 0; Remote := 0; Time_Limit := 0;
        Passive := TRUE; Go := FALSE;
    ELSIF Leave THEN
        Number := 2; Closing := TRUE; Leave := FALSE;
    END_IF;"""
RIVAL_VARIABLES = """
    Number AT D30018 : WORD; Port AT D30019 : UINT; IP AT D30020 : ARRAY[0..1] OF WORD; Remote AT D30022 : UINT;
    Time_Limit AT D30026 : UINT; Passive AT CIO 1519.01 : BOOL; Closing AT CIO 1519.05 : BOOL;
    Go, Leave : BOOL; Rival_Socket : WORD := 2;"""


def with_rival(socket: int, timing: str) -> Rig:
    """A program has let another socket, or ours, wait for a caller who never comes, by our parameter area."""
    rig = Rig(more=RIVAL, more_variables=RIVAL_VARIABLES, timing=timing, seed=4)
    rig.set("conn_EN", False)
    rig.set("Rival_Socket", socket)
    rig.set("Go", True)
    rig.scan(8)
    rig.set("conn_EN", True)
    return rig


@pytest.mark.slow
@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_parameter_area_that_another_program_keeps_busy(timing: str) -> None:
    """220F, again and again; when the program leaves it, the block connects by itself."""
    rig = with_rival(2, timing)
    assert rig.run_until("Main.conn.Error", 12) == pytest.approx(10, abs=0.3)
    assert (rig.code("conn"), rig.get("conn.Waiting_Server")) == ("220F", True)
    rig.scan(2000)
    assert rig.code("conn") == "220F"
    rig.set("Leave", True)
    rig.run_until("Main.conn.ENO", 15)
    assert rig.code("conn") == ""


@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_socket_that_another_program_lets_wait(timing: str) -> None:
    """The close before each open ends that."""
    rig = with_rival(1, timing)
    assert rig.run_until("Main.conn.ENO", 12) < 2


@pytest.mark.slow
@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_close_of_another_socket_that_is_under_way(timing: str) -> None:
    """Its answer, 2210, is taken for that of ours, and our socket goes on waiting for a caller: it is closed later."""
    rig = with_rival(1, timing)
    rig.set("conn_EN", False)
    rig.scan(4)
    rig.set("Leave", True)
    rig.set("conn_EN", True)
    rig.run_until("Main.conn.ENO", 15)
    assert rig.code("conn") == ""


@pytest.mark.slow
def test_a_unit_that_is_not_there() -> None:
    """2211 after ten seconds, and the connection once there is one."""
    rig = Rig()
    units = [rig.plc.units.pop()]
    assert rig.run_until("Main.conn.Error", 12) == pytest.approx(10, abs=0.1)
    assert (rig.code("conn"), rig.get("conn.Waiting_Server"), rig.get("conn.ENO")) == ("2211", True, False)
    rig.scan(1000)
    assert rig.code("conn") == "2211"
    rig.plc.units += units
    rig.run_until("Main.conn.ENO", 3)
    assert rig.code("conn") == ""


def test_all_sockets_closed_by_force() -> None:
    rig = Rig().connect()
    rig.plc.write("CIO 1500.02", True)
    rig.run_until("Main.conn.Error", 1)
    assert rig.code("conn") == "0081"
    rig.run_until("Main.conn.ENO", 2)


@pytest.mark.parametrize("octet", [256, 65535])
def test_an_octet_above_ff(octet: int) -> None:
    rig = Rig()
    rig.set("Octet1", octet)
    rig.scan()
    assert rig.code("conn") == "1100"
    assert not rig.get("conn.Waiting_Server")
    rig.scan(3)
    assert rig.words(30018, 10) == [0] * 10, "nothing was asked of the unit"
    rig.set("Octet1", 192)
    rig.connect()
    assert rig.code("conn") == ""


@pytest.mark.slow
def test_an_octet_that_becomes_wrong_between_two_tries() -> None:
    rig = Rig(refused=True)
    rig.run_until("Main.conn.Error")
    rig.set("Octet1", 300)
    rig.run_until("Main.conn.Error_Code = 16#1100", 2)
    rig.scan(500)
    assert not rig.get("conn.Waiting_Server")


SECOND = "conn2(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 3, Connect := Connect2);"


def test_a_second_connect_block_gets_220f() -> None:
    rig = Rig(more=SECOND, more_variables="conn2 : MTCP_ETN_Connect; Connect2 : BOOL;").connect()
    rig.set("Connect2", True)
    rig.scan(5)
    assert rig.code("conn2") == "220F"
    assert rig.get("conn.ENO")
    rig.set("Connect", False)
    rig.run_until("CIO 1519.02", 1)
    assert rig.words(30021, 1) == [0xFA03], "it has its turn when the first one has closed"


def test_en_falls_and_the_connection_stays() -> None:
    rig = Rig().connect()
    rig.set("conn_EN", False)
    assert (
        rig.chart(2, "conn.ENO", "CIO 1509.15", "CIO 1519.05")
        == """
        Main.conn.ENO  ..
        CIO1509.15     ##   TCP Open Flag
        CIO1519.05     ..   Close Request Switch
    """
    )
    rig.set("conn_EN", True)
    rig.scan()
    assert rig.get("conn.ENO")


@pytest.mark.slow
def test_en_falls_while_the_socket_opens() -> None:
    rig = Rig()
    rig.scan(3)
    rig.set("conn_EN", False)
    rig.scan(2000)
    rig.set("conn_EN", True)
    rig.scan()
    assert (rig.get("conn.ENO"), rig.code("conn")) == (True, "")


def test_the_area_bound_by_another_socket() -> None:
    """A program has opened socket 2 by parameter area 1: nothing can be done with it until that is closed."""
    rig = Rig()
    rig.set("Connect", False)
    rig.fill(30018, [2, 0, 0xC0A8, 0xFA02, 502])
    rig.plc.write("CIO 1519.02", True)
    rig.run_until("CIO 1510.15")
    rig.set("Connect", True)
    rig.run_until("Main.conn.Error", 1)
    assert rig.code("conn") == "2607"
    assert rig.get("conn.Waiting_Server")
