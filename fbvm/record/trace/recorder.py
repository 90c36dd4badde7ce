"""Records signals once a scan, after the I/O refresh, as lists of changes.

A recorder reads memory at the end of scans; values inside a scan are in traces.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from fbvm.base.types import BOOL, ArrayType, Elementary, EnumType, RefType, StringType, StructType, base
from fbvm.machine.plc import Plc
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span, UnknownPlace, element, member
from fbvm.watch.values import Value, show

HEXADECIMAL_AREAS = frozenset(("CIO", "W", "H", "A"))
"""Areas whose words are mostly flags and are shown in hexadecimal."""


@dataclass(frozen=True)
class Signal:
    """One row of waveforms: a place, its label, and the description by the unit that has this address."""

    place: Place
    label: str
    description: str = ""
    meanings: tuple[tuple[int, str], ...] = ()
    """Texts of some values, such as the states of a socket."""

    @property
    def is_bit(self) -> bool:
        return base(self.place.type) is BOOL

    def text(self, value: Value) -> str:
        """A value as a chart shows it: short, flag words in hexadecimal."""
        kind = base(self.place.type)
        wanted = self.place.hexadecimal or self.place.area in HEXADECIMAL_AREAS
        if wanted and isinstance(value, int) and not self.is_bit:
            return f"{value & (1 << 8 * kind.size) - 1:0{2 * kind.size}X}h"
        if isinstance(kind, EnumType) and isinstance(value, int):
            return kind.shown.get(value, str(value))
        return show(self.place.type, value).removeprefix("T#")

    def display(self, value: Value) -> str:
        """The text in `meanings` for a value, else `text`; for people only."""
        return next((text for known, text in self.meanings if known == value), None) or self.text(value)


@dataclass
class Track:
    """The values of a signal: (scan, value) for the first recorded scan and each scan at whose end the value is another one."""

    signal: Signal
    changes: list[tuple[int, Value]] = field(default_factory=list)

    def add(self, scan: int, value: Value) -> None:
        """Appends the value at the end of a scan if it is another one."""
        if not self.changes or self.changes[-1][1] != value:
            self.changes.append((scan, value))

    def values(self, scans: range) -> Iterator[Value]:
        """The value at the end of each of these scans, in order; the first must have been recorded."""
        at = 0
        for scan in scans:
            while at + 1 < len(self.changes) and self.changes[at + 1][0] <= scan:
                at += 1
            yield self.changes[at][1]


@dataclass
class Waveforms:
    """The values of some signals from scan number `first` on, and the time of each scan in nanoseconds."""

    tracks: list[Track]
    first: int
    times_ns: list[int] = field(default_factory=list)

    @property
    def scans(self) -> range:
        """Numbers of the scans that are recorded, counted from 0 at power-on."""
        return range(self.first, self.first + len(self.times_ns))

    @property
    def signals(self) -> list[Signal]:
        """The signals, in the order of the tracks."""
        return [track.signal for track in self.tracks]

    def steps(self) -> Iterator[tuple[int, int, list[tuple[int, Value]]]]:
        """Scan, time, and the signals that have a new value at its end, by number; of the first scan all."""
        changes: dict[int, list[tuple[int, Value]]] = {}
        for at, track in enumerate(self.tracks):
            for scan, value in track.changes:
                changes.setdefault(scan, []).append((at, value))
        for scan, now_ns in zip(self.scans, self.times_ns, strict=True):
            yield scan, now_ns, changes.get(scan, [])

    def relabelled(self, prefix: str) -> Waveforms:
        """The same waveforms without a prefix of the labels."""
        tracks = [Track(replace(track.signal, label=track.signal.label.removeprefix(prefix)), track.changes)
                  for track in self.tracks]  # fmt: skip
        return Waveforms(tracks, self.first, self.times_ns)


class Recorder(Waveforms):
    """Records signals from the next scan of `plc` until `stop`.

    `signals` are paths, addresses, ranges, or pairs of one and its description.  Raises UnknownPlace, and TypeError for an
    array or a structure."""

    def __init__(self, plc: Plc, signals: Iterable[str | tuple[str, str] | Signal]) -> None:
        super().__init__([Track(signal) for given in signals for signal in signals_of(plc, given)], plc.scans)
        self._plc, self._names = plc, Names.of(plc.image, plc.memory.areas)
        plc.watchers.append(self._watch)

    def stop(self) -> None:
        """Ends the recording; recorded values stay."""
        if self._watch in self._plc.watchers:
            self._plc.watchers.remove(self._watch)

    def _watch(self, plc: Plc) -> None:
        scan = self.first + len(self.times_ns)
        self.times_ns.append(plc.now_ns)
        for track in self.tracks:
            track.add(scan, self._names.read(plc.read, track.signal.place))


def signals_of(plc: Plc, given: str | tuple[str, str] | Signal) -> list[Signal]:
    """The signals that a name, an address or a range stands for; descriptions come from the attached units."""
    if isinstance(given, Signal):
        return [given]
    text, description = given if isinstance(given, tuple) else (given, "")
    found = plc.find(text)
    places = found.places if isinstance(found, Span) else (found,)
    return [signal(place, description or description_of(plc, place)) for place in places]


def signals_at(found: Place | Span, descriptions: Mapping[str, str], meanings: Mapping[str, Mapping[int, str]] | None = None,
               ) -> list[Signal]:  # fmt: skip
    """The signals at a place or in a span, with descriptions, and what values mean, by address."""
    places = found.places if isinstance(found, Span) else (found,)
    return [signal(place, descriptions.get(place.name, "") if place.area else "",
                   (meanings or {}).get(place.name, {}) if place.area else {}) for place in places]  # fmt: skip


def signal(place: Place, description: str = "", meanings: Mapping[int, str] | None = None) -> Signal:
    """The signal of one place.  Raises TypeError for an array or a structure."""
    if not is_charted(place) and not isinstance(place.type, RefType):
        whole = "elements" if isinstance(base(place.type), ArrayType) else "members"
        said = f"; name its {whole}, such as {example}" if (example := _first_value(place)) else ""
        raise TypeError(f"{place.name} is {place.type.name}, which is no single value{said}")
    return Signal(place, place.name.replace("CIO ", "CIO"), description, tuple((meanings or {}).items()))


def _first_value(place: Place) -> str:
    """The name of the first single value in an array or a structure, "" if it has none."""
    kind = base(place.type)
    if isinstance(kind, ArrayType):
        return _first_value(element(place, kind, 0))
    if not isinstance(kind, StructType):
        return place.name
    return next((name for field in kind.fields.values() if (name := _first_value(member(place, field.name)))), "")


def is_charted(place: Place) -> bool:
    """True for a place that charts show by default: no array, no structure, no reference."""
    return isinstance(base(place.type), Elementary | StringType | EnumType)


def description_of(plc: Plc, place: Place) -> str:
    """The description of an address by an attached unit, "" without one."""
    for attached in plc.units:
        descriptions: dict[str, str] = getattr(attached.unit, "descriptions", {})
        if place.area and place.name in descriptions:
            return descriptions[place.name]
    return ""


def default_signals(plc: Plc) -> list[Signal]:
    """The signals of a chart by default: all addresses that units describe, and the programs' own single values."""
    signals: list[Signal] = []
    for attached in plc.units:
        for address in getattr(attached.unit, "descriptions", {}):
            signals += signals_of(plc, address)
    for symbol in plc.image.symbols.values():
        for text in [symbol.name, *(f"{symbol.name}.{name}" for name in getattr(symbol.type, "fields", ()))]:
            try:
                signals += (found for found in signals_of(plc, text) if is_charted(found.place))
            except (TypeError, UnknownPlace):
                continue
    return signals
