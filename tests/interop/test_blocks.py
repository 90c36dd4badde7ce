"""The shipped client blocks over real TCP against servers of other people: all eight functions at the smallest, a
middle and the greatest quantity, right in both directions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from servers import SERVERS, client, server
from tables import COILS, DISCRETE_INPUTS, HOLDING_REGISTERS, INPUT_REGISTERS
from wireshark import TSHARK, dissected

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.tcp import TcpNetwork
from fbvm.record.export.pcapng import Capture
from fbvm.run import run
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

SERVER = Peer("192.168.250.2", 502)
LIMIT_NS = 20_000_000_000
PROGRAM = """
PROGRAM Main
VAR
    conn : MTCP_ETN_Connect;
    Fn01 : MTCP_ETN_Fn01; Fn02 : MTCP_ETN_Fn02; Fn03 : MTCP_ETN_Fn03; Fn04 : MTCP_ETN_Fn04;
    Fn05 : MTCP_ETN_Fn05; Fn06 : MTCP_ETN_Fn06; Fn0F : MTCP_ETN_Fn0F; Fn10 : MTCP_ETN_Fn10;
    Cmd01, Cmd02, Cmd03, Cmd04, Cmd05, Cmd06, Cmd0F, Cmd10 : BOOL;
    Address, Quantity, Number : UINT;
    On : BOOL;
END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := TRUE);
    Fn01(EN := conn.ENO, Coil_Address := Address, Coil_Qty := Quantity, RespData_DM := 1000, Cmd_Read := Cmd01,
         SlaveID := 1);
    Fn02(EN := conn.ENO, Coil_Address := Address, Coil_Qty := Quantity, RespData_DM := 1000, Cmd_Read := Cmd02,
         SlaveID := 1);
    Fn03(EN := conn.ENO, Register_Address := Address, Register_Qty := Quantity, RespData_DM := 1000, Cmd_Read := Cmd03,
         SlaveID := 1);
    Fn04(EN := conn.ENO, Register_Address := Address, Register_Qty := Quantity, RespData_DM := 1000, Cmd_Read := Cmd04,
         SlaveID := 1);
    Fn05(EN := conn.ENO, Coil_Address := Address, Value := On, Cmd_Write := Cmd05, SlaveID := 1);
    Fn06(EN := conn.ENO, Register_Address := Address, Value := Number, Cmd_Write := Cmd06, SlaveID := 1);
    Fn0F(EN := conn.ENO, Coil_Address := Address, Coil_Qty := Quantity, DataAddress_DM := 2000, Cmd_Write := Cmd0F,
         SlaveID := 1);
    Fn10(EN := conn.ENO, Register_Address := Address, Register_Qty := Quantity, DataAddress_DM := 2000,
         Cmd_Write := Cmd10, SlaveID := 1);
END_PROGRAM
"""
READS = {"01": (COILS, 2000), "02": (DISCRETE_INPUTS, 2000), "03": (HOLDING_REGISTERS, 125), "04": (INPUT_REGISTERS, 125)}
BITS = [number * number % 7 < 3 for number in range(1968)]
WORDS = [number * 523 + 0x8001 & 0xFFFF for number in range(123)]


class Bench:
    """A PLC that is connected to a server of the given port."""

    def __init__(self, port: int, network: TcpNetwork, timing: str = "exact") -> None:
        image = compile_text(PROGRAM).image
        assert image is not None
        self.plc = Plc(image, 1_000_000 if timing == "real" else 10_000_000)
        self.plc.attach(Etn21(0, "192.168.250.1", timing=timing, seed=port), network)
        self.until("Main.conn.ENO")

    def until(self, condition: str) -> None:
        """Runs until a condition holds; fails if that takes too long."""
        assert run(self.plc, until=condition, max_ns=LIMIT_NS, pace="event") == "until", condition

    def command(self, function: str, **inputs: object) -> None:
        """One exchange that has to end well."""
        for name, value in inputs.items():
            self.plc.write(f"Main.{name}", value)
        before = self.plc.read(f"Main.Fn{function}.Rcv_Counter")
        self.plc.write(f"Main.Cmd{function}", True)
        self.until(f"Main.Fn{function}.Rcv_Counter <> {before} OR Main.Fn{function}.Error")
        self.plc.write(f"Main.Cmd{function}", False)
        assert self.plc.read(f"Main.Fn{function}.Error_Code") == 0, (function, inputs)
        self.plc.scan(self.plc.now_ns)

    def words(self, first: int, count: int) -> list[int]:
        return list(self.plc.memory.words("D")[first : first + count])

    def fill(self, first: int, words: list[int]) -> None:
        for offset, word in enumerate(words):
            self.plc.memory.words("D")[first + offset] = word


@contextmanager
def bench(make: str, capture: Path, timing: str = "exact") -> Iterator[tuple[Bench, int]]:
    """A bench at a server of that make, and the port; what passed is captured, and looked at by tshark."""
    with server(make) as port, capture.open("wb") as file:
        network = TcpNetwork({SERVER: ("127.0.0.1", port)})
        network.tap = Capture(file, epoch_ns=1_700_000_000_000_000_000).tap
        try:
            yield Bench(port, network, timing), port
        finally:
            network.close()


def packed(bits: list[bool] | bytes) -> list[int]:
    """Bits in words, the first in bit 0 of the first."""
    return [sum(bool(bit) << at for at, bit in enumerate(bits[start : start + 16])) for start in range(0, len(bits), 16)]


def quantities(greatest: int) -> list[int]:
    return [1, greatest // 2 + 1, greatest]


@pytest.mark.slow
@pytest.mark.parametrize("make", SERVERS)
def test_every_function_in_both_directions(make: str, tmp_path: Path) -> None:
    capture = tmp_path / "blocks.pcapng"
    with bench(make, capture) as (plc, port):
        for function, (table, greatest) in READS.items():
            for quantity in quantities(greatest):
                plc.fill(1000, [0xA5A5] * 130)
                plc.command(function, Address=7, Quantity=quantity)
                held = table[7 : 7 + quantity]
                right = packed(held) if isinstance(held, bytes) else held
                assert plc.words(1000, 130) == right + [0xA5A5] * (130 - len(right)), (function, quantity)
        with client(port) as asked:
            check_writes(plc, asked)
    codes = [code for code in READS for _ in range(3)] + ["15"] * 3 + ["16"] * 3 + ["5"] * 2 + ["6"]
    assert dissected(capture) == ([f"{int(code)}" for code in codes for _ in range(2)] if TSHARK else [])


def check_writes(plc: Bench, asked: object) -> None:
    """What was written is what the server holds, and nothing beside it."""

    def coils(first: int, count: int) -> list[bool]:
        found = [asked.read_coils(at, count=min(1000, first + count - at)) for at in range(first, first + count, 1000)]  # type: ignore[attr-defined]
        return [bit for reply in found for bit in reply.bits[: min(1000, count)]][:count]

    def registers(first: int, count: int) -> list[int]:
        reply = asked.read_holding_registers(first, count=count)  # type: ignore[attr-defined]
        return list(reply.registers)

    plc.fill(2000, packed(BITS))
    for number, quantity in enumerate(quantities(1968)):
        first = 10_001 + 3000 * number
        plc.command("0F", Address=first, Quantity=quantity)
        assert coils(first - 1, quantity + 2) == [
            bool(COILS[first - 1]), *BITS[:quantity], bool(COILS[first + quantity])
        ]  # fmt: skip
    plc.fill(2000, WORDS)
    for number, quantity in enumerate(quantities(123)):
        first = 10_000 + 300 * number
        plc.command("10", Address=first, Quantity=quantity)
        assert registers(first, quantity) == WORDS[:quantity]
        assert registers(first + quantity, 1) == [HOLDING_REGISTERS[first + quantity]]
    for value in (True, False):
        plc.command("05", Address=40_001, On=value)
        assert coils(40_000, 3) == [True, value, True]
    plc.command("06", Address=65_535, Number=0xBEEF)
    assert registers(65_534, 2) == [HOLDING_REGISTERS[65_534], 0xBEEF]


@pytest.mark.slow
@pytest.mark.parametrize("make", ["pymodbus", "libmodbus"])
def test_with_the_timing_of_a_device(make: str, tmp_path: Path) -> None:
    with bench(make, tmp_path / "real.pcapng", "real") as (plc, _):
        plc.command("03", Address=0, Quantity=125)
        assert plc.words(1000, 125) == HOLDING_REGISTERS[:125]
        plc.fill(2000, WORDS)
        plc.command("10", Address=500, Quantity=123)
        plc.command("03", Address=500, Quantity=123)
        assert plc.words(1000, 123) == WORDS


@pytest.mark.slow
@pytest.mark.parametrize("make", SERVERS)
def test_what_a_server_refuses(make: str, tmp_path: Path) -> None:
    """One register too many: some refuse, some say nothing, some answer with a frame that Modbus does not know.

    Whatever it is, the block says so, writes nothing, and then works on."""
    with bench(make, tmp_path / "refused.pcapng") as (plc, _):
        plc.fill(1000, [0xA5A5] * 130)
        plc.plc.write("Main.Fn03.Reply_Time", 300_000_000)
        plc.plc.write("Main.Quantity", 126)
        plc.plc.write("Main.Cmd03", True)
        plc.until("Main.Fn03.Error OR Main.Fn03.Rcv_Counter = 1")
        assert plc.plc.read("Main.Fn03.Error_Code") in (0x0002, 0x0003, 0x0045, 0x0080, 0x0081)
        assert plc.words(1000, 130) == [0xA5A5] * 130
        plc.plc.write("Main.Cmd03", False)
        run(plc.plc, for_ns=800_000_000)  # libmodbus throws away for half a second what comes after a bad request
        plc.until("Main.conn.ENO")
        plc.plc.write("Main.Fn03.Reply_Time", 5_000_000_000)
        plc.command("03", Address=0, Quantity=125)
        assert plc.words(1000, 126) == [*HOLDING_REGISTERS[:125], 0xA5A5]
