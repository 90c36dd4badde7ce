"""A trace of a rig in a file: charts, scan tables and causes, with names as in the test."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fbvm.record.draw.chart import Chart, draw
from fbvm.record.draw.table import ScanTable
from fbvm.record.draw.why import cause_text, why
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import Recording
from fbvm.record.trace.signals import recording
from fbvm.record.trace.writer import Depth, TraceWriter, source_lines
from fbvm.testing.golden import check
from fbvm.testing.rig import Rig
from fbvm.watch.paths import Place


class Recorded:
    """Records a rig into `path` from its next scan.  Names are those of the rig; `patterns` select
    the variables of the trace, `depth` is that of `TraceWriter`, `folder` that of golden files, which `write_golden` writes."""

    def __init__(self, rig: Rig, path: Path, patterns: tuple[str, ...] = (), depth: str = "statements",
                 folder: Path = Path(), write_golden: bool = False) -> None:  # fmt: skip
        self.path = path
        self._folder, self._write_golden = folder, write_golden
        self._rig = rig
        self._file = path.open("wb")
        chosen = [pattern if "*" in pattern else rig.find(pattern).name for pattern in patterns]
        self._writer = TraceWriter(rig.plc, self._file, Depth(depth), chosen, source_lines(rig.plc.image, rig.subject.texts))

    def close(self) -> None:
        """Ends the recording."""
        if not self._file.closed:
            self._writer.close()
            self._file.close()

    def open(self) -> Trace:
        """Opens the trace of all scans so far; the caller closes it."""
        if not self._file.closed:
            self._writer.flush()
        return Trace.open(self.path)

    def chart(self, *names: str) -> Chart:
        """The time chart of some variables; without names of those that have changed."""
        with self.open() as trace:
            return draw(self._recording(trace, names))

    def table(self, *names: str, scans: range | None = None) -> str:
        """The scan table of some variables."""
        with self.open() as trace:
            signals = [track.signal for track in self._recording(trace, names).tracks]
            table = ScanTable(trace.sites, trace.names, signals)
            trace.follow(table, scans)
        return table.draw(band for band in table.bands if band.has_changes)

    def golden(self, file: str, *names: str) -> None:
        """Compares the changes of some variables with a golden file beside the test; `--fbvm-golden` writes the file.

        Without names the variables that have changed are compared.  Raises AssertionError with the differences."""
        __tracebackhide__ = True
        with self.open() as trace:
            made = self._recording(trace, names)
        check(self._folder / file, made, self._write_golden)

    def why(self, name: str, scan: int | None = None) -> str:
        """The causes of a variable's value at the end of a scan, by default the last one."""
        place = self._rig.find(name)
        if not isinstance(place, Place):
            raise ValueError(f"{name} is a range; name one place")
        with self.open() as trace:
            text = cause_text(trace, why(trace, place, trace.scans[-1] if scan is None else scan))
        return self._rig.subject.plain(text)

    def _recording(self, trace: Trace, names: Sequence[str]) -> Recording:
        made = recording(trace, [self._rig.find(name).name for name in names])
        return made.relabelled(self._rig.subject.prefix)
