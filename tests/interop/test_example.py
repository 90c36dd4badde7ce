"""The shipped example through `fbvm run`, over real TCP, against servers of other people, and what tshark says of it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main

HOUSE = Path(__file__).resolve().parents[2]
TSHARK = shutil.which("tshark")
SERVERS = {
    "pymodbus": [sys.executable, "-m", "fbvm", "peer", "--port", "0"],
    "libmodbus": [sys.executable, str(Path(__file__).with_name("libmodbus_server.py"))],
}


@contextmanager
def server(name: str) -> Iterator[int]:
    """A server of that make in a process of its own; its port."""
    with subprocess.Popen(SERVERS[name], stdout=subprocess.PIPE, text=True, cwd=HOUSE) as process:
        assert process.stdout is not None
        try:
            line = process.stdout.readline()
            if not line and process.wait() == 77:
                pytest.skip("libmodbus is not installed")
            yield int(line.rpartition(":")[2])
        finally:
            process.terminate()


@contextmanager
def client(port: int) -> Iterator[object]:
    pymodbus = pytest.importorskip("pymodbus.client")
    connected = pymodbus.ModbusTcpClient("127.0.0.1", port=port)
    connected.connect()
    try:
        yield connected
    finally:
        connected.close()


@pytest.mark.slow
@pytest.mark.parametrize("quantity", [1, 10, 125])
@pytest.mark.parametrize("make", SERVERS)
def test_the_example_moves_the_right_words(make: str, quantity: int, tmp_path: Path) -> None:
    written = min(quantity, 123)
    capture = tmp_path / "example.pcapng"
    with server(make) as port:
        result = CliRunner().invoke(main, [
            "run", str(HOUSE / "examples" / "demo.st"), "--net", "tcp", "--pace", "event", "--json",
            "--map", f"192.168.250.1:502=127.0.0.1:{port}", "--until", "Main.Done OR Main.Error_Code <> 0",
            "--max", "20s", "--set", f"Main.Quantity={quantity}", "--pcap", str(capture),
            "--show", f"D200..D{199 + quantity}", "--show", "Main.Error_Code",
        ])  # fmt: skip
        assert result.exit_code == 0, result.output
        values = json.loads(result.stdout)["values"]
        with client(port) as asked:
            held = [asked.read_holding_registers(5000, count=written).registers,  # type: ignore[attr-defined]
                    asked.read_holding_registers(4999, count=1).registers]  # type: ignore[attr-defined]  # fmt: skip
    assert values == {f"D200..D{199 + quantity}": list(range(1000, 1000 + quantity)), "Main.Error_Code": 0}
    assert held == [list(range(1001, 1001 + written)), [written]]
    if TSHARK:
        assert dissected(capture) == ["3", "3", "16", "16", "6", "6"]


def dissected(capture: Path) -> list[str]:
    """Function codes of the Modbus frames that tshark finds, if it has nothing to say against the capture."""
    def tshark(*arguments: str) -> list[str]:
        command = [str(TSHARK), "-r", str(capture), "-o", "tcp.check_checksum:TRUE", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()

    assert tshark("-Y", "_ws.malformed || tcp.checksum.status == 0 || _ws.expert.severity >= 6291456") == []
    return tshark("-Y", "modbus", "-T", "fields", "-e", "modbus.func_code")


@pytest.mark.slow
def test_the_demo_ends_well() -> None:
    result = subprocess.run([sys.executable, "-W", "error", "-m", "fbvm", "demo"], capture_output=True, text=True,
                            cwd=HOUSE, check=False, timeout=60)  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert "Equal on both sides." in result.stdout
    assert result.stdout.count("  =  ") == 21
    assert "differs" not in result.stdout
    assert result.stderr == ""
