"""`fbvm run`: runs a program with its units and a network, and prints the result."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from fbvm.cli.running.project_run import run_project
from fbvm.cli.shared.breakpoint_options import breakpoint_options, halt_lines, set_breakpoints
from fbvm.cli.shared.e_banks import e_banks_in
from fbvm.cli.shared.files import check_outputs, growing_file, writing
from fbvm.cli.shared.networks import build_network, mailbox_names, net_of, try_doors
from fbvm.cli.shared.options import (
    Door,
    Mapping,
    Setting,
    address,
    bind_option,
    charted_names,
    check_live_installed,
    cycle_option,
    debug_option,
    door_option,
    live_option,
    map_option,
    net_option,
    setting,
    show_option,
    time_ns,
    watch_cycle_option,
)
from fbvm.cli.shared.paths import SourcePath, taken_folders
from fbvm.cli.shared.project_arguments import allow_outside_option, project_argument
from fbvm.cli.shared.run_recording import RunRecording, described, program_text, record_run, recording_options, write_page
from fbvm.cli.shared.run_result import RunProgress, RunResult
from fbvm.cli.shared.sources import compile_options, compile_or_exit, source_options
from fbvm.cli.shared.terminal import say
from fbvm.cli.shared.traces import statement_lines
from fbvm.code.image import Image
from fbvm.engine.choice.tiers import CHOICES
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.tcp import TcpNetwork
from fbvm.record.export.pcapng import Capture
from fbvm.record.trace.recorder import Recorder
from fbvm.record.trace.source_texts import source_texts
from fbvm.run import loop
from fbvm.run.interactive import Control
from fbvm.run.plant import ENDLESS
from fbvm.run.running import EVENT, PACES, Running, TimedWrite
from fbvm.watch.paths import Place, Span
from fbvm.watch.places import parse_for

NEVER_WITH_DEBUG = {"journal": "--journal", "trace": "--trace", "html": "--html", "rungs": "--ladder", "charts": "--sfc",
                    "charted": "--chart", "lines": "--break", "watched": "--watch", "conditions": "--break-if"}  # fmt: skip
"""Options that look into scans themselves, by the names of their parameters."""


@click.command("run")
@source_options
@click.argument("files", nargs=-1, metavar="[FILE... | PROJECT]", type=SourcePath(), callback=taken_folders)
@cycle_option
@click.option("--scans", type=click.IntRange(min=0), metavar="N", help="End after N scans.")
@click.option("--for", "for_ns", type=time_ns, metavar="TIME", help="End after this time.")
@click.option("--until", metavar="EXPRESSION", help="End when this holds after a scan: 'Main.done AND D200 > 5'.")
@click.option("--max", "max_ns", type=time_ns, metavar="TIME",
              help="With --until: give up after this time, with status 1.")
@breakpoint_options
@click.option("--set", "settings", type=setting, multiple=True, metavar="NAME=VALUE[@TIME]",
              help="Write once, before the scan at that time.")
@show_option
@click.option("--chart", "charted", multiple=True, metavar="NAME|ADDRESS,...", help="Draw these, a column a scan.")
@click.option("--ladder", "rungs", metavar="SCANS", help="Draw the rungs with their power in these scans: 3 or 3,5..7.")
@click.option("--sfc", "charts", metavar="SCANS",
              help="Draw the charts with their active steps and tested transitions in these scans.")
@net_option
@map_option
@door_option
@bind_option
@allow_outside_option
@click.option("--pace", type=click.Choice(PACES), default=PACES[0], show_default=True,
              help="With tcp: keep the cycle, or scan again at once when something arrived.")
@watch_cycle_option
@click.option("--pcap", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Write what passed the network, for Wireshark.")
@recording_options
@click.option("--timing", type=click.Choice(["exact", "real"]), default="exact", show_default=True,
              help="exact: the unit answers in fixed scans.  real: late and out of step, as the device may.")
@click.option("--engine", type=click.Choice(CHOICES), default="auto", show_default=True,
              help="auto: Python first, machine code when that pays.")
@click.option("--seed", type=int, default=0, metavar="N", help="What chance begins with: the same again with the same N.")
@debug_option
@live_option
@click.option("--scan-time", is_flag=True,
              help="Say how long scans took and how late they began; a run over tcp on a terminal does so by itself.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], cycle_ns: int, as_json: bool,
    **options: Any,
) -> None:  # fmt: skip
    """Compile the files and run them, with an ETN21 (unit number 0) on the backplane; or run a PROJECT: a folder with an
    fbvm.toml, or that file.  Without either it is the folder where you are.  A folder without such a file stands for the sources
    in it (.st).

    Beside it is the unit of each mailbox that the program uses, such as the Ethernet module of MBP_MSTR in slot 7.

    End by one of --scans, --for and --until, or with --door by Ctrl-C; before that, --break, --watch and --break-if end it
    inside a scan.  Status 1 if --max ended --until, 3 if the program has errors, 4 if a trap stopped it, 5 if the network could
    not be used."""
    if options["live"]:
        check_live_installed()
    if project := project_argument(files):
        sys.exit(run_project(project, click.get_current_context()))
    options["net"] = net_of(options["net"], options["doors"])
    _check_usage(as_json=as_json, **options)
    _check_endpoints(**options)
    check_outputs(options["html"])
    drawn = bool(options["rungs"])
    image = compile_or_exit(files, program, libraries, runnable=True, as_json=as_json, drawn=drawn)
    named = [given.name for given in options["settings"]]
    banks = e_banks_in([*named, *options["shown"], *options["charted"], options["until"] or "", *options["watched"],
                      *options["conditions"], *options["lines"]])
    image = image.with_e_banks(banks)
    if options["live"]:
        _run_live(image, cycle_ns, banks, files=files, program=program, libraries=libraries, **options)
        return
    with ExitStack() as stack:
        network = build_network(options["net"], options["mappings"], options["seed"], options["bind"], options["doors"])
        stack.callback(network.close)
        said = {name: options[name] for name in ("net", "pace", "timing", "seed", "engine")}
        plc = _plc(image, cycle_ns, options["engine"])
        plc.watch_cycle.time_ns = options["watch_ns"]
        capture = _capture(stack, options["pcap"], network, plc) if options["pcap"] else None
        if capture:
            network.tap = capture.tap
        for unit in usual_units(mailbox_names(image), options["timing"], options["seed"]):
            plc.attach(unit, network)
        try_doors(plc, network, options["mappings"], options["doors"])
        prepared = _prepared(plc, **options)
        html = options["html"]
        with record_run(options, said, html is not None) as recorded, _drawn(plc, options["rungs"], options["charts"]):
            if recorded.recording:
                text = program_text(files, libraries, program=program, drawn=drawn, e_banks=tuple(banks),
                                    **compile_options(files))  # fmt: skip
                recorded.add(files[0].stem if files else "PLC", plc, described(plc, text, options, files, libraries))
            result = _run(prepared, as_json, capture, recorded, files=files, libraries=libraries, **options)
            recorded.only_last = result.reason == "interrupted"
        if html:
            write_page(recorded, html, statement_lines(image, files, libraries))
        result.print()
        _warn_unused_mappings(plc, network)
        if plc.halted and not as_json:
            for line in halt_lines(plc, plc.halted, statement_lines(image, files, libraries)):
                say(line, fg="yellow", err=True)
    sys.exit(result.status)


def _run_live(image: Image, cycle_ns: int, banks: Sequence[str], *, files: tuple[Path, ...], program: str | None,
              libraries: tuple[Path, ...], **options: Any) -> None:  # fmt: skip
    """Runs under a page, up to the bounds that are given; the page stays there until Ctrl-C."""
    from fbvm.cli.shared.live.origins import FileOrigin
    from fbvm.cli.shared.live.page import PageOptions, serve_page

    def wire(image: Image) -> tuple[Plc, Callable[[], None]]:
        network = build_network(options["net"], options["mappings"], options["seed"], options["bind"], options["doors"])
        plc = _plc(image.with_e_banks(banks), cycle_ns, options["engine"])
        plc.watch_cycle.time_ns = options["watch_ns"]
        for unit in usual_units(mailbox_names(image), options["timing"], options["seed"]):
            plc.attach(unit, network)
        try_doors(plc, network, options["mappings"], options["doors"])
        return plc, network.close

    def bound(plc: Plc) -> Running:
        ends = {"scans": ENDLESS} | {name: options[name] for name in ("scans", "for_ns", "until", "max_ns")
                                     if options[name] is not None}  # fmt: skip
        try:
            set_breakpoints(plc, options["lines"], options["watched"], options["conditions"])
            return Running(plc, **ends, writes=[_write(plc, given) for given in options["settings"]])
        except (LookupError, TypeError, ValueError) as error:
            raise click.UsageError(str(error)) from None

    origin = FileOrigin(files, libraries, image, wire, bound, {"program": program, **compile_options(files)})
    serve_page(origin, Control(), PageOptions(), {name: options[name] for name in ("journal", "trace", "verify")})


def _plc(image: Image, cycle_ns: int, engine: str) -> Plc:
    try:
        return Plc(image, cycle_ns, engine=engine)
    except ValueError as error:  # an engine that this machine does not have
        raise click.UsageError(str(error)) from None


@dataclass(frozen=True)
class _Prepared:
    """A run that can begin: its options fit the program."""

    running: Running
    writes: list[TimedWrite]
    shown: dict[str, Place | Span]
    recorder: Recorder | None


def _prepared(
    plc: Plc, *, settings: tuple[Setting, ...], shown: tuple[str, ...], charted: tuple[str, ...], pace: str, scans: int | None,
    for_ns: int | None, until: str | None, max_ns: int | None, lines: tuple[str, ...], watched: tuple[str, ...],
    conditions: tuple[str, ...], **_: Any,
) -> _Prepared:  # fmt: skip
    """The run with its names looked up, before any file is written.

    Raises UsageError for names, values and conditions that do not fit the program."""
    try:
        writes = [_write(plc, given) for given in settings]
        places = {text: plc.find(text) for text in shown}
        names = charted_names(charted)
        recorder = Recorder(plc, names) if names else None
        set_breakpoints(plc, lines, watched, conditions)
        most = ENDLESS if scans is None else scans
        running = Running(plc, scans=most, for_ns=for_ns, until=until, max_ns=max_ns, writes=writes, pace=pace)
    except (LookupError, TypeError, ValueError) as error:
        raise click.UsageError(str(error)) from None
    return _Prepared(running, writes, places, recorder)


def _run(
    prepared: _Prepared, as_json: bool, capture: Capture | None, recorded: RunRecording, *,
    settings: tuple[Setting, ...], scans: int | None, for_ns: int | None, until: str | None, max_ns: int | None, net: str,
    scan_time: bool, debug_port: int | None, files: tuple[Path, ...], libraries: tuple[Path, ...], **_: Any,
) -> RunResult:  # fmt: skip
    """Runs to the end.  Raises UsageError for values that do not fit the program when they are written."""
    running = prepared.running
    plc = running.plc
    for warning in plc.warnings:
        say(warning, fg="yellow", err=True)
    try:
        with RunProgress(None if as_json else plc, scans, for_ns or max_ns) as shown_progress:

            def progress() -> None:
                shown_progress.update(plc)
                recorded.tick()
                if capture:  # of a quiet network a buffer would take minutes to fill
                    capture.flush()

            _execute(running, debug_port, files, libraries, progress)
    except (LookupError, TypeError, ValueError) as error:
        raise click.UsageError(str(error)) from None
    for write, given in zip(prepared.writes, settings, strict=True):
        if not plc.scans or write.at_ns > plc.now_ns:
            say(f"--set {given} was never written: the run ended before", fg="yellow", err=True)
    wanted = scan_time or (net == "tcp" and not as_json and sys.stderr.isatty())
    return RunResult(plc, running.reason, prepared.shown, prepared.recorder, as_json, until or "", wanted)


@contextmanager
def _drawn(plc: Plc, rungs: str | None, charts: str | None) -> Iterator[None]:
    """Draws rungs and charts as some scans execute them, if asked; what draws is loaded only then."""
    if not rungs and not charts:
        yield
        return
    from fbvm.cli.shared.drawings import draw_executed_charts, draw_executed_rungs

    with draw_executed_rungs(plc, rungs), draw_executed_charts(plc, charts):
        yield


def _execute(running: Running, debug_port: int | None, files: tuple[Path, ...], libraries: tuple[Path, ...],
             progress: Callable[[], None]) -> None:  # fmt: skip
    """Runs a PLC to its end; with `debug_port` debuggers may attach meanwhile."""
    if debug_port is None:
        loop.run_all([running], progress)
        return
    from fbvm.cli.shared.debug.door import DebugPort, run_with_port
    from fbvm.cli.shared.debug.worlds import DebugSources

    paths = {str(path): path for path in files}
    sources = DebugSources(paths, source_texts(running.plc.image, paths, libraries))
    run_with_port({"plc": running}, DebugPort(debug_port, sources), progress)


def _write(plc: Plc, given: Setting) -> TimedWrite:
    """The write of a setting, with its value parsed for the type of its place."""
    found = plc.find(given.name)
    return TimedWrite(found, parse_for(found, given.value), given.at_ns)


def _warn_unused_mappings(plc: Plc, network: LoopNetwork | TcpNetwork) -> None:
    """Warns of rows of --map that the run has not used, which often have a wrong address."""
    if isinstance(network, LoopNetwork):
        return
    units = ", ".join(f"{attached.unit.name} has {attached.unit.address}" for attached in plc.units)
    for said in network.map.unused:
        say(f"--map {said}: nobody used it; {units}", fg="yellow", err=True)


def _capture(stack: ExitStack, path: Path, network: LoopNetwork | TcpNetwork, plc: Plc) -> Capture:
    with writing(path):
        file = stack.enter_context(growing_file(path))
    return Capture(file, 0 if network.virtual_time else loop.epoch_ns(), lambda address: f"scan {plc.scans}")


NEVER_LIVE = {"html": "--html", "rungs": "--ladder", "charts": "--sfc", "charted": "--chart", "shown": "--show", "pcap": "--pcap",
              "debug_port": "--debug", "scan_time": "--scan-time", "as_json": "--json"}  # fmt: skip
"""Options whose results the page shows itself, by the names of their parameters."""


def _check_usage(
    *, live: bool, net: str, doors: tuple[Door, ...], pace: str, scans: int | None, for_ns: int | None, until: str | None,
    max_ns: int | None, debug_port: int | None, **others: Any,
) -> None:  # fmt: skip
    given = {**others, "debug_port": debug_port is not None}
    if live and (both := [said for name, said in NEVER_LIVE.items() if given.get(name)]):
        raise click.UsageError(f"--live shows it on the page: leave out {', '.join(both)}")
    if debug_port is not None and (both := [said for name, said in NEVER_WITH_DEBUG.items() if others.get(name)]):
        raise click.UsageError(f"--debug looks into scans itself: leave out {', '.join(both)}")
    ends = sum(bound is not None for bound in (scans, for_ns, until))
    if ends > 1 or not (ends or doors or live or debug_port is not None):
        raise click.UsageError(f"say when to end by one of --scans, --for and --until; {ends or 'none'} given (such as --for 1s)")
    if max_ns is not None and until is None:
        raise click.UsageError("--max bounds --until, which is not given")
    if pace == EVENT and net == "loop":
        raise click.UsageError("--pace event is for real time: add --net tcp")


def _check_endpoints(*, net: str, mappings: tuple[Mapping, ...], doors: tuple[Door, ...], bind: str, **_: Any) -> None:
    address(bind)
    if net == "loop" and (doors or bind != "127.0.0.1"):
        raise click.UsageError(f"{'--door' if doors else '--bind'} leaves memory: add --net tcp")
    named = [*(row.endpoint for row in mappings), *(door.endpoint for door in doors if door.endpoint)]
    if twice := next((endpoint for endpoint in named if named.count(endpoint) > 1), None):
        raise click.UsageError(f"{twice} is mapped twice")
    if sum(not door.endpoint for door in doors) > 1:
        raise click.UsageError("several doors: say of each which it is, --door IP:PORT=HOST:PORT")
    for row in mappings:
        if net == "loop" and row.host is not None:
            raise click.UsageError(f"--map {row.endpoint}={row.host}:{row.port} leaves memory: add --net tcp")
        if net == "tcp" and row.host is None:
            raise click.UsageError(f"--map {row.endpoint}=peer is in memory: leave out --net tcp, or use `fbvm peer`")
