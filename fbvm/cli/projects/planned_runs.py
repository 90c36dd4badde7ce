"""What `campaign` and `sweep` share: their arguments, and the plan that these are."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from fbvm.base.diagnostics import Diagnostic
from fbvm.cli.shared import status
from fbvm.cli.shared.files import check_outputs, writing
from fbvm.cli.shared.options import cycle_option, mapping, show_option, time_ns
from fbvm.cli.shared.paths import SourcePath, taken_folders
from fbvm.cli.shared.project_arguments import allow_outside_option, project_argument, read_given_project
from fbvm.cli.shared.sources import compile_options, report_diagnostics, show_diagnostic, source_options
from fbvm.cli.shared.terminal import named

if TYPE_CHECKING:
    from fbvm.campaign.plan import Plan
    from fbvm.campaign.plan_file import Written
    from fbvm.code.image import Image
    from fbvm.run.project import Project

OUTPUT = click.Path(dir_okay=False, path_type=Path)
MOST_PROCESSES = 1_000
MOST_SEED = 1 << 62
jobs_option = click.option("--jobs", type=click.IntRange(1, MOST_PROCESSES), metavar="N",
                           help="Processes; as many as there are processors by itself.")


class RunPath(SourcePath):
    """A source, a folder or a file of settings, or tests as pytest names them: FILE::TEST."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path; of a test with its name.  Raises BadParameter."""
        file, mark, _ = str(value).partition("::")
        if not mark:
            return super().convert(value, param, ctx)
        super().convert(file, param, ctx)
        return Path(value)


def tests_among(files: Sequence[Path]) -> list[str]:
    """The arguments that are tests: files of Python, and names of tests."""
    return [str(file) for file in files if file.suffix == ".py" or "::" in str(file)]


def plan_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """What is run, for how long, what is varied and shown, and by how many processes."""
    for decorate in (
        click.argument("files", nargs=-1, metavar="[FILE... | PROJECT | CAMPAIGN | TEST...]", type=RunPath(),
                       callback=taken_folders),
        source_options,
        cycle_option,
        click.option("--map", "mappings", type=mapping, multiple=True, metavar="IP:PORT=peer",
                     help="Of a program: an endpoint at which it finds a Modbus server in memory."),
        click.option("--for", "for_ns", type=time_ns, metavar="TIME", help="How long a run takes at most."),
        click.option("--until", metavar="EXPRESSION", help="End a run when this holds."),
        click.option("--vary", "varied", multiple=True, metavar="NAME=VALUE,...|FIRST..LAST[/STEP]",
                     help="Write each of these values before the first scan; PLC.cycle, PLC.phase and PLC.timing are settings."),
        show_option,
        click.option("--seed", type=click.IntRange(0, MOST_SEED), metavar="N", help="What runs are drawn by."),
        jobs_option,
        click.option("--csv", "csv_file", type=OUTPUT, metavar="FILE", help="Write the results as CSV."),
        click.option("--parquet", "parquet_file", type=OUTPUT, metavar="FILE", help="Write them as Parquet; needs pyarrow."),
        allow_outside_option,
    ):  # fmt: skip
        function = decorate(function)
    return function


def processes(jobs: int | None) -> int:
    """How many processes there are to be."""
    return jobs or os.cpu_count() or 1


def written_plan(files: Sequence[Path], options: dict[str, Any]) -> tuple[Written, Path | None]:
    """What the campaign file says that the arguments name, with the options of all verbs; and that file.

    Ends the verb with status 3 for errors in the file.  Raises ValueError."""
    from fbvm.campaign.axes import axis_from_text
    from fbvm.campaign.plan_file import FILE, Written, is_campaign, read_plan_file, with_about

    written, where = Written(), _plan_file(files, FILE, is_campaign)
    if where:
        read = read_plan_file(where)
        if not isinstance(read, Written):
            refuse(read)
        written = read
    axes = [axis_from_text(text) for text in options["varied"]]
    if any(row.host is not None for row in options["mappings"]):
        raise click.UsageError("runs are in memory: write --map IP:PORT=peer")
    servers = (*written.about["servers"], *(row.endpoint for row in options["mappings"]))
    given = {"for": options["for_ns"], "until": options["until"], "seed": options["seed"]}
    written = with_about(written, servers=servers, show=(*written.about["show"], *options["shown"]),
                         **{name: value for name, value in given.items() if value is not None})  # fmt: skip
    return replace(written, axes=(*written.axes, *axes)), where


def planned(files: Sequence[Path], program: str | None, libraries: Sequence[Path], options: dict[str, Any],
            change: Callable[[Written, Project], Written]) -> tuple[Plan, dict[str, Image], Path]:  # fmt: skip
    """The plan that arguments and options say, the compiled programs, and the folder to which golden files are relative.

    `change` adds what only one verb has.  Ends the verb with status 3 for errors in files and programs."""
    from fbvm.campaign.execution import Wrong
    from fbvm.campaign.plan_file import with_about
    from fbvm.campaign.planning import Unfit, images_of, plan_of, program_project

    where = None
    try:
        written, where = written_plan(files, options)
        folder = where.parent if where else Path()
        if not where and files and project_argument(tuple(files)) is None:
            written = with_about(written, sources=tuple(map(str, files)), program=program, cycle=options["cycle_ns"],
                                 libraries=tuple(map(str, libraries)), dialect=compile_options(files)["dialect"])  # fmt: skip
        if written.about["sources"]:
            project = program_project([folder / name for name in written.about["sources"]], written.about, folder)
        else:
            project = _project(files, where, written)
        images, said = images_of(project)
        for diagnostic in said:
            show_diagnostic(diagnostic)
        return plan_of(change(written, project), project, images), images, folder
    except Wrong as error:
        refuse(error.diagnostics)
    except (Unfit, ValueError) as error:
        is_of_file = where and not any(options.get(name) for name in OF_PROGRAMS)
        raise click.UsageError(f"{named(where)}: {error}" if where and is_of_file else str(error)) from None


OF_PROGRAMS = ("varied", "shown", "never", "always", "within", "until", "mappings")
"""Options whose names and values programs may not have; without them it is the file that is wrong."""


def refuse(diagnostics: Sequence[Diagnostic]) -> NoReturn:
    """Ends the verb with what is wrong with its files."""
    report_diagnostics(diagnostics, False)
    sys.exit(status.PROGRAM_ERRORS)


def _plan_file(files: Sequence[Path], usual: str, is_campaign: Callable[[Path], bool]) -> Path | None:
    """The campaign file that the arguments name: itself, or the one of that name in a folder."""
    if len(files) > 1:
        return None
    where = files[0] if files else Path()
    if where.is_dir():
        return where / usual if (where / usual).is_file() else None
    return where if where.suffix == ".toml" and is_campaign(where) else None


def _project(files: Sequence[Path], where: Path | None, written: Written) -> Project:
    from fbvm.run.project import Project, project_file

    if where:
        name = where.parent / (written.about["project"] or "fbvm.toml")
        file = project_file(name)
        if file is None:
            raise click.UsageError(f"{named(where)} runs the project {named(name)}, which is not there")
    else:
        file = project_argument(tuple(files))
        assert file is not None
    found = read_given_project(file)
    if not isinstance(found, Project):
        refuse(found)
    return found


def write_results(outcome: Any, options: dict[str, Any]) -> None:
    """Writes what --csv and --parquet ask for."""
    from fbvm.campaign.store import write_parquet, write_table

    if path := options["csv_file"]:
        with writing(path):
            write_table(path, outcome)
    if path := options["parquet_file"]:
        with writing(path):
            write_parquet(path, outcome)


def check_results(options: dict[str, Any]) -> None:
    """Ends the verb if `write_results` could not write, before it has anything to write."""
    check_outputs(options.get("csv_file"), options.get("parquet_file"))


def check_parquet(options: dict[str, Any]) -> None:
    """Raises UsageError if --parquet is asked for without its library."""
    from importlib.util import find_spec

    if options["parquet_file"] and find_spec("pyarrow") is None:
        raise click.UsageError("--parquet needs pyarrow: pip install pyarrow")
