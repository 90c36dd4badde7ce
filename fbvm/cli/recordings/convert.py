"""`fbvm convert`: a trace as another format, and a table as a trace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from io import BytesIO, StringIO, TextIOWrapper
from pathlib import Path

import click

from fbvm.base.files import TABLE_BYTES, new_file, read_file, reason, write_file
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.options import split_names
from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.terminal import named
from fbvm.cli.shared.traces import (
    SUFFIX,
    ScanRange,
    open_trace,
    require_scans,
    samples_of,
    scans_option,
    trace_options,
    waveforms_of,
)
from fbvm.record.draw.svg import SvgChart
from fbvm.record.export.pcapng import Capture
from fbvm.record.export.vcd import write_vcd
from fbvm.record.page.data import page_data
from fbvm.record.page.page import page
from fbvm.record.trace.csv_reader import CsvError, read_csv
from fbvm.record.trace.csv_writer import write_csv
from fbvm.record.trace.scan_source import ScanSource
from fbvm.record.trace.signals import network_events, packets
from fbvm.record.trace.writer import Depth

CSV, HTML = ".csv", ".html"
Names = Sequence[str]


def _csv(trace: ScanSource, names: Names, scans: range | None, path: Path) -> None:
    found = samples_of(trace, names, scans)
    with new_file(path) as file:
        text = TextIOWrapper(file, encoding="utf-8", newline="")
        write_csv(found, text)
        text.detach()


def _vcd(trace: ScanSource, names: Names, scans: range | None, path: Path) -> None:
    if find_spec("vcd") is None:
        raise click.UsageError("VCD needs the package pyvcd: pip install 'fbvm[vcd]'")
    found = samples_of(trace, names, scans)
    with new_file(path) as file:
        text = TextIOWrapper(file, encoding="ascii", errors="replace", newline="\n")
        write_vcd(found, text)
        text.detach()


def _svg(trace: ScanSource, names: Names, scans: range | None, path: Path) -> None:
    made = waveforms_of(trace, names, scans)
    write_file(path, SvgChart(made, packets(trace, made.scans), path.stem).text())


def _html(trace: ScanSource, names: Names, scans: range | None, path: Path, inside: Sequence[range] = ()) -> None:
    require_scans(trace, scans)
    write_file(path, page(page_data(trace, names, scans, path.stem, inside=inside)))


def _pcapng(trace: ScanSource, names: Names, scans: range | None, path: Path) -> None:
    if names:
        raise click.UsageError("a capture holds what passed the network; it takes no names")
    with new_file(path) as file:
        said = ""
        capture = Capture(file, comment=lambda address: said)
        for scan, event in network_events(trace, scans):
            said = f"scan {scan}"
            capture.tap(event.now_ns, event.tap_event.local.host, replace(event.tap_event, mirrored=False))


FORMATS: dict[str, Callable[[ScanSource, Names, range | None, Path], None]] = {
    HTML: _html, ".svg": _svg, CSV: _csv, ".vcd": _vcd, ".pcapng": _pcapng,
}  # fmt: skip


@click.command("convert")
@click.argument("source", metavar="FROM", type=ExistingPath(dir_okay=False))
@click.argument("target", metavar="TO", type=click.Path(dir_okay=False, path_type=Path))
@click.argument("names", nargs=-1, metavar="[NAME|ADDRESS|FIRST..LAST]...")
@scans_option
@trace_options
@click.option("--inside", type=ScanRange(), multiple=True,
              help="Scans that a page shows statement by statement even if it cannot do so for all; may be given several times.")
def command(source: Path, target: Path, names: tuple[str, ...], scans: range | None, plc: str | None,
            libraries: tuple[Path, ...], inside: tuple[range, ...]) -> None:  # fmt: skip
    """Write a trace as a page that shows all of it, a picture, or a table; or a table as a trace.

    \b
    .html  one file for a browser: chart, inside of each scan, memory, frames
    .svg   a time chart for documents
    .csv   a table; FROM may be one, too, and becomes a trace
    .vcd   for GTKWave and Surfer
    .pcapng  what passed the network, for Wireshark

    Without names, all variables that changed are written."""
    if inside and target.suffix.lower() != HTML:
        raise click.UsageError(f"--inside is about pages; {named(target)} is none")
    with writing(target):
        if source.suffix.lower() == CSV:
            _to_trace(source, target)
            return
        write = FORMATS.get(target.suffix.lower())
        if write is None:
            raise click.UsageError(f"{named(target)}: what it shall be is not clear; end it with {', '.join(FORMATS)}")
        depth = None if write is _html else Depth.SCANS
        with open_trace(source, plc, libraries, depth) as trace:
            chosen = [name for text in names for name in split_names(text)]
            if inside:
                _html(trace, chosen, scans, target, inside)
            else:
                write(trace, chosen, scans, target)


def _to_trace(source: Path, target: Path) -> None:
    if target.suffix.lower() != SUFFIX:
        raise click.UsageError(f"{named(target)}: a table becomes a trace; end it with {SUFFIX}")
    made = BytesIO()
    try:
        text = read_file(source, TABLE_BYTES).decode("utf-8-sig")
        read_csv(StringIO(text, newline=""), made)
    except OSError as error:
        raise click.UsageError(f"{named(source)} cannot be read: {reason(error)}") from None
    except (CsvError, UnicodeDecodeError) as error:
        raise click.UsageError(f"{named(source)}: {error}") from None
    write_file(target, made.getvalue())
