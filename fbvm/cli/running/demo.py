"""`fbvm demo`: registers of a real Modbus TCP server arrive in D memory, over real sockets, and why.

The server runs in a process of its own: a PLC with the server program (`fbvm serve`), whose memory image says afterwards
what it holds; or pymodbus's (`fbvm peer`), which a client that has nothing to do with fbvm asks for that.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import click
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from fbvm.base.children import child
from fbvm.base.data import data_folder
from fbvm.base.files import write_file
from fbvm.base.host import can_end_others
from fbvm.cli.shared import status
from fbvm.cli.shared.doors import LISTENING
from fbvm.cli.shared.options import check_live_installed, live_option
from fbvm.cli.shared.run_recording import program_text
from fbvm.cli.shared.run_result import chart_width
from fbvm.code.compiler import compile_files
from fbvm.machine.backplane import ETN21_ADDRESS
from fbvm.machine.plc import Plc
from fbvm.net.tcp import TcpNetwork
from fbvm.record.draw.chart import draw
from fbvm.record.trace.recorder import Recorder
from fbvm.record.trace.source_texts import source_texts
from fbvm.run import loop
from fbvm.run.interactive import Control
from fbvm.run.plant import ENDLESS
from fbvm.run.running import Running
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

SERVER = Peer("192.168.250.1", 502)
"""The endpoint of the server in the program."""
CYCLE_NS = 10_000_000
LIMIT_NS = 20_000_000_000
SIGNALS = (
    "CIO 1519.05", "CIO 1519.02", "CIO 1509.15", "CIO 1519.03", "CIO 1509.02", "CIO 1509.13", "CIO 1519.04", "D30001",
    ("D32500", "Request, first word: transaction number"), ("D32510", "Reply, first word: transaction number"),
    ("Main.Connection.ENO", "connected"), ("Main.Done", "all three exchanges are over"),
)  # fmt: skip
STEPS = ("connect to the server", "read holding registers (function 03)", "compute", "write registers (function 10)",
         "write one register (function 06)")  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """Words of the PLC beside the registers of the server that they must equal."""

    what: str
    places: list[str]
    words: list[int]
    first_register: int
    registers: list[int]

    @property
    def equal(self) -> bool:
        return self.words == self.registers and bool(self.words)


class Server(Protocol):
    """A Modbus TCP server on this computer."""

    @property
    def port(self) -> int:
        """The port on which it listens."""

    def registers(self, first: int, count: int) -> list[int]:
        """Holding registers of the server after the program has ended."""


@click.command("demo")
@click.option("--server", "kind", type=click.Choice(["own", "pymodbus"]), default="own" if can_end_others() else "pymodbus",
              show_default=True, help="own: another PLC, with the server program for an ETN21.  pymodbus: other people's.")
@live_option
def command(kind: str, live: bool) -> None:
    """Run a client program against a real Modbus TCP server on this computer.

    Needs no hardware, no root, no configuration.  Ends with 0 only if the data is equal on both sides."""
    if live:
        check_live_installed()
    if kind == "pymodbus":
        try:
            import pymodbus.client  # noqa: F401
        except ImportError:
            raise click.UsageError("this server needs pymodbus: pip install 'fbvm[peer]'") from None
    console = Console(highlight=False)
    program = data_folder("examples") / "demo.st"
    whose = "of another PLC, with a program of its own," if kind == "own" else "of pymodbus"
    try:
        with own_server() if kind == "own" else pymodbus_server() as server:
            console.print(f"A Modbus TCP server {whose} listens on 127.0.0.1:{server.port}; what the program calls\n{SERVER} "
                          "is there.", soft_wrap=True)  # fmt: skip
            if live:
                console.print("The PLC waits for you to let it run: r on its page.")
                _serve_page(program, server)
                return
            sys.exit(_show(console, program, server))
    except OSError as error:
        console.print(f"The network cannot be used: {error}", style="red")
        sys.exit(status.NETWORK)


def _serve_page(program: Path, server: Server) -> None:
    """Runs the program under a page until Ctrl-C, paused before its first scan."""
    from fbvm.cli.shared.live.origins import Built, BuiltOrigin, SeenPlc
    from fbvm.cli.shared.live.page import PageOptions, serve_page

    plc, network = _plc(program, server)
    try:
        text = program_text([program], ())
        seen = SeenPlc(plc, source_texts(plc.image, {str(program): program}), text)
        origin = BuiltOrigin(Built({"demo": seen}, [Running(plc, scans=ENDLESS)]))
        serve_page(origin, Control(is_paused=True), PageOptions())
    finally:
        network.close()


def _plc(program: Path, server: Server) -> tuple[Plc, TcpNetwork]:
    image = compile_files([program], runnable=True, lint=False).image
    assert image is not None, "the demo's own program compiles"
    plc = Plc(image, CYCLE_NS)
    network = TcpNetwork({SERVER: ("127.0.0.1", server.port)})
    plc.attach(Etn21(0, ETN21_ADDRESS), network)
    return plc, network


def _show(console: Console, program: Path, server: Server) -> int:
    """Runs the program and prints everything; returns the exit status."""
    plc, network = _plc(program, server)
    try:
        recorder = Recorder(plc, SIGNALS)
        with StepDisplay(console, plc) as steps:
            plc.watchers.append(steps.watch)
            reason = loop.run(plc, until="Main.Done OR Main.Error_Code <> 0", max_ns=LIMIT_NS)
    finally:
        network.close()
    console.print("\nEach column is a scan of 10 ms: # is ON, . is OFF, | a word that changed, ~ a quiet stretch.\n")
    console.print(draw(recorder, width=chart_width(), ruler=True, compress=True), markup=False, soft_wrap=True)
    if reason != "until" or plc.read("Main.Done") is not True:
        console.print(_failure(plc, reason), style="red")
        return {"trap": status.STOPPED, "interrupted": status.INTERRUPTED}.get(reason, status.FAILED)
    comparisons = compare(plc, server)
    console.print(_table(comparisons))
    if not all(comparison.equal for comparison in comparisons):
        console.print("The data differs.", style="bold red")
        return status.FAILED
    console.print("Equal on both sides.", style="bold green")
    console.print(_next(program), markup=False, soft_wrap=True)
    return status.GOOD


def _failure(plc: Plc, reason: str) -> str:
    if plc.trap:
        return str(plc.trap)
    code = plc.read("Main.Error_Code") or plc.read("Main.Connection.Error_Code")
    return f"The program did not get through ({reason}); error code {code:04X}"


# --- the servers ------------------------------------------------------------------------------------------------------


@contextmanager
def _process(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A command of fbvm that listens, in a process of its own; its port.  Raises OSError if it does not start."""
    command = [sys.executable, "-m", "fbvm", *arguments]
    with child(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line.startswith(LISTENING):
                process.kill()
                raise OSError(f"the server did not start: {process.communicate()[1].strip()}")
            yield process, int(line.rpartition(":")[2])
        finally:
            process.terminate()
            process.communicate()


@contextmanager
def modbus_server() -> Iterator[int]:
    """pymodbus's server in a process of its own; its port."""
    with _process("peer", "--port", "0") as (_, port):
        yield port


@dataclass(frozen=True)
class PymodbusServer:
    """pymodbus's server; its client asks over a connection of its own."""

    port: int

    def registers(self, first: int, count: int) -> list[int]:
        from pymodbus.client import ModbusTcpClient

        client: Any = ModbusTcpClient("127.0.0.1", port=self.port)
        try:
            client.connect()
            found: list[int] = client.read_holding_registers(first, count=count).registers
            return found
        finally:
            client.close()


@contextmanager
def pymodbus_server() -> Iterator[Server]:
    with modbus_server() as port:
        yield PymodbusServer(port)


@dataclass(frozen=True)
class OwnServer:
    """A PLC with the server program, which saves its memory when it ends."""

    port: int
    process: subprocess.Popen[str]
    image: Path

    def registers(self, first: int, count: int) -> list[int]:
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait()
        words: list[int] = json.loads(self.image.read_text(encoding="utf-8"))["spaces"]["D"]
        return words[first : first + count]


@contextmanager
def own_server() -> Iterator[Server]:
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "memory.json"
        write_file(image, json.dumps({"spaces": {"D": list(range(1000, 1125))}}))
        with _process("serve", "--port", "0", "--image", str(image)) as (process, port):
            yield OwnServer(port, process, image)


def compare(plc: Plc, server: Server) -> list[Comparison]:
    """The words of the PLC beside the registers of the server."""
    quantity, written, source, target, signature = (
        int(str(plc.read(f"Main.{name}"))) for name in ("Quantity", "Written", "Source", "Target", "Signature")
    )
    answers = [server.registers(first, count) for first, count in ((source, quantity), (target, written), (signature, 1))]
    return [
        Comparison("read by function 03", *_words(plc, 200, quantity), source, answers[0]),
        Comparison("written by function 10", *_words(plc, 400, written), target, answers[1]),
        Comparison("written by function 06", ["Main.Written"], [written], signature, answers[2]),
    ]


def _words(plc: Plc, first: int, count: int) -> tuple[list[str], list[int]]:
    words = range(first, first + count)
    return [f"D{word}" for word in words], [plc.memory.words("D")[word] for word in words]


# --- output -----------------------------------------------------------------------------------------------------------


class StepDisplay:
    """Shows the steps of the program as they happen on a terminal; in a pipe once, at the end."""

    def __init__(self, console: Console, plc: Plc) -> None:
        self._plc = plc
        self._began_ms: dict[int, float] = {}
        self._live = Live(self._view(), console=console, auto_refresh=False)

    def __enter__(self) -> StepDisplay:
        self._live.start()
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._live.update(self._view(), refresh=True)
        self._live.stop()

    def watch(self, plc: Plc) -> None:
        """Notes a new step and shows it."""
        step = int(str(plc.read("Main.Step")))
        if step not in self._began_ms:
            self._began_ms[step] = plc.now_ns / 1e6
            self._live.update(self._view(), refresh=self._live.console.is_terminal)

    def _view(self) -> Group:
        lines = []
        for number, text in enumerate(STEPS):
            ended = self._began_ms.get(number + 1)
            began = self._began_ms.get(number)
            mark, style = (" ", "dim") if began is None else (">", "yellow") if ended is None else ("+", "green")
            time = "" if ended is None or began is None else f"{ended - began:8.1f} ms"
            lines.append(Text(f"  {mark} {text:<40}{time}", style=style))
        return Group(*lines)


def _table(comparisons: list[Comparison]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for title in ("PLC", "holds", "", "server", "register", ""):
        table.add_column(title, justify="right" if title in ("holds", "server", "register") else "left")
    for comparison in comparisons:
        rows = zip(comparison.places, comparison.words, comparison.registers, strict=False)
        for number, (place, word, register) in enumerate(rows):
            sign = "=" if word == register else "differs from"
            where = str(comparison.first_register + number)
            table.add_row(place, str(word), sign, str(register), where, comparison.what if number == 0 else "")
    return table


def command_name() -> str:
    """The command with which this program can be called again: `fbvm`, or the path by which it was called."""
    if shutil.which("fbvm"):
        return "fbvm"
    path = Path(sys.argv[0])
    if path.stem != "fbvm":
        return f"{sys.executable} -m fbvm"
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def _next(program: Path) -> str:
    here = program.relative_to(Path.cwd()) if program.is_relative_to(Path.cwd()) else program
    fbvm = command_name()
    return f"""
What to try next:
  {fbvm} run {here} --until Main.Done --max 5s --map {SERVER}=peer --show D200..D209
                                        the same in memory, in virtual time
  {fbvm} peer --port 15020 --trace        a server to watch, and in another window:
  {fbvm} run {here} --net tcp --map {SERVER}=127.0.0.1:15020 --until Main.Done --max 5s \\
           --set Main.Quantity=125 --pcap demo.pcapng
  {fbvm} list {here}                      what the program compiles to
"""
