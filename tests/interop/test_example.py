"""The shipped example through `fbvm run`, over real TCP, against servers of other people, and what tshark says of it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from servers import SERVERS, client, server
from wireshark import TSHARK, dissected

from fbvm.cli.main import main

HOUSE = Path(__file__).resolve().parents[2]


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
    assert dissected(capture) == (["3", "3", "16", "16", "6", "6"] if TSHARK else [])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["own", "pymodbus"])
def test_the_demo_ends_well(kind: str) -> None:
    result = subprocess.run([sys.executable, "-W", "error", "-m", "fbvm", "demo", "--server", kind], capture_output=True,
                            text=True, cwd=HOUSE, check=False, timeout=60)  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert "Equal on both sides." in result.stdout
    assert result.stdout.count("  =  ") == 21
    assert "differs" not in result.stdout
    assert result.stderr == ""
