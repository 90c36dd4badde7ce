"""`fbvm fmt`: sources in canonical form."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from difflib import unified_diff
from pathlib import Path

import click

from fbvm.base.diagnostics import Source, whole_lines
from fbvm.base.files import SOURCE_BYTES, read_all, read_file, reason, write_file
from fbvm.check.spelling import OUTSIDE
from fbvm.cli.shared import status
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.paths import SourcePath
from fbvm.cli.shared.sources import show_diagnostic
from fbvm.cli.shared.terminal import named, say, say_exactly
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.ladder.notation import Form, Notation
from fbvm.syntax.text import MARKS, decode, refusal

STREAM = Path("-")
ENCODINGS = (*MARKS, (b"", "utf-8"), (b"", "cp1252"), (b"", "latin-1"))
"""Marks and their encodings, in the order in which they are recognised."""


@click.command("fmt")
@click.argument("files", nargs=-1, required=True, metavar="FILE...",
                type=SourcePath(allow_dash=True))
@click.option("--check", is_flag=True, help="Write nothing; status 1 if a file would change.")
@click.option("--diff", is_flag=True, help="Write nothing; show what would change.")
@click.option("--mnemonics", "form", flag_value=Form.MNEMONICS.name, help="Write drawn rungs as instructions.")
@click.option("--drawing", "form", flag_value=Form.DRAWING.name, help="Draw the rungs that are written as instructions.")
def command(files: tuple[Path, ...], check: bool, diff: bool, form: str | None) -> None:
    """Rewrite the files in canonical Structured Text, and print the names of those that change.

    The program means the same.  A rung that has no drawing stays as its instructions, and is named.  A folder stands for all
    files in it that end in .st; FILE - reads the standard input and writes the standard output.  A file with syntax errors is
    left alone, and the status is 3."""
    results = [_one(path, check, diff, Notation(Form[form]) if form else None) for path in _found(files)]
    if None in results:
        sys.exit(status.PROGRAM_ERRORS)
    if check and any(results):
        sys.exit(status.FAILED)


def _found(paths: Iterable[Path]) -> list[Path]:
    """The files themselves and those in folders, each once."""
    found: dict[Path, None] = {}
    for path in paths:
        inside = sorted(file for file in path.rglob("*") if file.suffix.lower() == ".st" and file.is_file())
        found.update(dict.fromkeys(inside if path.is_dir() else [path]))
        if path.is_dir() and not inside:
            say(f"{named(path)}: no file in this folder ends in .st", err=True)
    return list(found)


def _one(path: Path, check: bool, diff: bool, notation: Notation | None) -> bool | None:
    """Formats one file; returns True if it changes, None if it has errors."""
    source, data = _read(path)
    if source is None:
        _left_alone(str(path), "it cannot be read")
        return None
    text, wrong = formatted(source, OUTSIDE, notation)
    for diagnostic in wrong:
        show_diagnostic(diagnostic)
    if wrong:
        _left_alone(source.name, "one syntax error" if len(wrong) == 1 else f"{len(wrong)} syntax errors")
        return None
    if notation is not None:
        _name_kept(source.name, notation)
    changes = text != source.text
    if diff:
        say_exactly("".join(_difference(source, text)))
    elif check:
        if changes:
            say(named(source.name))
    elif path == STREAM and sys.stdout.isatty():
        say_exactly(text)
    elif path == STREAM:
        sys.stdout.buffer.write(_encoded(source.text, text, data))
    elif changes:
        _replace(path, _encoded(source.text, text, data))
        say(named(path))
    return changes


def _name_kept(name: str, notation: Notation) -> None:
    """Names the rungs that have no other notation."""
    for line in notation.kept:
        say(f"{named(name)}:{line}: this rung cannot be written as {notation.form.value}", err=True)


def _left_alone(name: str, why: str) -> None:
    say(f"{named(name)} is left as it is: {why}", bold=True, err=True)


def _read(path: Path) -> tuple[Source | None, bytes]:
    """The text and the bytes of a file; without a text its error is printed."""
    name = "stdin" if path == STREAM else str(path)
    try:
        data = read_all(sys.stdin.buffer, SOURCE_BYTES) if path == STREAM else read_file(path, SOURCE_BYTES)
        source = decode(data, name)
    except OSError as error:
        data, source = b"", refusal(name, reason(error))
    if isinstance(source, Source):
        return source, data
    show_diagnostic(source)
    return None, data


def _encoded(before: str, after: str, data: bytes) -> bytes:
    """The new text in the encoding of the old one, with its byte order mark."""
    for mark, encoding in ENCODINGS:
        if data.startswith(mark):
            try:
                if whole_lines(data[len(mark):].decode(encoding)) == before:
                    return mark + after.encode(encoding)
            except UnicodeError:
                continue
    raise AssertionError("a text has the encoding with which it was read")


def _replace(path: Path, data: bytes) -> None:
    """Replaces a file at once."""
    with writing(path):
        write_file(path, data)


def _difference(source: Source, text: str) -> Iterator[str]:
    """The changes as a unified diff."""
    before, after = source.text.splitlines(keepends=True), text.splitlines(keepends=True)
    for line in unified_diff(before, after, named(source.name), named(source.name)):
        yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
