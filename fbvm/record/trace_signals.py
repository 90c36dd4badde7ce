"""Signals out of a trace, for charts and for other formats."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.record.recorder import Recording, Signal, Track, signals_at
from fbvm.record.selection import select, singles
from fbvm.record.trace import Trace
from fbvm.watch.paths import Place


def recording(trace: Trace, names: Sequence[str] = (), scans: range | None = None) -> Recording:
    """What some variables did, for charts; without names, those that were selected or all single ones that changed.

    Raises UnknownPlace; TypeError for an array or a structure."""
    wanted = range(max(trace.scans.start, scans.start), min(trace.scans.stop, scans.stop)) if scans else trace.scans
    signals = [signal for name in names for signal in signals_at(trace.find(name), trace.described)]
    made = Recording([Track(signal) for signal in signals or _every(trace)], wanted.start)
    for moment in trace.moments(wanted):
        for track in made.tracks:
            track.add(moment.scans, moment.read(track.signal.place))
        made.times_ns.append(moment.now_ns)
    if not names:
        made.tracks = [track for track in made.tracks if len(track.changes) > 1] or made.tracks
    return made


def _every(trace: Trace) -> list[Signal]:
    """All single values in the program that were selected, and what units describe."""
    selection = select(trace.symbols, trace.areas, trace.selected)
    chosen = selection.places if trace.selected else tuple(
        Place(field.name, field.type, field.offset, field.bit) for field in trace.symbols.values())  # fmt: skip
    found: dict[Place, None] = {}
    for place in chosen:
        for single in singles(place):
            found[single] = None
    if not trace.selected:
        described = [trace.find(name) for name in trace.described]
        found.update(dict.fromkeys(place for place in described if isinstance(place, Place)))
    return [signal for place in found for signal in signals_at(place, trace.described)]
