"""`fbvm serve` of a program of OpenPLC, read and written by pymodbus under the numbers of OpenPLC's own server."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_etn_server_serve import service

pytestmark = pytest.mark.slow
PROGRAM = """PROGRAM Main
VAR
    lamp AT %QX0.3 : BOOL; speed AT %QW2 : INT; wanted AT %MW5 : INT := 77; total AT %MD3 : DINT := 16#12345678;
    large AT %ML1 : LINT := 16#1122334455667788; level AT %IW1 : UINT := 9; ratio AT %MD9 : REAL := 1.5;
END_VAR
    speed := wanted + 1;
    lamp := wanted > 100;
END_PROGRAM
"""


def test_a_scada_that_talks_to_openplc_reads_the_same(tmp_path: Path) -> None:
    client_module = pytest.importorskip("pymodbus.client")
    program = tmp_path / "plant.st"
    program.write_text(PROGRAM)
    with service(str(program), "--dialect", "matiec", "--sockets", "3") as there, \
            client_module.ModbusTcpClient("127.0.0.1", port=there.port, timeout=10) as client:
        assert client.connect()

        def holding(first: int, count: int = 1) -> list[int]:
            found: list[int] = client.read_holding_registers(first, count=count).registers
            return found

        assert client.read_coils(0, count=8).bits == [False] * 8 and holding(2) == [78] and holding(1024 + 5) == [77]
        assert holding(2048 + 6, 2) == [0x1234, 0x5678] and holding(4096 + 4, 4) == [0x1122, 0x3344, 0x5566, 0x7788]
        assert client.read_input_registers(1, count=1).registers == [9]
        assert client.convert_from_registers(holding(2048 + 18, 2), client.DATATYPE.FLOAT32) == 1.5
        assert not client.write_register(1024 + 5, 200).isError()
        for _ in range(100):
            if holding(2) == [201]:
                break
        assert holding(2) == [201] and client.read_coils(3, count=1).bits[0]
        assert client.read_coils(8190, count=4).exception_code == 2
        assert there.end()[0] == 0
