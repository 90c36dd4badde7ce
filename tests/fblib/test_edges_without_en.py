"""Commands whose edges come while EN is FALSE: the block is not executed then, and sees in its next call what differs from its
last one."""

from __future__ import annotations

import pytest
from mtcp_rig import Rig as MtcpRig
from server_rig import image_of
from test_mtcp_turn import ALL

from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.units.contract import Unit
from fbvm.units.etn21.unit import Etn21
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Peer

ETN_CLIENT = """
PROGRAM Main
VAR Client : ETN_Modbus_Client; En : BOOL := TRUE; Command : BOOL; Request : ARRAY[0..252] OF BYTE := [3, 0, 0, 0, 1]; END_VAR
    Client(EN := En, IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Command := Command,
           PDU := Request, PDU_Size := 5);
END_PROGRAM
"""
MSTR = """
PROGRAM Main
VAR mstr : MBP_MSTR := (Edge := {edge}); En : BOOL := TRUE; Command : BOOL;
    CONTROL : ARRAY[1..9] OF INT := [2, 0, 3, 1, 16#0700, 192, 168, 250, 2]; DATABUF : ARRAY[1..3] OF INT; END_VAR
    mstr(EN := En, ENABLE := Command, ABORT := FALSE, CONTROL := CONTROL, DATABUF := DATABUF);
END_PROGRAM
"""
Step = tuple[bool, bool]
RISES_AND_STAYS: list[Step] = [(False, False), (False, True), (True, True)]
RISES_AND_FALLS: list[Step] = [(False, False), (False, True), (False, False), (True, False)]
FALLS_AND_RISES: list[Step] = [(True, True), (False, True), (False, False), (False, True), (True, True)]
"""Each step is EN and the command, for five scans."""


def requests(plc: Plc, peer: ModbusPeer, en: str, command: str, steps: list[Step]) -> list[int]:
    """How many requests the server has had at the end of each step."""
    counts = []
    before = len(peer.received)
    for is_enabled, is_commanded in steps:
        plc.write(f"Main.{en}", is_enabled)
        plc.write(f"Main.{command}", is_commanded)
        for _ in range(12):
            assert plc.scan() is None
        counts.append(len(peer.received) - before)
    return counts


@pytest.mark.slow
@pytest.mark.parametrize("block", ALL)
def test_blocks_of_mtcp_etn(block: str) -> None:
    for steps, expected in ((RISES_AND_STAYS, [0, 0, 1]), (RISES_AND_FALLS, [0] * 4), (FALLS_AND_RISES, [1] * 5)):
        rig = MtcpRig(**ALL).connect()
        assert requests(rig.plc, rig.peer, f"{block}_EN", f"{block}_Cmd", steps) == expected


def plc_of(text: str, unit: Unit) -> tuple[Plc, ModbusPeer]:
    network, peer = LoopNetwork(), ModbusPeer()
    network.place(Peer("192.168.250.2", 502), peer)
    plc = Plc(image_of(text))
    plc.attach(unit, network)
    for _ in range(20):
        assert plc.scan() is None
    return plc, peer


@pytest.mark.slow
def test_the_client_program_of_the_etn21() -> None:
    for steps, expected in ((RISES_AND_STAYS, [0, 0, 1]), (RISES_AND_FALLS, [0] * 4), (FALLS_AND_RISES, [1] * 5)):
        plc, peer = plc_of(ETN_CLIENT, Etn21(0, "192.168.250.1"))
        assert requests(plc, peer, "En", "Command", steps) == expected


@pytest.mark.slow
def test_mbp_mstr_with_edges() -> None:
    for steps, expected in ((RISES_AND_STAYS, [0, 0, 1]), (RISES_AND_FALLS, [0] * 4), (FALLS_AND_RISES, [1] * 5)):
        plc, peer = plc_of(MSTR.format(edge="TRUE"), Noc(7, "192.168.250.1"))
        assert requests(plc, peer, "En", "Command", steps) == expected


@pytest.mark.slow
def test_mbp_mstr_by_level() -> None:
    """Whatever happens while EN is FALSE, an operation follows the other as long as ENABLE and EN are TRUE."""
    plc, peer = plc_of(MSTR.format(edge="FALSE"), Noc(7, "192.168.250.1"))
    assert requests(plc, peer, "En", "Command", RISES_AND_FALLS) == [0] * 4
    first, *_, before, last = requests(plc, peer, "En", "Command", FALLS_AND_RISES)
    assert 0 < first <= before < last


def test_connect_and_disconnect_by_level() -> None:
    """MTCP_ETN_Connect keeps what it has while it is not executed; it does then what its Connect says."""
    rig = MtcpRig(**ALL).connect()
    assert rig.get("conn.ENO")
    rig.set("conn_EN", False)
    rig.scan()
    rig.set("Connect", False)
    rig.scan(5)
    assert rig.plc.read("CIO 1509.15"), "nobody has closed"
    rig.set("conn_EN", True)
    rig.scan(5)
    assert not rig.plc.read("CIO 1509.15")
