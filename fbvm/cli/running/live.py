"""`fbvm live`: runs a program or a project and serves a page on which it can be seen and touched."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fbvm.base.diagnostics import errors
from fbvm.cli.shared import status
from fbvm.cli.shared.debug.door import DebugPort, debug_option
from fbvm.cli.shared.debug.worlds import DebugSources
from fbvm.cli.shared.doors import notice_teller, say_doors, unusable
from fbvm.cli.shared.given_sources import given_sources
from fbvm.cli.shared.networks import build_network, mailbox_names
from fbvm.cli.shared.options import CYCLE_NS, Door, Mapping, address, door, mapping, time_ns
from fbvm.cli.shared.paths import SourcePath
from fbvm.cli.shared.project_arguments import allow_outside_option, project_argument, read_given_project
from fbvm.cli.shared.run_recording import program_text, record_run
from fbvm.cli.shared.sources import compile_options, compile_or_exit, report_diagnostics, source_options
from fbvm.cli.shared.terminal import say
from fbvm.interchange.formats.given import given_sources as sources_within
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.tcp import TcpNetwork
from fbvm.record.recording.file_writer import Described
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.trace.source_texts import source_texts
from fbvm.record.trace.writer import source_lines
from fbvm.run.interactive import Control, let_look_on, run_interactive
from fbvm.run.plant import ENDLESS, Plant
from fbvm.run.project import Project
from fbvm.run.running import Running
from fbvm.step.world import Debugged
from fbvm.watch.paths import UnknownPlace

if TYPE_CHECKING:
    from fbvm.live.host import LiveHost
    from fbvm.live.workbench import Workbench

HOW_TO_MAP = "say where by --map {endpoint}=127.0.0.1:{port} or --door {port}"
MISSING = "the live page needs websockets: pip install 'fbvm[live]'"


@click.command("live")
@source_options
@click.argument("files", nargs=-1, metavar="[FILE... | PROJECT]", type=SourcePath())
@click.option("--cycle", "cycle_ns", type=time_ns, default=CYCLE_NS, metavar="TIME", show_default="10ms",
              help="Cycle of programs without a TASK, and how often the PLC scans.")
@click.option("--net", type=click.Choice(["loop", "tcp"]), show_default="loop",
              help="loop: in memory, virtual time.  tcp: real connections, real time.")
@click.option("--map", "mappings", type=mapping, multiple=True, metavar="IP:PORT=HOST:PORT|peer",
              help="Where an endpoint that the program names really is.")
@click.option("--door", "doors", type=door, multiple=True, metavar="[IP:PORT=][HOST:]PORT",
              help="With tcp: where others reach the program.")
@allow_outside_option
@click.option("--port", type=click.IntRange(0, 65535), default=0, show_default="any free one", help="The port of the page.")
@click.option("--bind", default="127.0.0.1", show_default=True, metavar="ADDRESS",
              help="Where the page is served; others than this computer reach it with another address.")
@click.option("--read-only", is_flag=True, help="Let pages look and nothing else.")
@click.option("--allow-write", "writable", multiple=True, metavar="NAME",
              help="Let pages write and force this variable or address and what is in it, and nothing else; may be repeated.")
@click.option("--paused", is_flag=True, help="Wait before the first scan.")
@click.option("--speed", type=click.FloatRange(0, 1000), default=1.0, show_default=True, metavar="N",
              help="How fast virtual time passes: 1 as the clock, 0.1 ten times slower, 0 as fast as it goes.")
@debug_option
@click.option("--trace", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Record the run, with what is done on the page, for `fbvm chart`, `table`, `why`, `convert` and `replay`.")
def command(
    files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], cycle_ns: int, net: str | None,
    mappings: tuple[Mapping, ...], doors: tuple[Door, ...], port: int, bind: str, read_only: bool, writable: tuple[str, ...],
    paused: bool, speed: float, debug_port: int | None, trace: Path | None,
) -> None:  # fmt: skip
    """Run a program or a PROJECT and print the address of a page on which it lives: values, rungs with power, the scan that
    stops, steps and goes back, units, frames and faults.

    Ends by Ctrl-C.  The address has a token: who does not have it sees nothing.  Status 3 if the program has errors, 5 if the
    network or the port of the page cannot be used."""
    if find_spec("websockets") is None:
        raise click.UsageError(MISSING)
    if debug_port is not None and trace:
        raise click.UsageError("--debug looks into scans itself: leave out --trace")
    control = Control(is_paused=paused, speed=speed)
    with ExitStack() as stack:
        page = _Page(stack, control, bind=address(bind), port=port, read_only=read_only, writable=writable,
                     debug_port=debug_port)  # fmt: skip
        if project := project_argument(files):
            if trace or mappings or doors:
                raise click.UsageError("--trace, --map and --door are for FILE: what a project does stands in its file")
            page.run_project(project, net)
            return
        _run_files(page, stack, files, program, libraries, cycle_ns, _kind(net, mappings, doors), mappings, doors, trace)


def _kind(net: str | None, mappings: tuple[Mapping, ...], doors: tuple[Door, ...]) -> str:
    """"loop" or "tcp".  Raises UsageError for options that do not fit it."""
    kind = net or ("tcp" if doors else "loop")
    if kind == "loop" and (doors or any(row.host is not None for row in mappings)):
        raise click.UsageError("--door and --map to a real host leave memory: add --net tcp")
    return kind


def _run_files(
    page: _Page, stack: ExitStack, files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], cycle_ns: int,
    net: str, mappings: tuple[Mapping, ...], doors: tuple[Door, ...], trace: Path | None,
) -> None:  # fmt: skip
    """Runs a program, with its units and a network, under the page."""
    image = compile_or_exit(files, program, libraries, runnable=True)
    network = build_network(net, mappings, 0, "127.0.0.1", doors)
    stack.callback(network.close)
    plc = Plc(image, cycle_ns)
    for unit in usual_units(mailbox_names(image)):
        plc.attach(unit, network)
    if isinstance(network, TcpNetwork):
        try:
            found = network.try_doors([given.endpoint for given in doors if given.endpoint])
        except OSError as error:
            unusable(error)
        say_doors(found)
        network.notices.tell = notice_teller(HOW_TO_MAP, found)
    texts = source_texts(image, {file.name: file for file in files} | given_sources(files), libraries)
    page.run({files[0].stem: (plc, texts)}, [Running(plc, scans=ENDLESS)], program=program,
             repeated=files if network.virtual_time and not mappings else (), trace=trace,
             text=program_text(files, libraries, program=program, **compile_options(files)))  # fmt: skip


class _Page:
    """The page of a run, with its options."""

    def __init__(self, stack: ExitStack, control: Control, *, bind: str, port: int, read_only: bool, writable: Sequence[str],
                 debug_port: int | None) -> None:  # fmt: skip
        self._stack, self._control, self._debug_port = stack, control, debug_port
        self._bind, self._port, self._read_only, self._writable = bind, port, read_only, writable

    def run_project(self, file: Path, net: str | None) -> None:
        """Runs all PLCs of a project under one page."""
        project = read_given_project(file)
        if not isinstance(project, Project):
            report_diagnostics(project, False)
            sys.exit(status.PROGRAM_ERRORS)
        try:
            plant = Plant(project, net=net)
        except OSError as error:
            unusable(error)
        report_diagnostics(plant.diagnostics, False)
        if errors(plant.diagnostics):
            sys.exit(status.PROGRAM_ERRORS)
        self._stack.callback(plant.close)
        say_doors(plant.doors)
        plcs = {}
        for kind in plant.kinds:
            texts = source_texts(kind.runs[0].plc.image, {path.name: path for path in kind.row.sources}
                                 | sources_within(kind.row.sources, kind.row.resource), kind.row.libraries)
            for name, run in zip(kind.names, kind.runs, strict=True):
                plcs[name] = run.plc, texts
        self.run(plcs, [Running(run.plc, scans=ENDLESS, writes=run.writes) for run in plant.runs])

    def run(self, plcs: dict[str, tuple[Plc, dict[str, str]]], runs: list[Running], repeated: Sequence[Path] = (),
            program: str | None = None, trace: Path | None = None, text: ProgramText | None = None) -> None:  # fmt: skip
        """Serves the page and runs until Ctrl-C."""
        from fbvm.live.host import LiveHost
        from fbvm.live.plcs import LivePlc
        from fbvm.live.pytest_text import pytest_text
        from fbvm.live.workbench import Workbench

        options = {"journal": None, "trace": trace, "selected": (), "verify": False}
        recorded = self._stack.enter_context(record_run(options, {"verb": "live"}, in_memory=True))
        assert recorded.recording
        lives = []
        for name, (plc, texts) in plcs.items():
            told = Described(text or ProgramText(), source_lines(plc.image, texts))
            lives.append(LivePlc(name, plc, recorded.recording.add(name, plc, told), texts))
        test = partial(pytest_text, files=[file.resolve() for file in repeated], program=program) if repeated else None
        try:
            bench = Workbench(lives, self._control, read_only=self._read_only, writable=self._writable or None, test=test)
        except UnknownPlace as error:
            raise click.UsageError(f"--allow-write: {error}") from None
        try:
            host = LiveHost(bench, self._bind, self._port, tick=recorded.tick)
        except OSError as error:
            unusable(OSError(f"the page cannot be served at {self._bind}:{self._port}: {error.strerror}"))
        self._stack.callback(host.close)
        if self._bind != "127.0.0.1":
            say(f"--bind {self._bind}: who reaches this address and has the token can write into the PLC; nothing is encrypted",
                fg="yellow", err=True)  # fmt: skip
        say(host.address)
        sys.stdout.flush()
        if self._debug_port is None:
            run_interactive(runs, self._control, host)
            return
        texts = {name: text for _, each in plcs.values() for name, text in each.items()}
        port = DebugPort(self._debug_port, DebugSources({name: path for name in texts if (path := Path(name)).is_file()}, texts))
        self._stack.callback(port.close)
        _run_with_port(runs, bench, host, port)


def _run_with_port(runs: list[Running], bench: Workbench, host: LiveHost, port: DebugPort) -> None:
    """Runs as `run_interactive` does, and lets debuggers have the PLCs when they attach; pages look on meanwhile."""

    def debugged() -> list[Debugged]:
        return [Debugged(live.name, live.plc, run.writes, live.recorded)
                for live, run in zip(bench.plcs.values(), runs, strict=True)]  # fmt: skip

    def look_on() -> bool:
        let_look_on(host)
        return False

    while True:
        run_interactive(runs, bench.control, host, until=lambda: port.is_called)
        if bench.control.has_ended or not port.is_called:
            return
        bench.held_by = "a debugger"
        try:
            if port.serve(debugged, look_on):
                return
        except KeyboardInterrupt:
            return
        bench.held_by = ""
        for run in runs:
            run.resume()
