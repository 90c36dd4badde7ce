"""The PLCs of a stepping session: they run side by side in one virtual time, and every scan of each is recorded.

What was done to a PLC from outside is kept with its position, and done again when that position is executed again."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from fbvm.machine.plc import Plc, State
from fbvm.record.recording.recording import PlcRecording, Recording
from fbvm.record.trace.observing import observing
from fbvm.run.real_pace import RealPace
from fbvm.run.running import TimedWrite
from fbvm.step.position import Position
from fbvm.step.scan_replay import Action, ActionInjector

NEAR = 32
"""The states before so many scans on either side of the one that is looked at are kept."""


class ReadOnlyPast(ValueError):
    """The past cannot be changed here, because the connections of a unit do not travel in time; the message says so."""


@dataclass
class Debugged:
    """A PLC under its name, what is written into it at times of its own, and its recording if it is recorded already."""

    name: str
    plc: Plc
    writes: Sequence[TimedWrite] = ()
    recorded: PlcRecording | None = None


@dataclass
class _Live:
    """A PLC at the end of what was executed, and its past."""

    plc: Plc
    recorded: PlcRecording
    writes: Sequence[TimedWrite]
    """What is written at times of its own, in order of time."""
    is_recorded_elsewhere: bool
    """True for a recording that was there before and goes on afterwards."""
    actions: dict[Position, list[Action]] = field(default_factory=dict)
    timed: dict[int, list[Action]] = field(default_factory=dict)
    """Of `writes` those that were done, by the scan before which they were."""
    changed: dict[int, State] = field(default_factory=dict)
    """Of scans with changes from outside before them the state before those."""
    near: dict[int, State] = field(default_factory=dict)
    """States before scans near the one that was looked at last."""

    @property
    def waiting(self) -> Sequence[TimedWrite]:
        """What is still to be written."""
        return self.writes[sum(map(len, self.timed.values())) :] if self.writes else ()


class World:
    """Executes scans of PLCs in the order of their times, PLCs of one time in the order in which `make` returns them.

    `make` returns new PLCs at power-on, in virtual time; what it returns is equal each time.  With `is_fixed` it is called once
    only, and the past cannot be changed; `pace` is then that of the PLCs, if one has real connections."""

    def __init__(self, make: Callable[[], Iterable[Debugged]], is_fixed: bool = False, pace: RealPace | None = None) -> None:
        self._make, self.is_fixed, self._pace = make, is_fixed, pace
        self._live: dict[str, _Live] = {}
        self._build({})

    def _build(self, actions: Mapping[str, dict[Position, list[Action]]]) -> None:
        recording = Recording()
        self._live = {one.name: _Live(one.plc, one.recorded or recording.add(one.name, one.plc),
                                      sorted(one.writes, key=lambda row: row.at_ns), one.recorded is not None,
                                      actions.get(one.name, {})) for one in self._make()}  # fmt: skip
        self._rows = list(self._live.values())

    @property
    def names(self) -> list[str]:
        """The names of the PLCs, in the order of their scans at one time."""
        return list(self._live)

    def __getitem__(self, name: str) -> Plc:
        """The PLC of that name as it is now, which may be some scans ahead of what is looked at."""
        return self._live[name].plc

    def recorded(self, name: str) -> PlcRecording:
        """The recording of a PLC."""
        return self._live[name].recorded

    # --- forwards

    def advance(self, name: str, scan: int) -> None:
        """Executes scans of all PLCs, up to the one before number `scan` of one of them, or to a trap of it."""
        wanted = self._live[name]
        while wanted.plc.scans < scan and not wanted.plc.trap:
            if len(self._rows) > 1 or not self._many(wanted, scan):
                self.scan(self.next_name)

    @property
    def next_name(self) -> str:
        """The PLC whose scan comes next."""
        return min((name for name in self._live if not self[name].trap), key=lambda name: self[name].elapsed_ns,
                   default=self.names[0])  # fmt: skip

    def quiet_until(self, name: str, scan: int) -> int:
        """The first scan from now on, up to `scan`, before or in which something is done from outside."""
        live = self._live[name]
        if self._pace:
            return live.plc.scans
        first = min([scan, *(position.scan for position in live.actions if position.scan >= live.plc.scans)])
        if live.plc.scans in live.timed:
            return live.plc.scans
        if waiting := live.waiting:
            until = -((live.plc.elapsed_ns - waiting[0].at_ns) // live.plc.cycle_ns)
            first = min(first, live.plc.scans + max(0, until))
        return first

    def unchanged_until(self, name: str, scans: range) -> int:
        """The first of some scans inside which something was done from outside, or their end."""
        return min((at.scan for at in self._live[name].actions if at.step and at.scan in scans), default=scans.stop)

    def has_actions(self, name: str, scan: int) -> bool:
        """True if something was done to a PLC before a scan or in it."""
        return bool(self.actions_in(name, scan))

    def _many(self, live: _Live, scan: int) -> bool:
        """Executes the scans of the only PLC before which nothing is done; False if there are none."""
        plc = live.plc
        if (first := self.quiet_until(self.names[0], scan)) <= plc.scans:
            return False
        plc.run(scans=first - plc.scans)
        return True

    def scan(self, name: str) -> None:
        """Executes one scan of a PLC with what is done to it; one that meets a breakpoint stands (see `undo`)."""
        live = self._live[name]
        plc = live.plc
        if plc.trap:
            return
        for row in live.waiting:
            if row.at_ns > plc.elapsed_ns:
                break
            live.timed.setdefault(plc.scans, []).append(partial(_write, row))
        actions = self.actions_in(name, plc.scans)
        now_ns = self._pace.wait(plc.elapsed_ns) if self._pace and not plc.halted else None
        if not actions:
            plc.scan(now_ns)
            return
        live.changed.setdefault(plc.scans, plc.snapshot())
        for action in actions.get(0, ()):
            action(plc)
        if any(actions):
            with observing(plc, ActionInjector(actions), stands_still=True):
                plc.scan(now_ns)
            live.recorded.changed()
        else:
            plc.scan(now_ns)

    def undo(self, name: str) -> None:
        """Takes back the scan of a PLC that stands at a breakpoint: the PLC is before it again."""
        live = self._live[name]
        plc = live.plc
        state = live.changed.get(plc.scans) or next(live.recorded.states(range(plc.scans, plc.scans + 1)))
        plc.resume(state, list(plc.units))

    # --- the past

    def state(self, name: str, scan: int) -> State:
        """The state before a scan, without the changes from outside that were made there."""
        self.advance(name, scan)
        live = self._live[name]
        held = live.recorded.scans
        if scan < held.start and not self.is_fixed and scan not in live.changed:
            self._again(name, scan)
            return self.state(name, scan)
        if scan in live.changed:
            return live.changed[scan]
        if scan >= live.plc.scans:
            return live.plc.snapshot()
        if scan not in live.near:
            near = range(max(held.start, scan - NEAR), min(live.plc.scans, scan + NEAR))
            live.near = {state.scans: state for state in live.recorded.states(near)}
        return live.near[scan]

    def first(self, name: str) -> int:
        """The oldest scan that can be looked at."""
        if not self.is_fixed:
            return 0
        held = self._live[name].recorded.scans
        return held.start if held else self[name].scans

    def begin(self) -> None:
        """Called when scans are executed again after a stop: real time goes on where it stood."""
        if self._pace:
            self._pace.begin()

    def leave(self) -> None:
        """Ends the session: what was done and is not executed yet takes effect, and nothing is recorded any more."""
        for name, live in self._live.items():
            if self.has_actions(name, live.plc.scans):
                self.begin()
                self.scan(name)
            if not live.is_recorded_elsewhere:
                live.recorded.close()

    def time_of(self, name: str, scan: int) -> int:
        """The time at which a scan began, or will begin."""
        live = self._live[name]
        return live.recorded.now_ns(scan) if scan in live.recorded.scans else live.plc.elapsed_ns

    def scan_at(self, name: str, now_ns: int) -> int:
        """The number of the first scan of a PLC that begins at a time or later, as far as they have been executed."""
        live = self._live[name]
        scans = live.recorded.scans
        return scans.start + bisect_right(range(len(scans)), now_ns - 1, key=lambda at: live.recorded.now_ns(scans[at]))

    def beside(self, name: str, other: str, now_ns: int) -> int:
        """The next scan of PLC `other` while `name` is in the scan that began at `now_ns`."""
        goes_first = self.names.index(other) < self.names.index(name)
        return self.scan_at(other, now_ns + goes_first)

    def actions_in(self, name: str, scan: int) -> Mapping[int, list[Action]]:
        """What is done to a PLC in a scan: by the number of the statement before which it is done."""
        live = self._live[name]
        found = {0: list(live.timed[scan])} if scan in live.timed else {}
        for position, rows in live.actions.items():
            if position.scan == scan:
                found.setdefault(position.step, []).extend(rows)
        return found

    # --- changes from outside

    def act(self, name: str, here: Position, action: Action) -> None:
        """Keeps something that is done to a PLC at a position, and forgets all that came later, on all PLCs.

        Raises ReadOnlyPast where the past cannot be changed."""
        live = self._live[name]
        if live.plc.scans > here.scan:
            if self.is_fixed:
                raise ReadOnlyPast("real connections do not travel in time: the past can only be looked at here")
            now_ns = self.time_of(name, here.scan)
            for other, row in self._live.items():
                last = here if other == name else Position(self.scan_at(other, now_ns), 0)
                row.actions = {at: done for at, done in row.actions.items() if at <= last}
                row.changed = {scan: state for scan, state in row.changed.items() if scan <= last.scan}
            live.actions.setdefault(here, []).append(action)
            self._again(name, here.scan)
        else:
            live.actions = {at: done for at, done in live.actions.items() if at <= here}
            live.actions.setdefault(here, []).append(action)

    def _again(self, name: str, scan: int) -> None:
        """Puts the PLCs before a scan of one of them: by its state if it is alone and has no units, else as new PLCs."""
        live = self._live[name]
        if len(self._live) == 1 and not live.plc.units and not live.plc.watchers and scan >= live.recorded.scans.start:
            live.plc.restore(self.state(name, scan))
            live.near.clear()
            live.timed = {at: done for at, done in live.timed.items() if at < scan}
            return
        self._build({one: row.actions for one, row in self._live.items()})
        self.advance(name, scan)


def _write(row: TimedWrite, plc: Plc) -> None:
    plc.write(row.where, row.value)
