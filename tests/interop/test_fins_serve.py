"""`fbvm serve --fins` and projects with FINS over the host's UDP and TCP: ports, warnings, who may do what."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from forked_fbvm import Forked

from fbvm.net.tcp import TcpNetwork
from fbvm.run import run_all
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project
from fbvm.wire.fins.frames import Address, Command, Header, Response, parse_frame
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapKind

pytestmark = pytest.mark.slow
HERE = Path(__file__).resolve().parent
BOUND_S = 30


class Served:
    def __init__(self, process: Forked, port: int) -> None:
        self.process, self.port = process, port

    def ask(self, code: int, parameters: str = "", node: int = 1, unit: int = 0) -> str:
        """The end code of a command by UDP."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.settimeout(BOUND_S)
            header = Header(Address(0, node, unit), Address(0, 25), 1)
            sock.sendto(Command(header, code, bytes.fromhex(parameters)).to_bytes(), ("127.0.0.1", self.port))
            answer = parse_frame(sock.recv(2012))
        assert isinstance(answer, Response)
        return f"{answer.end_code:04X}"

    def end(self) -> tuple[int, str]:
        """Status, and what it said on stderr."""
        self.process.terminate()
        said = self.process.communicate(timeout=BOUND_S)[1]
        return self.process.wait(), said


@contextmanager
def served(*options: str) -> Iterator[Served]:
    with Forked(["serve", "--port", "0", "--fins", "--fins-port", "0", *options], HERE.parents[1]) as process:
        try:
            found = re.fullmatch(r"FINS: listening on [\d.]+:(\d+), node (?:any|\d+)\n", process.stdout.readline())
            assert found, process.communicate()
            yield Served(process, int(found[1]))
        finally:
            process.kill()


def test_on_this_computer_everything_is_allowed() -> None:
    with served() as there:
        assert there.ask(0x0102, "82 0064 00 0001 0007") == "0000"
        assert there.ask(0x0402) == there.ask(0x0401) == there.ask(0x0601) == "0000"
        assert there.ask(0x0601, node=2) == "1005"
        assert there.end() == (0, "")


def test_read_only_is_for_fins_too_also_with_a_program_of_ones_own() -> None:
    with served("--read-only", str(HERE / "fins_program.st")) as there:
        assert there.ask(0x0101, "82 0064 00 0001") == "0000"
        assert there.ask(0x0102, "82 0064 00 0001 0007") == there.ask(0x0402) == "2102"


def test_where_others_reach_it_there_is_a_warning_and_no_mode_to_be_changed() -> None:
    with served("--fins-bind", "0.0.0.0") as there:
        assert there.ask(0x0102, "82 0064 00 0001 0007", node=77) == "0000"
        assert there.ask(0x0402) == there.ask(0x0403, unit=0x10) == "2102"
        status, said = there.end()
    assert status == 0
    assert "Other computers can reach 0.0.0.0" in said and "--fins-control" in said
    with served("--fins-bind", "0.0.0.0", "--fins-control", "--fins-node", "7") as there:
        assert (there.ask(0x0402, node=7), there.ask(0x0402, node=8)) == ("0000", "1005")
        assert "stop the PLC" in there.end()[1]


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_DGRAM])
def test_a_port_in_use_is_status_5(kind: int) -> None:
    with socket.socket(type=kind) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with Forked(["serve", "--port", "0", "--fins", "--fins-port", str(port)]) as process:
            said = process.communicate(BOUND_S)[1]
            assert process.wait() == 5
    assert said == f"127.0.0.1:{port} cannot be used: somebody else listens there\n"


def test_an_address_that_is_none_is_status_2() -> None:
    with Forked(["serve", "--fins", "--fins-bind", "plc"]) as process:
        said = process.communicate(BOUND_S)[1]
        assert process.wait() == 2
    assert "--fins-bind plc is not an IPv4 address" in said


PROJECT = """
[run]
net = "tcp"
{door}
[plc.tank]
sources = ["tank.st"]
until = "D200 = 1234"
[[plc.tank.unit]]
address = "192.168.250.2"
fins = true
{more}
[plc.desk]
sources = ["desk.st"]
until = "D110 = 4321"
[[plc.desk.unit]]
address = "192.168.250.1"
fins = true
fins_access = "read-only"
"""
TANK = "PROGRAM Main VAR Level AT D300 : UINT := 4321; END_VAR ; END_PROGRAM"
DESK = """PROGRAM Main
VAR
    Give AT D10 : ARRAY[0..4] OF WORD := [1, 0, 16#0200, 16#0000, 0];
    Ask  AT D20 : ARRAY[0..4] OF WORD := [1, 0, 16#0200, 16#0100, 0];
    Setpoint AT D100 : UINT := 1234;
END_VAR
    LADDER
        LD      A202.00
        SEND    D100 D200 D10
        LD      A202.01
        RECV    D300 D110 D20
    END_LADDER
END_PROGRAM"""


def project_in(folder: Path, door: str = "", more: str = "") -> Project:
    (folder / "tank.st").write_text(TANK)
    (folder / "desk.st").write_text(DESK)
    (folder / "fbvm.toml").write_text(PROJECT.format(door=door, more=more))
    found = read_project(folder / "fbvm.toml")
    assert isinstance(found, Project), [str(each) for each in found]
    return found


def test_two_plcs_exchange_words_over_the_hosts_network(tmp_path: Path) -> None:
    doors = "".join(f'[[door]]\naddress = "192.168.250.{node}:9600"\nbind = "127.0.0.1:0"\n' for node in (1, 2))
    plant = Plant(project_in(tmp_path, doors))
    assert not plant.diagnostics
    assert all(real.port for real in plant.doors.values())
    try:
        run_all(plant.runs)
    finally:
        plant.close()
    assert [run.reason for run in plant.runs] == ["until", "until"]
    desk = plant.runs[1].plc
    assert (desk.read("D110"), desk.read("A219")) == (4321, 0)
    assert desk.servicing.clock_ns > 0


def test_they_exchange_words_over_a_connection_by_tcp_that_one_of_them_opens(tmp_path: Path) -> None:
    doors = "".join(f'[[door]]\naddress = "192.168.250.{node}:9600"\nbind = "127.0.0.1:0"\n' for node in (1, 2))
    project_in(tmp_path, doors)
    text = (tmp_path / "fbvm.toml").read_text()
    text = text.replace('fins_access = "read-only"', 'fins_clients = { 5 = "192.168.250.2" }')
    (tmp_path / "fbvm.toml").write_text(text)
    (tmp_path / "desk.st").write_text(DESK.replace("A202.00", "1523.04").replace("A202.01", "1523.04"))
    found = read_project(tmp_path / "fbvm.toml")
    assert isinstance(found, Project)
    plant = Plant(found)
    assert not plant.diagnostics
    told: list[TapKind] = []
    assert isinstance(plant.network, TcpNetwork)
    plant.network.tap = lambda now_ns, unit, event: told.append(event.kind)
    try:
        run_all(plant.runs)
    finally:
        plant.close()
    assert [run.reason for run in plant.runs] == ["until", "until"]
    assert TapKind.DATA in told
    assert TapKind.UDP not in told


def test_udp_and_tcp_of_a_door_have_one_port() -> None:
    network = TcpNetwork({Peer("192.168.250.2", 9600): ("127.0.0.1", 0)})
    try:
        endpoint = Peer("192.168.250.2", 9600)
        assert network.host_endpoint(endpoint) == network.host_endpoint(endpoint, "udp")
    finally:
        network.close()


@pytest.mark.parametrize(("more", "message"), [
    ('fins_nodes = ["2"]', "no table of texts"), ("fins_port = 0", "no whole number from 1"),
    ("fins_node = 255", "no whole number from 0 to 254"), ('fins_access = "all"', "none of full"),
    ('fins_nodes = { 300 = "1.2.3.4" }', "300"),
])  # fmt: skip
def test_keys_that_cannot_be(tmp_path: Path, more: str, message: str) -> None:
    (tmp_path / "tank.st").write_text(TANK)
    (tmp_path / "desk.st").write_text(DESK)
    (tmp_path / "fbvm.toml").write_text(PROJECT.format(door="", more=more))
    found = read_project(tmp_path / "fbvm.toml")
    diagnostics = Plant(found, net="loop").diagnostics if isinstance(found, Project) else found
    assert message in str([each.message for each in diagnostics])
