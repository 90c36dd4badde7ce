"""`fbvm chart`: the time chart of a trace."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.cli.shared.options import split_names
from fbvm.cli.shared.run_result import chart_width
from fbvm.cli.shared.terminal import say
from fbvm.cli.shared.traces import open_trace, scans_option, trace_argument, waveforms_of
from fbvm.record.draw.chart import draw
from fbvm.record.trace.writer import Depth


@click.command("chart")
@trace_argument
@click.argument("names", nargs=-1, metavar="[NAME|ADDRESS|FIRST..LAST]...")
@scans_option
@click.option("--width", type=click.IntRange(min=20), help="Columns of text; the terminal's if not given.")
@click.option("--whole", is_flag=True, help="Draw every scan, also where nothing changes for long.")
def command(path: Path, names: tuple[str, ...], scans: range | None, width: int | None, whole: bool, plc: str | None,
            libraries: tuple[Path, ...]) -> None:  # fmt: skip
    """Draw variables of a TRACE, one column a scan.  Without names, those that changed.

    A trace can be drawn while it is still being written."""
    with open_trace(path, plc, libraries, Depth.SCANS) as trace:
        chosen = [name for text in names for name in split_names(text)]
        made = waveforms_of(trace, chosen, scans)
        say(draw(made, width=width or chart_width(), ruler=True, compress=not whole), nl=False)
