"""Clients of other people that speak FINS, against `fbvm serve --fins`: each as far as it can (see their own limits below).

`fins` takes one receive for a whole message, `fins-driver` has no FINS/TCP, `omron-fins` frames TCP rightly up to 114 words, and
`finscommand` insists on port 9600.  FBVM_FINS_CLIENTS is a folder with one folder a client, filled by `pip install --target`,
and with `node_modules`."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from forked_fbvm import Forked

pytestmark = pytest.mark.slow
HERE = Path(__file__).resolve().parent
CLIENTS = Path(os.environ.get("FBVM_FINS_CLIENTS", "/nowhere"))
NODE = shutil.which("node")
BOUND_S = 60


@contextmanager
def served(*options: str) -> Iterator[int]:
    """The port at which `fbvm serve --fins` runs the program."""
    with Forked(["serve", str(HERE / "fins_program.st"), "--fins", *options], HERE.parents[1]) as process:
        try:
            line = process.stdout.readline()
            found = re.fullmatch(r"FINS: listening on [\d.]+:(\d+), node \w+\n", line)
            assert found, line
            yield int(found[1])
        finally:
            process.terminate()


def conversation(client: str, name: str, host: str, port: int) -> dict[str, object]:
    folder = CLIENTS / client
    if not folder.is_dir():
        pytest.skip(f"{client} is not installed")
    done = subprocess.run([sys.executable, str(HERE / "fins_conversations.py"), name, host, str(port)], capture_output=True,
                          text=True, timeout=BOUND_S, env={**os.environ, "PYTHONPATH": str(folder)}, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    made: dict[str, object] = json.loads(done.stdout)
    return made


@pytest.mark.parametrize("name", ["fins_udp", "fins_tcp"])
def test_fins(name: str) -> None:
    with served("--fins-port", "0") as port:
        found = conversation("fins", name, "127.0.0.1", port)
    assert found | {"nodes": None} == {
        "answer": 42, "twice": 3.0, "words": [0x1230, 0x1231, 0x1232], "model": "CJ2M-CPU33-FBVM", "status": "0102",
        "modes": ["0000", "0000"], "nodes": None}  # fmt: skip
    if name == "fins_tcp":
        assert found["nodes"] == [239, 1]


def test_fins_driver() -> None:
    with served("--fins-port", "0") as port:
        found = conversation("fins-driver", "fins_driver", "127.0.0.1", port)
    assert found == {"answer": "002a", "words": "123012311232", "several": ["1230", "1232"], "copied": "abcd0000",
                     "ok": [True] * 7}  # fmt: skip


def test_finscommand() -> None:
    """At an address of its own, since the port is fixed; its node is the last part of that."""
    host = "127.0.0.7"
    for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
        with socket.socket(type=kind) as sock:
            try:
                sock.bind((host, 9600))
            except OSError as error:
                pytest.skip(f"{host}:9600 cannot be used: {error}")
    with served("--fins-bind", host) as port:
        found = conversation("finscommand", "finscommand", host, port)
    assert found == {"words": True, "fixed": "123012311232", "empty": 1980}


@pytest.mark.parametrize("protocol", ["udp", "tcp"])
def test_omron_fins(protocol: str) -> None:
    if NODE is None:
        pytest.skip("node is not installed")
    with served("--fins-port", "0") as port:
        done = subprocess.run([NODE, str(HERE / "fins_conversation.js"), "127.0.0.1", str(port), protocol], capture_output=True,
                              text=True, timeout=BOUND_S, check=False,
                              env={**os.environ, "NODE_PATH": str(CLIENTS / "node_modules")})  # fmt: skip
    if done.returncode == 77:
        pytest.skip("omron-fins is not installed")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    status = found.pop("status")
    assert (status["status"], status["mode"]) == ("RUN", "MONITOR"), status
    assert found == {
        "words": [0x1230, 0x1231, 0x1232], "written": "0000", "answer": 42, "many": "0000", "last": 113, "bit": True,
        "copied": [7, 0], "several": [0x1230, 0x1232], "model": "CJ2M-CPU33-FBVM", "clock": [26, 11, 22, 13, 44],
        "stopped": "0000", "ran": "0000"}  # fmt: skip
