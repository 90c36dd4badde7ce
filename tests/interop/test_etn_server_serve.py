"""`fbvm serve`: the server as a service, from its first line to SIGTERM."""

from __future__ import annotations

import json
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from forked_fbvm import Forked
from received import heard
from test_etn_server import BOUND_S, HOUSE, connected

from fbvm.wire import modbus
from fbvm.wire.modbus import Adu

pytestmark = pytest.mark.slow


class Service:
    def __init__(self, process: Forked, port: int) -> None:
        self.process = process
        self.port = port

    def ask(self, *pdus: bytes) -> list[bytes]:
        """The replies to a new client."""
        with connected(self.port) as sock:
            replies = []
            for pdu in pdus:
                sock.sendall(Adu(1, 1, pdu).to_bytes())
                head = heard(sock, 7)
                replies.append(heard(sock, int.from_bytes(head[4:6], "big") - 1))
            return replies

    def end(self, number: int = signal.SIGTERM) -> tuple[int, str]:
        """Status and what it said on stderr; fails if it takes more than a second, and some for a busy computer."""
        start_s = time.monotonic()
        self.process.send_signal(number)
        _, said = self.process.communicate(timeout=BOUND_S)
        assert time.monotonic() - start_s < 5
        return self.process.wait(), said


@contextmanager
def service(*arguments: str) -> Iterator[Service]:
    with Forked(["serve", "--port", "0", *arguments], HOUSE) as process:
        try:
            line = process.stdout.readline()
            assert line.startswith("listening on "), line + process.communicate()[1]
            yield Service(process, int(line.rpartition(":")[2]))
        finally:
            process.kill()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_serves_until_it_is_told_to_end(number: int) -> None:
    with service() as there:
        assert there.ask(modbus.write_register(7, 9), modbus.read(3, 7, 1)) == [b"\6\0\7\0\x09", b"\3\2\0\x09"]
        held = connected(there.port)
        assert there.end(number) == (0, "")
        assert heard(held, 1) == b"" if number == signal.SIGINT else True
        held.close()
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", there.port), 1)


def test_the_image_is_loaded_saved_at_the_end_and_on_request(tmp_path: Path) -> None:
    path = tmp_path / "image.json"
    path.write_text('{"spaces": {"CIO": [1, 2], "D": [10, 20, 30]}}')
    with service("--image", str(path)) as there:
        replies = there.ask(modbus.read(3, 0, 3), modbus.read(4, 0, 2), modbus.write_register(2, 31))
        assert replies[:2] == [b"\3\6\0\x0a\0\x14\0\x1e", b"\4\4\0\1\0\2"]
        there.process.send_signal(signal.SIGUSR1)
        end_s = time.monotonic() + BOUND_S
        while json.loads(path.read_text())["spaces"]["D"][2] != 31:
            assert time.monotonic() < end_s
        there.ask(modbus.write_coil(0, False))
        assert there.end() == (0, "")
    assert json.loads(path.read_text()) == {"spaces": {"CIO": [0, 2], "D": [10, 20, 31]}}


def test_the_log_says_who_asked_what(tmp_path: Path) -> None:
    path = tmp_path / "requests.jsonl"
    with service("--log", str(path)) as there:
        there.ask(modbus.read(3, 100, 5), modbus.read(3, 0, 0), modbus.write_registers(9, [1, 2]))
        there.end()
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    found = [(row["function"], row["address"], row["count"], row["result"]) for row in rows if row["function"] != 8]
    assert found == [(3, 100, 5, 0), (3, 0, 0, 3), (16, 9, 2, 0)]
    assert all(row["peer"].startswith("127.0.0.1:") and row["scan"] > 0 for row in rows)
    assert abs(rows[-1]["time"] - time.time()) < 60


def test_writes_are_refused_when_it_is_told_so() -> None:
    with service("--read-only", "--fn0f", "--full-dm", "--sockets", "2") as there:
        writes = [modbus.write_register(7, 9), modbus.write_coil(0, True), modbus.write_registers(0, [1]),
                  modbus.write_coils(0, [1])]  # fmt: skip
        assert there.ask(*writes) == [b"\x86\1", b"\x85\1", b"\x90\1", b"\x8f\1"]
        assert there.ask(modbus.read(3, 7, 1)) == [b"\3\2\0\0"]


def test_what_may_be_switched_on() -> None:
    with service("--fn0f", "--full-dm", "--sockets", "2", "--idle", "5s") as there:
        first = connected(there.port)
        assert there.ask(modbus.write_coils(0, [1, 0, 1]), modbus.write_registers(32767, [7])) == [
            b"\x0f\0\0\0\3", b"\x10\x7f\xff\0\1",
        ]  # fmt: skip
        first.close()


def failing(*arguments: str) -> tuple[int, str]:
    with Forked(["serve", *arguments], HOUSE) as process:
        said = process.communicate(BOUND_S)[1]
        return process.wait(), said


def test_a_port_that_is_taken() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        status, said = failing("--port", str(taken.getsockname()[1]))
    assert (status, "cannot be used" in said) == (5, True)


def test_an_address_that_is_none(tmp_path: Path) -> None:
    assert failing("--bind", "nowhere")[0] == 2
    assert failing("--bind", "192.0.2.1", "--port", "0")[0] == 5
    (tmp_path / "bad.json").write_text("{}")
    status, said = failing("--image", str(tmp_path / "bad.json"))
    assert (status, "spaces" in said) == (2, True)
    assert failing("--port", "0", "--log", str(tmp_path / "no" / "log"))[0] == 2


def test_it_says_when_others_can_reach_it() -> None:
    with service("--bind", "0.0.0.0") as there:
        assert there.ask(modbus.read(3, 0, 1)) == [b"\3\2\0\0"]
        assert "Other computers" in there.end()[1]
