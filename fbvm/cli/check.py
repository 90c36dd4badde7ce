"""`fbvm check`: what is wrong with a program."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fbvm.base.diagnostics import errors
from fbvm.check.silence import Wanted
from fbvm.cli import status
from fbvm.cli.patience import patience
from fbvm.cli.sources import chosen, report, source_arguments
from fbvm.code.compiler import compile_files


@click.command("check")
@source_arguments
@click.option("--no-warn", metavar="CODE", multiple=True,
              help="Do not warn of that, such as S0390, or of `all`; may be repeated, or a list with commas.")
@click.option("--warnings-as-errors", is_flag=True, help="A warning counts as an error.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], no_warn: tuple[str, ...],
            warnings_as_errors: bool, as_json: bool) -> None:
    """Say what is wrong with the files; silent, and status 0, when nothing is.

    Status 3 if there is an error; warnings are shown and leave the status 0.  In a text, `{warning disable S0390}` ..
    `{warning restore S0390}` switches a warning off."""
    codes = [code for listed in no_warn for code in listed.split(",")]
    try:
        Wanted.of(codes, warnings_as_errors)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--no-warn") from None
    with patience(f"checking {', '.join(path.name for path in files)}") as progress:
        compilation = compile_files(files, program=program, libraries=libraries, no_warn=codes,
                                    warnings_as_errors=warnings_as_errors, progress=progress,
                                    **chosen())
    if compilation.diagnostics or as_json:
        report(compilation.diagnostics, as_json)
    if errors(compilation.diagnostics):
        sys.exit(status.PROGRAM_ERRORS)
