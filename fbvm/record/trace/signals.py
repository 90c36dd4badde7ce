"""Waveforms of signals, and packets, read from a trace for charts and other formats."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Event, NetworkEvent
from fbvm.record.trace.packets import Dissector, Packet
from fbvm.record.trace.recorder import Track, Waveforms
from fbvm.record.trace.samples import ScanSamples, chosen_signals, some_scans
from fbvm.record.trace.scan_source import Moment, ScanSource


def waveforms(trace: ScanSource, names: Sequence[str] = (), scans: range | None = None) -> Waveforms:
    """The values of some variables in some scans, for charts and other formats.

    `names` are paths, addresses and ranges; without names the variables that the trace selects, else all single values that
    change.  Without `scans` all of them.  Raises UnknownPlace, and TypeError for an array or a structure."""
    found = ScanSamples(trace, chosen_signals(trace, names), some_scans(trace, scans))
    made = Waveforms([Track(signal) for signal in found.signals], found.scans.start)
    for scan, now_ns, changed in found.steps():
        made.times_ns.append(now_ns)
        for number, value in changed:
            made.tracks[number].changes.append((scan, value))
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
    trace.follow_ends(listener, scans)
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
