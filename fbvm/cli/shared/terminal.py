"""The only way to the terminal: what a verb says passes here, so that no file, name or peer sends control characters to it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from fbvm.base.printable import one_line, printable


def say(text: object = "", *, err: bool = False, nl: bool = True, fg: str | None = None, bold: bool | None = None) -> None:
    """Prints a text on stdout, or on stderr with `err`; in a colour or bold on a terminal; it is written at once.  Control and
    escape characters in it are shown as escapes."""
    click.secho(printable(str(text)), err=err, nl=nl, fg=fg, bold=bold)


def say_exactly(text: str) -> None:
    """Prints the contents of a file on stdout: to the letter into a file or a pipe, as `say` does on a terminal."""
    click.echo(printable(text) if sys.stdout.isatty() else text, nl=False)


def say_json(data: object, indent: int | None = None) -> None:
    """Prints one JSON object on stdout.  Raises ValueError for numbers that JSON does not have."""
    click.echo(json.dumps(data, indent=indent, allow_nan=False).replace("\x7f", "\\u007f"))


def named(path: Path | str) -> str:
    """The name of a file in a message: one line without control characters."""
    return one_line(str(path))
