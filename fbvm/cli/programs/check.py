"""`fbvm check`: what is wrong with a program."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

import click

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.check.lint.suppression import Wanted
from fbvm.cli.shared import status
from fbvm.cli.shared.given_sources import inputs
from fbvm.cli.shared.paths import SourcePath, taken_folders
from fbvm.cli.shared.project_arguments import allow_outside_option, check_project_options, project_argument, read_given_project
from fbvm.cli.shared.sources import compile_options, report_diagnostics, source_options
from fbvm.code.compiler import LONG, compile_files

PROJECT_OPTIONS = {"no_warn": "--no-warn", "warnings_as_errors": "--warnings-as-errors", "as_json": "--json"}
"""The options that may be given with a project."""


@click.command("check")
@source_options
@click.argument("files", nargs=-1, metavar="[FILE... | PROJECT]", type=SourcePath(), callback=taken_folders)
@click.option("--no-warn", metavar="CODE", multiple=True,
              help="Do not warn of that, such as S0390, or of `all`; may be repeated, or a list with commas.")
@click.option("--warnings-as-errors", is_flag=True, help="A warning counts as an error.")
@allow_outside_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], no_warn: tuple[str, ...],
            warnings_as_errors: bool, as_json: bool) -> None:
    """Say what is wrong with the files; silent, and status 0, when nothing is.  Of a PROJECT, a folder with an fbvm.toml
    or the one where you are, the programs of all PLCs are checked and what else its file says.

    Status 3 if there is an error; warnings are shown and leave the status 0.  In a text, `{warning disable S0390}` ..
    `{warning restore S0390}` switches a warning off."""
    codes = [code for listed in no_warn for code in listed.split(",")]
    try:
        wanted = Wanted.of(codes, warnings_as_errors)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--no-warn") from None
    with _progress(files) as progress:
        if project := project_argument(files):
            check_project_options(click.get_current_context(), PROJECT_OPTIONS)
            diagnostics = _of_project(project, wanted)
        else:
            given, found = inputs(files)
            made = compile_files(given, program=program, libraries=libraries, no_warn=codes,
                                 warnings_as_errors=warnings_as_errors, progress=progress, **compile_options(files))
            diagnostics = found + made.diagnostics
    if diagnostics or as_json:
        report_diagnostics(diagnostics, as_json)
    if errors(diagnostics):
        sys.exit(status.PROGRAM_ERRORS)


def _progress(files: tuple[Path, ...]) -> AbstractContextManager[Callable[[str, int, int], None]]:
    """A context that shows the progress of a long check on a terminal; for short files, rich is not imported."""
    if not sys.stderr.isatty() or all(path.is_file() for path in files) and sum(path.stat().st_size for path in files) < LONG:
        return nullcontext(lambda what, done, known: None)
    from fbvm.cli.shared.progress import show_progress

    return show_progress(f"checking {', '.join(path.name for path in files)}")


def _of_project(file: Path, wanted: Wanted) -> list[Diagnostic]:
    """The diagnostics of a project file and of the programs of its PLCs, without duplicates."""
    from fbvm.run.plant import Plant
    from fbvm.run.project import Project

    project = read_given_project(file)
    if not isinstance(project, Project):
        return project
    one_each = tuple(replace(row, count=row.count and 1) for row in project.plcs)
    plant = Plant(replace(project, plcs=one_each), net="loop", wanted=wanted)
    plant.close()
    return list({diagnostic.render(): diagnostic for diagnostic in plant.diagnostics}.values())
