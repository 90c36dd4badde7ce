"""What happened inside the scans of a window, for the page: a row a phase or statement, with what it changed; rungs with power.

    {scan: [[where, instance, signal, text, ...], ...]}

`where` is a statement, or -1, -2, -3 for the phases of a scan; signal -1 says whether an element of a rung conducts."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

from fbvm.base.memory import WHOLE_BYTES, Snapshot, compare
from fbvm.code.image import RungPicture
from fbvm.machine.plc import Phase
from fbvm.record.draw.ladder_svg import rung_svg
from fbvm.record.draw.ladder_text import ladder_surface
from fbvm.record.draw.power import PowerFlow
from fbvm.record.draw.sfc_recorder import ChartCall, ChartRecorder
from fbvm.record.draw.sfc_text import sfc_surface
from fbvm.record.trace.events import Contact, Event, Frame, Statement, Write
from fbvm.record.trace.format import PHASES
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.scan_source import Moment, ScanSource
from fbvm.syntax.ladder.drawing.widths import Annotations

MOST_IN_SCAN = 20_000
"""Rows up to which a scan is followed statement by statement; a loop of two million statements would take half a minute."""
FIRST_IN_SCAN = 1000
"""Rows that are kept of a scan with more: enough to see what is done again and again."""
MOST_PICTURES = 5000
"""Drawings of rungs and charts; executions with the same states share one."""
RUNG_WIDTH = 90
POWER = -1
"""In place of a signal: whether an element of a rung conducts."""

Rows = list[list[Any]]


class TooManyRows(Exception):
    """A scan has more rows than a page holds; its number is the value."""


def text_of(source: ScanSource, signal: Signal, moment: Moment) -> str:
    """The value of a signal as the page shows it; of a BOOL 0 or 1."""
    value = source.names.read(moment.read, signal.place)
    return str(int(value is True)) if signal.is_bit else signal.display(value)


class Insides:
    """What happened inside the scans of some windows: each in its turn.

    `signals` are those whose changes are shown, by their numbers on the page."""

    def __init__(self, source: ScanSource, signals: Sequence[Signal]) -> None:
        self._source, self._signals = source, signals
        self.instances: dict[str, int] = {}
        self.sites: dict[int, int] = {}
        """Statements that occur, by site, and the numbers that they have on the page."""
        self.pictures: list[str] = []
        self._located: dict[tuple[int, int], tuple[int, int]] = {}
        self._drawings: dict[tuple[object, ...], int] = {}
        self._at: dict[int, list[int]] = {}
        for number, signal in enumerate(signals):
            for offset in range(signal.place.offset, signal.place.offset + max(1, signal.place.type.size)):
                self._at.setdefault(offset, []).append(number)

    def window(self, scans: range, most_rows: int, end: Window | None = None) -> Window:
        """What happened inside these scans; if there are more rows, in the latest of them.  `end` is what is known already of
        the last ones."""
        if end is not None and end.scans:
            if end.scans.start <= scans.start:
                return end
            made = self.window(range(scans.start, end.scans.start), max(1, most_rows - end.count))
            made.append(end)
            return made
        made = Window(self, self._source, most_rows)
        begin = scans.start - 1 if scans.start > self._source.scans.start else scans.start
        made.shown_from = scans.start
        rest = range(begin, scans.stop)
        while rest:
            try:
                self._source.follow(made, rest)
                break
            except TooManyRows as long:
                scan = long.args[0]
            for moment in self._source.moments(range(scan, scan + 1)):
                made.phase(moment, Phase.REFRESH)
            rest = range(scan + 1, rest.stop)
        return made

    # --- asked by a window ----------------------------------------------------------------------------------------------

    def located(self, site: int, base: int) -> tuple[int, int]:
        """The numbers that a statement and the instance that begins at a byte have on the page."""
        known = self._located.get((site, base))
        if known is None:
            where = self.sites.setdefault(site, len(self.sites)) if site >= 0 else site
            known = self._located[site, base] = where, self.instance(base)
        return known

    def instance(self, base: int) -> int:
        """The number of the instance that begins at a byte."""
        return self.instances.setdefault(self._source.names.instance(base), len(self.instances))

    def picture(self, key: tuple[object, ...], lines: Callable[[], list[str]]) -> int | None:
        """The number of a drawing, which is made if there is none with this key; None if there are too many."""
        if key not in self._drawings:
            if len(self.pictures) >= MOST_PICTURES:
                return None
            self._drawings[key] = len(self.pictures)
            self.pictures.append("\n".join(lines()))
        return self._drawings[key]

    def texts(self, moment: Moment) -> list[str]:
        """The values of all signals."""
        return [text_of(self._source, signal, moment) for signal in self._signals]

    def new_values(self, known: list[str], numbers: Iterable[int], moment: Moment) -> list[Any]:
        """Signal, text, signal, text ... of those of some signals that have another value than the `known` one, which changes."""
        made: list[Any] = []
        for number in sorted(numbers):
            text = text_of(self._source, self._signals[number], moment)
            if text != known[number]:
                known[number] = text
                made += [number, text]
        return made

    def within(self, runs: Iterable[tuple[int, int]]) -> set[int]:
        """The numbers of the signals in some runs of bytes: (offset, length)."""
        return {number for offset, size in runs for at in range(offset, offset + size) for number in self._at.get(at, ())}

    def written(self, event: Write) -> list[int]:
        """The numbers of the signals that a write may change."""
        return [number for number in self.within([(event.offset, len(event.value))]) if event.bit == WHOLE_BYTES
                or self._signals[number].place.bit in (None, event.bit)]  # fmt: skip


class Window:
    """Follows the scans of one window and keeps its rows: of at most `most_rows` rows the latest scans."""

    def __init__(self, insides: Insides, source: ScanSource, most_rows: int) -> None:
        self._insides, self._source, self._most_rows = insides, source, most_rows
        self.rows: OrderedDict[int, Rows] = OrderedDict()
        self.ladder: dict[int, list[list[int]]] = {}
        self.shown_from = 0
        """The scan before it only tells what was before."""
        self._power = PowerFlow(source.rungs, lambda scan: True)
        self._chart_recorder = ChartRecorder(source.charts, lambda scan: True)
        self._has_pictures = bool(source.rungs or source.charts)
        self._known: list[str] = []
        self._memory: Snapshot | None = None
        self._statement: tuple[int, Frame] | None = None
        self._row: list[Any] | None = None
        self.count = 0
        """The number of rows that are kept."""
        self._lead_in = 0

    @property
    def scans(self) -> range:
        """The scans whose rows are kept."""
        return range(next(iter(self.rows)), next(reversed(self.rows)) + 1) if self.rows else range(0)

    def append(self, following: Window) -> None:
        """Adds what is known of the scans behind these."""
        self.rows.update(following.rows)
        self.ladder.update(following.ladder)
        self.count += following.count

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Records changes that no statement has made."""
        now = moment.memory.snapshot()
        if self._memory is None:
            self._known = self._insides.texts(moment)
        self._statement = self._row = None
        touched = self._insides.within(compare(self._memory, now)) if self._memory else ()
        moved = self._insides.new_values(self._known, touched, moment)
        self._memory = now
        if moved or phase is Phase.INPUTS:
            self._add(moment.scans, [-1 - PHASES.index(phase), -1, *moved])
        self._power.phase(moment, phase)
        self._chart_recorder.phase(moment, phase)
        if phase is Phase.PROGRAM:
            self._draw(moment.scans)

    def event(self, moment: Moment, event: Event) -> None:
        """Records a statement, its writes, the state of a contact."""
        if self._has_pictures:
            self._power.event(moment, event)
            self._chart_recorder.event(moment, event)
        if type(event) is Statement:
            self._statement = event.site, event.frame
            self._open(moment, event.site, event.frame)
        elif type(event) is Contact:
            self._add(moment.scans, [*self._insides.located(event.site, event.frame.base), POWER, str(int(event.value))])
        elif type(event) is Write and event.old != event.value:
            if self._statement != (event.site, event.frame) or self._row is None:
                self._statement = event.site, event.frame
                self._open(moment, event.site, event.frame)
            assert self._row is not None
            self._row += self._insides.new_values(self._known, self._insides.written(event), moment)

    def _open(self, moment: Moment, site: int, frame: Frame) -> None:
        self._row = [*self._insides.located(site, frame.base)]
        self._add(moment.scans, self._row)

    def _add(self, scan: int, row: list[Any]) -> None:
        if scan < self.shown_from:
            self._lead_in += 1
            if self._lead_in > MOST_IN_SCAN:
                raise TooManyRows(scan)
            return
        if scan not in self.rows:
            self.rows[scan] = []
        rows = self.rows[scan]
        if len(rows) >= MOST_IN_SCAN:
            self.count -= len(rows) - FIRST_IN_SCAN
            del rows[FIRST_IN_SCAN:]
            raise TooManyRows(scan)
        rows.append(row)
        self.count += 1
        while self.count > self._most_rows and len(self.rows) > 1:
            gone, rows = self.rows.popitem(last=False)
            self.count -= len(rows)
            self.ladder.pop(gone, None)

    # --- drawings -------------------------------------------------------------------------------------------------------

    def _draw(self, scan: int) -> None:
        """Draws the rungs and charts of a scan; those with the same states share one drawing."""
        executed, calls = list(self._power.executed), list(self._chart_recorder.calls)
        self._power.executed.clear()
        self._chart_recorder.calls.clear()
        if scan < self.shown_from:
            return
        for made in executed:
            key = made.picture.site, *sorted((step, tuple(seen)) for step, seen in made.states.items())
            self._picture(scan, made.base, key, partial(_rung, made.picture, Annotations(made.states)))
        for called in calls:
            key = called.picture.site, tuple(sorted(called.tested.items())), called.active
            self._picture(scan, called.base, key, partial(self._chart, called))

    def _chart(self, called: ChartCall) -> list[str]:
        name, kind = self._source.bodies[called.picture.body]
        return [f"{kind} {name}", rung_svg(sfc_surface(called.picture, RUNG_WIDTH, called.state))]

    def _picture(self, scan: int, base: int, key: tuple[object, ...], lines: Callable[[], list[str]]) -> None:
        number = self._insides.picture(key, lines)
        if number is not None:
            self.ladder.setdefault(scan, []).append([self._insides.instance(base), number])


def _rung(picture: RungPicture, annotations: Annotations) -> list[str]:
    """The headline of a rung, and its drawing as SVG."""
    head, surface = ladder_surface(picture, RUNG_WIDTH, annotations)
    return [head, rung_svg(surface)] if picture.steps else [head]
