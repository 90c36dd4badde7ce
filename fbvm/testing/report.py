"""The report of a failed test: the last change of each variable and its statement, and the scan table before the failure."""

from __future__ import annotations

from fbvm.base.types import StructType
from fbvm.machine.plc import Phase, Plc
from fbvm.record.draw.table import LastWrite, ScanTable
from fbvm.record.recording.recording import PlcRecording
from fbvm.record.trace.recorder import Signal
from fbvm.testing.reads import VariableReads
from fbvm.testing.subject import Subject
from fbvm.watch.names import Names, is_single
from fbvm.watch.paths import Place
from fbvm.watch.values import show_time

LOOKED_BACK = 400
"""Scans that are executed again to find the last change of a variable."""
BANDS = 4
"""Scans with changes that the table shows."""
MOST_COLUMNS = 8


class Report:
    """Writes reports about one PLC."""

    def __init__(self, plc: Plc, subject: Subject, recorded: PlcRecording, reads: VariableReads) -> None:
        self._plc, self._subject, self._recorded, self._reads = plc, subject, recorded, reads
        self.names = Names.of(plc.image, plc.memory.areas)

    def names_in(self, prefix: str) -> list[str]:
        """The names of the variables of the block or program at the path `prefix`, which ends with a dot."""
        kind = self._plc.find(prefix.rstrip(".")) if prefix else None
        fields = kind.type.fields.values() if isinstance(kind, Place) and isinstance(kind.type, StructType) else ()
        return [field.name for field in fields]

    def text(self, lines: tuple[str, range] | None = None) -> str:
        """The report about the variables that some lines of a file have read; without `lines`, all that the test has read."""
        places = self._reads.places(*lines) if lines else self._reads.places()
        signals = self._signals(places)
        if not signals or not self._plc.scans:
            return ""
        table = self._again(signals, LOOKED_BACK)
        changes = "\n".join([*(self._last_change(table, signal) for signal in signals), *self._blocks(table, signals)])
        moved = [band for band in table.bands if band.has_changes][-BANDS:]
        last = table.bands[-1:] if table.bands and table.bands[-1] not in moved else []
        return f"{changes}\n\n{table.draw([*moved, *last])}" if table.bands else changes

    def table(self, places: list[Place], scans: int) -> str:
        """The scan table of the last scans."""
        return self._again(self._signals(places), scans).draw()

    def _signals(self, places: list[Place]) -> list[Signal]:
        prefix = self._subject.prefix
        return [Signal(place, place.name.removeprefix(prefix)) for place in places if is_single(place)][:MOST_COLUMNS]

    def _again(self, signals: list[Signal], scans: int) -> ScanTable:
        table = ScanTable(self._plc.image.sites, self.names, signals)
        end = self._plc.scans
        self._recorded.follow(table, range(max(0, end - scans), end))
        return table

    def _last_change(self, table: ScanTable, signal: Signal) -> str:
        """The last change of a variable: `Running is TRUE since scan 5 (50ms), by pump.st:12:  Running := Delay.Q;  with ...`."""
        value = self.names.read(self._plc.read, signal.place)
        now = f"{signal.label} is {signal.text(value)}"
        change, writer = table.last_change(signal), table.writers.get(signal)
        first = table.bands[0].scan if table.bands else self._plc.scans
        if change is None:
            now += f" since {'power-on' if first == 0 else f'before scan {first}'}"
        elif change.new != value:
            return f"{now}, written after the last scan"
        else:
            at_ns = next(band.now_ns for band in table.bands if band.scan == change.scan)
            now += f" since scan {change.scan} ({show_time(at_ns)[2:]})"
            if change.phase is Phase.REFRESH:
                return f"{now}, by a unit in the I/O refresh"
            if change.phase is Phase.PROGRAM and signal.place.name not in self._plc.forces:
                return f"{now}, by a stub"
            if change.phase is not None:
                return f"{now}, written from outside the program"
        if writer is None:
            return f"{now}; {f'writes are known from scan {first} on' if first else 'no statement wrote it'}"
        last = f", written last in scan {writer.scan}" if change is None or change.scan != writer.scan else ""
        return f"{now}{last}, by {self._by(writer)}"

    def _blocks(self, table: ScanTable, signals: list[Signal]) -> list[str]:
        """The pins of the blocks whose variables the last scan's statements read, a line each."""
        asked = {signal.place.name for signal in signals}
        writers = [table.writers[signal] for signal in signals if signal in table.writers]
        paths = dict.fromkeys(name.rpartition(".")[0] for writer in writers if writer.scan == self._plc.scans - 1
                              for name, _ in writer.reads if name not in asked)  # fmt: skip
        lines = (self._block(path) for path in paths if path and f"{path}." != self._subject.prefix)
        return [line for line in lines if line]

    def _block(self, path: str) -> str:
        """`Delay: TON with IN = TRUE, PT = 50ms, Q = FALSE, ET = 20ms`; "" for what is no instance or has no pins."""
        block = self._plc.find(path)
        if not isinstance(block, Place) or not isinstance(block.type, StructType):
            return ""
        pins = [field.name for field in block.type.fields.values() if field.kind in ("VAR_INPUT", "VAR_OUTPUT")]
        found = [self._plc.find(f"{path}.{pin}") for pin in pins]
        places = [place for place in found if isinstance(place, Place) and is_single(place)][:MOST_COLUMNS]
        values = ", ".join(f"{place.name.rpartition('.')[2]} = {self._value(place)}" for place in places)
        return f"{path.removeprefix(self._subject.prefix)}: {block.type.name} with {values}" if values else ""

    def _value(self, place: Place) -> str:
        return Signal(place, place.name).text(self.names.read(self._plc.read, place))

    def _by(self, writer: LastWrite) -> str:
        if writer.site is None:
            return "a stub"
        site, prefix = writer.site, self._subject.prefix
        where = writer.instance.removeprefix(prefix.rstrip(".")).lstrip(".")
        line = self._subject.line(site.file, site.line)
        reads = ", ".join(f"{name.removeprefix(prefix)} = {text}" for name, text in writer.reads)
        return (f"{site.file}:{site.line}" + (f" in {where}" if where else "") + (f":  {line}" if line else "")
                + (f"  with {reads}" if reads else ""))  # fmt: skip
