"""A stepping session with a PLC that runs: the position in the program, and changes from outside.

Every scan is executed once on the live PLC of a `World`, which has units and a network, and is recorded.  A position inside a
scan is reached by executing that scan again (`ScanReplay`) from the state before it, which the recording gives.  A change from
outside is kept with its position.  A change in the past discards all later scans: they are executed anew, in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from fbvm.machine.plc import Phase, Plc
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.step.position import Position as Position
from fbvm.step.scan_replay import END, Action, MomentListener, PastMoment, ScanReplay, Stop
from fbvm.step.stepping import Stepping, reached_step
from fbvm.step.world import Debugged, World


class Session(Stepping):
    """Steps through the scans of the PLC `name` of a world, of its only one without a name."""

    player: ScanReplay

    def __init__(self, world: World, name: str = "") -> None:
        self.world, self.name = world, name or world.names[0]
        super().__init__(ScanReplay(world[self.name]))
        self.go_to(Position(self.world[self.name].scans))
        self.mark()

    @classmethod
    def of(cls, make: Callable[[], Plc]) -> Session:
        """A session with one PLC.  `make` returns a new PLC at power-on, with its units and a network in virtual time; all PLCs
        that it returns are equal."""
        return cls(World(lambda: [Debugged("plc", make())]))

    @property
    def plc(self) -> Plc:
        """The PLC at the current position, for reading; `act` changes it."""
        return self.player.plc

    @property
    def units(self) -> Plc:
        """The live PLC with its units, which may be some scans ahead."""
        return self.world[self.name]

    def first(self) -> int:
        return self.world.first(self.name)

    def reachable(self, scan: int) -> int:
        self.world.advance(self.name, scan)
        live = self.units
        return live.scans - 1 if live.trap and scan >= live.scans else max(self.first(), scan)

    def play(self, scan: int, stop: Stop, listener: MomentListener | None = None) -> bool:
        state = self.world.state(self.name, scan)
        return self.player.play(state, self.world.actions_in(self.name, scan), stop, listener)

    def act(self, action: Action) -> None:
        """Calls `action` with the PLC at the current position and discards all later scans.

        `action` is called again whenever this position is executed again.  Raises what `action` raises, and ReadOnlyPast where
        the past can only be looked at."""
        here = self.here
        try:
            action(self.plc)
            self.world.act(self.name, here, action)
        finally:
            self.go_to(here)

    @property
    def recorded(self) -> RecordedPlc:
        return self.world.recorded(self.name)

    def follow(self, listener: MomentListener, scans: range) -> None:
        here = self.here
        for scan in range(max(self.first(), scans.start), min(scans.stop, here.scan + 1)):
            last = here.step if scan == here.scan else END
            self.play(scan, partial(reached_step, last), listener)
            if scan < here.scan:
                now_ns = self.now_ns
                self.plc.restore(self.world.state(self.name, scan + 1))
                listener.phase(PastMoment(self.plc, scan, now_ns), Phase.REFRESH)
        self.go_to(here)
