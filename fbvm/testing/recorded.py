"""A rig that is looked at afterwards: charts, scan tables and causes, with names as in the test."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fbvm.machine.plc import Plc
from fbvm.record.draw.chart import Chart, draw
from fbvm.record.draw.table import ScanTable
from fbvm.record.draw.why import cause_text, why
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.recorder import Waveforms
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.writer import Depth, TraceWriter, source_lines
from fbvm.testing.golden import check
from fbvm.testing.rig import Rig
from fbvm.watch.paths import Place


class Recorded:
    """The scans of a rig from the next one on.  Names are those of the rig; `patterns` select the variables that are meant if
    none is named.

    `depth` is how much the trace file at `path` holds, `folder` that of golden files, which `write_golden` writes."""

    def __init__(self, rig: Rig, path: Path, patterns: tuple[str, ...] = (), depth: str = "statements",
                 folder: Path = Path(), write_golden: bool = False) -> None:  # fmt: skip
        self._path, self._folder, self._write_golden, self._rig = path, folder, write_golden, rig
        self._depth, self._lines = Depth(depth), source_lines(rig.plc.image, rig.subject.texts)
        chosen = [pattern if "*" in pattern else rig.find(pattern).name for pattern in patterns]
        self._scans = RecordedScans(rig._recorded, self._lines, chosen, first=rig.plc.scans)

    @property
    def path(self) -> Path:
        """A trace file of all scans so far, for `fbvm chart` and `fbvm why`, which is written now."""
        scans = self._scans.scans
        with self._path.open("wb") as file:

            @contextmanager
            def writing(plc: Plc) -> Iterator[None]:
                writer = TraceWriter(plc, file, self._depth, self._scans.selected, self._lines)
                try:
                    yield
                finally:
                    writer.close()

            self._rig._recorded.follow_with(scans, writing)
        return self._path

    def chart(self, *names: str) -> Chart:
        """The time chart of some variables; without names of those that have changed."""
        return draw(self._waveforms(names))

    def table(self, *names: str, scans: range | None = None) -> str:
        """The scan table of some variables."""
        source = self._scans
        signals = [track.signal for track in self._waveforms(names).tracks]
        table = ScanTable(source.sites, source.names, signals)
        source.follow(table, scans)
        return table.draw(band for band in table.bands if band.has_changes)

    def golden(self, file: str, *names: str) -> None:
        """Compares the changes of some variables with a golden file beside the test; `--fbvm-golden` writes the file.

        Without names the variables that have changed are compared.  Raises AssertionError with the differences."""
        __tracebackhide__ = True
        check(self._folder / file, self._waveforms(names), self._write_golden)

    def why(self, name: str, scan: int | None = None) -> str:
        """The causes of a variable's value at the end of a scan, by default the last one."""
        place = self._rig.find(name)
        if not isinstance(place, Place):
            raise ValueError(f"{name} is a range; name one place")
        source = self._scans
        text = cause_text(source, why(source, place, source.scans[-1] if scan is None else scan))
        return self._rig.subject.plain(text)

    def _waveforms(self, names: Sequence[str]) -> Waveforms:
        made = waveforms(self._scans, [self._rig.find(name).name for name in names])
        return made.relabelled(self._rig.subject.prefix)
