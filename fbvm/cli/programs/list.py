"""`fbvm list`: the Image, readable."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.cli.shared.sources import compile_or_exit, source_arguments
from fbvm.cli.shared.terminal import say
from fbvm.code.listing import listing
from fbvm.engine.native.emit.module import translate


@click.command("list")
@source_arguments
@click.option("--native", "as_native", is_flag=True, help="Print the LLVM code instead.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], as_native: bool) -> None:
    """Print what the files compile to: tasks, layout, symbols and the code of each POU."""
    image = compile_or_exit(files, program, libraries, runnable=False)
    say(translate(image).text if as_native else listing(image))
