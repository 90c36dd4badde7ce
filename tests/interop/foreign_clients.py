"""Modbus TCP clients of other people that all do the same round: write and read what a server has, and say what it refuses.

A round gives its results by name.  A refusal is "exception 1"; a client that cannot do something leaves it out.
"""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).resolve().parent
NODE, MBPOLL = shutil.which("node"), shutil.which("mbpoll")
BOUND_S = 30.0
MISSING = 77
REGISTER, COIL = 100, 40
"""Where the rounds read and write."""
Results = dict[str, Any]

EXPECTED: dict[str, tuple[int, Any]] = {
    "write_registers": (16, True), "read_registers": (3, [11, 22, 33]), "write_register": (6, True),
    "read_again": (3, [11, 44, 33]), "write_coil": (5, True), "read_coils": (1, [False, True, False]),
    "write_coils": (15, True), "read_inputs": (2, [False, False, False]), "read_input_registers": (4, [0, 0, 0]),
}  # fmt: skip
"""Each step: its function code and what a server that has it gives."""


def expected(functions: set[int]) -> Results:
    """The results of a round with a server that has these function codes."""
    found = {name: value if code in functions else "exception 1" for name, (code, value) in EXPECTED.items()}
    if 16 not in functions:
        raise ValueError("the round begins with 16")
    return found


def by_pymodbus(port: int) -> Results:
    module = pytest.importorskip("pymodbus.client")
    with module.ModbusTcpClient("127.0.0.1", port=port, timeout=BOUND_S) as client:
        assert client.connected or client.connect()

        def said(answer: Any, values: str = "") -> Any:
            if answer.isError():
                return f"exception {answer.exception_code}"
            return getattr(answer, values)[:3] if values else True

        return {
            "write_registers": said(client.write_registers(REGISTER, [11, 22, 33])),
            "read_registers": said(client.read_holding_registers(REGISTER, count=3), "registers"),
            "write_register": said(client.write_register(REGISTER + 1, 44)),
            "read_again": said(client.read_holding_registers(REGISTER, count=3), "registers"),
            "write_coil": said(client.write_coil(COIL + 1, True)),
            "read_coils": said(client.read_coils(COIL, count=3), "bits"),
            "write_coils": said(client.write_coils(COIL + 5, [True, False, True])),
            "read_inputs": said(client.read_discrete_inputs(20, count=3), "bits"),
            "read_input_registers": said(client.read_input_registers(150, count=3), "registers"),
        }


def by_pymodbustcp(port: int) -> Results:
    module = pytest.importorskip("pyModbusTCP.client")
    client = module.ModbusClient("127.0.0.1", port, timeout=BOUND_S)
    assert client.open()

    def said(answer: Any) -> Any:
        return answer or f"exception {client.last_except}"

    found = {
        "write_registers": said(client.write_multiple_registers(REGISTER, [11, 22, 33])),
        "read_registers": said(client.read_holding_registers(REGISTER, 3)),
        "write_register": said(client.write_single_register(REGISTER + 1, 44)),
        "read_again": said(client.read_holding_registers(REGISTER, 3)),
        "write_coil": said(client.write_single_coil(COIL + 1, True)),
        "read_coils": said(client.read_coils(COIL, 3)),
        "write_coils": said(client.write_multiple_coils(COIL + 5, [True, False, True])),
        "read_inputs": said(client.read_discrete_inputs(20, 3)),
        "read_input_registers": said(client.read_input_registers(150, 3)),
    }
    client.close()
    return found


def by_umodbus(port: int) -> Results:
    tcp, exceptions = pytest.importorskip("umodbus.client.tcp"), pytest.importorskip("umodbus.exceptions")
    import socket

    with socket.create_connection(("127.0.0.1", port), BOUND_S) as sock:
        def said(adu: bytes, is_read: bool = False) -> Any:
            try:
                answer = tcp.send_message(adu, sock)
            except exceptions.ModbusError as error:
                return f"exception {error.error_code}"
            return answer if is_read else True

        def bits(adu: bytes) -> Any:
            answer = said(adu, True)
            return [bool(bit) for bit in answer] if isinstance(answer, list) else answer

        return {
            "write_registers": said(tcp.write_multiple_registers(1, REGISTER, [11, 22, 33])),
            "read_registers": said(tcp.read_holding_registers(1, REGISTER, 3), True),
            "write_register": said(tcp.write_single_register(1, REGISTER + 1, 44)),
            "read_again": said(tcp.read_holding_registers(1, REGISTER, 3), True),
            "write_coil": said(tcp.write_single_coil(1, COIL + 1, 1)),
            "read_coils": bits(tcp.read_coils(1, COIL, 3)),
            "write_coils": said(tcp.write_multiple_coils(1, COIL + 5, [1, 0, 1])),
            "read_inputs": bits(tcp.read_discrete_inputs(1, 20, 3)),
            "read_input_registers": said(tcp.read_input_registers(1, 150, 3), True),
        }


def by_modbus_tk(port: int) -> Results:
    module = pytest.importorskip("modbus_tk.modbus_tcp")
    from modbus_tk.exceptions import ModbusError  # type: ignore[import-not-found]

    master = module.TcpMaster("127.0.0.1", port, timeout_in_sec=BOUND_S)

    def said(code: int, address: int, count: int, values: Any = 0) -> Any:
        try:
            answer = master.execute(1, code, address, count, output_value=values)
        except ModbusError as error:
            return f"exception {error.get_exception_code()}"
        return True if code > 4 else [bool(bit) for bit in answer] if code < 3 else list(answer)

    with contextlib.ExitStack() as stack:
        stack.callback(master._do_close)  # `close` forgets a connection that could not be opened
        return {
            "write_registers": said(16, REGISTER, 3, [11, 22, 33]), "read_registers": said(3, REGISTER, 3),
            "write_register": said(6, REGISTER + 1, 1, 44), "read_again": said(3, REGISTER, 3),
            "write_coil": said(5, COIL + 1, 1, 1), "read_coils": said(1, COIL, 3),
            "write_coils": said(15, COIL + 5, 3, [1, 0, 1]), "read_inputs": said(2, 20, 3),
            "read_input_registers": said(4, 150, 3),
        }  # fmt: skip


def by_mbpoll(port: int) -> Results:
    """libmodbus, underneath; a call of the program for each step."""
    if not MBPOLL:
        pytest.skip("mbpoll is not installed")

    def said(table: int, address: int, count: int, *values: int) -> Any:
        asked = [str(value) for value in values]
        size = [] if asked else ["-c", str(count)]
        command = [MBPOLL, "-m", "tcp", "-p", str(port), "-a", "1", "-0", "-1", "-t", str(table), "-r", str(address),
                   *size, "127.0.0.1", *asked]  # fmt: skip
        for _ in range(60):  # each call is a new client, and the server may just be opening its socket again
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=BOUND_S)
            if "Connection" not in done.stderr:
                break
        if "Illegal function" in done.stdout + done.stderr:
            return "exception 1"
        if asked:
            return "Written" in done.stdout
        numbers = [int(found) for found in re.findall(r"^\[\d+\]:\s+(\d+)", done.stdout, re.M)]
        return numbers if table > 1 else [bool(number) for number in numbers]

    return {
        "write_registers": said(4, REGISTER, 3, 11, 22, 33), "read_registers": said(4, REGISTER, 3),
        "write_register": said(4, REGISTER + 1, 1, 44), "read_again": said(4, REGISTER, 3),
        "write_coil": said(0, COIL + 1, 1, 1), "read_coils": said(0, COIL, 3),
        "write_coils": said(0, COIL + 5, 3, 1, 0, 1), "read_inputs": said(1, 20, 3), "read_input_registers": said(3, 150, 3),
    }  # fmt: skip


def _by_node(library: str) -> Callable[[int], Results]:
    def ask(port: int) -> Results:
        if not NODE:
            pytest.skip("node is not installed")
        command = [NODE, str(HERE / "node_client.js"), library, str(port), str(REGISTER), str(COIL)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=BOUND_S)
        if done.returncode == MISSING:
            pytest.skip(f"{library} is not installed")
        assert done.returncode == 0, done.stderr
        found: Results = json.loads(done.stdout)
        return found

    return ask


CLIENTS: dict[str, Callable[[int], Results]] = {
    "pymodbus": by_pymodbus, "pyModbusTCP": by_pymodbustcp, "uModbus": by_umodbus, "modbus-tk": by_modbus_tk,
    "mbpoll": by_mbpoll, "jsmodbus": _by_node("jsmodbus"), "modbus-serial": _by_node("modbus-serial"),
}  # fmt: skip
