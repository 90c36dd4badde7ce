"""`fbvm table`: the scan table of a trace, statement by statement."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fbvm.cli.shared import status
from fbvm.cli.shared.options import split_names
from fbvm.cli.shared.terminal import named, say
from fbvm.cli.shared.traces import open_trace, scans_option, trace_argument
from fbvm.record.draw.table import ScanTable
from fbvm.record.trace.recorder import signals_at
from fbvm.record.trace.writer import Depth

MOST_SCANS = 10_000
"""Without --scans so many are looked at, the last ones: some seconds."""


@click.command("table")
@trace_argument
@click.argument("names", nargs=-1, required=True, metavar="NAME|ADDRESS|FIRST..LAST...")
@scans_option
@click.option("--every", is_flag=True, help="Also the statements and the scans that changed none of these.")
def command(path: Path, names: tuple[str, ...], scans: range | None, every: bool, plc: str | None,
            libraries: tuple[Path, ...]) -> None:  # fmt: skip
    """Show which statement changed variables of a TRACE, and in which phase of the scan.

    Without --scans, of a longer trace only the last 10,000 scans are looked at.  Status 1 if nothing changed."""
    with open_trace(path, plc, libraries, Depth.STATEMENTS) as trace:
        if trace.depth is Depth.SCANS:
            raise click.UsageError(f"{named(path)} holds values at scan ends only, not what statements did")
        signals = [signal for text in names for name in split_names(text)
                   for signal in signals_at(trace.find(name), trace.described, trace.meanings)]  # fmt: skip
        table = ScanTable(trace.sites, trace.names, signals, every)
        if scans is None and len(trace.scans) > MOST_SCANS:
            scans = trace.scans[-MOST_SCANS:]
            say(f"only scans {scans[0]} to {scans[-1]} were looked at; --scans FIRST..LAST looks at others", fg="yellow",
                err=True)
        trace.follow(table, scans)
    bands = [band for band in table.bands if every or band.has_changes]
    if not bands:
        say("none of these changed", err=True)
        sys.exit(status.FAILED)
    say(table.draw(bands))
