"""`fbvm list`: the Image, readable."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.cli.sources import compiled, source_arguments
from fbvm.code.listing import listing


@click.command("list")
@source_arguments
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...]) -> None:
    """Print what the files compile to: tasks, layout, symbols and the code of each POU."""
    click.echo(listing(compiled(files, program, libraries, runnable=False)))
