"""The two tables of error codes in the sheet, row by row: each code is provoked, and the library's README explains it."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from mtcp_rig import Rig, answering, saying

from fbvm.base.data import data_folder
from fbvm.net.faults import Fault
from fbvm.net.peers import Fin, Reset, Say, ScriptedPeer
from fbvm.units.etn21.faults import Fault as UnitFault
from fbvm.units.etn21.map import Switch

README = (data_folder("fblib") / "omron" / "mtcp_etn" / "README.md").read_text(encoding="utf-8")
READ = "Fn03(Register_Address := 1000, Register_Qty := 3, RespData_DM := 200)"
UNIT = """Number AT D30018 : WORD; Port AT D30019 : UINT; Address_Low AT D30025 : WORD; Number_2 AT D30028 : WORD;
    Port_2 AT D30029 : UINT; UDP AT CIO 1519.00 : BOOL; Send AT CIO 1519.03 : BOOL; UDP_2 AT CIO 1519.08 : BOOL; Done : BOOL;"""
"""Words and switches of parameter areas 1 and 2."""


def read(rig: Rig) -> str:
    """What a read ends with."""
    rig.command("rd", max_s=8)
    return rig.code("rd")


def connecting(rig: Rig) -> str:
    """What MTCP_ETN_Connect says first."""
    rig.run_until("Main.conn.Error", 12)
    return rig.code("conn")


def exception(code: int) -> Callable[[], str]:
    return lambda: read(Rig(saying(lambda frame: frame[:4] + bytes((0, 3, 255, 0x83, code))), rd=READ).connect())


def fault(code: int, switch: Switch) -> Callable[[], str]:
    """A unit that answers the next request so."""

    def provoke() -> str:
        rig = Rig(rd=READ)
        rig.unit.faults.append(UnitFault(code, switch))
        return connecting(rig) if switch is Switch.ACTIVE_OPEN else read(rig.connect())

    return provoke


def unreachable(error: str) -> Callable[[], str]:
    def provoke() -> str:
        rig = Rig(rd=READ)
        rig.network.faults.append(Fault(silent=True) if error == "silent" else Fault(error=error))
        return connecting(rig)

    return provoke


def program(more: str, connected: bool = False) -> Callable[[], str]:
    """A program that drives the unit itself, beside the blocks."""

    def provoke() -> str:
        rig = Rig(rd=READ, more=more, more_variables=UNIT)
        return read(rig.connect()) if connected else connecting(rig)

    return provoke


def area_taken() -> str:
    """A program has opened socket 2 by parameter area 1."""
    more = "IF NOT Done THEN Number := 2; Port := 6000; UDP := TRUE; Done := TRUE; END_IF;"
    rig = Rig(rd=READ, more=more, more_variables=UNIT)
    rig.set("conn_EN", False)
    rig.scan(3)
    rig.set("conn_EN", True)
    return connecting(rig)


def with_block(block: str) -> Callable[[], str]:
    return lambda: read(Rig(rd=block).connect())


def twice() -> str:
    rig = Rig(answering(lambda frame: [Say(frame, 100_000_000)]), rd=READ).connect()
    for command in (True, False, True):
        rig.set("rd_Cmd", command)
        rig.scan()
    return rig.code("rd")


def second_connect() -> str:
    rig = Rig(more="second(IP_Address1 := 10, Connect := TRUE);", more_variables="second : MTCP_ETN_Connect;").connect()
    return rig.code("second")


EXCEPTIONS = {"0001": exception(1), "0002": exception(2), "0003": exception(3)}
SOCKET_SERVICE = {
    "2607": area_taken,
    "0302": fault(0x0302, Switch.ACTIVE_OPEN),
    "1100": with_block("Fn10(Register_Address := 0, Register_Qty := 124, DataAddress_DM := 200)"),
    "1101": with_block("Fn03(Register_Address := 0, Register_Qty := 3, RespData_DM := 32766)"),
    "1103": program("IF Send THEN Address_Low := Address_Low OR 1; END_IF;", connected=True),
    "110C": twice,
    "220F": second_connect,
    "2210": lambda: read(Rig(refused=True, rd=READ, wired=False)),
    "2211": fault(0x2211, Switch.SEND),
    "2606": program("IF NOT Done THEN Number_2 := 1; Port_2 := 6000; UDP_2 := TRUE; Done := TRUE; END_IF;"),
    "0020": fault(0x0020, Switch.SEND),
    "003E": fault(0x003E, Switch.SEND),
    "0045": lambda: read(Rig(saying(lambda frame: frame[:2] + b"\0\1" + frame[4:]), rd=READ).connect()),
    "004B": lambda: read(Rig(answering(lambda frame: [Reset()]), rd=READ).connect()),
    "004E": unreachable("ENETUNREACH"),
    "0051": unreachable("EHOSTUNREACH"),
    "0053": unreachable("silent"),
    "0080": lambda: read(Rig(ScriptedPeer(), rd=READ).connect()),
    "0081": lambda: read(Rig(answering(lambda frame: [Say(frame[:7]), Fin()]), rd=READ).connect()),
}  # fmt: skip


@pytest.mark.parametrize("code", EXCEPTIONS | SOCKET_SERVICE)
def test_each_code_of_the_sheet_is_provoked(code: str) -> None:
    assert (EXCEPTIONS | SOCKET_SERVICE)[code]() == code


def test_the_readme_explains_each() -> None:
    table = README.partition("## Error codes")[2].partition("\n## ")[0]
    rows = [line.partition("|")[2].partition("|")[0] for line in table.splitlines() if line.startswith("| ")]
    named = {code for row in rows for code in re.findall(r"[0-9A-F]{4}", row)}
    assert set(SOCKET_SERVICE) <= named
    assert "0001 to 000B" in table
