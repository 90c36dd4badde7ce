"""The scan table: one column a variable, one row a phase or a statement that changed something, scans as bands.

    scan 4     40 ms   Start   Delay.Q  Running
      inputs          >TRUE     FALSE    FALSE
      pump.st:12                         >TRUE

A cell with a new value is marked with `>`.  The row of a statement shows only the values that it has changed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Protocol

from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.image import Site
from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Cut, Event, Frame, Read, Return, Statement, Write
from fbvm.record.trace.recorder import Signal
from fbvm.watch.names import Names
from fbvm.watch.paths import Place
from fbvm.watch.values import Value, show_time

MARK = ">"
WIDEST_CELL = 24
NOT_RECORDED = "(not recorded)"
"""What a task did after the events that are recorded of it, which are about MOST_EVENTS."""
MOST_READS = 32
"""Values that are kept as the operands of a value without a name."""


class ScanState(Protocol):
    """A PLC, or a moment of a trace, of which a listener reads values."""

    @property
    def scans(self) -> int: ...
    @property
    def now_ns(self) -> int: ...
    def read(self, where: Place) -> Value: ...


@dataclass(frozen=True)
class Change:
    """A new value of a variable, written by a statement (`site`) of an instance, or from outside the program."""

    scan: int
    signal: Signal
    old: Value
    new: Value
    site: Site | None
    instance: str
    phase: Phase | None = None
    """The phase of a change that no statement has made."""


@dataclass(frozen=True)
class LastWrite:
    """The last statement that wrote a variable, also with an equal value, and the names and values that it had read."""

    scan: int
    site: Site | None
    instance: str
    reads: tuple[tuple[str, str], ...]


@dataclass
class Row:
    """One row: its label, the values of all variables after it, and which of them are new."""

    label: str
    values: list[Value]
    changed: list[bool]


@dataclass
class Band:
    """The rows of one scan."""

    scan: int
    now_ns: int
    rows: list[Row] = field(default_factory=list)

    @property
    def has_changes(self) -> bool:
        return any(any(row.changed) for row in self.rows)


class ScanTable:
    """A listener that records the changes of some variables in scans of a PLC or of a trace.

    `sites` and `names` are those of the image, `signals` the columns.  `every` keeps also statements that change none."""

    def __init__(self, sites: Sequence[Site], names: Names, signals: Sequence[Signal], every: bool = False) -> None:
        self.signals = list(signals)
        self.bands: list[Band] = []
        self.changes: list[Change] = []
        self.writers: dict[Signal, LastWrite] = {}
        """The last write of each variable."""
        self._sites, self._names, self._every = sites, names, every
        self._values: list[Value] | None = None
        self._statement: Statement | None = None
        self._reads: dict[Frame, dict[str, str]] = {}
        self._cut_scans: set[int] = set()
        self._nameless: dict[int, dict[str, str]] = {}
        """By offset the values that were read for a value without a name, such as the condition of a rung."""

    def phase(self, plc: ScanState, phase: Phase) -> None:
        """Records the values that have changed in a phase without a statement."""
        if phase is Phase.INPUTS or not self.bands or self.bands[-1].scan != plc.scans:
            self.bands.append(Band(plc.scans, plc.now_ns))
        self._finish(plc)
        values, changed = self._read_values(plc)
        for signal, before, now, moved in zip(self.signals, self._values or values, values, changed, strict=True):
            if moved:
                self.changes.append(Change(plc.scans, signal, before, now, None, "", phase))
        self._values = values
        cut = phase is Phase.PROGRAM and plc.scans in self._cut_scans
        if phase is Phase.INPUTS or any(changed) or cut:
            self.bands[-1].rows.append(Row(NOT_RECORDED if cut else phase.value, values, changed))

    def event(self, plc: ScanState, event: Event) -> None:
        """Records the reads of a statement, and the changes by its writes."""
        if isinstance(event, Statement):
            self._finish(plc)
            self._statement = event
            self._reads[event.frame] = {}
        elif isinstance(event, Read):
            place = self._names.at(event.offset, event.bit if event.bit != WHOLE_BYTES else None)
            read = self._reads.setdefault(event.frame, {})
            if place is None:
                read.update(self._nameless.get(event.offset, {}))
            elif not place.is_generated:
                read[place.name] = Signal(place, place.name).text(self._names.read(plc.read, place))
        elif isinstance(event, Return):
            self._reads.pop(event.frame, None)
        elif isinstance(event, Cut):
            self._cut_scans.add(plc.scans)
        elif isinstance(event, Write) and self._names.at(event.offset) is None:
            self._nameless[event.offset] = dict(islice(self._reads.get(event.frame, {}).items(), MOST_READS))
        elif isinstance(event, Write) and (written := self._written_signals(event)):
            reads = tuple(self._reads.get(event.frame, {}).items())
            for signal in written:
                self.writers[signal] = LastWrite(plc.scans, self._site(event.site), self._names.instance(event.frame.base), reads)
            if event.old != event.value:
                self._row(plc, event.site, event.frame)

    def _site(self, number: int) -> Site | None:
        return self._sites[number] if number >= 0 else None

    def _written_signals(self, event: Write) -> list[Signal]:
        end = event.offset + len(event.value)
        near = [signal for signal in self.signals if (place := signal.place).hops
                or place.offset < end and event.offset < place.offset + place.type.size]  # fmt: skip
        return [signal for signal in near if signal.place.bit is None or event.bit in (signal.place.bit, WHOLE_BYTES)]

    def _finish(self, plc: ScanState) -> None:
        """Ends the row of the last statement; without a change the row is kept only if `every` is set."""
        statement, self._statement = self._statement, None
        if statement and self._every and self._values is not None:
            label = _place(self._sites[statement.site])
            if not self.bands[-1].rows or self.bands[-1].rows[-1].label != label:
                self.bands[-1].rows.append(Row(label, self._values, [False] * len(self.signals)))

    def _row(self, plc: ScanState, site: int, frame: Frame) -> None:
        values, changed = self._read_values(plc)
        if not any(changed):
            return
        place = self._site(site)
        instance = self._names.instance(frame.base)
        for signal, old, new, moved in zip(self.signals, self._values or values, values, changed, strict=True):
            if moved:
                self.changes.append(Change(plc.scans, signal, old, new, place, instance))
        self._values = values
        self.bands[-1].rows.append(Row(_place(place) if place else "stub", values, changed))
        self._statement = None

    def _read_values(self, plc: ScanState) -> tuple[list[Value], list[bool]]:
        values = [self._names.read(plc.read, signal.place) for signal in self.signals]
        before = self._values
        return values, [before is not None and now != before[at] for at, now in enumerate(values)]

    def last_change(self, signal: Signal) -> Change | None:
        """The last change of a variable, None if it has kept its value."""
        return next((change for change in reversed(self.changes) if change.signal == signal), None)

    def draw(self, bands: Iterable[Band] | None = None) -> str:
        """The table as text, of all recorded scans or of some `bands`; "" of none."""
        chosen = list(self.bands if bands is None else bands)
        if not chosen:
            return ""
        headings = [signal.label for signal in self.signals]
        heads = [f"scan {band.scan}   {show_time(band.now_ns).removeprefix('T#')}" for band in chosen]
        left = max([len(head) + 2 for head in heads] + [len(row.label) + 4 for band in chosen for row in band.rows])
        widths = [max([len(heading)] + [len(self._cell(at, row)) for band in chosen for row in band.rows])
                  for at, heading in enumerate(headings)]  # fmt: skip
        lines = []
        for number, (head, band) in enumerate(zip(heads, chosen, strict=True)):
            names = "  ".join(f" {name:<{width}}" for name, width in zip(headings, widths, strict=True))
            lines.append(f"{head:<{left}}{names if number == 0 else ''}".rstrip())
            for row in band.rows:
                whole = row.label == Phase.INPUTS.value
                cells = [(MARK if moved else " ") + f"{self._cell(at, row) if whole or moved else '':<{width}}"
                         for at, (width, moved) in enumerate(zip(widths, row.changed, strict=True))]  # fmt: skip
                lines.append(f"  {row.label:<{left - 2}}{'  '.join(cells)}".rstrip())
        return "\n".join(lines)

    def _cell(self, at: int, row: Row) -> str:
        text = self.signals[at].display(row.values[at])
        return text if len(text) <= WIDEST_CELL else text[: WIDEST_CELL - 3] + "..."


def _place(site: Site) -> str:
    return f"{site.file.rpartition('/')[2]}:{site.line}"
