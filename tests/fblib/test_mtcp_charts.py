"""The timing chart of every MTCP_ETN block in both timing models of the unit; one column is the end of a scan."""

from __future__ import annotations

import pytest
from mtcp_rig import Rig
from rows import each_of, first_quick

BLOCKS = [
    "Fn01(Coil_Address := 0, Coil_Qty := 19, RespData_DM := 200)",
    "Fn02(Coil_Address := 0, Coil_Qty := 2000, RespData_DM := 200)",
    "Fn03(Register_Address := 0, Register_Qty := 3, RespData_DM := 200)",
    "Fn04(Register_Address := 0, Register_Qty := 125, RespData_DM := 200)",
    "Fn05(Coil_Address := 0, Value := TRUE)",
    "Fn06(Register_Address := 0, Value := 7)",
    "Fn0F(Coil_Address := 0, Coil_Qty := 1968, DataAddress_DM := 200)",
    "Fn10(Register_Address := 0, Register_Qty := 123, DataAddress_DM := 200)",
]
PINS = ("rd_Cmd", "rd.Rcv_Counter", "rd.Error")
EXCHANGE = (*PINS, "CIO 1519.03", "CIO 1509.02", "CIO 1519.04", "CIO 1509.01", "CIO 1509.13")
CONNECTION = ("Connect", "conn.ENO", "conn.Waiting_Server", "CIO 1519.02", "CIO 1519.05", "CIO 1509.15")


@pytest.mark.slow
@pytest.mark.parametrize("block", first_quick(BLOCKS))
def test_exact(block: str) -> None:
    rig = Rig(rd=block).connect()
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(6, *EXCHANGE)
        == """
        Main.rd_Cmd          ######
        Main.rd.Rcv_Counter  0   |1
        Main.rd.Error        ......
        CIO1519.03           #.....   Send Request Switch
        CIO1509.02           #.....   TCP Sending Flag
        CIO1519.04           ..#...   Receive Request Switch
        CIO1509.01           ..#...   TCP Receiving Flag
        CIO1509.13           .#....   TCP Data Received Flag
    """
    )


@pytest.mark.slow
@each_of("block", BLOCKS)
def test_real(block: str) -> None:
    """Switches and flags are out of step: the reply waits before the Sending flag has fallen."""
    rig = Rig(rd=block, timing="real", seed=2).connect()
    rig.scan(10)
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(22, *EXCHANGE)
        == """
        Main.rd_Cmd          ######################
        Main.rd.Rcv_Counter  0                 |1
        Main.rd.Error        ......................
        CIO1519.03           #########.............   Send Request Switch
        CIO1509.02           .#########............   TCP Sending Flag
        CIO1519.04           ...........######.....   Receive Request Switch
        CIO1509.01           ............#####.....   TCP Receiving Flag
        CIO1509.13           ..##########..........   TCP Data Received Flag
    """
    )


def test_connect_real() -> None:
    rig = Rig(timing="real", seed=2)
    assert (
        rig.chart(22, *CONNECTION)
        == """
        Main.Connect              ######################
        Main.conn.ENO             ...............#######
        Main.conn.Waiting_Server  ###############.......
        CIO1519.02                ........######........   TCP Active Open Request Switch
        CIO1519.05                #######...............   Close Request Switch
        CIO1509.15                ..............########   TCP Open Flag
    """
    )
    rig.set("Connect", False)
    assert (
        rig.chart(14, *CONNECTION)
        == """
        Main.Connect              ..............
        Main.conn.ENO             ..............
        Main.conn.Waiting_Server  ..............
        CIO1519.02                ..............   TCP Active Open Request Switch
        CIO1519.05                .#########....   Close Request Switch
        CIO1509.15                #############.   TCP Open Flag
    """
    )
