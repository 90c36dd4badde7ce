"""A stepping session with a recording: everything but going on past its end, and changing anything."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

from fbvm.base.memory import Memory
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Phase, Plc
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.events import Event
from fbvm.record.trace.scan_source import Moment
from fbvm.step.facts import ProgramFacts
from fbvm.step.position import Position
from fbvm.step.scan_replay import END, Action, MomentListener, Paused, Player, Stop
from fbvm.step.stepping import Stepping, reached_step
from fbvm.step.world import ReadOnlyPast


class RecordingPlayer(Player):
    """Plays the scans of a recording."""

    def __init__(self, source: RecordedScans) -> None:
        image, areas = source.recorded.plc.image, source.areas
        super().__init__(ProgramFacts(image, areas, source.names, source.cycle_ns, source.described, source.meanings))
        self._source = source
        self.memory = Memory(image.layout.size, image.layout.areas)
        self._moment = Moment(source, self.memory)
        self._trap: Trap | None = None

    def play(self, scan: int, stop: Stop, listener: MomentListener | None = None) -> bool:
        """Plays a scan until `stop` returns True; returns False if its program has ended before, or nothing is known of it."""
        self._begin(stop, listener)
        self._trap = None
        with suppress(Paused):
            self._source.follow(self, range(scan, scan + 1))
        return self.statement is not None

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Called at the end of a phase."""
        self._moment, self.memory = moment, moment.memory
        if phase is not Phase.INPUTS:
            self._trap = self._trap_in(moment.scans)
        self._over(phase)

    def event(self, moment: Moment, event: Event) -> None:
        """Called for each event."""
        self._moment, self.memory = moment, moment.memory
        self._see(event)

    def _trap_in(self, scan: int) -> Trap | None:
        recorded = self._source.recorded
        end = recorded.scans.stop
        if scan != end - 1:
            return None
        return next(recorded.states(range(end, end + 1))).trap

    @property
    def now_ns(self) -> int:
        return self._moment.now_ns

    @property
    def trap(self) -> Trap | None:
        return self._trap

    @property
    def moment(self) -> Moment:
        return self._moment


class PastSession(Stepping):
    """Steps through the scans of a recording.  It begins at the end of the last one."""

    player: RecordingPlayer

    def __init__(self, source: RecordedScans, name: str = "plc") -> None:
        if not source.scans:
            raise ValueError("nothing is recorded")
        super().__init__(RecordingPlayer(source))
        self.source, self.name = source, name
        self.go_to(Position(source.scans[-1], END))
        self.mark()

    @property
    def source_plc(self) -> Plc:
        """The PLC that was recorded."""
        return self.recorded.plc

    @property
    def recorded(self) -> RecordedPlc:
        return self.source.recorded

    def first(self) -> int:
        return self.source.scans.start

    def reachable(self, scan: int) -> int:
        return max(self.first(), min(scan, self.source.scans[-1]))

    def play(self, scan: int, stop: Stop, listener: MomentListener | None = None) -> bool:
        return self.player.play(scan, stop, listener)

    def act(self, action: Action) -> None:
        """Raises ReadOnlyPast: what was recorded cannot be changed."""
        raise ReadOnlyPast("this is a recording: it can be looked at, not changed")

    def follow(self, listener: MomentListener, scans: range) -> None:
        here = self.here
        for scan in range(max(self.first(), scans.start), min(scans.stop, here.scan + 1)):
            last = here.step if scan == here.scan else END
            self.play(scan, partial(reached_step, last), listener)
            if scan < here.scan:
                listener.phase(self.source.at(scan), Phase.REFRESH)
        self.go_to(here)
