"""All server programs behind real TCP: other people's clients, nmap's script, what tshark says, and hostile clients."""

from __future__ import annotations

import contextlib
import json
import random
import shutil
import signal
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from depth import times
from foreign_clients import BOUND_S, CLIENTS, EXPECTED, expected
from forked_fbvm import Forked
from received import heard
from wireshark import TSHARK, dissected

from fbvm.wire.modbus import Adu

HOUSE = Path(__file__).resolve().parents[2]
NMAP = shutil.which("nmap")
MB_TCP = """
PROGRAM Main
VAR Server : MB_TCP_SERVER; Config : TCP_CONNECTCONFIG; Coils : ARRAY[0..99] OF BOOL; Inputs : ARRAY[0..9] OF BYTE;
    Holding, Registers : ARRAY[0..199] OF WORD; END_VAR
    Server(DISCONNECT := FALSE, CONNECT := Config, COIL_DATAAREA := Coils, DISCRETE_DATAAREA := Inputs,
           HOLDING_REG_DATAAREA := Holding, INPUT_REG_DATAAREA := Registers);
END_PROGRAM
"""
MSTR = "PROGRAM Main VAR Server : MSTR_Server; END_VAR Server(Idle_Time := T#2s); END_PROGRAM"

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Kind:
    """A server program, its unit's endpoint, its function codes, and words that a hostile client must not change."""

    program: str
    endpoint: str
    functions: frozenset[int]
    kept: tuple[str, ...]
    settings: tuple[str, ...] = ()


KINDS = {
    "etn_modbus": Kind("", "192.168.250.21:502", frozenset((1, 2, 3, 4, 5, 6, 8, 16)), ("D0..D9", "CIO 0..CIO 9"),
                       ("Main.Server.Idle_Time=2s",)),
    "mbp_mstr": Kind(MSTR, "192.168.250.22:502", frozenset((3, 6, 16, 23)), ("%MW1..%MW9",)),
    "mb_tcp_server": Kind(MB_TCP, "192.168.250.23:502", frozenset((1, 2, 3, 4, 5, 6, 15, 16)),
                          ("Main.Holding[0]", "Main.Holding[199]", "Main.Coils[0]")),
}  # fmt: skip
every_kind = pytest.mark.parametrize("kind", KINDS)


@dataclass
class Server:
    process: Forked
    port: int
    output: str = ""

    def end(self) -> dict[str, Any]:
        """Ctrl-C; the values shown at the end."""
        self.process.send_signal(signal.SIGINT)
        output, _ = self.process.communicate(timeout=BOUND_S)
        values = json.loads(output)["values"]
        assert isinstance(values, dict)
        return values

    def size(self) -> tuple[int, int]:
        """KiB in memory, open handles."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        resident = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))
        return resident, len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))


def assert_untouched(kind: str, values: dict[str, Any]) -> None:
    """The kept words were all shown at the end, and are what they were at power-on."""
    assert len(values) == len(KINDS[kind].kept)
    assert [value for value in values.values() if value not in (0, False, 10 * [0], 9 * [0])] == []


@contextmanager
def serving(name: str, folder: Path, capture: bool = False, engine: str = "auto") -> Iterator[Server]:
    kind = KINDS[name]
    file = HOUSE / "examples" / "server.st"
    if kind.program:
        file = folder / "server.st"
        file.write_text(kind.program)
    arguments = [
        "run", str(file), "--net", "tcp", "--pace", "event", "--for", "600s", "--json",
        "--engine", engine,
        "--map", f"{kind.endpoint}=127.0.0.1:0", *(part for one in kind.settings for part in ("--set", one)),
        *(part for one in kind.kept for part in ("--show", one)),
        *(["--pcap", str(folder / "server.pcapng")] if capture else []),
    ]  # fmt: skip
    with Forked(arguments, HOUSE) as process:
        try:
            line = process.stderr.readline()
            assert line.startswith(kind.endpoint), line + process.stderr.read()
            server = Server(process, int(line.rpartition(":")[2]))
            settled(name, server.port)
            yield server
        finally:
            process.kill()


def ask(kind: str) -> bytes:
    """A request that the server answers without changing anything."""
    return Adu(1, 1, b"\3\0\0\0\1").to_bytes()


def connected(kind: str, port: int) -> socket.socket:
    """A connection on which the server has answered; until it listens, others are refused."""
    end_s = time.monotonic() + BOUND_S
    while True:
        sock = socket.socket()
        sock.settimeout(BOUND_S)
        try:
            sock.connect(("127.0.0.1", port))
            sock.sendall(ask(kind))
            if len(heard(sock, 11)) == 11:
                return sock
        except OSError:
            pass
        sock.close()
        assert time.monotonic() < end_s, "it does not serve any more"


def settled(kind: str, port: int) -> None:
    """Wait until the server answers, and leave politely."""
    connected(kind, port).close()


# --- other people's clients -------------------------------------------------------------------------------------------


@dataclass
class Watched:
    """A server for all clients, and how many of them have made their round."""

    kind: str
    port: int
    rounds: int = 0


@pytest.fixture(scope="module", params=KINDS)
def watched(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    """In the end tshark looks at all that the clients said."""
    folder = tmp_path_factory.mktemp("watched")
    with serving(request.param, folder, capture=True) as server:
        watched = Watched(request.param, server.port)
        yield watched
        server.end()
    frames = len(dissected(folder / "server.pcapng", with_resets=True))
    assert frames >= 2 * (1 + watched.rounds * len(EXPECTED)) or not TSHARK, "one question when it began to listen"


@pytest.mark.parametrize("name", CLIENTS)
def test_a_client_of_other_people(watched: Watched, name: str) -> None:
    end_s = time.monotonic() + BOUND_S
    while True:
        try:
            found = CLIENTS[name](watched.port)
            break
        except (OSError, AssertionError):  # the socket is just being opened again
            assert time.monotonic() < end_s
    assert found == expected(set(KINDS[watched.kind].functions))
    watched.rounds += 1


@every_kind
def test_nmap_finds_a_modbus_server(kind: str, tmp_path: Path) -> None:
    if not NMAP:
        pytest.skip("nmap is not installed")
    with serving(kind, tmp_path) as server:
        # With + the script runs for any port.
        command = [NMAP, "-sT", "-Pn", "-n", "-p", str(server.port), "--script", "+modbus-discover", "127.0.0.1"]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
        assert "modbus-discover" in done.stdout, done.stdout
        assert "ILLEGAL FUNCTION" in done.stdout.upper(), done.stdout
        settled(kind, server.port)


# --- hostile clients --------------------------------------------------------------------------------------------------


def random_frame(dice: random.Random, functions: frozenset[int]) -> bytes:
    """Bytes that may be a frame: right and wrong headers, any function code, any length.  Writes are never complete."""
    code = dice.choice((*functions, dice.randrange(256)))
    body = dice.randbytes(dice.choice((0, 1, 2, 3, 4, 5, 7, 12, 60, 252)))
    if code in (5, 6, 15, 16, 23):
        body = body[:3]
    pdu = bytes((code,)) + body
    length = dice.choice((len(pdu) + 1,) * 6 + (0, 1, 2, 255, 65535, dice.randrange(65536)))
    protocol = dice.choice((0,) * 9 + (dice.randrange(65536),))
    head = dice.randrange(65536).to_bytes(2, "big") + protocol.to_bytes(2, "big") + length.to_bytes(2, "big")
    return head + bytes((dice.randrange(255),)) + pdu


@every_kind
def test_twenty_thousand_random_frames(kind: str, tmp_path: Path) -> None:
    """No word changes, memory and handles do not grow, and the server goes on."""
    dice = random.Random(7)
    with serving(kind, tmp_path, engine="python") as server:  # machine code takes its memory when it comes
        sizes = []
        sent = 0
        while sent < times(20_000, 5):
            sock = connected(kind, server.port)
            burst = dice.choice((1, 3, 40, 400))
            data = b"".join(random_frame(dice, KINDS[kind].functions) for _ in range(burst))
            sent += burst
            try:
                sock.settimeout(2)
                sock.sendall(data)
                if dice.random() < 0.5:
                    sock.shutdown(socket.SHUT_WR)
                    while sock.recv(65536):
                        pass
            except OSError:
                pass
            sock.close()
            sizes.append(server.size())
        settled(kind, server.port)
        values = server.end()
    assert_untouched(kind, values)
    quarter = len(sizes) // 4
    assert sizes[-1][0] - sizes[quarter][0] < 4096, "KiB"
    assert max(handles for _, handles in sizes) < 40


ASK = ask("")
TRASH = [
    b"", b"\0", ASK[:6], ASK[:7], ASK[:11], b"\0\1\0\0\0\0", b"\0\1\0\0\0\1\xff", b"\0\1\0\0\0\xff" + bytes(300),
    b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"\xff" * 5000, bytes(5000), ASK * 500, b"\0\1\0\7\0\6\1\6\0\0\x55\x55",
    b"\0\1\0\0\0\6\1\6\0\0\x55", Adu(1, 1, b"\x10\0\0\0\1\3\x55\x55").to_bytes(), b"\x16\3\1\0\xa5\1\0\0",
    b"".join(Adu(code, 1, bytes((code,))).to_bytes() for code in range(256)),
    Adu(1, 1, b"\x10\0\0\0\x7c\xf6" + 246 * b"\x55").to_bytes(), Adu(1, 1, b"\6\xff\xff\x55\x55").to_bytes(),
]  # fmt: skip


def reset(sock: socket.socket) -> None:
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    sock.close()


@every_kind
def test_rude_clients_change_nothing(kind: str, tmp_path: Path) -> None:
    """Each leaves in its own way; some are silent for longer than a server waits."""
    with serving(kind, tmp_path) as server:
        for data in TRASH:
            for leave in (socket.socket.close, reset):
                sock = connected(kind, server.port)
                with contextlib.suppress(OSError):
                    sock.sendall(data)
                leave(sock)
        if kind != "mb_tcp_server":  # whose sheet knows no time limit
            silent = connected(kind, server.port)
            silent.sendall(ASK[:5])
            settled(kind, server.port)
            silent.close()
        settled(kind, server.port)
        values = server.end()
    assert_untouched(kind, values)


@every_kind
def test_pipelines_single_bytes_and_half_closed_clients(kind: str, tmp_path: Path) -> None:
    reply = Adu(1, 1, b"\3\2\0\0").to_bytes()
    with serving(kind, tmp_path) as server, connected(kind, server.port) as sock:
        sock.sendall(300 * ASK)
        assert heard(sock, 300 * len(reply)) == 300 * reply
        for byte in ASK:
            sock.sendall(bytes((byte,)))
        assert heard(sock, len(reply)) == reply
        sock.sendall(40 * ASK)
        sock.shutdown(socket.SHUT_WR)
        assert heard(sock, 40 * len(reply)) == 40 * reply


@every_kind
def test_a_crowd(kind: str, tmp_path: Path) -> None:
    """Two hundred connections at once, then a thousand in turn: the one that is served goes on, and no handle is kept."""
    with serving(kind, tmp_path) as server:
        first = connected(kind, server.port)
        crowd = []
        for _ in range(200):
            sock = socket.socket()
            sock.setblocking(False)
            sock.connect_ex(("127.0.0.1", server.port))
            crowd.append(sock)
        first.sendall(ASK)
        assert len(heard(first, 11)) == 11
        for sock in (*crowd, first):
            sock.close()
        for _ in range(times(1000, 5)):
            with socket.socket() as sock:
                sock.connect_ex(("127.0.0.1", server.port))
        settled(kind, server.port)
        assert server.size()[1] < 40
