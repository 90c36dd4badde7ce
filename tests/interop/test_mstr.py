"""MBP_MSTR and the server of its module over real TCP: servers and clients of other people, and what tshark says."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from forked_fbvm import Forked
from servers import SERVERS, client, server
from wireshark import TSHARK, dissected

from fbvm.cli.main import main
from fbvm.wire.modbus import Adu

HOUSE = Path(__file__).resolve().parents[2]
BOUND_S = 30.0
STATION = "192.168.250.22:502"
SERVING = "PROGRAM Main VAR Server : MSTR_Server; END_VAR Server(); END_PROGRAM"

pytestmark = pytest.mark.slow

WITH_23 = [name for name in SERVERS if name not in ("uModbus", "modbus-serial")]
"""Servers that know function 17."""


@pytest.mark.parametrize("make", SERVERS)
def test_the_example_against_servers_of_other_people(make: str, tmp_path: Path) -> None:
    capture = tmp_path / "mstr.pcapng"
    with server(make) as port:
        result = CliRunner().invoke(main, [
            "run", str(HOUSE / "examples" / "mstr.st"), "--net", "tcp", "--pace", "event", "--json",
            "--map", f"192.168.250.1:502=127.0.0.1:{port}", "--until", "Main.Step = Ready OR Main.Step = Failed",
            "--max", "20s", "--pcap", str(capture), "--show", "Main.Step", "--show", "Main.Result", "--show", "%MW120..%MW121",
        ])  # fmt: skip
        assert result.exit_code == 0, result.output
        values = json.loads(result.stdout)["values"]
        with client(port) as asked:
            held = asked.read_holding_registers(100, count=10).registers  # type: ignore[attr-defined]
            total = asked.read_holding_registers(199, count=1).registers  # type: ignore[attr-defined]
    assert held == list(range(1001, 1011))
    if make in WITH_23:
        assert (values["Main.Step"], values["Main.Result"], total) == (4, 0, [10045])
        assert dissected(capture) == (["3", "3", "16", "16", "23", "23"] if TSHARK else [])
    else:
        assert (values["Main.Step"], values["Main.Result"]) == (5, 0x3001)


# --- the server of the module -------------------------------------------------------------------------------------------


class Station:
    """`fbvm run` with the server program, in a process of its own."""

    def __init__(self, process: Forked, port: int) -> None:
        self.process, self.port = process, port

    def end(self) -> dict[str, Any]:
        """A last request ends the run; the values shown at its end."""
        with socket.create_connection(("127.0.0.1", self.port), BOUND_S) as sock:
            sock.sendall(Adu(1, 1, bytes.fromhex("06 0063 1267")).to_bytes())
            output, _ = self.process.communicate(timeout=BOUND_S)
        values = json.loads(output)["values"]
        assert isinstance(values, dict)
        return values


@contextmanager
def serving(folder: Path) -> Iterator[Station]:
    (folder / "server.st").write_text(SERVING)
    arguments = [
        "run", str(folder / "server.st"), "--net", "tcp", "--pace", "event",
        "--until", "%MW100 = 4711", "--max", "300s",
        "--json", "--map", f"{STATION}=127.0.0.1:0", "--pcap", str(folder / "server.pcapng"),
        "--show", "%MW1..%MW3", "--show", "Main.Server.Requests",
    ]  # fmt: skip
    with Forked(arguments, HOUSE) as process:
        try:
            line = process.stderr.readline()
            assert line.startswith(STATION), line + process.stderr.read()
            yield Station(process, int(line.rpartition(":")[2]))
        finally:
            process.kill()


def reached(connect: Callable[[], bool]) -> None:
    """Connect as soon as a session listens."""
    end_s = time.monotonic() + BOUND_S
    while not connect():
        assert time.monotonic() < end_s, "nobody listens"


def by_pymodbus(port: int) -> None:
    from pymodbus.client import ModbusTcpClient

    with ModbusTcpClient("127.0.0.1", port=port, timeout=BOUND_S) as client:
        reached(client.connect)
        assert not client.write_registers(0, [1, 2, 3]).isError()
        assert not client.write_register(1, 7).isError()
        assert client.read_holding_registers(0, count=125).registers[:4] == [1, 7, 3, 0]
        answer = client.readwrite_registers(read_address=0, read_count=3, write_address=0, values=[5])
        assert answer.registers == [5, 7, 3]
        assert client.read_coils(0, count=1).exception_code == 1
        assert client.read_holding_registers(32767, count=1).exception_code == 2


def by_pymodbustcp(port: int) -> None:
    module = pytest.importorskip("pyModbusTCP.client")
    asking = module.ModbusClient("127.0.0.1", port, timeout=BOUND_S)
    reached(asking.open)
    assert asking.write_multiple_registers(0, [5, 7, 3])
    assert asking.read_holding_registers(0, 3) == [5, 7, 3]
    asking.close()


@pytest.mark.parametrize("ask", [by_pymodbus, by_pymodbustcp])
def test_clients_of_other_people(ask: Callable[[int], None], tmp_path: Path) -> None:
    with serving(tmp_path) as station:
        ask(station.port)
        ask(station.port)
        values = station.end()
    assert values["%MW1..%MW3"] == [5, 7, 3]
    assert values["Main.Server.Requests"] > 4
    functions = dissected(tmp_path / "server.pcapng")
    assert "16" in functions or not TSHARK


def test_the_example_against_our_own_server(tmp_path: Path) -> None:
    with serving(tmp_path) as station:
        command = [
            sys.executable, "-m", "fbvm", "run", "examples/mstr.st", "--net", "tcp", "--pace", "event", "--json",
            "--map", f"192.168.250.1:502=127.0.0.1:{station.port}", "--max", "20s", "--show", "Main.Step",
            "--until", "Main.Step = Ready OR Main.Step = Failed", "--pcap", str(tmp_path / "client.pcapng"),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, cwd=HOUSE, check=True, timeout=60)
        assert json.loads(done.stdout)["values"] == {"Main.Step": 4}
        assert station.end()["Main.Server.Requests"] == 4
    exchanged = ["3", "3", "16", "16", "23", "23"] if TSHARK else []
    assert dissected(tmp_path / "client.pcapng") == exchanged
    assert dissected(tmp_path / "server.pcapng")[:6] == exchanged
