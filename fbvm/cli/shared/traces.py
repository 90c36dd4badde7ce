"""Recordings and traces in files: arguments and options of the verbs that read one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

import fbvm
from fbvm.base.digits import whole_number
from fbvm.base.files import open_file, reason
from fbvm.cli.shared.given_sources import given_sources
from fbvm.cli.shared.paths import ExistingPath, LibraryFolder
from fbvm.cli.shared.terminal import named, say
from fbvm.code.image import Image
from fbvm.record.recording import container
from fbvm.record.recording.container import RecordingError
from fbvm.record.recording.file_reader import FileRecordedPlc, RecordingFile
from fbvm.record.recording.file_scans import FileScans
from fbvm.record.trace.format import TraceError
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import Waveforms
from fbvm.record.trace.samples import ScanSamples, samples, some_scans
from fbvm.record.trace.scan_source import ScanSource
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.source_texts import source_texts
from fbvm.record.trace.writer import Depth, source_lines
from fbvm.watch.paths import UnknownPlace

SUFFIX = ".fbtrace"
LAST_SCAN = 1 << 62
"""No run has so many scans."""


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
    """TRACE, a file that `fbvm run --trace` wrote, and the options about it."""
    return trace_options(click.argument("path", metavar="TRACE", type=ExistingPath(dir_okay=False))(function))


def trace_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """--plc and --library, about the file of a recording."""
    for decorate in (
        click.option("--library", "libraries", multiple=True, metavar="DIR", type=LibraryFolder(),
                     help="A folder of libraries to use in place of those that the recording holds; may be repeated."),
        click.option("--plc", metavar="NAME", help="Which PLC of a recording that has several."),
    ):
        function = decorate(function)
    return function


def scans_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """--scans, the part of a trace."""
    return click.option("--scans", type=ScanRange(), help="Only these scans.")(function)


def is_recording(path: Path) -> bool:
    """True for the file of a recording, False for a trace of fbvm 0.1, a table, and all others.  Raises OSError."""
    with open_file(path) as file:
        return file.read(len(container.MAGIC)) == container.MAGIC


@contextmanager
def open_recording(path: Path, libraries: Sequence[Path] = ()) -> Iterator[RecordingFile]:
    """Opens the file of a recording for a `with` block.  One that cannot be read, or is damaged, ends the verb with status 2."""
    try:
        recording = RecordingFile.open(path, libraries, version=fbvm.__version__)
    except OSError as error:
        raise click.UsageError(f"{named(path)} cannot be read: {reason(error)}") from None
    except RecordingError as error:
        raise click.UsageError(f"{named(path)}: {error}") from None
    try:
        with recording:
            yield recording
    except RecordingError as error:
        raise click.UsageError(f"{named(path)}: {error}") from None


@contextmanager
def open_trace(path: Path, plc: str | None = None, libraries: Sequence[Path] = (), depth: Depth | None = None,
               ) -> Iterator[ScanSource]:  # fmt: skip
    """Opens the file of a recording, or a trace, for a `with` block.  A damaged file and an unknown name in the block end the
    verb with status 2.

    `depth` is what is asked of the scans of a recording; a trace has what was written."""
    try:
        opened = _recorded(path, plc, libraries, depth) if is_recording(path) else _written(path)
    except OSError as error:
        raise click.UsageError(f"{named(path)} cannot be read: {reason(error)}") from None
    with opened as source:
        try:
            yield source
        except (UnknownPlace, TypeError) as error:
            raise click.UsageError(str(error)) from None
        except TraceError as error:
            raise click.UsageError(f"{named(path)}: {error}") from None


@contextmanager
def _recorded(path: Path, plc: str | None, libraries: Sequence[Path], depth: Depth | None) -> Iterator[ScanSource]:
    with open_recording(path, libraries) as recording:
        source = FileScans(chosen_plc(recording, plc), depth)
        yield source
    if source.warning:
        say(source.warning, fg="yellow", err=True)


@contextmanager
def _written(path: Path) -> Iterator[ScanSource]:
    """A trace that fbvm 0.1 wrote, or one that was made of a table."""
    try:
        with Trace.open(path) as trace:
            yield trace
    except TraceError as error:
        raise click.UsageError(f"{named(path)}: {error}") from None


def chosen_plc(recording: RecordingFile, name: str | None) -> FileRecordedPlc:
    """The PLC of this name, or the only one.  Raises UsageError."""
    names = list(recording)
    if not names:
        raise RecordingError("the recording has no PLC yet")
    if name is None and len(names) == 1:
        return recording[names[0]]
    if name is None or name not in names:
        raise click.UsageError(f"choose a PLC with --plc NAME; the recording has {', '.join(names)}")
    return recording[name]


def samples_of(trace: ScanSource, names: Sequence[str], scans: range | None) -> ScanSamples:
    """The values of some variables in some scans, to be gone through.  Raises UsageError if the trace has no such scans."""
    require_scans(trace, scans)
    return samples(trace, names, scans)


def waveforms_of(trace: ScanSource, names: Sequence[str], scans: range | None) -> Waveforms:
    """The waveforms of some variables in some scans.  Raises UsageError if the trace has no such scans."""
    require_scans(trace, scans)
    return waveforms(trace, names, scans)


def require_scans(trace: ScanSource, scans: range | None) -> None:
    """Raises UsageError if the trace has none of these scans; without `scans`, if it has none at all."""
    if not some_scans(trace, scans):
        held = f"scans {trace.scans[0]} to {trace.scans[-1]}" if trace.scans else "no scans yet"
        raise click.UsageError(f"the trace has {held}")


def statement_lines(image: Image, files: Sequence[Path], libraries: Sequence[Path]) -> dict[str, dict[int, str]]:
    """The source lines with statements, by file and line number."""
    return source_lines(image, source_texts(image, given_sources(files), libraries))
