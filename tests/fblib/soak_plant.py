"""A plant in which all blocks are busy all the time: each command follows the end of the one before, for as long as one
likes.  What a soak looks at: that nothing fails, and that memory and handles stay as they are."""

from __future__ import annotations

import gc
import os
import time
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("192.168.250.2", 502)
UNIT_ADDRESS = "192.168.250.1"
LOOKS, LOOKED_S = 5, 0.01
"""How often handles are counted, and the time behind each."""
READS = {
    "Fn01": "Coil_Address := 7, Coil_Qty := 2000, RespData_DM := 1000",
    "Fn02": "Coil_Address := 3, Coil_Qty := 33, RespData_DM := 1200",
    "Fn03": "Register_Address := 100, Register_Qty := 125, RespData_DM := 1300",
    "Fn04": "Register_Address := 0, Register_Qty := 1, RespData_DM := 1500",
}
WRITES = {
    "Fn05": "Coil_Address := 30000, Value := Even",
    "Fn06": "Register_Address := 30000, Value := Round",
    "Fn0F": "Coil_Address := 30100, Coil_Qty := 1968, DataAddress_DM := 2000",
    "Fn10": "Register_Address := 30100, Register_Qty := 123, DataAddress_DM := 2200",
}
BLOCKS = (*READS, *WRITES)
BUSY = """
FUNCTION_BLOCK Busy     // commands again and again
VAR_INPUT Counter : UINT; Error : BOOL; END_VAR
VAR_OUTPUT Cmd : BOOL; Ended, Failed : UDINT; END_VAR
VAR Before : UINT; END_VAR
    IF NOT Cmd THEN
        Before := Counter;
        Cmd := TRUE;
    ELSIF Error OR Counter <> Before THEN
        Cmd := FALSE;
        Ended := Ended + 1;
        IF Error THEN
            Failed := Failed + 1;
        END_IF;
    END_IF;
END_FUNCTION_BLOCK
"""
DESTINATIONS = {"Fn01": (1000, 125), "Fn02": (1200, 3), "Fn03": (1300, 125), "Fn04": (1500, 1)}


def program() -> str:
    """The text of the plant."""
    variables = [f"{name} : MTCP_ETN_{name}; {name}_Busy : Busy;" for name in BLOCKS]
    calls = []
    for name, pins in (READS | WRITES).items():
        command = "Cmd_Read" if name in READS else "Cmd_Write"
        calls.append(
            f"IF conn.ENO THEN {name}_Busy(Counter := {name}.Rcv_Counter, Error := {name}.Error); END_IF;\n"
            f"{name}(EN := conn.ENO, {pins}, {command} := {name}_Busy.Cmd);"
        )
    return "\n".join([
        BUSY, "PROGRAM Main", "VAR", "conn : MTCP_ETN_Connect; Even : BOOL; Round : UINT;", *variables, "END_VAR",
        "conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := TRUE);",
        "Round := Fn06.Rcv_Counter; Even := (Round MOD 2) = 0;", *calls, "END_PROGRAM",
    ])  # fmt: skip


def plant(cycle_ns: int = 10_000_000) -> Plc:
    """A PLC with the program and its data, without unit and network."""
    made = compile_text(program())
    assert made.image is not None, [message.render() for message in made.diagnostics]
    plc = Plc(made.image, cycle_ns)
    for number in range(123):
        plc.memory.words("D")[2000 + number] = plc.memory.words("D")[2200 + number] = number * 523 & 0xFFFF
    return plc


def contents() -> ModbusServer:
    """What the plant's server holds."""
    server = ModbusServer()
    server.coils[:] = bytes(number % 2 == 0 for number in range(65536))
    server.discrete_inputs[:] = bytes(number % 3 == 0 for number in range(65536))
    server.holding_registers[:] = array("H", [1000 + number & 0xFFFF for number in range(65536)])
    server.input_registers[:] = array("H", [2000 + number & 0xFFFF for number in range(65536)])
    return server


def right(name: str) -> list[int]:
    """The words that belong at a read's destination."""
    if name == "Fn03":
        return [1100 + number for number in range(125)]
    if name == "Fn04":
        return [2000]
    first, count, step = (7, 2000, 2) if name == "Fn01" else (3, 33, 3)
    bits = [(first + number) % step == 0 for number in range(count)]
    return [sum(bit << at for at, bit in enumerate(bits[word : word + 16])) for word in range(0, count, 16)]


RIGHT = {name: right(name) for name in READS}


@dataclass(frozen=True)
class Usage:
    """What a process holds: Python objects, open files and connections, resident memory."""

    objects: int
    handles: int
    resident_bytes: int


def usage() -> Usage:
    """Now.  Handles and memory are 0 where the host has no /proc."""
    gc.collect()
    proc = Path("/proc/self")
    if not proc.exists():
        return Usage(len(gc.get_objects()), 0, 0)
    pages = int((proc / "statm").read_text(encoding="ascii").split()[1])
    return Usage(len(gc.get_objects()), min(_handles()), pages * os.sysconf("SC_PAGE_SIZE"))


def _handles() -> Iterator[int]:
    """Of some moments: the compiler's thread, which works beside, may have a file of its cache open in one of them."""
    for _ in range(LOOKS):
        yield len(os.listdir("/proc/self/fd"))
        time.sleep(LOOKED_S)


def check(plc: Plc) -> int:
    """Everything that was read is right, and no command failed; how many commands have ended."""
    assert plc.trap is None
    ended = 0
    for name in BLOCKS:
        assert plc.read(f"Main.{name}_Busy.Failed") == 0, (name, plc.read(f"Main.{name}.Error_Code"))
        ended += int(str(plc.read(f"Main.{name}_Busy.Ended")))
    assert plc.read("Main.conn.Error_Code") == 0
    for name, (first, count) in DESTINATIONS.items():
        if plc.read(f"Main.{name}.Rcv_Counter"):
            assert list(plc.memory.words("D")[first : first + count]) == RIGHT[name], name
    return ended
