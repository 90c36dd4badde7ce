"""Trace files: arguments and options of the verbs that read one, and the traces that `fbvm run` writes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from fbvm.base.digits import whole_number
from fbvm.base.files import reason, write_file
from fbvm.cli.shared.ending import held
from fbvm.cli.shared.files import growing_file, writing
from fbvm.cli.shared.given_sources import given_sources
from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.terminal import named, say
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.record.page.data import page_data
from fbvm.record.page.page import page
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.format import TraceError
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import Waveforms
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.source_texts import source_texts
from fbvm.record.trace.writer import Depth, TraceWriter, source_lines
from fbvm.watch.paths import UnknownPlace

SUFFIX = ".fbtrace"
LAST_SCAN = 1 << 62
"""No run has so many scans."""
INTERRUPTED_SCANS = 400
"""The scans on the page of a run that was interrupted."""


class ScanRange(click.ParamType[range]):
    """The option type of `41`, `10..60`, `10..`: numbers of scans, both ends included."""

    name = "FIRST..LAST"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> range:
        """The scans that a text names.  Raises BadParameter."""
        if isinstance(value, range):
            return value
        first, dots, last = str(value).partition("..")
        try:
            start = min(whole_number(first or "0"), LAST_SCAN)
            end = min(whole_number(last), LAST_SCAN) if last else start if not dots else LAST_SCAN
        except ValueError:
            self.fail(f"{value!r} is not scans such as 41 or 10..60", param, ctx)
        if start < 0 or end < start:
            self.fail(f"{value!r} has no scan in it", param, ctx)
        return range(start, end + 1)


def trace_argument(function: Callable[..., Any]) -> Callable[..., Any]:
    """TRACE, a file that `fbvm run --trace` wrote."""
    return click.argument("path", metavar="TRACE", type=ExistingPath(dir_okay=False))(function)


def scans_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """--scans, the part of a trace."""
    return click.option("--scans", type=ScanRange(), help="Only these scans.")(function)


@contextmanager
def open_trace(path: Path) -> Iterator[Trace]:
    """Opens a trace for a `with` block.  A damaged file and an unknown name in the block end the verb with status 2."""
    try:
        trace = Trace.open(path)
    except OSError as error:
        raise click.UsageError(f"{named(path)} cannot be read: {reason(error)}") from None
    except TraceError as error:
        raise click.UsageError(f"{named(path)}: {error}") from None
    try:
        with trace:
            yield trace
    except TraceError as error:
        raise click.UsageError(f"{named(path)}: {error}") from None
    except (UnknownPlace, TypeError) as error:
        raise click.UsageError(str(error)) from None


def waveforms_of(trace: Trace, names: Sequence[str], scans: range | None) -> Waveforms:
    """The waveforms of some variables in some scans.  Raises UsageError if the trace has no such scans."""
    made = waveforms(trace, names, scans)
    if not made.times_ns:
        held = f"scans {trace.scans[0]} to {trace.scans[-1]}" if trace.scans else "no scans yet"
        raise click.UsageError(f"the trace has {held}")
    return made


# --- written by a run -------------------------------------------------------------------------------------------------


@contextmanager
def write_trace(
    plc: Plc, path: Path | None, depth: str, selected: Sequence[str], files: Sequence[Path], libraries: Sequence[Path]
) -> Iterator[None]:
    """Records the scans of `plc` in the `with` block into a trace file, if `path` is given."""
    if path is None:
        if selected:
            raise click.UsageError("--select chooses what --trace keeps, which is not given")
        yield
        return
    with writing(path):
        file = growing_file(path)
    with file:
        try:
            lines = statement_lines(plc.image, files, libraries)
            with held():
                writer = TraceWriter(plc, file, Depth(depth), selected, lines)
        except UnknownPlace as error:
            raise click.UsageError(str(error)) from None
        try:
            yield
        finally:
            with held():
                writer.close()


@dataclass
class PageScans:
    """The scans that a page holds."""

    only_last: bool = False
    """True after Ctrl-C: a page of all scans may take long."""


@contextmanager
def write_page(plc: Plc, path: Path | None, files: Sequence[Path], libraries: Sequence[Path]) -> Iterator[PageScans]:
    """Writes the scans of `plc` in the `with` block as one HTML file, if `path` is given: all, or those that the block wants."""
    wanted = PageScans()
    if path is None:
        yield wanted
        return
    recording = Recording()
    recorded = recording.add(path.stem, plc)
    yield wanted
    recording.close()
    source = RecordedScans(recorded, statement_lines(plc.image, files, libraries))
    last = max(source.scans.start, source.scans.stop - INTERRUPTED_SCANS)
    scans = range(last, source.scans.stop) if wanted.only_last and last > source.scans.start else None
    if scans:
        say(f"{named(path)} holds scans {last} to {scans[-1]} only: the run was interrupted", err=True)
    with writing(path):
        write_file(path, page(page_data(source, scans=scans, title=path.stem)))


def statement_lines(image: Image, files: Sequence[Path], libraries: Sequence[Path]) -> dict[str, dict[int, str]]:
    """The source lines with statements, by file and line number."""
    return source_lines(image, source_texts(image, given_sources(files), libraries))
