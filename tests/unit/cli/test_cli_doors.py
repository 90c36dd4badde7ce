"""Doors: how each verb that listens is told where, what it says of it, and what it does with a port that it cannot have."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result
from rows import each_of

from fbvm.cli.main import main
from fbvm.cli.shared import status
from fbvm.cli.shared.doors import notice_teller
from fbvm.cli.shared.networks import try_doors
from fbvm.cli.shared.options import Door, door
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.notices import Notice, NoticeKind
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.link import Peer

UNIT = "192.168.250.21"
SERVER = """
PROGRAM Main
VAR Level AT D1000 : UINT; Server : ETN_Modbus_Server; END_VAR
    Server();
    Level := 77;
END_PROGRAM
"""
CLIENT = """
PROGRAM Main
VAR conn : MTCP_ETN_Connect; END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
END_PROGRAM
"""
PLANT = """
run = {net = "tcp", scans = 3}
[plc.tank]
sources = ["server.st"]
[[plc.tank.unit]]
address = "192.168.250.2"
"""
Fbvm = Callable[..., Result]


@pytest.fixture
def fbvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fbvm:
    """Runs the command in a folder with `server.st` and `client.st`."""
    monkeypatch.chdir(tmp_path)
    Path("server.st").write_text(SERVER, encoding="utf-8")
    Path("client.st").write_text(CLIENT, encoding="utf-8")
    return lambda *arguments: CliRunner().invoke(main, arguments, catch_exceptions=False)


@pytest.fixture
def busy() -> Iterator[int]:
    """A port that somebody else has."""
    with socket.create_server(("127.0.0.1", 0)) as sock:
        yield sock.getsockname()[1]


def project(*doors: tuple[str, str], key: str = "bind") -> None:
    rows = "".join(f'[[door]]\naddress = "{address}"\n{key} = "{where}"\n' for address, where in doors)
    Path("fbvm.toml").write_text(PLANT + rows, encoding="utf-8")


# --- a port that cannot be had --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_busy_port_is_told_alike_by_every_verb(fbvm: Fbvm, busy: int) -> None:
    project((f"{UNIT[:-1]}:502", f"127.0.0.1:{busy}"))
    said = f"127.0.0.1:{busy} cannot be used: somebody else listens there\n"
    for arguments in (
        ("serve", "--port", str(busy)), ("serve", "server.st", "--port", str(busy)),
        ("run", "server.st", "--scans", "3", "--door", str(busy)),
        ("run", "server.st", "--scans", "3", "--door", f"{UNIT}:502={busy}"),
        ("run", "server.st", "--scans", "3", "--net", "tcp", "--map", f"{UNIT}:502=127.0.0.1:{busy}"),
        ("run", "."),
    ):  # fmt: skip
        result = fbvm(*arguments)
        assert (result.exit_code, result.stdout) == (status.NETWORK, ""), (arguments, result.output)
        assert result.stderr == said, arguments


@pytest.mark.slow
def test_the_peer_speaks_like_the_others(busy: int) -> None:
    pytest.importorskip("pymodbus")
    command = [sys.executable, "-m", "fbvm", "peer", "--bind", "127.0.0.1", "--port", str(busy)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (5, f"127.0.0.1:{busy} cannot be used: somebody else listens there\n")


@pytest.mark.slow
def test_an_address_of_another_host(fbvm: Fbvm) -> None:
    project((f"{UNIT[:-1]}:502", "192.0.2.1:1502"))
    for arguments in (("serve", "--bind", "192.0.2.1"), ("run", "."),
                      ("run", "server.st", "--scans", "3", "--bind", "192.0.2.1", "--door", "1502")):  # fmt: skip
        result = fbvm(*arguments)
        assert result.exit_code == status.NETWORK
        assert "192.0.2.1:1502 cannot be used: it is not an address of this host\n" in result.stderr


@pytest.mark.slow
def test_two_doors_on_one_port(fbvm: Fbvm) -> None:
    with socket.create_server(("127.0.0.1", 0)) as sock:
        port = sock.getsockname()[1]
    project(("192.168.250.2:502", f"127.0.0.1:{port}"), ("192.168.250.2:503", f"0.0.0.0:{port}"))
    result = fbvm("run", ".")
    assert result.exit_code == status.NETWORK
    assert result.stderr == f"0.0.0.0:{port} cannot be used for 192.168.250.2:503: it is the door of 192.168.250.2:502\n"
    result = fbvm("run", "server.st", "--scans", "3", "--door", f"{UNIT}:502={port}", "--door", f"{UNIT}:503={port}")
    assert result.exit_code == status.NETWORK
    assert f"it is the door of {UNIT}:502" in result.stderr


@pytest.mark.slow
def test_a_door_to_a_unit_that_is_not_there(fbvm: Fbvm) -> None:
    project(("192.168.250.3:502", "127.0.0.1:0"))
    result = fbvm("run", ".")
    assert result.exit_code == status.NETWORK
    assert result.stderr == "192.168.250.3:502 cannot be used: no unit has the address 192.168.250.3; units: 192.168.250.2\n"
    result = fbvm("run", "server.st", "--scans", "3", "--door", "10.0.0.1:502=0")
    assert result.exit_code == status.NETWORK
    assert result.stderr == f"10.0.0.1:502 cannot be used: no unit has the address 10.0.0.1; units: {UNIT}\n"


@pytest.mark.slow
def test_a_server_without_a_map_is_told_what_to_write(fbvm: Fbvm) -> None:
    result = fbvm("run", "server.st", "--net", "tcp", "--scans", "30")
    assert result.exit_code == 0
    assert result.stderr.splitlines()[0] == (
        f"{UNIT}:502 is not tried: ports below 1024 belong to the host; say where by --map {UNIT}:502=127.0.0.1:1502 or "
        "--door 1502")
    project()
    Path("fbvm.toml").write_text(Path("fbvm.toml").read_text().replace("scans = 3", "scans = 30"), encoding="utf-8")
    result = fbvm("run", ".")
    assert result.exit_code == 0
    assert 'write [[door]] with address = "192.168.250.2:502" and bind = "127.0.0.1:1502"' in result.stderr


@pytest.mark.slow
def test_a_map_to_a_dead_port_says_so(fbvm: Fbvm) -> None:
    with socket.create_server(("127.0.0.1", 0)) as sock:
        port = sock.getsockname()[1]
    result = fbvm("run", "client.st", "--net", "tcp", "--scans", "60", "--pace", "event", "--map",
                  f"192.168.250.1:502=127.0.0.1:{port}")  # fmt: skip
    assert result.stderr.splitlines()[0] == f"192.168.250.1:502: nobody answers at 127.0.0.1:{port} (ECONNREFUSED)"
    Path("fbvm.toml").write_text(
        PLANT.replace("server.st", "client.st").replace("scans = 3", "scans = 60")
        + f'[[server]]\naddress = "192.168.250.1:502"\nhost = "127.0.0.1:{port}"\n', encoding="utf-8")  # fmt: skip
    assert fbvm("run", ".").stderr.splitlines()[0] == f"192.168.250.1:502: nobody answers at 127.0.0.1:{port} (ECONNREFUSED)"


# --- where doors are, and who can reach them ------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("key", ["bind", "host"])
def test_where_a_door_is_is_printed_at_the_start(fbvm: Fbvm, key: str) -> None:
    project(("192.168.250.2:502", "127.0.0.1:0"), key=key)
    result = fbvm("run", ".")
    assert result.exit_code == 0
    assert result.stderr.startswith("192.168.250.2:502: listening on 127.0.0.1:")
    assert "Other computers" not in result.stderr


@pytest.mark.slow
def test_every_way_that_others_can_reach_warns_in_one_voice(fbvm: Fbvm) -> None:
    project(("192.168.250.2:502", "0.0.0.0:0"))
    for arguments in (
        ("run", "."),
        ("run", "server.st", "--scans", "9", "--net", "tcp", "--map", f"{UNIT}:502=0.0.0.0:0"),
        ("run", "server.st", "--scans", "9", "--door", f"{UNIT}:502=0.0.0.0:0"),
        ("run", "server.st", "--scans", "9", "--door", f"{UNIT}:502=0", "--bind", "0.0.0.0"),
        ("run", "server.st", "--scans", "30", "--door", "0", "--bind", "0.0.0.0"),
    ):
        result = fbvm(*arguments)
        first, second = result.stderr.splitlines()[:2]
        assert ": listening on 0.0.0.0:" in first, arguments
        assert second == f"Other computers can reach 0.0.0.0:{first.rpartition(':')[2]}: whoever connects may read and write."
    assert fbvm("serve", "--bind", "192.0.2.1").stderr.startswith("Other computers can reach 192.0.2.1:1502: whoever connects ")


@each_of("verb", ["run", "serve", "peer"])
def test_every_verb_that_listens_has_bind(verb: str) -> None:
    command = main.get_command(click.Context(main), verb)
    assert command is not None
    names = [name for parameter in command.params for name in parameter.opts]
    assert "--bind" in names
    assert verb != "peer" or "--host" in names, "the former name stays"


@each_of(("text", "made"), [
    ("1502", Door(None, None, 1502)), ("0.0.0.0:1502", Door(None, "0.0.0.0", 1502)),
    ("192.168.250.21:502=1502", Door(Peer(UNIT, 502), None, 1502)),
    ("192.168.250.21:502=127.0.0.1:0", Door(Peer(UNIT, 502), "127.0.0.1", 0)),
])
def test_how_a_door_is_written(text: str, made: Door) -> None:
    assert door(text) == made


@each_of(("arguments", "said"), [
    (("--door", "70000"), "is not an address and a port"), (("--door", "x=1"), "is not an address and a port"),
    (("--door", "1502", "--door", "1503"), "say of each which it is"),
    (("--door", "1502", "--net", "loop"), "--door leaves memory"),
    (("--bind", "0.0.0.0", "--scans", "1"), "--bind leaves memory"),
    (("--door", "1502", "--bind", "here"), "here is not an IPv4 address"), (("--net", "tcp"), "say when to end"),
    (("--door", f"{UNIT}:502=1", "--map", f"{UNIT}:502=127.0.0.1:2"), "is mapped twice"),
])
def test_wrong_usage_of_doors(arguments: tuple[str, ...], said: str) -> None:
    result = CliRunner().invoke(main, ["run", str(Path(__file__).parents[3] / "examples" / "server.st"), *arguments])
    assert result.exit_code == 2
    assert said in result.stderr


# --- serving one's own program --------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("verb", ["serve", "run"])
def test_one_command_serves_a_program_of_ones_own(tmp_path: Path, verb: str) -> None:
    (tmp_path / "own.st").write_text(SERVER, encoding="utf-8")
    where = ("--port", "0") if verb == "serve" else ("--door", "0")
    command = [sys.executable, "-m", "fbvm", verb, str(tmp_path / "own.st"), *where]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            line = (process.stdout if verb == "serve" else process.stderr).readline()
            assert "listening on 127.0.0.1:" in line
            with socket.create_connection(("127.0.0.1", int(line.rpartition(":")[2])), 10) as client:
                client.sendall(bytes.fromhex("0001 0000 0006 01 03 03E8 0001"))
                assert client.recv(99).hex() == "000100000005010302004d"
        finally:
            process.terminate()


def test_settings_of_the_shipped_program_are_refused_for_ones_own(fbvm: Fbvm) -> None:
    result = fbvm("serve", "server.st", "--sockets", "2", "--idle", "5s")
    assert result.exit_code == 2
    assert "--sockets, --idle: said to the shipped server program" in result.stderr
    Path("wrong.st").write_text("PROGRAM Main x := 1; END_PROGRAM", encoding="utf-8")
    assert fbvm("serve", "wrong.st").exit_code == 3


@pytest.mark.slow
def test_the_image_says_which_words_it_does_not_set(fbvm: Fbvm, busy: int) -> None:
    words = {"CIO": [7] * 1500, "D": [0] * 30010 + [1, 2, 0, 3]}
    Path("some.json").write_text(json.dumps({"spaces": words}), encoding="utf-8")
    said = fbvm("serve", "--image", "some.json", "--port", str(busy)).stderr.splitlines()
    assert said[:-1] == ["some.json: D 30010 to 30013: not set, since these words belong to units"]
    Path("none.json").write_text(json.dumps({"spaces": {"D": [7] * 30000 + [0] * 9}}), encoding="utf-8")
    assert len(fbvm("serve", "--image", "none.json", "--port", str(busy)).stderr.splitlines()) == 1


HERE, REAL = Peer("192.168.250.1", 502), Peer("127.0.0.1", 1502)


@each_of("kind, error, said", [
    (NoticeKind.NOT_MAPPED, "", "192.168.250.1:502 is not tried: ports below 1024 belong to the host; map it to 1502\n"),
    (NoticeKind.UNUSABLE, "in use", "192.168.250.1:502: 127.0.0.1:1502 cannot be used: in use\n"),
    (NoticeKind.UNREACHED, "refused", "192.168.250.1:502: nobody answers at 127.0.0.1:1502 (refused)\n"),
    (NoticeKind.FULL, "", "192.168.250.1:502: a caller waits at 127.0.0.1:1502, since all sockets are in use\n"),
    (NoticeKind.TURNED_AWAY, "", "192.168.250.1:502: 127.0.0.1:1502 is turned away, since no socket waits\n"),
    (NoticeKind.LISTENING, "", "192.168.250.1:502: listening on 127.0.0.1:1502\n"),
])
def test_what_is_said_of_a_door(kind: NoticeKind, error: str, said: str) -> None:
    with redirect_stderr(StringIO()) as file:
        notice_teller("map it to {port}")(Notice(kind, HERE, REAL, error))
    assert file.getvalue() == said


def test_a_door_that_was_said_at_the_start_is_not_said_again() -> None:
    with redirect_stderr(StringIO()) as file:
        tell = notice_teller("", {HERE: REAL})
        tell(Notice(NoticeKind.LISTENING, HERE, REAL))
        tell(Notice(NoticeKind.LISTENING, Peer("192.168.250.2", 502), Peer("0.0.0.0", 1503)))
    assert file.getvalue().splitlines() == [
        "192.168.250.2:502: listening on 0.0.0.0:1503",
        "Other computers can reach 0.0.0.0:1503: whoever connects may read and write."]


def test_twenty_callers_are_told_of_and_not_more() -> None:
    with redirect_stderr(StringIO()) as file:
        tell = notice_teller("")
        for number in range(30):
            tell(Notice(NoticeKind.FULL if number % 2 else NoticeKind.TURNED_AWAY, HERE, Peer("127.0.0.1", number)))
        tell(Notice(NoticeKind.UNREACHED, HERE, REAL, "refused"))
    lines = file.getvalue().splitlines()
    assert len(lines) == 21 and "127.0.0.1:19" in lines[19] and "nobody answers" in lines[20]


def test_a_real_network_tells_what_happens_at_its_doors() -> None:
    image = compile_text("PROGRAM Main END_PROGRAM").image
    assert image is not None
    network = TcpNetwork()
    with redirect_stderr(StringIO()) as file:
        try_doors(Plc(image), network, (), ())
        network.notices.note(NoticeKind.UNREACHED, HERE, REAL, "refused")
    network.close()
    assert file.getvalue() == "192.168.250.1:502: nobody answers at 127.0.0.1:1502 (refused)\n"
