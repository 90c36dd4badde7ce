"""Signals out of a trace, for charts and for other formats."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Event, Passing
from fbvm.record.trace.reader import Moment, Trace
from fbvm.record.trace.recorder import Recording, Signal, Track, is_charted, signals_at
from fbvm.record.trace.selection import select, singles, tops
from fbvm.record.trace.traffic import Passed, Reader
from fbvm.watch.paths import Place


def recording(trace: Trace, names: Sequence[str] = (), scans: range | None = None) -> Recording:
    """What some variables did, for charts; without names, those that were selected or all single ones that changed.

    Raises UnknownPlace; TypeError for an array or a structure."""
    wanted = range(max(trace.scans.start, scans.start), min(trace.scans.stop, scans.stop)) if scans else trace.scans
    made = Recording([Track(signal) for signal in chosen_signals(trace, names)], wanted.start)
    for moment in trace.moments(wanted):
        for track in made.tracks:
            track.add(moment.scans, trace.names.read(moment.read, track.signal.place))
        made.times_ns.append(moment.now_ns)
    if not names:
        written = [track for track in made.tracks if not track.signal.place.unwritten]
        made.tracks = [track for track in written if len(track.changes) > 1] or written
    return made


def traffic(trace: Trace, scans: range | None = None) -> list[tuple[int, Passed]]:
    """What passed the network in some scans, with their numbers."""
    reader = Reader()
    return [(scan, passed) for scan, event in happenings(trace, scans) for passed in reader.read(event.now_ns, event.happening)]


def happenings(trace: Trace, scans: range | None = None) -> list[tuple[int, Passing]]:
    """The same as the network told it."""
    heard = _Heard()
    trace.follow(heard, scans)
    return heard.rows


class _Heard:
    """Follows a trace and keeps what the network told."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, Passing]] = []

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Nothing passes between phases."""

    def event(self, moment: Moment, event: Event) -> None:
        if isinstance(event, Passing):
            self.rows.append((moment.scans, event))


def chosen_signals(trace: Trace, names: Sequence[str]) -> list[Signal]:
    """The signals of some names; without names, those that were selected or all single ones.  Raises as `recording`."""
    return [signal for name in names for signal in signals_at(trace.find(name), trace.described, trace.meanings)] or _every(trace)


def _every(trace: Trace) -> list[Signal]:
    """All single values in the program that were selected, and what units describe; references only where they are named."""
    selection = select(trace.symbols, trace.areas, trace.selected)
    chosen = selection.places if trace.selected else tuple(tops(trace.symbols))
    found: dict[Place, None] = {}
    for place in chosen:
        for single in singles(place):
            found[single] = None
    if not trace.selected:
        described = [trace.find(name) for name in trace.described]
        found.update(dict.fromkeys(place for place in described if isinstance(place, Place)))
    return [signal for place in found if is_charted(place) for signal in signals_at(place, trace.described, trace.meanings)]
