"""The server program behind real TCP: other people's clients, hostile ones, and what tshark says of it all."""

from __future__ import annotations

import json
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from forked_fbvm import Forked
from received import heard
from wireshark import TSHARK, dissected

from fbvm.wire.modbus import Adu

HOUSE = Path(__file__).resolve().parents[2]
UNIT = "192.168.250.21:502"
BOUND_S = 30.0
MBPOLL = shutil.which("mbpoll")
ECHO = Adu(1, 255, bytes.fromhex("08 00 00 12 34")).to_bytes()

pytestmark = pytest.mark.slow


class Server:
    """`fbvm run examples/server.st` in a process of its own."""

    def __init__(self, process: Forked, port: int) -> None:
        self.process = process
        self.port = port

    def end(self) -> dict[str, Any]:
        """Ctrl-C; the values shown at the end."""
        self.process.send_signal(signal.SIGINT)
        output, _ = self.process.communicate(timeout=BOUND_S)
        values = json.loads(output)["values"]
        assert isinstance(values, dict)
        return values


@contextmanager
def serving(*settings: str, shown: tuple[str, ...] = ("W491..W495",), pcap: Path | None = None) -> Iterator[Server]:
    arguments = [
        "run", "examples/server.st", "--net", "tcp", "--pace", "event", "--for", "300s",
        "--json", "--map", f"{UNIT}=127.0.0.1:0", *(part for one in settings for part in ("--set", one)),
        *(part for one in shown for part in ("--show", one)), *(["--pcap", str(pcap)] if pcap else []),
    ]  # fmt: skip
    with Forked(arguments, HOUSE) as process:
        try:
            line = process.stderr.readline()
            assert line.startswith(UNIT), line + process.stderr.read()
            yield Server(process, int(line.rpartition(":")[2]))
        finally:
            process.kill()


def connected(port: int) -> socket.socket:
    """A connection that the server has accepted and answered on; until it listens, others are refused."""
    end_s = time.monotonic() + BOUND_S
    while True:
        sock = socket.socket()
        sock.settimeout(BOUND_S)
        try:
            sock.connect(("127.0.0.1", port))
            sock.sendall(ECHO)
            if heard(sock, len(ECHO)) == ECHO:
                return sock
        except OSError:
            pass
        sock.close()
        assert time.monotonic() < end_s, "it does not serve any more"


def settled(port: int) -> None:
    """Wait until the server listens, and leave politely."""
    connected(port).close()


def reached(connect: Callable[[], bool]) -> None:
    """Connect as soon as the server's one socket is open again; until then a connection is refused."""
    time_limit = time.monotonic() + BOUND_S
    while not connect():
        assert time.monotonic() < time_limit, "the server does not listen any more"


# --- other people's clients -------------------------------------------------------------------------------------------


def by_pymodbus(port: int) -> None:
    from pymodbus.client import ModbusTcpClient

    with ModbusTcpClient("127.0.0.1", port=port, timeout=BOUND_S) as client:
        reached(client.connect)
        assert not client.write_registers(1000, list(range(100, 223))).isError()
        assert client.read_holding_registers(1000, count=123).registers == list(range(100, 223))
        assert not client.write_register(2000, 0x3AC5).isError()
        assert client.read_holding_registers(2000, count=1).registers == [0x3AC5]
        assert not client.write_coil(34, True).isError()
        assert client.read_coils(32, count=8).bits == [False, False, True] + 5 * [False]
        assert client.read_discrete_inputs(34, count=1).bits[0] is True
        assert client.read_input_registers(2, count=2).registers == [4, 0]
        assert len(client.read_coils(0, count=2000).bits) == 2000
        assert client.diag_query_data(b"\xa5\x37").message == b"\xa5\x37"
        assert client.write_coils(20, [True] * 10).exception_code == 1
        assert client.read_holding_registers(32767, count=2).exception_code == 2
        assert client.read_input_registers(5801, count=1).exception_code == 2
        assert client.mask_write_register(address=4, and_mask=1, or_mask=2).exception_code == 1


def by_pymodbustcp(port: int) -> None:
    module = pytest.importorskip("pyModbusTCP.client")
    client = module.ModbusClient("127.0.0.1", port, timeout=BOUND_S, auto_open=True)
    reached(client.open)
    assert client.write_multiple_registers(1000, list(range(123)))
    assert client.read_holding_registers(1000, 123) == list(range(123))
    assert client.write_single_register(2000, 7)
    assert client.write_single_coil(34, True)
    assert client.read_coils(32, 3) == [False, False, True]
    assert client.read_discrete_inputs(32, 3) == [False, False, True]
    assert client.read_input_registers(2, 1) == [4]
    assert client.write_multiple_coils(20, [True]) is False
    assert client.last_except == 1
    client.close()


def by_umodbus(port: int) -> None:
    tcp = pytest.importorskip("umodbus.client.tcp")
    with socket.create_connection(("127.0.0.1", port), BOUND_S) as sock:
        def ask(adu: bytes) -> Any:
            return tcp.send_message(adu, sock)

        assert ask(tcp.write_multiple_registers(1, 1000, [1, 2, 3])) == 3
        assert ask(tcp.read_holding_registers(1, 1000, 3)) == [1, 2, 3]
        assert ask(tcp.write_single_register(1, 2000, 0x3AC5)) == 0x3AC5
        assert ask(tcp.write_single_coil(1, 34, 1)) == 1
        assert ask(tcp.read_coils(1, 32, 3)) == [0, 0, 1]
        assert ask(tcp.read_discrete_inputs(1, 32, 3)) == [0, 0, 1]
        assert ask(tcp.read_input_registers(1, 2, 1)) == [4]


def mbpoll(port: int, *arguments: str) -> str:
    command = [str(MBPOLL), "-m", "tcp", "-p", str(port), "-a", "1", "-0", "-1", *arguments]
    end_s = time.monotonic() + BOUND_S
    while True:  # each call is a new client, and the server may just be opening its socket again
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=BOUND_S)
        if "Connection" not in done.stderr or time.monotonic() > end_s:
            return done.stdout + done.stderr


def by_mbpoll(port: int) -> None:
    """libmodbus, underneath."""
    if not MBPOLL:
        pytest.skip("mbpoll is not installed")
    host = "127.0.0.1"
    assert "Written 3 references" in mbpoll(port, "-t", "4", "-r", "1000", host, "1", "2", "3")
    assert "[1002]: \t3" in mbpoll(port, "-t", "4", "-r", "1000", "-c", "3", host)
    assert "Written 1 references" in mbpoll(port, "-t", "4", "-r", "2000", host, "15045")
    assert "Written 1 references" in mbpoll(port, "-t", "0", "-r", "34", host, "1")
    assert "[34]: \t1" in mbpoll(port, "-t", "0", "-r", "32", "-c", "3", host)
    assert "[34]: \t1" in mbpoll(port, "-t", "1", "-r", "34", "-c", "1", host)
    assert "[2]: \t4" in mbpoll(port, "-t", "3", "-r", "2", "-c", "1", host)
    assert "Illegal function" in mbpoll(port, "-t", "0", "-r", "0", host, "1", "1")
    assert "Illegal data address" in mbpoll(port, "-t", "3", "-r", "5801", "-c", "1", host)


CLIENTS = {"pymodbus": by_pymodbus, "pyModbusTCP": by_pymodbustcp, "uModbus": by_umodbus, "mbpoll": by_mbpoll}


@pytest.mark.parametrize("name", CLIENTS)
def test_a_client_of_other_people(name: str, tmp_path: Path) -> None:
    if name == "pymodbus":
        pytest.importorskip("pymodbus")
    capture = tmp_path / "server.pcapng"
    with serving(shown=("CIO 2", "W493", "W494", "W495"), pcap=capture) as server:
        settled(server.port)
        connected(server.port).close()
        time_limit = time.monotonic() + BOUND_S
        while True:
            try:
                CLIENTS[name](server.port)
                break
            except OSError:  # the socket is just being opened again
                assert time.monotonic() < time_limit
        values = server.end()
    assert values["CIO 2"] == 4
    assert values["W493"] > 7
    assert (values["W494"], values["W495"]) == (0, 0)
    assert len(dissected(capture, with_resets=True)) > 10 or not TSHARK


# --- several at once, and hostile ones --------------------------------------------------------------------------------


def test_eight_clients_at_once() -> None:
    with serving("Main.Server.Sockets=8") as server:
        clients = [connected(server.port) for _ in range(8)]
        for round_ in range(20):
            for number, sock in enumerate(clients):
                sock.sendall(Adu(round_, number, b"\3\0\0\0\x7d").to_bytes())
            for number, sock in enumerate(clients):
                assert heard(sock, 259) == Adu(round_, number, b"\3\xfa" + bytes(250)).to_bytes()
        for sock in clients:
            sock.close()
        settled(server.port)
        assert server.end()["W491..W495"][3:] == [0, 0]


def test_pipelines_bytes_one_by_one_and_half_closed_clients() -> None:
    with serving() as server:
        with connected(server.port) as sock:
            sock.sendall(300 * ECHO)
            assert heard(sock, 300 * len(ECHO)) == 300 * ECHO
            for byte in ECHO:
                sock.sendall(bytes((byte,)))
            assert heard(sock, len(ECHO)) == ECHO
            sock.sendall(40 * ECHO)
            sock.shutdown(socket.SHUT_WR)
            assert heard(sock, 40 * len(ECHO)) == 40 * ECHO
        settled(server.port)
        assert server.end()["W491..W495"][3:] == [0, 0]


def reset(sock: socket.socket) -> None:
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    sock.close()


@pytest.mark.parametrize("sockets", [1, 3])
def test_hostile_clients(sockets: int) -> None:
    """Each leaves in its own rude way; the server goes on, and no word has changed."""
    trash = [
        b"", b"\0", ECHO[:6], ECHO[:7], b"\0\1\0\0\0\0", b"\0\1\0\0\0\1\xff", b"\0\1\0\0\0\xff" + bytes(300),
        b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"\xff" * 5000, bytes(5000), ECHO * 500,
        b"\0\1\0\7\0\6\xff\6\0\0\x55\x55",
        b"\0\1\0\0\0\6\xff\6\0\0\x55", Adu(1, 1, b"\x10\0\0\0\1\3\x55\x55").to_bytes(), b"\x16\3\1\0\xa5\1\0\0",
    ]  # fmt: skip
    shown = ("W491..W495", "D0..D9", "CIO 0..CIO 9")
    with serving(f"Main.Server.Sockets={sockets}", "Main.Server.Idle_Time=1s", shown=shown) as server:
        for data in trash:
            for leave in (socket.socket.close, reset):
                sock = connected(server.port)
                sock.sendall(data)
                leave(sock)
        for _ in range(3):
            silent = connected(server.port)
            silent.sendall(ECHO[:5])
            settled(server.port)
            silent.close()
        settled(server.port)
        values = server.end()
    assert values["D0..D9"] == 10 * [0]
    assert values["CIO 0..CIO 9"] == 10 * [0]


def test_two_hundred_connections_and_many_connects() -> None:
    with serving() as server:
        first = connected(server.port)
        crowd = []
        for _ in range(200):
            sock = socket.socket()
            sock.setblocking(False)
            sock.connect_ex(("127.0.0.1", server.port))
            crowd.append(sock)
        first.sendall(ECHO)
        assert heard(first, len(ECHO)) == ECHO
        for sock in (*crowd, first):
            sock.close()
        for _ in range(1000):
            sock = socket.socket()
            sock.connect_ex(("127.0.0.1", server.port))
            sock.close()
        settled(server.port)
        assert server.process.poll() is None
        handles = list(Path(f"/proc/{server.process.pid}/fd").iterdir())
        assert len(handles) < 40


def test_the_client_program_against_the_server_program_in_two_processes() -> None:
    with serving("D1000..D1002=1,2,3") as server:
        settled(server.port)
        command = [
            sys.executable, "-m", "fbvm", "run", "examples/client.st", "--net", "tcp", "--until", "Main.Replies >= 3",
            "--max", "20s", "--json", "--map", f"192.168.250.1:502=127.0.0.1:{server.port}", "--show", "D0..D2",
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, cwd=HOUSE, check=True, timeout=60)
        assert json.loads(done.stdout)["values"] == {"D0..D2": [1, 2, 3]}
