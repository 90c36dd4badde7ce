"""`fbvm check`: what is wrong with a program."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fbvm.base.diagnostics import errors
from fbvm.cli import status
from fbvm.cli.patience import patience
from fbvm.cli.sources import report, source_arguments
from fbvm.code.compiler import compile_files


@click.command("check")
@source_arguments
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], as_json: bool) -> None:
    """Say what is wrong with the files; silent, and status 0, when nothing is.

    Status 3 if there is an error; warnings are shown and leave the status 0."""
    with patience(f"checking {', '.join(path.name for path in files)}"):
        compilation = compile_files(files, program=program, libraries=libraries)
    if compilation.diagnostics or as_json:
        report(compilation, as_json)
    if errors(compilation.diagnostics):
        sys.exit(status.PROGRAM_ERRORS)
