"""Breakpoints inside one scan that is played: at which statement each is reached, as the guarded engine reaches it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from fbvm.engine.observation import NO_SITE
from fbvm.engine.stops import State
from fbvm.machine.breakpoints import Breakpoint, BreakpointRows
from fbvm.machine.plc import Phase
from fbvm.record.trace.events import OUTSIDE, Event, Return, Statement, Write
from fbvm.step.position import Position, Reached, Said
from fbvm.step.scan_replay import END, Moment
from fbvm.step.stepping import Stepping

Ends = Callable[[int, Statement], bool]
"""True for the statement at which a move ends, by its number in the scan."""
FROM_OUTSIDE = "from outside"
BETWEEN = "by the I/O refresh or from outside, between two scans"


@dataclass
class Looked:
    """What was found in a scan: the first or last position at which breakpoints are reached, what log points said."""

    reached: Reached | None = None
    said: list[tuple[int, Said]] = field(default_factory=list)
    """With the number of the statement."""
    state: State | None = None
    """What breakpoints had seen at the end of the scan, if nothing stopped it before."""
    ended: bool = False
    """True if the move ended at its own statement."""
    passes: dict[Breakpoint, int] = field(default_factory=dict)
    """How often each was passed up to where the player stands."""


class ScanStops:
    """The breakpoints of the PLC of a session, in the scans that it plays."""

    def __init__(self, session: Stepping, name: str) -> None:
        self._session, self._name = session, name
        self._rows = BreakpointRows(session.player, session.facts.image)

    def put(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Sets these breakpoints and no others.  Raises as `BreakpointRows.put`."""
        self._rows.clear()
        for each in breakpoints:
            self._rows.put(each)

    def look(self, scan: int, *, after: int = -1, before: int = END, state: State | None = None, ends: Ends | None = None,
             last: bool = False, passes: Mapping[Breakpoint, int] | None = None) -> Looked:  # fmt: skip
        """Plays a scan and looks for the first position, or the `last` one, behind statement `after` and before `before`.

        `state` is what breakpoints had seen before; without, changes count from statement `after` on, and passes from `passes`.
        The session's player stands where a position was reached or the move ended, else at the end of the program."""
        looking = _Looking(self._rows, self._session, self._name, scan, after, before, state, ends, last, passes or {})
        self._session.play(scan, looking.stop, looking)
        looking.end()
        return looking.found


class _Looking:
    """Looks at one scan while it is played."""

    def __init__(self, rows: BreakpointRows, session: Stepping, name: str, scan: int, after: int, before: int,
                 state: State | None, ends: Ends | None, last: bool, passes: Mapping[Breakpoint, int]) -> None:  # fmt: skip
        self._rows, self._session, self._name, self._scan = rows, session, name, scan
        self._after, self._before, self._ends, self._last = after, before, ends, last
        self._passes = passes
        self.found = Looked()
        self._is_looking = state is not None
        self._stopped = False
        if state is not None:
            rows.restore(state)

    def stop(self, number: int, statement: Statement) -> bool:
        """Called before each statement."""
        if number == 0:
            self._rows.use(self._session.memory)
        if self._stopped or number >= self._before:
            self._stopped = True
            return True
        if number > self._after and not self._is_looking or number == self._after:
            self._rows.begin(self._passes)
            self._is_looking = True
        if number > self._after:
            self._look(number, statement.site, True, statement.frame.base)
            if not self._stopped and self._ends and self._ends(number, statement):
                self._stopped = self.found.ended = True
        return self._stopped

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Nothing is reached at the end of a phase."""

    def event(self, moment: Moment, event: Event) -> None:
        """Called for each event."""
        if not self._is_looking or self._stopped:
            return
        if isinstance(event, Write):
            self._look(self._session.player.count, event.site, False, event.frame.base)
        elif isinstance(event, Return) and event.frame.caller is OUTSIDE:
            self._look(self._session.player.count, NO_SITE, False, event.frame.base)

    def _look(self, number: int, site: int, is_statement: bool, base: int) -> None:
        rows = self._rows
        hit = rows.look(site, is_statement, base)
        for told in rows.take_told():
            said = Said(self._name, told.site, self._scan, self._session.player.now_ns, told.text)
            self.found.said.append((number, said))
        if not hit or number >= self._before:
            return
        from_outside = FROM_OUTSIDE if number else BETWEEN
        reasons = tuple(f"{reason} {from_outside}" if row.kind == "change" and is_statement else reason
                        for row, reason in zip(rows.reached, rows.reasons, strict=True))  # fmt: skip
        self.found.reached = Reached(self._name, Position(self._scan, number), site, tuple(rows.reached), reasons)
        self._stopped = not self._last

    def end(self) -> None:
        """Called when the scan has been played."""
        if not self._stopped:
            self._rows.use(self._session.memory)
            if not self._is_looking:  # it began at the end of the program
                self._rows.begin(self._passes)
            self.found.state = self._rows.state
        self.found.passes = self._rows.passes
