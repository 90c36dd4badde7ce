"""`fbvm convert`: a trace as another format, and a table as a trace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from fbvm.cli.options import split_names
from fbvm.cli.traces import SUFFIX, opened, recorded, scans_option
from fbvm.record.recorder import Recording
from fbvm.record.rows import RowsError, read_rows, write_rows
from fbvm.record.vcd import write_vcd

CSV = ".csv"


def _csv(recording: Recording, path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        write_rows(recording, file)


def _vcd(recording: Recording, path: Path) -> None:
    with path.open("w", encoding="ascii", errors="replace") as file:
        try:
            write_vcd(recording, file)
        except ModuleNotFoundError:
            raise click.UsageError("VCD needs the package pyvcd: pip install 'fbvm[vcd]'") from None


FORMATS: dict[str, Callable[[Recording, Path], None]] = {CSV: _csv, ".vcd": _vcd}


@click.command("convert")
@click.argument("source", metavar="FROM", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.argument("target", metavar="TO", type=click.Path(dir_okay=False, path_type=Path))
@click.argument("names", nargs=-1, metavar="[NAME|ADDRESS|FIRST..LAST]...")
@scans_option
def command(source: Path, target: Path, names: tuple[str, ...], scans: range | None) -> None:
    """Write a trace as .csv or .vcd (for GTKWave and Surfer), or a .csv as a trace.

    FROM and TO are told apart by their endings.  Without names, all variables that changed are written."""
    try:
        if source.suffix.lower() == CSV:
            _to_trace(source, target)
            return
        write = FORMATS.get(target.suffix.lower())
        if write is None:
            raise click.UsageError(f"{target}: what it shall be is not clear; end it with {', '.join(FORMATS)}")
        with opened(source) as trace:
            write(recorded(trace, [name for text in names for name in split_names(text)], scans), target)
    except OSError as error:
        raise click.UsageError(f"{target} cannot be written: {error.strerror}") from None


def _to_trace(source: Path, target: Path) -> None:
    if target.suffix.lower() != SUFFIX:
        raise click.UsageError(f"{target}: a table becomes a trace; end it with {SUFFIX}")
    try:
        with source.open(encoding="utf-8-sig", newline="") as file, target.open("wb") as out:
            read_rows(file, out)
    except (RowsError, UnicodeDecodeError) as error:
        raise click.UsageError(f"{source}: {error}") from None
