"""The scans of a recording for charts, tables, causes and pages, which ask for a scan and do not care how it is had."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from fbvm.machine.plc import Phase, Plc
from fbvm.record.recording.last_change import may_change
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.trace.events import Event, NetworkEvent
from fbvm.record.trace.observing import observing
from fbvm.record.trace.outline import outer_statements
from fbvm.record.trace.packets import add_tap
from fbvm.record.trace.results import results_of
from fbvm.record.trace.scan_source import Follower, Moment, ScanSource
from fbvm.record.trace.writer import Depth, descriptions, meanings
from fbvm.watch.names import Names
from fbvm.watch.paths import Place
from fbvm.wire.tap import TapEvent


class RecordedScans(ScanSource):
    """The scans of `recorded` from number `first` on.

    `selected` are patterns of the variables that are meant if none is named, `lines` source lines by file and number.  Of depth
    SCANS, nothing is told of what happened inside but what passed the network."""

    def __init__(self, recorded: RecordedPlc, lines: Mapping[str, Mapping[int, str]], selected: Sequence[str] = (),
                 depth: Depth = Depth.STATEMENTS, first: int = 0) -> None:  # fmt: skip
        plc, image = recorded.plc, recorded.plc.image
        self._recorded: RecordedPlc = recorded
        self._first = first
        self.cycle_ns, self.depth, self.selected, self.lines = plc.cycle_ns, depth, tuple(selected), lines
        self.symbols, self.areas = image.symbols, plc.memory.areas
        self.names = Names.of(image, plc.memory.areas)
        self.sites, self.rungs, self.charts = image.sites, image.rungs, image.charts
        self.outer = outer_statements(image)
        self.results = results_of(image)
        self.bodies = [(body.name, body.kind) for body in image.bodies]
        self.described, self.meanings = descriptions(plc), meanings(plc)

    @property
    def recorded(self) -> RecordedPlc:
        """The recording that the scans are of."""
        return self._recorded

    @property
    def scans(self) -> range:
        """Numbers from the first to the last scan that there is, one that was interrupted among them."""
        scans = self._recorded.begun
        return range(max(scans.start, self._first), max(scans.stop, self._first))

    def moments(self, scans: range | None = None) -> Iterator[Moment]:
        """The PLC at the end of each scan; the same object for all scans."""
        if scans := self._wanted(scans):
            moment = None
            for plc in self._recorded.again(scans):
                moment = moment or Moment(self, plc.memory)
                moment.scans, moment.now_ns = plc.scans - 1, plc.now_ns
                yield moment

    def follow(self, follower: Follower, scans: range | None = None) -> None:
        """Executes some scans again, or all, and reports their phases and events to `follower`."""
        if self.depth is Depth.SCANS:
            self.follow_ends(follower, scans)
            return

        @contextmanager
        def attached(plc: Plc) -> Iterator[None]:
            with observing(plc, self._listen(plc, follower)):
                yield

        if scans := self._wanted(scans):
            self._recorded.follow_with(scans, attached)

    def follow_ends(self, follower: Follower, scans: range | None = None) -> None:
        """Executes some scans again, or all, and reports their ends and what passed the network."""

        @contextmanager
        def attached(plc: Plc) -> Iterator[None]:
            self._listen(plc, follower)
            yield

        if scans := self._wanted(scans):
            self._recorded.follow_with(scans, attached)

    def may_change(self, places: Sequence[Place], scans: range) -> range:
        """The scans up to the last change of one of the places, or up to some scans behind it."""
        return may_change(self._recorded, places, scans)

    def _listen(self, plc: Plc, follower: Follower) -> ScanListener:
        """Has a PLC report to `follower` the ends of its scans and what passes the network."""
        listener = ScanListener(plc, Moment(self, plc.memory), follower)
        plc.watchers.append(listener.end)
        for network in [attached.network for attached in plc.units][:1]:
            add_tap(network, listener.passed)
        return listener

    def _wanted(self, scans: range | None) -> range:
        held = self.scans
        return held if scans is None else range(max(held.start, scans.start), min(held.stop, scans.stop))


class ScanListener:
    """Passes on to a follower what happens in the scans of a PLC that executes them again."""

    def __init__(self, plc: Plc, moment: Moment, follower: Follower) -> None:
        self._plc, self._moment, self._follower = plc, moment, follower

    def _at(self, plc: Plc, scan: int) -> Moment:
        self._moment.scans, self._moment.now_ns = scan, plc.now_ns
        return self._moment

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Passes on the end of a phase; that of the refresh is the end of the scan, which a trap may bring, too."""
        if phase is not Phase.REFRESH:
            self._follower.phase(self._at(plc, plc.scans), phase)

    def event(self, plc: Plc, event: Event) -> None:
        self._follower.event(self._moment, event)  # which the phase before has set

    def passed(self, now_ns: int, unit: str, event: TapEvent) -> None:
        """Passes on an event of the network."""
        self._follower.event(self._at(self._plc, self._plc.scans), NetworkEvent(now_ns, event))

    def end(self, plc: Plc) -> None:
        """Called after each scan."""
        self._follower.phase(self._at(plc, plc.scans - 1), Phase.REFRESH)
