"""`fbvm run` of a project: runs all its PLCs and prints the result of each."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.cli.shared import status
from fbvm.cli.shared.doors import notice_teller, say_doors, unusable
from fbvm.cli.shared.project_arguments import check_project_options, read_given_project
from fbvm.cli.shared.run_recording import record_plant, record_run
from fbvm.cli.shared.run_result import EXIT_STATUS, RunProgress, json_trap, json_value, scans_in, value_text
from fbvm.cli.shared.sources import report_diagnostics, show_diagnostic
from fbvm.cli.shared.terminal import say, say_json
from fbvm.machine.scan_times import Lateness, ScanTimes
from fbvm.net.tcp import TcpNetwork
from fbvm.run import run_all
from fbvm.run.interactive import Control
from fbvm.run.plant import Kind, Plant
from fbvm.run.project import Project
from fbvm.run.running import Running
from fbvm.watch.names import Names
from fbvm.watch.paths import Place
from fbvm.watch.values import Value

OPTIONS = {"net": "--net", "for_ns": "--for", "scans": "--scans", "scan_time": "--scan-time", "as_json": "--json",
           "trace": "--trace", "journal": "--journal", "verify": "--verify", "depth": "--depth",
           "debug_port": "--debug", "live": "--live"}  # fmt: skip
"""The options that may be given with a project; all others are in its file."""
HOW_TO_MAP = 'write [[door]] with address = "{endpoint}" and bind = "127.0.0.1:{port}"'


def run_project(file: Path, context: click.Context) -> int:
    """Runs a project with the options of the command line; returns the exit status."""
    given = {name for name in context.params if context.get_parameter_source(name) is not ParameterSource.DEFAULT}
    check_project_options(context, OPTIONS)
    net = context.params["net"] if "net" in given else None
    for_ns, scans = context.params["for_ns"], context.params["scans"]
    as_json, debug_port = context.params["as_json"], context.params["debug_port"]
    if context.params["live"]:
        _run_live(file, net, context.params)
        return status.GOOD
    project = read_given_project(file)
    if not isinstance(project, Project):
        return _refuse(project, as_json)
    if debug_port is None:
        _check_end(project, net, for_ns, scans)
    elif context.params["trace"] or context.params["journal"]:
        raise click.UsageError("--debug looks into scans itself: leave out --trace and --journal")
    try:
        plant = Plant(project, net=net, for_ns=for_ns, scans=scans)
    except OSError as error:
        unusable(error)
    if errors(plant.diagnostics):
        return _refuse(plant.diagnostics, as_json)
    for diagnostic in plant.diagnostics:
        show_diagnostic(diagnostic)
    for message in plant.missing_units():
        say(message, fg="yellow", err=True)
    say_doors(plant.doors)
    if isinstance(plant.network, TcpNetwork):
        plant.network.notices.tell = notice_teller(HOW_TO_MAP, plant.doors)
    first = plant.runs[0].plc
    try:
        with record_run(context.params, {"project": project.source.name}) as recorded, \
                RunProgress(None if as_json else first, plant.scans, plant.for_ns) as progress:  # fmt: skip
            if recorded.recording:
                record_plant(plant, recorded.add, context.params)

            def tick() -> None:
                progress.update(first)
                recorded.tick()

            _execute(plant, debug_port, tick)
    finally:
        plant.close()
    real = not plant.network.virtual_time and not as_json and sys.stderr.isatty()
    _print(plant, as_json, context.params["scan_time"] or real)
    return max(EXIT_STATUS.get(run.reason, status.GOOD) for run in plant.runs)


def _execute(plant: Plant, debug_port: int | None, tick: Callable[[], None]) -> None:
    """Runs all PLCs to their ends; with `debug_port` debuggers may attach meanwhile."""
    if debug_port is None:
        run_all(plant.runs, tick)
    else:
        from fbvm.cli.shared.debug.door import DebugPort, run_with_port
        from fbvm.cli.shared.debug.worlds import plant_sources

        run_with_port(plant.named_runs, DebugPort(debug_port, plant_sources(plant)), tick)


def _run_live(file: Path, net: str | None, options: Mapping[str, Any]) -> None:
    """Runs a project under a page, which stays there until Ctrl-C."""
    if options["as_json"] or options["scan_time"] or options["debug_port"] is not None:
        raise click.UsageError("--live shows it on the page: leave out --json, --scan-time and --debug")
    from fbvm.cli.shared.live.origins import project_origin
    from fbvm.cli.shared.live.page import PageOptions, serve_page

    origin = project_origin(file, net, lambda run: run, options["for_ns"], options["scans"])
    serve_page(origin, Control(), PageOptions(), {name: options[name] for name in ("journal", "trace", "verify")})


def _refuse(diagnostics: list[Diagnostic], as_json: bool) -> int:
    report_diagnostics(diagnostics, as_json)
    return status.PROGRAM_ERRORS


def _check_end(project: Project, net: str | None, for_ns: int | None, scans: int | None) -> None:
    """Raises UsageError for a run in virtual time without an end."""
    ends = for_ns is not None or scans is not None or project.for_ns is not None or project.scans is not None
    if not ends and (net or project.net) == "loop" and not any(row.until for row in project.plcs):
        raise click.UsageError('say when to end: by --for or --scans, by for = "10s" in [run], or by until of a PLC')


def _print(plant: Plant, as_json: bool, scan_time: bool) -> None:
    if as_json:
        say_json({"plcs": dict(_for_scripts(plant)), **(_measures(plant) if scan_time else {})})
        return
    for kind in plant.kinds:
        for line in _lines(kind):
            say(line)
        for name, run in zip(kind.names, kind.runs, strict=True):
            if run.plc.trap:
                told = run.plc.trap.told(Names.of(run.plc.image, run.plc.memory.areas).instance)
                say(f"{name}: {told}", fg="red", err=True)
    if scan_time:
        for kind in plant.kinds:
            times, late = _measured(kind.runs, kind.row.cycle_ns)
            say(f"{kind.row.name}: {times}", err=True)
            if late.count:
                say(f"{kind.row.name}: {late}", err=True)


def _lines(kind: Kind) -> Iterator[str]:
    """The lines about the PLCs of one kind: scans, reasons of the end, and watched values or their range."""
    scans = [run.plc.scans for run in kind.runs]
    many = f"{len(kind.runs):,} PLCs, " if kind.row.count is not None else ""
    each = " each" if many else ""
    ends = sorted({run.reason for run in kind.runs})
    lasted_ns = max(run.plc.elapsed_ns for run in kind.runs)
    yield f"{kind.row.name}: {many}{scans_in(min(scans), max(scans), lasted_ns, each)}, ended by {', '.join(ends)}"
    first = kind.runs[0].plc
    names = Names.of(first.image, first.memory.areas)
    for name, place in kind.watched.items():
        values = [names.read(run.plc.read, place) for run in kind.runs]
        if all(value == values[0] for value in values):
            yield f"  {name} = {value_text(place, values[0])}"
        elif isinstance(place, Place) and all(isinstance(value, int | float) for value in values):
            yield f"  {name} = {value_text(place, min(values, key=_number))} .. {value_text(place, max(values, key=_number))}"
        else:
            yield f"  {name} has {len({repr(value) for value in values})} different values"


def _number(value: Value) -> float:
    return value if isinstance(value, int | float) else 0.0


def _for_scripts(plant: Plant) -> Iterator[tuple[str, object]]:
    for kind in plant.kinds:
        first = kind.runs[0].plc
        names = Names.of(first.image, first.memory.areas)
        for name, run in zip(kind.names, kind.runs, strict=True):
            yield name, {
                "scans": run.plc.scans, "time_ns": run.plc.elapsed_ns, "stopped": run.reason,
                "values": {text: json_value(place, names.read(run.plc.read, place)) for text, place in kind.watched.items()},
                "trap": json_trap(run.plc.trap),
            }  # fmt: skip


def _measures(plant: Plant) -> dict[str, object]:
    found = {kind.row.name: _measured(kind.runs, kind.row.cycle_ns) for kind in plant.kinds}
    return {"scan_time": {name: times.as_dict() for name, (times, _) in found.items()},
            "lateness": {name: late.as_dict() for name, (_, late) in found.items()}}  # fmt: skip


def _measured(runs: list[Running], cycle_ns: int) -> tuple[ScanTimes, Lateness]:
    """The durations and delays of the scans of some PLCs together."""
    times, late = ScanTimes(cycle_ns), Lateness()
    for run in runs:
        times.add(run.plc.scan_times)
        late.add(run.plc.lateness)
    return times, late
