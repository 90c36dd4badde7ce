"""Waveforms of signals, and packets, read from a trace for charts and other formats."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Event, NetworkEvent
from fbvm.record.trace.packets import Dissector, Packet
from fbvm.record.trace.recorder import Signal, Track, Waveforms, is_charted, signals_at
from fbvm.record.trace.scan_source import Moment, ScanSource
from fbvm.record.trace.selection import select, single_places, symbol_places
from fbvm.watch.paths import Place


def waveforms(trace: ScanSource, names: Sequence[str] = (), scans: range | None = None) -> Waveforms:
    """The values of some variables in some scans, for charts and other formats.

    `names` are paths, addresses and ranges; without names the variables that the trace selects, else all single values that
    change.  Without `scans` all of them.  Raises UnknownPlace, and TypeError for an array or a structure."""
    wanted = range(max(trace.scans.start, scans.start), min(trace.scans.stop, scans.stop)) if scans else trace.scans
    made = Waveforms([Track(signal) for signal in chosen_signals(trace, names)], wanted.start)
    for moment in trace.moments(wanted):
        for track in made.tracks:
            track.add(moment.scans, trace.names.read(moment.read, track.signal.place))
        made.times_ns.append(moment.now_ns)
    if not names:
        written = [track for track in made.tracks if not track.signal.place.is_generated]
        made.tracks = [track for track in written if len(track.changes) > 1] or written
    return made


def packets(trace: ScanSource, scans: range | None = None) -> list[tuple[int, Packet]]:
    """The packets of some scans, or of all, each with the number of its scan."""
    dissector = Dissector()
    return [(scan, packet) for scan, event in network_events(trace, scans)
            for packet in dissector.dissect(event.now_ns, event.tap_event)]  # fmt: skip


def network_events(trace: ScanSource, scans: range | None = None) -> list[tuple[int, NetworkEvent]]:
    """The network events of some scans, or of all, each with the number of its scan."""
    listener = _NetworkEvents()
    trace.follow(listener, scans)
    return listener.rows


class _NetworkEvents:
    """Follows a trace and keeps its network events."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, NetworkEvent]] = []

    def phase(self, moment: Moment, phase: Phase) -> None:
        """The end of a phase is no network event."""

    def event(self, moment: Moment, event: Event) -> None:
        if isinstance(event, NetworkEvent):
            self.rows.append((moment.scans, event))


def chosen_signals(trace: ScanSource, names: Sequence[str]) -> list[Signal]:
    """The signals of some names; without names those that the trace selects, else all single values.  Raises as `recording`."""
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
