"""The data of the HTML page of a run: signals, words, the events inside scans, packets.

    {"scans": [first, count], "times": [ns, then differences], "signals": [...], "words": {"D": {"200": [scan, value, ...]}},
     "rows": {scan: [[where, instance, signal, text, ...], ...]}, "frames": [...], ...}

A value is written when it changes.  Numbers of signals, statements and instances are places in their lists; of a row,
`where` is a statement, or -1, -2, -3 for the phases of a scan; signal -1 says whether an element of a rung conducts.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any

from fbvm.base.areas import FLAG_AREAS
from fbvm.base.memory import WHOLE_BYTES, Snapshot, compare
from fbvm.base.types import StructType
from fbvm.code.image import RungPicture
from fbvm.machine.plc import Phase
from fbvm.record.draw.ladder_svg import rung_svg
from fbvm.record.draw.ladder_text import ladder_surface
from fbvm.record.draw.power import PowerFlow
from fbvm.record.draw.sfc_recorder import ChartCall, ChartRecorder
from fbvm.record.draw.sfc_text import sfc_surface
from fbvm.record.trace.events import Contact, Event, Frame, NetworkEvent, Statement, Write
from fbvm.record.trace.format import PHASES
from fbvm.record.trace.packets import Dissector, Packet
from fbvm.record.trace.recorder import Signal, signals_at
from fbvm.record.trace.scan_source import Moment, ScanSource
from fbvm.record.trace.signals import chosen_signals
from fbvm.record.trace.writer import Depth
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.watch.paths import UnknownPlace

MOST_ROWS = 200_000
"""Rows of statements and phases that are kept, the latest ones; earlier scans have values only."""
MOST_IN_SCAN = 20_000
"""Rows up to which a scan is followed statement by statement; a loop of two million statements would take half a minute."""
FIRST_IN_SCAN = 1000
"""Rows that are kept of a scan with more: enough to see what is done again and again."""
MOST_PICTURES = 5000
"""Drawings of rungs and charts; executions with the same states share one."""
RUNG_WIDTH = 90
FEW_SIGNALS = 60
"""If there are more signals, those without changes are left out, unless they are named."""
POWER = -1
"""In place of a signal: whether an element of a rung conducts."""
VERSION = 1


class TooManyRows(Exception):
    """A scan has more rows than a page holds; its number is the value."""


class Collector:
    """A listener that collects the data of a trace."""

    def __init__(self, trace: ScanSource, signals: Sequence[Signal]) -> None:
        self._trace, self.signals = trace, list(signals)
        self.times_ns: list[int] = []
        self.first = 0
        self.changes: list[list[Any]] = [[] for _ in signals]
        self.words: dict[str, dict[int, list[int]]] = {}
        self.rows: OrderedDict[int, list[list[Any]]] = OrderedDict()
        self.packets: list[tuple[int, Packet]] = []
        self.instances: dict[str, int] = {}
        self.drawings: dict[tuple[object, ...], int] = {}
        self.pictures: list[str] = []
        self.ladder: dict[int, list[list[int]]] = {}
        self._power = PowerFlow(trace.rungs, lambda scan: True)
        self._chart_recorder = ChartRecorder(trace.charts, lambda scan: True)
        self._dissector = Dissector()
        self._known: list[str] = []
        self._ended: list[str] = []
        self._memory: Snapshot | None = None
        self._whole: Snapshot | None = None
        self._statement: tuple[int, Frame] | None = None
        self._row: list[Any] | None = None
        self._count = 0
        self._at: dict[int, list[int]] = {}
        for number, signal in enumerate(signals):
            for offset in range(signal.place.offset, signal.place.offset + max(1, signal.place.type.size)):
                self._at.setdefault(offset, []).append(number)

    # --- called by the trace

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Records changes that no statement has made, and at the end of a scan all values."""
        now = moment.memory.snapshot()
        if self._memory is None:
            self.first = moment.scans
            self._known = [self._text(number, moment) for number in range(len(self.signals))]
        self._statement = self._row = None
        moved = self._new_values(self._touched(now), moment)
        self._memory = now
        if moved or phase is Phase.INPUTS:
            self._add(moment.scans, [-1 - PHASES.index(phase), -1, *moved])
        self._power.phase(moment, phase)
        self._chart_recorder.phase(moment, phase)
        if phase is Phase.PROGRAM:
            self._draw(moment.scans)
        if phase is Phase.REFRESH:
            self._end(moment, now)

    def event(self, moment: Moment, event: Event) -> None:
        """Records a statement, its writes, the state of a contact, a packet."""
        self._power.event(moment, event)
        self._chart_recorder.event(moment, event)
        if isinstance(event, NetworkEvent):
            self.packets += [(moment.scans, packet) for packet in self._dissector.dissect(event.now_ns, event.tap_event)]
        elif isinstance(event, Contact):
            self._add(moment.scans, [event.site, self._instance(event.frame), POWER, str(int(event.value))])
        elif isinstance(event, Statement):
            self._statement, self._row = (event.site, event.frame), None
            self._open(moment, event.site, event.frame)
        elif isinstance(event, Write) and event.old != event.value:
            if self._statement != (event.site, event.frame) or self._row is None:
                self._statement = event.site, event.frame
                self._open(moment, event.site, event.frame)
            assert self._row is not None
            self._row += self._new_values(self._written(event), moment)

    def _draw(self, scan: int) -> None:
        """Draws the rungs and charts of a scan; those with the same states share one drawing."""
        for made in self._power.executed:
            key = made.picture.site, *sorted((step, tuple(seen)) for step, seen in made.states.items())
            self._picture(scan, made.base, key, partial(_rung, made.picture, Annotations(made.states)))
        self._power.executed.clear()
        for called in self._chart_recorder.calls:
            key = called.picture.site, tuple(sorted(called.tested.items())), called.active
            self._picture(scan, called.base, key, partial(self._chart, called))
        self._chart_recorder.calls.clear()

    def _chart(self, called: ChartCall) -> list[str]:
        name, kind = self._trace.bodies[called.picture.body]
        return [f"{kind} {name}", rung_svg(sfc_surface(called.picture, RUNG_WIDTH, called.state))]

    def _picture(self, scan: int, base: int, key: tuple[object, ...], lines: Callable[[], list[str]]) -> None:
        if key not in self.drawings and len(self.pictures) < MOST_PICTURES:
            self.drawings[key] = len(self.pictures)
            self.pictures.append("\n".join(lines()))
        if key in self.drawings:
            instance = self.instances.setdefault(self._trace.names.instance(base), len(self.instances))
            self.ladder.setdefault(scan, []).append([instance, self.drawings[key]])

    def _open(self, moment: Moment, site: int, frame: Frame) -> None:
        self._row = [site, self._instance(frame)]
        self._add(moment.scans, self._row)

    def _instance(self, frame: Frame) -> int:
        return self.instances.setdefault(self._trace.names.instance(frame.base), len(self.instances))

    def _add(self, scan: int, row: list[Any]) -> None:
        rows = self.rows.setdefault(scan, [])
        if len(rows) >= MOST_IN_SCAN:
            self._count -= len(rows) - FIRST_IN_SCAN
            del rows[FIRST_IN_SCAN:]
            raise TooManyRows(scan)
        rows.append(row)
        self._count += 1
        while self._count > MOST_ROWS and len(self.rows) > 1:
            gone, rows = self.rows.popitem(last=False)
            self._count -= len(rows)
            self.ladder.pop(gone, None)

    # --- values

    def _text(self, number: int, moment: Moment) -> str:
        signal = self.signals[number]
        value = self._trace.names.read(moment.read, signal.place)
        return str(int(value is True)) if signal.is_bit else signal.display(value)

    def _touched(self, now: Snapshot) -> set[int]:
        """The numbers of the signals in bytes that differ from the phase before."""
        if self._memory is None:
            return set()
        runs = compare(self._memory, now)
        return {number for offset, size in runs for at in range(offset, offset + size) for number in self._at.get(at, ())}

    def _written(self, event: Write) -> list[int]:
        numbers = {number for at in range(event.offset, event.offset + len(event.value)) for number in self._at.get(at, ())}
        return [number for number in sorted(numbers) if event.bit == WHOLE_BYTES
                or self.signals[number].place.bit in (None, event.bit)]  # fmt: skip

    def _new_values(self, numbers: Iterable[int], moment: Moment) -> list[Any]:
        """Signal, text, signal, text ... of those of some signals that have a new value."""
        made: list[Any] = []
        for number in sorted(numbers):
            text = self._text(number, moment)
            if text != self._known[number]:
                self._known[number] = text
                made += [number, text]
        return made

    def _end(self, moment: Moment, now: Snapshot) -> None:
        scan = moment.scans
        self.times_ns.append(moment.now_ns)
        for number, text in enumerate(self._known):
            if not self._ended or text != self._ended[number]:
                self.changes[number] += [scan, text]
        self._ended = list(self._known)
        before = self._whole or Snapshot((None,) * len(now.pages))
        for area, address in _words(self._trace, compare(before, now)):
            changes = self.words.setdefault(area, {}).setdefault(address, [] if self._whole is None else [self.first, 0])
            changes += [scan, moment.memory.words(area)[address]]
        self._whole = now


def _rung(picture: RungPicture, annotations: Annotations) -> list[str]:
    """The headline of a rung, and its drawing as SVG."""
    head, surface = ladder_surface(picture, RUNG_WIDTH, annotations)
    return [head, rung_svg(surface)] if picture.steps else [head]


def _words(trace: ScanSource, runs: list[tuple[int, int]]) -> Iterator[tuple[str, int]]:
    """The words of areas in some bytes, each once."""
    areas = [area for area in trace.areas.values() if area.unit_bits == 16 and area.name not in FLAG_AREAS]
    seen: set[tuple[str, int]] = set()
    for offset, size in runs:
        for area in areas:
            low, high = max(offset, area.offset), min(offset + size, area.offset + area.size_bytes)
            for address in range((low - area.offset) // 2, (high - area.offset + 1) // 2) if low < high else ():
                if (area.name, address) not in seen:
                    seen.add((area.name, address))
                    yield area.name, address


def page_data(trace: ScanSource, names: Sequence[str] = (), scans: range | None = None, title: str = "", *, prefix: str = "",
              pinned: Sequence[str] = ()) -> dict[str, Any]:  # fmt: skip
    """The data of a trace, or of some of its scans and variables.  Raises UnknownPlace, TypeError, TraceError.

    `prefix` is not shown in names; variables that are `pinned` have columns in the scan table, and the last scan is
    shown first."""
    signals = chosen_signals(trace, names) if names else _in_order(trace)
    known = {signal.place.name for signal in signals}
    signals += [signal for name in pinned if name not in known
                for signal in signals_at(trace.find(name), trace.described, trace.meanings)]  # fmt: skip
    made = Collector(trace, signals)
    _follow(trace, made, trace.scans if scans is None else scans)
    every = bool(names) or len(made.signals) <= FEW_SIGNALS
    made.changes = [changes if every or len(changes) > 2 or signal.place.name in pinned else []
                    for signal, changes in zip(made.signals, made.changes, strict=True)]  # fmt: skip
    return {"title": title, "pinned": [name.removeprefix(prefix) for name in pinned], **_as_data(trace, made, prefix)}


def _follow(trace: ScanSource, made: Collector, scans: range) -> None:
    """Follows scans; of one with too many rows the first ones, and then its end."""
    while scans:
        try:
            trace.follow(made, scans)
            return
        except TooManyRows as long:
            scan = long.args[0]
        for moment in trace.moments(range(scan, scan + 1)):
            made.phase(moment, Phase.REFRESH)
        scans = range(scan + 1, scans.stop)


def _in_order(trace: ScanSource) -> list[Signal]:
    """All signals: first the programs' own variables, then described addresses, then members of instances."""
    programs = {field.name for field in trace.symbols.values() if isinstance(field.type, StructType) and field.type.block}

    def rank(signal: Signal) -> int:
        owner, *rest = signal.place.name.split(".")
        return 1 if signal.place.area else len(rest) - 1 if owner in programs else 2

    return sorted((signal for signal in chosen_signals(trace, ()) if not signal.place.is_generated), key=rank)


def _as_data(trace: ScanSource, made: Collector, prefix: str) -> dict[str, Any]:
    """What was collected, as JSON can write it; signals without values are left out."""
    times = made.times_ns
    return {
        "version": VERSION, "cycle": trace.cycle_ns, "depth": trace.depth.value,
        "scans": [made.first, len(times)],
        "times": [now - before for before, now in zip([0, *times], times, strict=False)],
        "words": {area: {str(at): changes for at, changes in sorted(rows.items())} for area, rows in made.words.items()},
        "names": dict(reversed(list(_located(trace, made.signals)))), "described": trace.described,
        "meanings": {address: {str(value): text for value, text in known.items()}
                     for address, known in trace.meanings.items()},
        "instances": [path.removeprefix(prefix.rstrip(".")).lstrip(".") for path in made.instances],
        **_numbered(trace, made, prefix),
        "frames": frame_rows(made.packets),
        "pictures": made.pictures, "ladder": {str(scan): rungs for scan, rungs in made.ladder.items()},
    }  # fmt: skip


def _numbered(trace: ScanSource, made: Collector, prefix: str) -> dict[str, Any]:
    """The signals that have values, the statements that occur, and the rows, which name both by their places in these lists."""
    kept = [number for number, changes in enumerate(made.changes) if changes]
    signals = {number: at for at, number in enumerate(kept)}
    used = sorted({row[0] for rows in made.rows.values() for row in rows if row[0] >= 0})
    sites = {number: at for at, number in enumerate(used)}
    rows = made.rows if trace.depth is not Depth.SCANS else {}
    return {
        "signals": [_signal(made, number, prefix) for number in kept],
        "sites": [[site.file, site.line, trace.line(site)] for site in (trace.sites[number] for number in used)],
        "rows": {str(scan): [_renumbered(row, signals, sites) for row in found] for scan, found in rows.items()},
    }


def frame_rows(rows: Sequence[tuple[int, Packet]]) -> list[list[Any]]:
    """The rows of the page's list of packets: scan, time, source, destination, info and the bytes in hexadecimal."""
    return [[scan, packet.now_ns, str(packet.source), str(packet.destination), packet.info, packet.data.hex()]
            for scan, packet in rows]  # fmt: skip


def _signal(made: Collector, number: int, prefix: str) -> dict[str, Any]:
    signal = made.signals[number]
    return {"name": signal.label.removeprefix(prefix), "bit": int(signal.is_bit), "said": signal.description,
            "changes": made.changes[number]}  # fmt: skip


def _renumbered(row: list[Any], signals: dict[int, int], sites: dict[int, int]) -> list[Any]:
    changed = [item for number, text in zip(row[2::2], row[3::2], strict=True) if number in signals or number == POWER
               for item in (signals.get(number, POWER), text)]  # fmt: skip
    return [sites.get(row[0], row[0]), row[1], *changed]


def _located(trace: ScanSource, signals: Sequence[Signal]) -> Iterator[tuple[str, str]]:
    """Pairs of an address and the variable that is located there."""
    for signal in signals:
        if not signal.place.area:
            try:
                if address := trace.names.address(signal.place):
                    yield address, signal.place.name
            except UnknownPlace:
                continue
