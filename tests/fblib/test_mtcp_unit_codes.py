"""Codes that only a program which drives the unit itself can provoke (1103, 2606, 2607), and scripted faults of it."""

from __future__ import annotations

import pytest
from mtcp_rig import SERVER, Rig
from rows import each_of

from fbvm.units.etn21.faults import Fault
from fbvm.units.etn21.map import Switch

READ = "Fn03(Register_Address := 1000, Register_Qty := 3, RespData_DM := 200)"

SOCKET_PROGRAM = """
PROGRAM Main
VAR
    // Parameter area 1 and 2 of unit 0, and their switches.
    Number_1 AT D30018 : WORD; Port_1 AT D30019 : UINT; IP_1 AT D30020 : ARRAY[0..1] OF WORD; Remote_1 AT D30022 : UINT;
    Count_1 AT D30023 : UINT; Address_1 AT D30024 : ARRAY[0..1] OF WORD; Code_1 AT D30027 : UINT;
    Number_2 AT D30028 : WORD; Port_2 AT D30029 : UINT; Code_2 AT D30037 : UINT;
    Active_1 AT CIO 1519.02 : BOOL; Send_1 AT CIO 1519.03 : BOOL; Receive_1 AT CIO 1519.04 : BOOL;
    UDP_2 AT CIO 1519.08 : BOOL;
    Connected AT CIO 1509.15 : BOOL;
    UDP_Open AT CIO 1501.15 : BOOL;
    Step : INT;
    Codes : ARRAY[1..6] OF UINT;
END_VAR
    CASE Step OF
        0:  // UDP on socket 1 by area 2
            Number_2 := 1; Port_2 := 6000; UDP_2 := TRUE; Step := 1;
        1:  // TCP on the same socket
            IF NOT UDP_2 AND UDP_Open THEN
                Codes[1] := Code_2;
                Number_1 := 1; IP_1[0] := 16#C0A8; IP_1[1] := 16#FA02; Remote_1 := 502; Active_1 := TRUE; Step := 2;
            END_IF;
        2:  // socket 2 instead
            IF NOT Active_1 THEN
                Codes[2] := Code_1; Number_1 := 2; Active_1 := TRUE; Step := 3;
            END_IF;
        3:  // send from D500, bit 1
            IF NOT Active_1 THEN
                Codes[3] := Code_1; Count_1 := 4; Address_1[0] := 16#8201; Address_1[1] := 16#F401; Send_1 := TRUE;
                Step := 4;
            END_IF;
        4:  // receive to D500, bit 15
            IF NOT Send_1 THEN
                Codes[4] := Code_1; Count_1 := 4; Address_1[1] := 16#F40F; Receive_1 := TRUE; Step := 5;
            END_IF;
        5:  // send from D500
            IF NOT Receive_1 THEN
                Codes[5] := Code_1; Count_1 := 4; Address_1[1] := 16#F400; Send_1 := TRUE; Step := 6;
            END_IF;
        6:
            IF NOT Send_1 THEN
                Codes[6] := Code_1; Step := 7;
            END_IF;
    END_CASE;
END_PROGRAM
"""


@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_program_that_drives_the_unit_itself(timing: str) -> None:
    """2606: the socket is open as UDP.  1103: a data address with a bit number.  What is right goes on."""
    rig = Rig(text=SOCKET_PROGRAM, timing=timing, seed=3)
    rig.fill(500, [0x0102, 0x0304])
    rig.run_until("Main.Step = 7", 5)
    assert [f"{code:04X}" for code in rig.get("Codes")] == ["0000", "2606", "0000", "1103", "1103", "0000"]  # type: ignore[attr-defined]
    assert rig.peer.received == []
    assert rig.words(500, 3) == [0x0102, 0x0304, 0]


@pytest.mark.slow
def test_connect_finds_its_socket_open_as_udp() -> None:
    """A program opens socket 1 for UDP in between: MTCP_ETN_Connect says 2606, closes it, and connects at its next try."""
    rig = Rig(
        rd=READ,
        more="IF NOT Done THEN Number_2 := 1; Port_2 := 6000; UDP_2 := TRUE; Done := TRUE; END_IF;",
        more_variables="Number_2 AT D30028 : WORD; Port_2 AT D30029 : UINT; UDP_2 AT CIO 1519.08 : BOOL; Done : BOOL;",
    )
    rig.run_until("Main.conn.Error", 1)
    assert rig.code("conn") == "2606"
    assert rig.get("conn.Waiting_Server") is True
    assert rig.run_until("Main.conn.ENO", 3) > 0.9
    assert rig.code("conn") == ""
    rig.command("rd")
    assert rig.result("rd") == (1, "")


@pytest.mark.slow
def test_connect_finds_its_parameter_area_in_use_by_another_socket() -> None:
    """2607 until the program closes its socket 2, then MTCP_ETN_Connect connects by itself."""
    rig = Rig(
        wired=False,
        rd=READ,
        more="""
            CASE Step OF
                0: Number := 2; IP[0] := 16#C0A8; IP[1] := 16#FA02; Remote := 502; Opening := TRUE; Step := 1;
                1: IF NOT Opening THEN Step := 2; END_IF;
                3: Number := 2; Closing := TRUE; Step := 4;
            END_CASE;""",
        more_variables="""
            Number AT D30018 : WORD; IP AT D30020 : ARRAY[0..1] OF WORD; Remote AT D30022 : UINT;
            Opening AT CIO 1519.02 : BOOL; Closing AT CIO 1519.05 : BOOL; Step : INT;""",
    )
    rig.set("conn_EN", False)
    rig.set("Connect", False)
    rig.run_until("Main.Step = 2", 1)
    rig.set("conn_EN", True)
    rig.set("Connect", True)
    rig.run_until("Main.conn.Error", 1)
    assert rig.code("conn") == "2607"
    rig.scan(50)
    assert rig.code("conn") == "2607"
    rig.set("Step", 3)
    rig.run_until("Main.conn.ENO", 3)
    rig.command("rd")
    assert rig.result("rd") == (1, "")


@pytest.mark.slow
def test_a_block_whose_data_address_a_program_spoils() -> None:
    """The program writes a bit number behind the block that has just set the send switch: 1103, and nothing is sent."""
    rig = Rig(
        rd=READ,
        more="IF Spoil AND Send THEN Low := Low OR 16#0001; END_IF;",
        more_variables="Low AT D30025 : WORD; Send AT CIO 1519.03 : BOOL; Spoil : BOOL := TRUE;",
    ).connect()
    rig.command("rd", max_s=1)
    assert rig.result("rd") == (0, "1103")
    assert rig.peer.received == []
    assert rig.get("conn.ENO")
    rig.set("Spoil", False)
    rig.command("rd")
    assert rig.result("rd") == (1, "")


@pytest.mark.parametrize("timing", ["exact", "real"])
@pytest.mark.parametrize(
    ("switch", "code"),
    [(Switch.CLOSE, 0x0302), (Switch.ACTIVE_OPEN, 0x0302), (Switch.ACTIVE_OPEN, 0x2211)],
)
def test_a_fault_of_the_unit_while_connecting(switch: Switch, code: int, timing: str) -> None:
    rig = Rig(timing=timing, seed=code, rd=READ)
    rig.unit.faults.append(Fault(code, switch, 1))
    rig.run_until("Main.conn.Error", 1)
    assert rig.code("conn") == f"{code:04X}"
    assert rig.unit.faults == []
    rig.run_until("Main.conn.ENO", 3)
    assert rig.code("conn") == ""
    rig.command("rd")
    assert rig.result("rd") == (1, "")


@pytest.mark.slow
@each_of("switch", [Switch.SEND, Switch.RECEIVE])
@each_of("code", [0x0302, 0x2211])
def test_a_script_of_faults_hits_one_request_each(code: int, switch: Switch) -> None:
    rig = Rig(rd=READ).connect()
    rig.server.holding_registers[1000] = 7
    rig.unit.faults += [Fault(code, switch, 1), Fault(code, switch, 2), Fault(code, switch, 1)]
    ended = []
    for _ in range(4):
        rig.run_until("Main.conn.ENO", 3)
        rig.command("rd")
        ended.append(rig.result("rd")[1])
    wrong = f"{code:04X}"
    assert ended == [wrong, wrong, "", ""]
    assert rig.unit.faults == [Fault(code, switch, 2)], "socket 2 did nothing"
    assert rig.words(200, 1) == [7]
    rig.network.remove(SERVER)
