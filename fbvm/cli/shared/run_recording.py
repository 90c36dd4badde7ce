"""The recording of a run and the options that ask for it: one file for `--journal` and `--trace`, and the page of `--html`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import click

import fbvm
from fbvm.base.files import write_file
from fbvm.base.host import interrupt_held
from fbvm.cli.shared.files import growing_file, writing
from fbvm.cli.shared.given_sources import sources_of
from fbvm.cli.shared.terminal import named, say
from fbvm.cli.shared.traces import statement_lines
from fbvm.machine.plc import Plc
from fbvm.record.recording.file_writer import Described, RecordingWriter
from fbvm.record.recording.library_texts import library_texts
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.recording import RING_BYTES, Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.selection import select
from fbvm.record.trace.writer import Depth
from fbvm.run import loop
from fbvm.run.plant import Plant
from fbvm.watch.paths import UnknownPlace

INTERRUPTED_SCANS = 400
"""The scans on the page of a run that was interrupted."""
FLUSHES = 10
"""The file has what happened up to so many calls of `tick` ago: one second, if they come every 100 ms."""


_FILE = click.Path(dir_okay=False, path_type=Path)


def recording_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """--trace, --journal, --verify, --html, --depth and --select."""
    for decorate in (
        click.option("--select", "selected", multiple=True, metavar="PATTERN",
                     help="What charts and pages of the recording show by default: 'Main.*.Q', D200..D299.  May be repeated."),
        click.option("--depth", type=click.Choice([depth.value for depth in Depth]), default="scans", show_default=True,
                     help="What a page of the recording carries along: scan ends, also writes, also statements."),
        click.option("--html", type=_FILE, metavar="FILE",
                     help="Write the run as one page for a browser, with every statement."),
    ):
        function = decorate(function)
    return recording_file_options(function)


def recording_file_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """--trace, --journal and --verify."""
    for decorate in (
        click.option("--verify", is_flag=True, help="Record a fingerprint of the memory at every scan."),
        click.option("--journal", type=_FILE, metavar="FILE", help="The same as --trace."),
        click.option("--trace", type=_FILE, metavar="FILE",
                     help="Record the run for `fbvm chart`, `table`, `why`, `convert` and `replay`."),
    ):
        function = decorate(function)
    return function


class _Files(BytesIO):
    """Several files with the same contents."""

    def __init__(self, files: Sequence[BinaryIO]) -> None:
        super().__init__()
        self._files = files

    def write(self, data: Any, /) -> int:
        for file in self._files:
            file.write(data)
        return len(data)

    def flush(self) -> None:
        for file in self._files:
            file.flush()


@dataclass
class RunRecording:
    """The recording of the PLCs of one run, if any of the options asks for it."""

    recording: Recording | None = None
    only_last: bool = False
    """True after Ctrl-C: a page of all scans may take long."""
    _ticks: int = field(default=0)

    def add(self, name: str, plc: Plc, described: Described) -> None:
        """Records a PLC from its next scan on."""
        if self.recording:
            with interrupt_held():
                self.recording.add(name, plc, described)

    def tick(self) -> None:
        """To be called now and then while the run goes on, between scans: what was recorded goes into the file."""
        self._ticks += 1
        if self.recording and self._ticks >= FLUSHES:
            self._ticks = 0
            self.recording.flush()


@contextmanager
def record_run(options: Mapping[str, Any], about: Mapping[str, object], in_memory: bool = False) -> Iterator[RunRecording]:
    """Records what is added in the `with` block into the files that --journal and --trace name; for a page `in_memory`, too."""
    paths = list(dict.fromkeys(path for path in (options["journal"], options["trace"]) if path))
    if not paths and options["selected"]:
        raise click.UsageError("--select chooses what --trace keeps, which is not given")
    if not paths and not in_memory:
        yield RunRecording()
        return
    with ExitStack() as stack:
        files = []
        for path in paths:
            with writing(path):
                files.append(stack.enter_context(growing_file(path)))
        with interrupt_held():
            about = {"began_ns": loop.epoch_ns(), "options": dict(about)}
            file = files[0] if len(files) == 1 else _Files(files)
            writer = RecordingWriter(file, fbvm.__version__, options["verify"], about) if files else None
        made = RunRecording(Recording(RING_BYTES if in_memory else 1, writer))
        try:
            yield made
        finally:
            with interrupt_held():
                assert made.recording
                made.recording.close()


def described(plc: Plc, program: ProgramText, options: Mapping[str, Any], files: Sequence[Path],
              libraries: Sequence[Path]) -> Described:  # fmt: skip
    """What the file tells of a PLC beside its scans.  Raises UsageError if --select names nothing."""
    try:
        select(plc.image.symbols, plc.memory.areas, options["selected"])
    except UnknownPlace as error:
        raise click.UsageError(str(error)) from None
    return Described(program, statement_lines(plc.image, files, libraries), Depth(options["depth"]), options["selected"])


def record_plant(plant: Plant, add: Callable[[str, Plc, Described], object], options: Mapping[str, Any]) -> None:
    """Has all PLCs of a plant recorded by `add`, each by its name."""
    for kind in plant.kinds:
        row = kind.row
        text = program_text(row.sources, row.libraries, program=row.program, resource=row.resource, dialect=row.dialect,
                            heap=row.heap)  # fmt: skip
        for name, run in zip(kind.names, kind.runs, strict=True):
            add(name, run.plc, described(run.plc, text, options, row.sources, row.libraries))


def program_text(files: Sequence[Path], libraries: Sequence[Path], **choices: Any) -> ProgramText:
    """The text of a program in these files."""
    texts = tuple((source.name, source.text) for source in sources_of(files))
    return ProgramText(texts, tuple(str(folder) for folder in libraries), library_texts(libraries), **choices)


def write_page(recorded: RunRecording, path: Path, lines: Mapping[str, Mapping[int, str]]) -> None:
    """Writes the scans of a run as one HTML file: all, or after Ctrl-C the last ones."""
    from fbvm.record.page.data import page_data  # most runs write no page
    from fbvm.record.page.page import page

    assert recorded.recording
    source = RecordedScans(recorded.recording[next(iter(recorded.recording))], lines)
    last = max(source.scans.start, source.scans.stop - INTERRUPTED_SCANS)
    scans = range(last, source.scans.stop) if recorded.only_last and last > source.scans.start else None
    if scans:
        say(f"{named(path)} holds scans {last} to {scans[-1]} only: the run was interrupted", err=True)
    with writing(path):
        write_file(path, page(page_data(source, scans=scans, title=path.stem)))
