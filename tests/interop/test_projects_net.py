"""One project file, in memory and over real TCP: the same PLCs, a server of other people, and a PLC that others reach."""

from __future__ import annotations

import json
import socket
import time
from contextlib import nullcontext
from pathlib import Path

import pytest
from click.testing import CliRunner
from servers import server

from fbvm.cli.main import main
from fbvm.run import Plant, Project, read_project, run_all

CLIENT = """
PROGRAM Main
VAR conn : MTCP_ETN_Connect; read : MTCP_ETN_Fn03; done : BOOL; END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := %d, Connect := TRUE);
    read(EN := conn.ENO, Register_Address := 5, Register_Qty := 2, RespData_DM := 200, Cmd_Read := TRUE, SlaveID := 1);
    done := read.Rcv_Counter = 1;
END_PROGRAM
"""
MANY = """
[run]
for = "20s"
[[server]]
address = "192.168.250.1:502"
host = "127.0.0.1:{port}"
[plc.pump]
sources = ["client.st"]
count = 12
pace = "event"
until = "Main.done"
watch = ["D200..D201", "Main.read.Error_Code"]
[[plc.pump.unit]]
address = "192.168.250.21"
"""
PAIR = """
[plc.station]
sources = ["server.st"]
[[plc.station.unit]]
address = "192.168.250.2"
[[door]]
address = "192.168.250.2:502"
host = "127.0.0.1:0"
[plc.panel]
sources = ["client.st"]
until = "Main.done"
watch = ["Main.done", "Main.read.Error_Code"]
[[plc.panel.unit]]
address = "192.168.250.21"
"""


@pytest.mark.slow
@pytest.mark.parametrize(("net", "make"), [("loop", ""), ("tcp", "libmodbus"), ("tcp", "pyModbusTCP")])
def test_many_plcs_read_from_one_server(tmp_path: Path, net: str, make: str) -> None:
    (tmp_path / "client.st").write_text(CLIENT % 1, encoding="utf-8")
    with server(make) if make else nullcontext(0) as port:
        (tmp_path / "fbvm.toml").write_text(MANY.format(port=port), encoding="utf-8")
        result = CliRunner().invoke(main, ["run", str(tmp_path), "--net", net, "--json"])
    assert result.exit_code == 0, result.output
    plcs = json.loads(result.stdout)["plcs"]
    assert len(plcs) == 12
    for plc in plcs.values():
        assert (plc["stopped"], plc["values"]) == ("until", {"D200..D201": [1005, 1006], "Main.read.Error_Code": 0})


@pytest.mark.slow
@pytest.mark.parametrize("net", ["loop", "tcp"])
def test_plcs_talk_to_each_other(tmp_path: Path, net: str) -> None:
    example = Path(__file__).resolve().parents[2] / "examples" / "server.st"
    (tmp_path / "server.st").write_bytes(example.read_bytes())
    (tmp_path / "client.st").write_text(CLIENT % 2, encoding="utf-8")
    (tmp_path / "fbvm.toml").write_text(PAIR, encoding="utf-8")
    project = read_project(tmp_path / "fbvm.toml")
    assert isinstance(project, Project)
    plant = Plant(project, net=net)
    try:
        run_all(plant.runs)
    finally:
        plant.close()
    assert [run.reason for run in plant.runs] == ["until", "until"]
    assert plant.kinds[1].values(plant.runs[1]) == {"Main.done": True, "Main.read.Error_Code": 0}


DOOR = """
[run]
net = "tcp"
[plc.station]
sources = ["server.st"]
[[plc.station.unit]]
address = "192.168.250.2"
[[door]]
address = "192.168.250.2:502"
bind = "127.0.0.1:0"
"""
READ_D5 = bytes.fromhex("0001 0000 0006 01 03 0005 0001")
BOUND_S = 20


@pytest.mark.slow
@pytest.mark.parametrize("backlog", [True, False])
def test_a_door_holds_callers_where_the_project_says_so(tmp_path: Path, backlog: bool) -> None:
    """The second client calls while the unit's only socket serves the first."""
    example = Path(__file__).resolve().parents[2] / "examples" / "server.st"
    (tmp_path / "server.st").write_bytes(example.read_bytes())
    (tmp_path / "fbvm.toml").write_text(DOOR + "backlog = true\n" * backlog, encoding="utf-8")
    project = read_project(tmp_path / "fbvm.toml")
    assert isinstance(project, Project)
    plant = Plant(project)
    try:
        plc = plant.runs[0].plc
        (door,) = plant.doors.values()

        def answer(client: socket.socket) -> bytes:
            client.setblocking(False)
            client.sendall(READ_D5)
            ends_s = time.monotonic() + BOUND_S
            while time.monotonic() < ends_s:
                assert plc.scan(time.monotonic_ns()) is None
                try:
                    return client.recv(99)
                except BlockingIOError:
                    continue
            raise AssertionError("no answer")

        plc.write("D5", 7)
        while not plc.read("CIO 1519.01"):  # passive open
            plc.scan(time.monotonic_ns())
        plc.scan(time.monotonic_ns())
        with socket.create_connection((door.host, door.port), BOUND_S) as first:
            assert answer(first)[-2:] == b"\0\7"
            if not backlog:
                with pytest.raises(ConnectionRefusedError):
                    socket.create_connection((door.host, door.port), BOUND_S)
                return
            second = socket.create_connection((door.host, door.port), BOUND_S)
        with second:
            assert answer(second)[-2:] == b"\0\7"
    finally:
        plant.close()
