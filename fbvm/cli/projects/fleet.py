"""`fbvm fleet`: the many equal PLCs of a project, in several processes or on a cluster, for load tests of what talks to them."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fbvm.cli.projects.cluster import client_of, cluster_option
from fbvm.cli.projects.planned_runs import MOST_PROCESSES, jobs_option, processes, refuse
from fbvm.cli.shared import status
from fbvm.cli.shared.files import check_outputs, writing
from fbvm.cli.shared.options import time_ns
from fbvm.cli.shared.paths import SourcePath
from fbvm.cli.shared.progress import show_progress
from fbvm.cli.shared.project_arguments import allow_outside_option, project_argument, read_given_project
from fbvm.cli.shared.sources import show_diagnostic
from fbvm.cli.shared.terminal import named, say, say_json

if TYPE_CHECKING:
    from fbvm.campaign.fleet.places import Places
    from fbvm.campaign.fleet.shard import Figures, Shard
    from fbvm.run.project import Project

PAUSE_NS = 1_000_000_000
LAST_NS = 20_000_000_000
"""How long the last figures of parts that were told to stop are waited for."""
OUTPUT = click.Path(dir_okay=False, path_type=Path)
Told = Mapping[int, "tuple[str, Figures]"]
"""By the number of each part: where it is, and its figures."""


@click.command("fleet")
@click.argument("project", required=False, type=SourcePath())
@click.option("--net", type=click.Choice(["loop", "tcp"]), help="The network, in place of the project's.")
@click.option("--for", "for_ns", type=time_ns, metavar="TIME", help="How long the PLCs run; until Ctrl-C by itself.")
@jobs_option
@cluster_option
@click.option("--shards", type=click.IntRange(1, MOST_PROCESSES), metavar="N",
              help="Parts of the fleet; on a cluster as many as it has workers by itself, else as many as --jobs.")
@click.option("--doors", "doors_file", type=OUTPUT, metavar="FILE",
              help="Write where each unit can be reached, as CSV, when all parts run.")
@click.option("--json-lines", is_flag=True, help="Print the figures of each part as a JSON object a line, about once a second.")
@allow_outside_option
def command(project: Path | None, **options: Any) -> None:
    """Run the PLCs of a project in several processes, or beside the workers of a Dask cluster.

    PLCs with a `count` are spread evenly, all others run in the first part.  Each part has the doors of its own PLCs.  Ctrl-C
    ends all of them, and figures of each are printed.

    Status 0; 3 if the project or its programs have errors, 4 if traps have stopped PLCs, 5 if a part could not run."""
    from fbvm.campaign.execution import Wrong
    from fbvm.campaign.work import Mismatch, Unreachable

    try:
        told = _conducted(_places(project, options), options)
    except Wrong as error:
        refuse(error.diagnostics)
    except (Mismatch, Unreachable) as error:
        say(str(error), fg="red", err=True)
        sys.exit(status.NETWORK)
    if not options["json_lines"]:
        _print(told)
    for _, each in told.values():
        if each.message:
            say(f"part {each.number + 1}: {each.message}", fg="red", err=True)
    failed = any(each.state == "failed" for _, each in told.values())
    sys.exit(status.NETWORK if failed else status.STOPPED if any(each.traps for _, each in told.values()) else status.GOOD)


def _places(file: Path | None, options: dict[str, Any]) -> AbstractContextManager[Places]:
    """What runs the parts of the project.  Ends the verb for what is wrong.  Raises Wrong."""
    from fbvm.base.version import VERSION
    from fbvm.campaign.fleet.places import here, in_cluster
    from fbvm.campaign.fleet.shard import Shard
    from fbvm.campaign.planning import images_of
    from fbvm.campaign.work import packed
    from fbvm.run.shards import shards_of

    project, for_ns = _project(file, options)
    check_outputs(options["doors_file"])
    _check_shards(project, options["shards"])
    found, said = images_of(project)
    for diagnostic in said:
        show_diagnostic(diagnostic)
    images = packed(found)

    def shards(count: int) -> list[Shard]:
        parts = shards_of(project, options["shards"] or count)
        rows = [{row.name for row in part.plcs} for part in parts]
        return [Shard(number, part, tuple(image for image in images if image[0] in names), VERSION, for_ns)
                for number, (part, names) in enumerate(zip(parts, rows, strict=True))]  # fmt: skip

    jobs = processes(options["jobs"])
    return in_cluster(client_of(options["cluster"], jobs), shards) if options["cluster"] else here(shards(jobs))


def _check_shards(project: Project, shards: int | None) -> None:
    plcs = sum(row.count or 1 for row in project.plcs)
    if shards and shards > plcs:
        raise click.UsageError(f"--shards {shards}: there {'is' if plcs == 1 else 'are'} {plcs:,} PLC{'s' * (plcs != 1)}; "
                               "a part has one at least")  # fmt: skip


def _project(file: Path | None, options: dict[str, Any]) -> tuple[Project, int | None]:
    """The project on its network, and how long it runs.  Ends the verb for what is wrong."""
    from fbvm.run.project import Project

    path = project_argument((file,) if file else ())
    if path is None:
        raise click.UsageError(f"{named(file or '.')} is no project: a fleet is one with a count of PLCs in its fbvm.toml")
    found = read_given_project(path)
    if not isinstance(found, Project):
        refuse(found)
    project = replace(found, net=options["net"] or found.net)
    if wrong := project.wrong_on(project.net):
        refuse(wrong)
    for_ns = options["for_ns"] or project.for_ns
    if project.net == "loop" and not for_ns and project.scans is None and not any(row.until for row in project.plcs):
        raise click.UsageError('say when to end, by --for or by for = "10s" in [run]: in memory there is no real time')
    return project, for_ns


def _conducted(places: AbstractContextManager[Places], options: dict[str, Any]) -> Told:
    """Runs all parts to their ends, or to Ctrl-C; the last figures of each."""
    from fbvm.run.time_limit import pause, stopwatch, time_limit

    with places as parts, show_progress("fleet") as update:
        told, scans, elapsed, has_doors = parts.figures(), 0, stopwatch(), False
        try:
            while not _all(told, "over", "failed"):
                pause(PAUSE_NS)
                told = parts.figures()
                total = sum(each.scans for _, each in told.values())
                running = sum(each.state == "running" for _, each in told.values())
                update(_in_words(told, (total - scans) * 1e9 / max(elapsed(), 1)), running, len(told))
                scans, elapsed = total, stopwatch()
                if options["json_lines"]:
                    say_json(_as_dict(told))
                if not has_doors and _all(told, "running", "over"):
                    has_doors = True
                    if options["doors_file"]:
                        _write_doors(told, options["doors_file"])
        except KeyboardInterrupt:
            say("stopping all parts", err=True)
        parts.stop()
        is_late = time_limit(LAST_NS)
        while not _all(told, "over", "failed") and not is_late():
            pause(PAUSE_NS // 20)
            told = parts.figures()
        if options["json_lines"]:
            say_json(_as_dict(told))
    return told


def _all(told: Told, *states: str) -> bool:
    return all(each.state in states for _, each in told.values())


def _in_words(told: Told, rate: float) -> str:
    each = [figures for _, figures in told.values()]
    plcs, connections, missed = (sum(getattr(one, name) for one in each) for name in ("plcs", "connections", "missed"))
    return f"{plcs:,} PLCs, {rate:,.0f} scans a second, {connections:,} connections, {missed:,} periods missed; parts that run"


def _as_dict(told: Told) -> dict[str, Any]:
    """The figures for --json-lines, without doors, of which there are thousands."""
    shards = [{"where": where} | {name: value for name, value in asdict(each).items() if name != "doors"}
              for where, each in told.values()]  # fmt: skip
    return {**{name: sum(shard[name] for shard in shards) for name in ("plcs", "scans", "missed", "traps", "connections")},
            "shards": shards}  # fmt: skip


def _write_doors(told: Told, path: Path) -> None:
    """Writes into a file where each unit can be reached."""
    doors = {unit: (real, where) for where, each in told.values() for unit, real in each.doors.items()}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["unit", "door", "where"])
    writer.writerows([unit, real, where] for unit, (real, where) in doors.items())
    from fbvm.base.files import write_file

    with writing(path):
        write_file(path, text.getvalue())


COLUMNS: dict[str, Callable[[Figures], float]] = {
    "PLCs": lambda each: each.plcs, "doors": lambda each: len(each.doors), "scans": lambda each: each.scans,
    "a second": lambda each: each.scans / each.elapsed_s if each.elapsed_s else 0, "missed": lambda each: each.missed,
    "connections": lambda each: each.connections, "trapped": lambda each: each.traps}  # fmt: skip
"""What is printed of each part, and summed up."""


def _print(told: Told) -> None:
    """A table with a line for each part, and one for all."""
    rows = [[str(each.number + 1), where, *(f"{value(each):,.0f}" for value in COLUMNS.values()), _late(each)]
            for where, each in told.values()]  # fmt: skip
    rows.append(["all", "", *(f"{sum(value(each) for _, each in told.values()):,.0f}" for value in COLUMNS.values()), ""])
    table = [["part", "where", *COLUMNS, "latest scan"], *rows]
    widths = [max(len(row[at]) for row in table) for at in range(len(table[0]))]
    for row in table:
        cells = [cell.ljust(width) if at < 2 else cell.rjust(width)
                 for at, (cell, width) in enumerate(zip(row, widths, strict=True))]  # fmt: skip
        say("  ".join(cells).rstrip())


def _late(figures: Figures) -> str:
    """How much too late a scan began at most, where time is real."""
    longest_ns = figures.lateness.get("longest_ns")
    return f"{longest_ns / 1e6:.1f} ms late" if longest_ns else ""
