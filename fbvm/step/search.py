"""Searches the scans of a PLC for breakpoints at the speed of its engine, forwards and backwards.

The guarded engine (`engine/choice/stoppable.py`) says in which scan one is reached; where in that scan, the scan itself says when
it is played (`ScanStops`).  So a stop at full speed and a step back stand at the same positions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator, Mapping, Sequence
from typing import Protocol

from fbvm.engine.stops import State
from fbvm.machine.breakpoints import Breakpoint, Breakpoints
from fbvm.machine.plc import Plc
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.recording.replay import Replay
from fbvm.step.world import World

MOST_AT_ONCE = 4096
"""Scans of one slice."""


class ScanCheck(Protocol):
    """Looks at a PLC after each of its scans; what stops a run there is in `found`."""

    found: str
    kind: str
    """The exception filter that found it."""

    def attached(self, plc: Plc) -> None:
        """Called when another PLC executes the scans."""

    def checked(self, plc: Plc) -> bool:
        """Called after each scan.  Returns True if the run stops before the next one."""


class Scene(Protocol):
    """What a runner asks of the PLC whose scans it executes."""

    def changed_inside(self, scan: int) -> bool:
        """True for a scan in which something was done from outside: it is played, not executed."""

    def unchanged_until(self, scans: range) -> int:
        """The first of some scans in which something was done from outside, or their end."""

    def stops_in(self, scan: int, state: State) -> tuple[bool, State]:
        """Plays such a scan.  Returns True if a breakpoint is reached in it, and what breakpoints have seen at its end."""


class Runner(ABC):
    """Executes scans of a PLC until one of its breakpoints is reached.  `passes` is how often each was passed before."""

    def __init__(self, plc: Plc, scene: Scene, breakpoints: Sequence[Breakpoint], state: State | None,
                 passes: Mapping[Breakpoint, int], check: ScanCheck | None) -> None:  # fmt: skip
        self.plc, self.check = plc, check
        self._scene, self._breakpoints = scene, breakpoints
        self.rows: Breakpoints = plc.breakpoints
        self._arm()
        self.rows.begin(passes)
        if state is not None:
            self.rows.restore(state)
        self.state: State = self.rows.state
        """What breakpoints had seen before the scan that was executed last."""
        if check:
            check.attached(plc)

    def _arm(self) -> None:
        self.rows.clear()
        for each in self._breakpoints:
            self.rows.put(each)

    def scan(self) -> bool:
        """Executes one scan, or goes on with one that stands.

        Returns True if it stands at a breakpoint, or if one was reached in a scan that had to be played."""
        if self.plc.halted:
            self.execute()
            return self.plc.halted is not None
        self.state = self.rows.state
        if self._breakpoints and self._scene.changed_inside(self.plc.scans):
            stops, state = self._scene.stops_in(self.plc.scans, self.state)
            self.rows.clear()
            self.execute()
            self._arm()
            self.rows.restore(state)
            return stops
        self.execute()
        return self.plc.halted is not None

    @abstractmethod
    def execute(self) -> None:
        """Executes one scan or the rest of one."""

    @abstractmethod
    def many(self, scan: int) -> bool:
        """Executes scans in machine code at once, up to `scan` or to one that stops; False if that cannot be."""

    def stops_behind(self) -> bool:
        """True if something stops the run behind the scan that was executed last."""
        return self.check is not None and self.check.checked(self.plc)


class LiveRunner(Runner):
    """Executes scans that have not been executed yet, in a world."""

    def __init__(self, world: World, name: str, scene: Scene, breakpoints: Sequence[Breakpoint], state: State | None,
                 passes: Mapping[Breakpoint, int], check: ScanCheck | None) -> None:  # fmt: skip
        self._world, self._name = world, name
        super().__init__(world[name], scene, breakpoints, state, passes, check)

    def execute(self) -> None:
        self._world.scan(self._name)

    def many(self, scan: int) -> bool:
        left = min(self._world.quiet_until(self._name, scan) - self.plc.scans, MOST_AT_ONCE)
        return self.check is None and left > 1 and self.plc.scan_many(left)

    def undo(self) -> None:
        """Takes back the scan that stands."""
        if self.plc.halted:
            self._world.undo(self._name)

    def end(self) -> None:
        """Takes the breakpoints off the PLC."""
        self.rows.clear()


class PastRunner(Runner):
    """Executes scans of a recording again, from number `scan` on."""

    def __init__(self, recorded: RecordedPlc, scan: int, scene: Scene, breakpoints: Sequence[Breakpoint], state: State | None,
                 passes: Mapping[Breakpoint, int], check: ScanCheck | None = None) -> None:  # fmt: skip
        self._again = Replay(recorded, scan)
        self._again.advance(scan)
        super().__init__(self._again.plc, scene, breakpoints, state, passes, check)

    def execute(self) -> None:
        self._again.scan()

    def many(self, scan: int) -> bool:
        end = self._scene.unchanged_until(range(self.plc.scans, min(scan, self.plc.scans + MOST_AT_ONCE)))
        return self.check is None and self._again.many(end)


def last_in(runner: Runner, end: int, checks_last: bool) -> Generator[None, None, tuple[int, State, bool] | None]:
    """Executes the scans before number `end`.  A check stops behind the last of them only if `checks_last`.

    The result is the last one in which a breakpoint is reached, or behind which a check stops: its number, what breakpoints had
    seen before it, and True if it was a check."""
    found: tuple[int, State, bool] | None = None
    while runner.plc.scans < end and not runner.plc.trap:
        if runner.many(end):
            runner.rows.take_told()
            yield None
            continue
        scan = runner.plc.scans
        while runner.scan():
            found = scan, runner.state, False
            if runner.plc.scans > scan:
                break
        if (checks_last or scan + 1 < end) and runner.stops_behind():
            found = scan, runner.state, True
        runner.rows.take_told()
        yield None
    return found
