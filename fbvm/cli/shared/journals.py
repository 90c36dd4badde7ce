"""Journals of fbvm 0.1: the inputs of a run, with its program."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from io import TextIOWrapper
from pathlib import Path
from typing import Any

import click

from fbvm.base.diagnostics import Source
from fbvm.base.files import LINE_CHARACTERS, open_file, reason
from fbvm.cli.shared import status
from fbvm.cli.shared.sources import report_diagnostics
from fbvm.cli.shared.terminal import named
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.net.journal import Entry, Header, JournalError, open_journal


@contextmanager
def open_journal_file(path: Path) -> Iterator[tuple[Header, Iterator[Entry]]]:
    """Opens a journal file for a `with` block: its header and its entries.  A JournalError in the block ends the verb with
    status 2."""
    try:
        with TextIOWrapper(open_file(path), encoding="utf-8", newline="\n") as file:
            yield open_journal(_text(file))
    except JournalError as error:
        raise click.UsageError(f"{named(path)}: {error}") from None
    except OSError as error:
        raise click.UsageError(f"{named(path)} cannot be read: {reason(error)}") from None


def _text(file: TextIOWrapper) -> Iterator[str]:
    try:
        for number, line in enumerate(iter(partial(file.readline, LINE_CHARACTERS), "")):
            if number == 0 and not line.startswith("{"):
                raise JournalError("this is neither a recording of fbvm nor a journal; `fbvm run --trace FILE` writes one")
            yield line
    except UnicodeDecodeError:
        raise JournalError("this is neither a recording of fbvm nor a journal") from None


def program_of(header: Header, libraries: Sequence[Path], as_json: bool) -> Image:
    """Compiles the program in a journal.  Ends the verb with status 3 if it has errors.

    `libraries` replace the folders that the journal names.  Raises JournalError for a journal without a program."""
    about: dict[str, Any] = header.about
    try:
        sources = [Source(str(name), str(text)) for name, text in about["sources"]]
        folders = list(libraries) or [Path(folder) for folder in about["libraries"]]
        banks = [str(name) for name in about.get("banks", ())]
        program = None if about["program"] is None else str(about["program"])
        choice = {str(name): str(value) for name, value in about.get("chosen", {}).items()}
    except (AttributeError, KeyError, TypeError, ValueError):
        raise JournalError("it holds no program; one that Python wrote is done again from Python") from None
    for folder in folders:
        if not folder.is_dir():
            raise JournalError(f"the program needs the library folder {named(folder)}; say where it is now with --library")
    compilation = compile_sources(sources, program, folders, runnable=True, lint=False, resource=choice.get("resource"),
                                  dialect=choice.get("dialect", "standard"))
    if compilation.image is None:
        report_diagnostics(compilation.diagnostics, as_json)
        sys.exit(status.PROGRAM_ERRORS)
    return compilation.image.with_e_banks(banks)
