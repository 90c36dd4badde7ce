"""The values of signals scan by scan, as they change: for formats that are written without the run in memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.memory import Snapshot
from fbvm.record.trace.recorder import Signal, is_charted, signals_at
from fbvm.record.trace.scan_source import Moment, ScanSource
from fbvm.record.trace.selection import select, single_places, symbol_places
from fbvm.watch.paths import Place
from fbvm.watch.values import Value

LINE = 32
"""Bytes that are compared together: a few signals lie in them."""
_ZEROS = bytes(PAGE_BYTES)

Step = tuple[int, int, list[tuple[int, Value]]]
"""A scan, its time in nanoseconds, and the signals that have a new value at its end, by number; of the first scan all."""


class Samples(Protocol):
    """Signals, and their values scan by scan."""

    @property
    def signals(self) -> Sequence[Signal]: ...

    def steps(self) -> Iterator[Step]:
        """Scan after scan, each with the values that changed."""


class SignalLines:
    """Finds the signals whose values may have changed between two moments."""

    def __init__(self, signals: Sequence[Signal]) -> None:
        self._at: dict[int, list[int]] = {}
        self._always = [number for number, signal in enumerate(signals) if signal.place.hops]
        for number, signal in enumerate(signals):
            place = signal.place
            for line in range(place.offset // LINE, (place.offset + max(1, place.type.size) - 1) // LINE + 1):
                self._at.setdefault(line, []).append(number)
        self._pages = sorted({line * LINE // PAGE_BYTES for line in self._at})

    def moved(self, before: Snapshot, now: Snapshot) -> Iterable[int]:
        """The numbers of the signals in lines that differ."""
        found = set(self._always)
        for page in self._pages:
            old, new = before.pages[page], now.pages[page]
            if old is new:
                continue
            old, new = old or _ZEROS, new or _ZEROS
            for at in range(0, PAGE_BYTES, LINE):
                if old[at:at + LINE] != new[at:at + LINE]:
                    found.update(self._at.get((page * PAGE_BYTES + at) // LINE, ()))
        return sorted(found)


class ScanSamples:
    """The values of `signals` in some scans of `source`, which are gone through each time that they are asked for."""

    def __init__(self, source: ScanSource, signals: Sequence[Signal], scans: range) -> None:
        self.signals, self.scans = signals, scans
        self._source = source

    def steps(self) -> Iterator[Step]:
        """Scan after scan, each with the values that changed."""
        lines, known, before = SignalLines(self.signals), list[Value](), None
        for moment in self._source.moments(self.scans):
            now = moment.memory.snapshot()
            if before is None:
                known = [self._read(moment, number) for number in range(len(self.signals))]
                yield moment.scans, moment.now_ns, list(enumerate(known))
            else:
                changed: list[tuple[int, Value]] = []
                for number in lines.moved(before, now):
                    value = self._read(moment, number)
                    if value != known[number]:
                        known[number] = value
                        changed.append((number, value))
                yield moment.scans, moment.now_ns, changed
            before = now

    def _read(self, moment: Moment, number: int) -> Value:
        return self._source.names.read(moment.read, self.signals[number].place)

    def changing(self) -> set[int]:
        """The numbers of the signals that change."""
        found: set[int] = set()
        steps = self.steps()
        next(steps, None)
        for _, _, changed in steps:
            found.update(number for number, _ in changed)
            if len(found) == len(self.signals):
                break
        return found


def samples(source: ScanSource, names: Sequence[str] = (), scans: range | None = None) -> ScanSamples:
    """The values of some variables in some scans.

    `names` are paths, addresses and ranges; without names the variables that the trace selects, else all single values that
    change, for which the scans are gone through once more.  Without `scans` all of them.  Raises UnknownPlace, and TypeError for
    an array or a structure."""
    made = ScanSamples(source, chosen_signals(source, names), some_scans(source, scans))
    if not names:
        written = [signal for signal in made.signals if not signal.place.is_generated]
        made.signals = written
        changing = made.changing()
        made.signals = [signal for number, signal in enumerate(written) if number in changing] or written
    return made


def some_scans(source: ScanSource, scans: range | None) -> range:
    """Those of some scans that there are; without `scans` all."""
    held = source.scans
    return range(max(held.start, scans.start), min(held.stop, scans.stop)) if scans else held


def chosen_signals(trace: ScanSource, names: Sequence[str]) -> list[Signal]:
    """The signals of some names; without names those that the trace selects, else all single values.  Raises as `samples`."""
    return [signal for name in names for signal in signals_at(trace.find(name), trace.described, trace.meanings)] or _every(trace)


def _every(trace: ScanSource) -> list[Signal]:
    """The single values that the trace selects, else those of the program and what units describe; no references."""
    selection = select(trace.symbols, trace.areas, trace.selected)
    chosen = selection.places if trace.selected else tuple(symbol_places(trace.symbols))
    found: dict[Place, None] = {}
    for place in chosen:
        for single in single_places(place):
            found[single] = None
    if not trace.selected:
        described = [trace.find(name) for name in trace.described]
        found.update(dict.fromkeys(place for place in described if isinstance(place, Place)))
    return [signal for place in found if is_charted(place) for signal in signals_at(place, trace.described, trace.meanings)]
