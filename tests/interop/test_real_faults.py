"""Faults on real connections, with other people's servers and clients: what a row does in memory it does over TCP."""

from __future__ import annotations

import queue
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from servers import client, server

from fbvm.base.diagnostics import errors
from fbvm.net.faults import NAMED, Fault, fault
from fbvm.run import Plant, Project, read_project, run_all
from fbvm.wire.link import Peer

pytestmark = pytest.mark.slow

CLIENT = """
PROGRAM Main
VAR conn : MTCP_ETN_Connect; rd : MTCP_ETN_Fn03; done : BOOL; END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
    rd(EN := conn.ENO, Register_Address := 5, Register_Qty := 2, RespData_DM := 200, Cmd_Read := conn.ENO, SlaveID := 1);
    done := rd.Rcv_Counter = 1 OR rd.Error OR conn.Error_Code <> 0;
END_PROGRAM
"""
PLANT = """
run = {{net = "{net}", for = "{most}"}}
[[server]]
address = "192.168.250.1:502"
host = "127.0.0.1:{port}"
[plc.pump]
sources = ["client.st"]
engine = "{engine}"
pace = "event"
until = "Main.done"
set = [{{name = "Main.rd.Reply_Time", value = "T#{reply}"}}]
[[plc.pump.unit]]
address = "192.168.250.21"
[[fault]]
{fault}
"""
OK = ("until", [1005, 1006], 0, 0)
SILENT = ("until", [0, 0], 0, 0x80)
KINDS = {
    "slow": ('latency = "20ms"', OK),
    "unsteady": ('jitter = "30ms"', OK),
    "cut": ("segment_bytes = 3", OK),
    "dripping": ('gap = "4ms"', OK),
    "joined": ('join = "50ms"', OK),
    "doubled": ("duplicate_percent = 100", OK),
    "lossy": ("lose_percent = 100", SILENT),
    "refused": ("", ("until", [0, 0], 0x4A, 0)),
    "unreachable": ("", ("until", [0, 0], 0x51, 0)),
    "interrupted": ("reset_after_bytes = 16", ("until", [0, 0], 0, 0x4B)),
    "silent": ("", ("max", [0, 0], 0, 0)),
    "reset": ('from = "0s"', None),
}
"""Each kind: the keys beside it, and the end of the run, the words, the codes of the connection and of the command."""


def ended(
    folder: Path, net: str, port: int, engine: str, rows: str, most: str = "10s", reply: str = "5s"
) -> tuple[str, object, object, object]:
    (folder / "client.st").write_text(CLIENT, encoding="utf-8")
    text = PLANT.format(net=net, port=port, engine=engine, fault=rows, most=most, reply=reply)
    (folder / "fbvm.toml").write_text(text, encoding="utf-8")
    project = read_project(folder / "fbvm.toml")
    assert isinstance(project, Project), [found.render() for found in project]
    plant = Plant(project)
    assert not errors(plant.diagnostics)
    try:
        run_all(plant.runs)
        plc = plant.runs[0].plc
        return plant.runs[0].reason, plc.read("D200..D201"), plc.read("Main.conn.Error_Code"), plc.read("Main.rd.Error_Code")
    finally:
        plant.close()


def test_every_kind_is_tried() -> None:
    assert set(KINDS) == set(NAMED)


@pytest.mark.parametrize(("make", "engine"), [("pymodbus", "python"), ("libmodbus", "native")])
def test_a_kind_does_over_tcp_what_it_does_in_memory(make: str, engine: str, tmp_path: Path) -> None:
    with server(make) as port:
        for kind, (keys, expected) in KINDS.items():
            rows = f'kind = "{kind}"\npeer = "192.168.250.1:502"\n{keys}'
            most = "300ms" if kind in ("silent", "reset") else "10s"
            reply = "300ms" if expected == SILENT else "5s"  # no reply is a matter of time; a loaded host takes time, too
            in_memory = ended(tmp_path, "loop", port, engine, rows, most, reply)
            over_tcp = ended(tmp_path, "tcp", port, engine, rows, most, reply)
            assert over_tcp == in_memory, kind
            assert expected is None or over_tcp == expected, kind
        assert ended(tmp_path, "tcp", port, engine, "silent = true\nuntil_scan = 1")[0] in ("until", "max")
        assert ended(tmp_path, "tcp", port, engine, 'silent = true\npeer = "192.168.250.9:502"') == OK, "another's fault"


# --- doors, switched while the PLC runs -----------------------------------------------------------------------------------

SERVER = """
PROGRAM Main
VAR Level AT D1000 : UINT; Server : ETN_Modbus_Server := (Sockets := 4); END_VAR
    Server();
    Level := 77;
END_PROGRAM
"""
TANK = """
run = {{net = "tcp", for = "60s"}}
[plc.tank]
sources = ["server.st"]
engine = "{engine}"
pace = "event"
[[plc.tank.unit]]
address = "192.168.250.21"
[[door]]
address = "192.168.250.21:502"
bind = "127.0.0.1:0"
"""
DOOR = Peer("192.168.250.21", 502)


@contextmanager
def tank(folder: Path, engine: str) -> Iterator[tuple[Callable[[Fault | None], None], int]]:
    """A server that runs in a thread: a function that switches its fault and waits for ten scans, and its port."""
    (folder / "server.st").write_text(SERVER, encoding="utf-8")
    (folder / "fbvm.toml").write_text(TANK.format(engine=engine), encoding="utf-8")
    project = read_project(folder / "fbvm.toml")
    assert isinstance(project, Project)
    plant = Plant(project)
    assert not errors(plant.diagnostics)
    plc, ends, scans = plant.runs[0].plc, threading.Event(), queue.SimpleQueue[None]()
    wanted: list[Fault | None] = []

    def watch(_: object) -> None:
        scans.put(None)
        if wanted:
            while not scans.empty():
                scans.get()
            row = wanted.pop()
            plant.network.faults[:] = [row] if row else []
        if ends.is_set():
            raise KeyboardInterrupt

    def switch(row: Fault | None) -> None:
        wanted.append(row)
        while wanted:
            time.sleep(0.001)
        for _ in range(10):
            scans.get(timeout=20)

    plc.watchers.append(watch)
    thread = threading.Thread(target=run_all, args=(plant.runs,))
    thread.start()
    try:
        yield switch, plant.doors[DOOR].port
    finally:
        ends.set()
        thread.join(20)
        plant.close()


def asked(port: int, timeout_s: float = 5) -> bytes:
    """What the server replies to a read of D1000, b"" for a timeout."""
    with socket.create_connection(("127.0.0.1", port), timeout_s) as sock:
        sock.sendall(bytes.fromhex("0001 0000 0006 01 03 03E8 0001"))
        reply = b""
        try:
            while len(reply) < 11 and (data := sock.recv(99)):
                reply += data
        except TimeoutError:
            return b""
        return reply


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_door_under_faults_that_are_switched(engine: str, tmp_path: Path) -> None:
    right = bytes.fromhex("0001 0000 0005 01 03 02 004D")
    with tank(tmp_path, engine) as (switch, port):
        for _ in range(200):
            try:
                assert asked(port) == right
                break
            except ConnectionError:
                time.sleep(0.02)
        for row in (fault("dripping", gap_ns=1_000_000), fault("slow", latency_ns=20_000_000), fault("cut")):
            switch(row)
            assert asked(port) == right, row
        switch(fault("silent", peer=DOOR))
        assert asked(port, 0.3) == b""
        switch(fault("refused", peer=DOOR))
        with pytest.raises(ConnectionRefusedError):
            asked(port)
        switch(fault("interrupted", reset_after_bytes=15))
        with pytest.raises(ConnectionResetError):
            asked(port)
        switch(fault("lossy", lose_percent=100))
        assert asked(port, 0.3) == b""
        switch(None)
        assert asked(port) == right
        with client(port) as there:
            answer = there.read_holding_registers(1000, count=1)  # type: ignore[attr-defined]
            assert answer.registers == [77]
        with socket.create_connection(("127.0.0.1", port), 5) as held:
            held.sendall(bytes.fromhex("0001 0000 0006 01 03 03E8 0001"))
            assert held.recv(99) == right
            switch(fault("reset"))
            with pytest.raises(ConnectionResetError):
                held.recv(1)
        switch(None)
        assert asked(port) == right
