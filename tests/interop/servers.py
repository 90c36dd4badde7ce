"""Modbus TCP servers of other people, each in a process of its own, all with the contents of `tables.py`."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from forked_fbvm import Forked

HERE = Path(__file__).resolve().parent
HOUSE = HERE.parents[1]
NODE = shutil.which("node") or "node"
SERVERS = {
    "pymodbus": [sys.executable, "-m", "fbvm", "peer", "--port", "0"],
    "libmodbus": [sys.executable, str(HERE / "libmodbus_server.py")],
    "pyModbusTCP": [sys.executable, str(HERE / "pymodbustcp_server.py")],
    "uModbus": [sys.executable, str(HERE / "umodbus_server.py")],
    "modbus-serial": [NODE, str(HERE / "modbus_serial_server.js")],
}
MISSING = 77
"""Status with which a server says that its library is not installed."""


def _started(command: list[str]) -> Forked | subprocess.Popen[str]:
    is_fbvm = command[:3] == [sys.executable, "-m", "fbvm"]
    return Forked(command[3:], HOUSE) if is_fbvm else subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=HOUSE)


@contextmanager
def server(name: str) -> Iterator[int]:
    """A server of that make; its port.  Skips the test where it is not installed."""
    command = SERVERS[name]
    if shutil.which(command[0]) is None:
        pytest.skip(f"{name} needs {command[0]}, which is not installed")
    with _started(command) as process:
        assert process.stdout is not None
        try:
            line = process.stdout.readline()
            if not line and process.wait() == MISSING:
                pytest.skip(f"{name} is not installed")
            yield int(line.rpartition(":")[2])
        finally:
            process.terminate()


@contextmanager
def client(port: int) -> Iterator[object]:
    """pymodbus's client: asks a server what it holds, independent of anything here."""
    pymodbus = pytest.importorskip("pymodbus.client")
    connected = pymodbus.ModbusTcpClient("127.0.0.1", port=port)
    connected.connect()
    try:
        yield connected
    finally:
        connected.close()
