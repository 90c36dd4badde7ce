"""`fbvm demo` in parts: which server it starts, what it prints of the run, and with which status it ends."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from click.testing import CliRunner
from images import counter_image
from rich.console import Console
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.cli.running import demo
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.run.plant import ENDLESS
from fbvm.wire.link import Peer

PROGRAM = """
PROGRAM Main
VAR
    Step, Quantity, Source, Target, Signature, Written : INT;
    Done : BOOL; Error_Code : WORD; Connection : Way; n, zero : INT;
END_VAR
    n := n + 1;
    Source := 0; Target := 2; Signature := 4; Quantity := 2; Written := 1;
    {}
END_PROGRAM
FUNCTION_BLOCK Way VAR_OUTPUT ENO : BOOL; Error_Code : WORD := 16#0105; END_VAR END_FUNCTION_BLOCK
"""


@contextmanager
def server() -> Iterator[Any]:
    yield SimpleNamespace(port=1502)


# --- the verb ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("kind, live, said, called", [
    ("own", False, "A Modbus TCP server of another PLC, with a program of its own, listens on 127.0.0.1:1502; what the program "
     "calls\n192.168.250.1:502 is there.\n", "show"),
    ("pymodbus", False, "A Modbus TCP server of pymodbus listens on 127.0.0.1:1502; what the program calls\n"
     "192.168.250.1:502 is there.\n", "show"),
    ("own", True, "A Modbus TCP server of another PLC, with a program of its own, listens on 127.0.0.1:1502; what the program "
     "calls\n192.168.250.1:502 is there.\nThe PLC waits for you to let it run: r on its page.\n", "page"),
])
def test_which_server_is_started_and_what_is_said_of_it(kind: str, live: bool, said: str, called: str) -> None:
    calls: list[tuple[str, str, int]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "check_live_installed", lambda: None)
        patch.setitem(sys.modules, "pymodbus.client", SimpleNamespace())
        patch.setattr(demo, {"own": "own_server", "pymodbus": "pymodbus_server"}[kind], server)
        patch.setattr(demo, "_show", lambda console, program, server: calls.append(("show", program.name, server.port)) or 1)
        patch.setattr(demo, "_serve_page", lambda program, server: calls.append(("page", program.name, server.port)))
        result = CliRunner().invoke(demo.command, ["--server", kind, *["--live"] * live])
    assert (result.exit_code, result.stdout) == (1 - live, said)
    assert calls == [(called, "demo.st", 1502)]


def test_without_pymodbus_its_server_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymodbus.client", None)
    result = CliRunner().invoke(demo.command, ["--server", "pymodbus"])
    assert result.exit_code == 2 and "this server needs pymodbus: pip install 'fbvm[peer]'" in result.stderr


@pytest.mark.slow
@each_of("fails", [False, True])
def test_under_a_page_the_program_waits_and_its_network_is_closed_at_the_end(fails: bool) -> None:
    plc, closed, served = Plc(counter_image()), [], []

    def serve_page(origin: Any, control: Any, options: Any) -> None:
        served.append((origin.built, control.is_paused, (options.bind, options.port)))
        if fails:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.cli.shared.live.page.serve_page", serve_page)
        patch.setattr(demo, "_plc", lambda program, server: (plc, SimpleNamespace(close=lambda: closed.append(True))))
        with pytest.raises(KeyboardInterrupt) if fails else server():
            demo._serve_page(data_folder("examples") / "demo.st", cast(Any, None))
    [(built, paused, where)] = served
    assert paused and where == ("127.0.0.1", 0) and closed == [True]
    assert list(built.plcs) == ["demo"] and built.plcs["demo"].plc is plc
    assert [text for text, _ in built.plcs["demo"].text.sources] == [str(data_folder("examples") / "demo.st")]
    assert [(run.plc, run.scans_left) for run in built.runs] == [(plc, ENDLESS)]


@pytest.mark.slow
def test_the_plc_of_the_demo_reaches_the_server_by_the_address_of_its_program() -> None:
    plc, network = demo._plc(data_folder("examples") / "demo.st", cast(Any, SimpleNamespace(port=4711)))
    try:
        assert plc.cycle_ns == 10_000_000 and [each.unit.address for each in plc.units] == ["192.168.250.21"]
        assert plc.units[0].network is network and not network.virtual_time
        assert network.map.outward(Peer("192.168.250.1", 502)) == Peer("127.0.0.1", 4711)
    finally:
        network.close()


# --- the run ----------------------------------------------------------------------------------------------------------


def shown(body: str, registers: list[int], reason: str = "", limit_ns: int = 50_000_000) -> tuple[int, str, list[str]]:
    """The status of a run of a program with this body beside these registers, what was printed, and what was done."""
    image = compile_text(PROGRAM.format(body)).image
    assert image is not None
    plc, done = Plc(image, 10_000_000), []
    for number, value in ((200, 7), (201, 8), (400, 9)):
        plc.write(f"D{number}", value)
    console = Console(file=io.StringIO(), width=100, highlight=False)
    other = SimpleNamespace(registers=lambda first, count: registers[first : first + count])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "_plc", lambda program, server: (plc, SimpleNamespace(close=lambda: done.append("closed"))))
        patch.setattr(demo, "LIMIT_NS", limit_ns)
        patch.setattr(demo, "_next", lambda program: "what next")
        if reason:
            patch.setattr("fbvm.run.loop.run", lambda *_, **__: reason)
        status = demo._show(console, Path("demo.st"), cast(Any, other))
    return status, cast(io.StringIO, console.file).getvalue(), [*done, f"{plc.scans} scans"]


@pytest.mark.slow
@each_of("body, registers, status, said, scans", [
    ("Step := 5; Done := n = 3;", [7, 8, 9, 0, 1], 0, "Equal on both sides.\nwhat next\n", 3),
    ("Step := 5; Done := n = 3;", [7, 8, 9, 0, 2], 1, "The data differs.\n", 3),
    ("Done := n = 3;", [7, 6, 9, 0, 1], 1, "The data differs.\n", 3),
    ("Error_Code := 16#8403 * INT_TO_WORD(MIN(1, n / 2));", [], 1,
     "The program did not get through (until); error code 8403\n", 2),
    ("Step := n;", [], 1, "The program did not get through (max); error code 0105\n", 5),
    ("Step := 1 / (2 - n);", [], 4, "1 divided by 0\n", 2),
])
def test_what_is_said_behind_the_run_and_the_status(body: str, registers: list[int], status: int, said: str, scans: int) -> None:
    found, text, done = shown(body.replace("16#8403 * INT_TO_WORD(MIN(1, n / 2))", "SEL(n = 2, 16#0000, 16#8403)"), registers)
    assert found == status and text.endswith(said), text
    assert done == ["closed", f"{scans} scans"]
    assert "\nEach column is a scan of 10 ms: # is ON, . is OFF, | a word that changed, ~ a quiet stretch.\n\n" in text
    assert "connect to the server" in text and ("all three exchanges are over" in text) and "Reply, first word" in text
    assert ("PLC" in text and "register" in text.rpartition("Each column")[2]) == (said in (
        "The data differs.\n", "Equal on both sides.\nwhat next\n"))


@pytest.mark.slow
def test_the_chart_of_a_demo_leaves_out_quiet_stretches() -> None:
    _, text, done = shown("Step := 5; Done := n = 400;", [7, 8, 9, 0, 1], limit_ns=5_000_000_000)
    assert done == ["closed", "400 scans"] and "~" in text.partition("~ a quiet stretch.")[2]


def test_a_demo_that_is_interrupted_has_the_status_of_that() -> None:
    assert shown("", [], "interrupted")[0] == 130


def test_what_to_try_next_is_written_as_it_can_be_called(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(demo, "command_name", lambda: "fbvm")
    monkeypatch.chdir(tmp_path)
    here = demo._next(tmp_path / "demo.st")
    assert here.splitlines()[1:3] == [
        "What to try next:", "  fbvm run demo.st --until Main.Done --max 5s --map 192.168.250.1:502=peer --show D200..D209"]
    assert here.splitlines()[-1].split() == ["fbvm", "list", "demo.st", "what", "the", "program", "compiles", "to"]
    assert "  fbvm run demo.st --net tcp --map 192.168.250.1:502=127.0.0.1:15020 --until Main.Done --max 5s \\\n" in here
    assert "fbvm list /elsewhere/demo.st" in demo._next(Path("/elsewhere/demo.st"))


# --- the servers ------------------------------------------------------------------------------------------------------


class Process:
    """A process that says one line, and what was done to it."""

    def __init__(self, line: str) -> None:
        self.stdout, self.done = io.StringIO(line), list[str]()

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *_: object) -> None:
        self.done.append("left")

    def communicate(self) -> tuple[str, str]:
        self.done.append("communicate")
        return "", " no port is free\n"

    def terminate(self) -> None:
        self.done.append("terminate")

    def kill(self) -> None:
        self.done.append("kill")

    def poll(self) -> int | None:
        return 0 if "wait" in self.done else None

    def wait(self) -> None:
        self.done.append("wait")


def test_a_server_is_a_command_that_says_where_it_listens(monkeypatch: pytest.MonkeyPatch) -> None:
    process, commands = Process("listening on 127.0.0.1:4711\n"), list[Any]()
    monkeypatch.setattr(demo, "child", lambda command, **options: commands.append((command, options)) or process)
    with demo.modbus_server() as port:
        assert (port, process.done) == (4711, [])
    assert process.done == ["terminate", "communicate", "left"]
    assert commands == [([sys.executable, "-m", "fbvm", "peer", "--port", "0"],
                         {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True})]
    process.stdout.seek(0)
    with demo.pymodbus_server() as server:
        assert server.port == 4711
    silent = Process("")
    monkeypatch.setattr(demo, "child", lambda command, **options: silent)
    with pytest.raises(OSError, match=r"^the server did not start: no port is free$"), demo.modbus_server():
        pass
    assert silent.done[:2] == ["kill", "communicate"]


def test_the_own_server_begins_with_an_image_and_is_asked_by_the_one_that_it_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    process, asked = Process("listening on 127.0.0.1:4711\n"), list[list[str]]()
    monkeypatch.setattr(demo, "child", lambda command, **options: asked.append(command[3:]) or process)
    with demo.own_server() as server:
        assert server.port == 4711
        assert server.registers(100, 3) == [1100, 1101, 1102]  # as if it had left what it began with
        assert process.done == ["terminate", "wait"]
        assert server.registers(0, 2) == [1000, 1001] and process.done == ["terminate", "wait"]
        [[*words, image]] = asked
        assert words == ["serve", "--port", "0", "--image"]
        assert json.loads(Path(image).read_text()) == {"spaces": {"D": list(range(1000, 1125))}}
    assert not Path(image).exists()


@each_of("fails", [False, True])
def test_pymodbus_is_asked_over_a_connection_of_its_own(fails: bool) -> None:
    done: list[object] = []

    class Client:
        def __init__(self, host: str, port: int) -> None:
            done.append((host, port))

        def connect(self) -> None:
            done.append("connect")

        def read_holding_registers(self, first: int, count: int) -> Any:
            if fails:
                raise OSError("gone")
            return SimpleNamespace(registers=list(range(first, first + count)))

        def close(self) -> None:
            done.append("close")

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "pymodbus", SimpleNamespace())
        patch.setitem(sys.modules, "pymodbus.client", SimpleNamespace(ModbusTcpClient=Client))
        if fails:
            with pytest.raises(OSError):
                demo.PymodbusServer(9).registers(5, 2)
        else:
            assert demo.PymodbusServer(9).registers(5, 2) == [5, 6]
    assert done == [("127.0.0.1", 9), "connect", "close"]
