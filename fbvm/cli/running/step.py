"""`fbvm step`: a debugger for the statements and scans of a program, at a terminal and for scripts."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.files import reason
from fbvm.cli.shared import status
from fbvm.cli.shared.debug.worlds import NetworkPackets, ProgramErrors, ProjectWorld, program_world
from fbvm.cli.shared.e_banks import e_banks_in
from fbvm.cli.shared.given_sources import given_sources
from fbvm.cli.shared.options import CYCLE_NS, Mapping, Setting, mapping, setting, time_ns
from fbvm.cli.shared.paths import SourcePath, taken_folders
from fbvm.cli.shared.project_arguments import allow_outside_option, project_argument, read_given_project
from fbvm.cli.shared.prompt import prompt_lines
from fbvm.cli.shared.sources import compile_or_exit, report_diagnostics, source_options
from fbvm.cli.shared.terminal import named, say
from fbvm.cli.shared.traces import is_recording, open_trace
from fbvm.record.recording.file_scans import FileScans
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.signals import packets
from fbvm.record.trace.source_texts import source_texts
from fbvm.record.trace.writer import Depth
from fbvm.run.project import Project
from fbvm.step.commands import CommandError, Commands, ExpectationError
from fbvm.step.past_session import PastSession
from fbvm.step.session import Session
from fbvm.step.stop_report import StopReport
from fbvm.watch.places import parse_for

SCRIPT_LINE_CHARACTERS = 1_000_000
"""Longest line of a script."""
PACKET_SCANS = 1000
"""Scans of a recording up to the present one whose packets `net` knows."""

PAST_PARAMETERS = "files", "name", "libraries", "watched"
"""What can be given with a recording."""


class SourceOrRecording(SourcePath):
    """A source, a folder, or the file of a recording."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path.  Raises BadParameter."""
        path = Path(value)
        return path if path.is_file() and is_recording(path) else super().convert(value, param, ctx)


@click.command("step", epilog="At the prompt, `help` lists the commands.  A script: printf 'run Main.Done\\nprint D200\\n' | "
               "fbvm step FILE")
@source_options
@click.argument("files", nargs=-1, metavar="[FILE... | PROJECT | TRACE]", type=SourceOrRecording(), callback=taken_folders)
@click.option("--plc", "name", metavar="NAME", help="Which PLC of a project, where the others scan along; or of a trace.")
@click.option("--cycle", "cycle_ns", type=time_ns, default=CYCLE_NS, metavar="TIME", show_default="10ms",
              help="Cycle of programs without a TASK, and how often the PLC scans.")
@allow_outside_option
@click.option("--set", "settings", type=setting, multiple=True, metavar="NAME=VALUE", help="Write before the first scan.")
@click.option("--watch", "watched", multiple=True, metavar="NAME|ADDRESS|FIRST..LAST",
              help="Print this at each stop; with IF EXPRESSION behind it only where that holds.")
@click.option("--map", "mappings", type=mapping, multiple=True, metavar="IP:PORT=peer",
              help="Where a Modbus server is, in memory.")
@click.option("--timing", type=click.Choice(["exact", "real"]), default="exact", show_default=True,
              help="exact: the unit answers in fixed scans.  real: late and out of step, as the device may.")
@click.option("--seed", type=int, default=0, metavar="N", help="What chance begins with: the same again with the same N.")
def command(
    files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], cycle_ns: int, settings: tuple[Setting, ...],
    watched: tuple[str, ...], mappings: tuple[Mapping, ...], timing: str, seed: int, name: str | None,
) -> None:  # fmt: skip
    """Step through a program statement by statement and scan by scan, forth and back, in virtual time.

    Going back is real: memory, unit and network are as they were, and what is written there leads to another future.
    From a pipe, each line is a command; the first that fails ends it with status 1 (`expect`) or 2.

    Of a TRACE, which `fbvm run --trace` wrote, every scan can be stepped through, and nothing can be changed."""
    if len(files) == 1 and files[0].is_file() and is_recording(files[0]):
        _past(files[0], name, libraries, watched)
        return
    for row in mappings:
        if row.host is not None:
            raise click.UsageError(f"stepping stays in memory: --map {row.endpoint}=peer")
    packets = NetworkPackets()
    if project := project_argument(files):
        world = _project_world(project, packets)
        session, texts = Session(world, _chosen(world.names, name)), world.sources.texts
    else:
        image = compile_or_exit(files, program, libraries, runnable=True, drawn=True)
        image = image.with_e_banks(e_banks_in([*watched, *(given.name for given in settings)]))
        session = Session(program_world(image, cycle_ns, mappings, timing, seed, packets))
        texts = source_texts(image, given_sources(files), libraries)
    commands = Commands(session, StopReport(session, texts), lambda: packets.packets)
    try:
        for given in settings:
            _write(session, given)
        for text in watched:
            list(commands.run(f"watch {text}"))
    except (CommandError, LookupError, TypeError, ValueError) as error:
        raise click.UsageError(str(error)) from None
    _prompt(commands)


def _past(path: Path, name: str | None, libraries: Sequence[Path], watched: Sequence[str]) -> None:
    """Steps through the scans of a recording, from the end of the last one."""
    context = click.get_current_context()
    wrong = [parameter.opts[0] for parameter in context.command.params if parameter.name not in PAST_PARAMETERS
             and context.get_parameter_source(parameter.name or "") is ParameterSource.COMMANDLINE]  # fmt: skip
    if wrong:
        raise click.UsageError(f"{', '.join(wrong)}: a trace has happened already; beside it there are --plc, --library, --watch")
    with open_trace(path, name, libraries, Depth.STATEMENTS) as source:
        assert isinstance(source, FileScans)
        if not source.scans:
            raise click.UsageError(f"{named(path)} has no scans yet")
        session = PastSession(source)
        texts = source_texts(session.source_plc.image, source.texts, libraries)

        def latest() -> list[Packet]:
            here = session.here.scan
            return [packet for _, packet in packets(source, range(here - PACKET_SCANS, here + 1))]

        commands = Commands(session, StopReport(session, texts), latest)
        try:
            for text in watched:
                list(commands.run(f"watch {text}"))
        except CommandError as error:
            raise click.UsageError(str(error)) from None
        _prompt(commands)


def _prompt(commands: Commands) -> None:
    """Says where the session stands, and executes what is typed, or comes from a pipe."""
    for line in commands.stop():
        _print(line)
    if sys.stdin.isatty():
        _interact(commands)
    else:
        _script(commands)


def _project_world(file: Path, packets: NetworkPackets) -> ProjectWorld:
    """The PLCs of a project.  Ends with status 3 if it has errors."""
    project = read_given_project(file)
    try:
        if isinstance(project, Project):
            return ProjectWorld(project, packets)
        diagnostics: Sequence[Diagnostic] = project
    except ProgramErrors as error:
        diagnostics = error.diagnostics
    report_diagnostics(list(diagnostics), False)
    sys.exit(status.PROGRAM_ERRORS)


def _chosen(names: Sequence[str], name: str | None) -> str:
    """The PLC of that name, the only one without a name.  Raises UsageError."""
    if (name or names[0]) not in names or (name is None and len(names) > 1):
        said = f"there is no PLC {name}" if name else "there are several PLCs; say which by --plc NAME"
        raise click.UsageError(f"{said}; there is {', '.join(names)}")
    return name or names[0]


def _write(session: Session, given: Setting) -> None:
    if given.time:
        raise ValueError(f"--set {given}: here values are written before the first scan only; leave out @{given.time}")
    place = session.find(given.name)
    value = parse_for(place, given.value)
    session.act(lambda plc: plc.write(place, value))


def _interact(commands: Commands) -> None:
    """Executes typed lines until `quit` or the end of input; an error is printed."""
    for line in prompt_lines(commands):
        try:
            for said in commands.run(line):
                _print(said)
        except CommandError as error:
            say(str(error), fg="red")
        if commands.ended:
            return


def _script(commands: Commands) -> None:
    for line in _script_lines():
        if not line.strip() or line.lstrip().startswith("//"):
            continue
        say(f"> {line.strip()}")
        try:
            for said in commands.run(line):
                say(said)
        except CommandError as error:
            say(str(error), err=True)
            sys.exit(status.FAILED if isinstance(error, ExpectationError) else status.USAGE)
        if commands.ended:
            return


def _script_lines() -> Iterator[str]:
    """The lines of the standard input.  Raises UsageError for a line without an end, and if it cannot be read."""
    try:
        while line := sys.stdin.readline(SCRIPT_LINE_CHARACTERS + 1):
            if len(line) > SCRIPT_LINE_CHARACTERS:
                raise click.UsageError(f"a line of the standard input has more than {SCRIPT_LINE_CHARACTERS} characters")
            yield line
    except OSError as error:
        raise click.UsageError(f"the standard input cannot be read: {reason(error)}") from None


def _print(line: str) -> None:
    """Prints a line; that of the next statement is bold on a terminal."""
    say(line, bold=line.startswith((" >", "scan ")) or None)
