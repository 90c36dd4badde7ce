"""A debugger of PLCs: breakpoints that stop every way of moving, at the speed of the engine, forwards and backwards.

The moves are generators: each `next` does a slice of the work, behind which it may be given up by `pause`.  They end with the
breakpoints that were reached, None for none."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from fbvm.engine.observation import NO_SITE
from fbvm.engine.stops import State
from fbvm.machine.breakpoints import Breakpoint
from fbvm.record.recording.last_change import stretches
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.trace.events import Statement
from fbvm.step.past_session import PastSession
from fbvm.step.position import Position, Reached, Said
from fbvm.step.scan_replay import END, depth
from fbvm.step.scan_stops import Ends, Looked, ScanStops
from fbvm.step.search import LiveRunner, PastRunner, Runner, ScanCheck, last_in
from fbvm.step.session import Session
from fbvm.step.world import World

Move: TypeAlias = "Generator[None, None, Reached | None]"
UNCOUNTED = f"> {10 ** 15}"
"""A hit count that no pass reaches: passes are counted, and nothing stops."""
BEFORE = -1
"""In place of the number of a statement: before the first one of a scan."""


class Debugged:
    """A PLC under the debugger: its session, its breakpoints, and how often they have been passed."""

    def __init__(self, name: str, session: Session | PastSession) -> None:
        self.name, self.session = name, session
        self.stops = ScanStops(session, name)
        self.breakpoints: tuple[Breakpoint, ...] = ()
        self._counted: dict[Breakpoint, tuple[Position, Position, int]] = {}
        """By breakpoint with a hit count: where it was set, and how often it had been passed up to a position."""

    @property
    def recorded(self) -> RecordedPlc:
        """The recording of its scans."""
        return self.session.recorded

    @property
    def world(self) -> World | None:
        """The world in which its scans are executed; None for a recording."""
        return self.session.world if isinstance(self.session, Session) else None

    @property
    def end(self) -> int:
        """The number of the first scan that has not been executed."""
        return self.world[self.name].scans if self.world else self.recorded.scans.stop

    def put(self, breakpoints: Sequence[Breakpoint]) -> None:
        """Replaces all breakpoints.  Passes of new ones are counted from here on."""
        self.breakpoints = tuple(dict.fromkeys(breakpoints))
        self.stops.put(self.breakpoints)
        here = self.session.here
        self._counted = {row: self._counted.get(row, (here, here, 0)) for row in self.breakpoints if row.hits}

    # --- Scene

    def changed_inside(self, scan: int) -> bool:
        """True for a scan in which something was done from outside."""
        return self.world is not None and any(self.world.actions_in(self.name, scan))

    def unchanged_until(self, scans: range) -> int:
        """The first of some scans in which something was done from outside, or their end."""
        return self.world.unchanged_until(self.name, scans) if self.world else scans.stop

    def stops_in(self, scan: int, state: State) -> tuple[bool, State]:
        """Plays a scan.  Returns True if a breakpoint is reached in it, and what breakpoints have seen at its end."""
        looked = self.stops.look(scan, state=state, last=True)
        assert looked.state is not None
        return looked.reached is not None, looked.state

    def seen_before(self, scan: int) -> State | None:
        """What breakpoints have seen at the end of the program of the scan before; None before the first one."""
        if scan <= self.session.first():
            return None
        return self.stops.look(scan - 1, passes=self.passes(Position(scan - 1, BEFORE))).state

    # --- hit counts

    def passes(self, at: Position) -> dict[Breakpoint, int]:
        """How often each breakpoint with a hit count has been passed since it was set, up to a position and at it."""
        found = {}
        for row, (since, known, count) in self._counted.items():
            if at < since:
                since, known, count = at, at, 0
            elif at < known:
                known, count = since, 0
            count += self._passes_between(row, known, at)
            self._counted[row] = since, at, count
            found[row] = count
        return found

    def _passes_between(self, row: Breakpoint, known: Position, at: Position) -> int:
        """How often a breakpoint is passed behind one position and up to another one."""
        if known >= at:
            return 0
        silent = replace(row, hits=UNCOUNTED, message="")
        stops = ScanStops(self.session, self.name)
        stops.put([silent])

        def ends(number: int, statement: Statement) -> bool:
            return number >= at.step

        before = 0 if at.step == BEFORE else END
        if known.scan == at.scan:
            return stops.look(at.scan, after=known.step, before=before, ends=ends).passes[silent]
        first = stops.look(known.scan, after=known.step)
        runner = PastRunner(self.recorded, known.scan + 1, self, [silent], first.state, {})
        while runner.plc.scans < at.scan:
            runner.scan()
        return stops.look(at.scan, state=runner.rows.state, before=before, ends=ends).passes[silent]


class Debugger:
    """Moves through the scans of PLCs, all of one world or each of a recording, and stops at their breakpoints.

    `say` is called with what log points say, once for each scan that is executed for the first time."""

    def __init__(self, sessions: Mapping[str, Session | PastSession], say: Callable[[Said], None] = lambda said: None) -> None:
        self.plcs = {name: Debugged(name, session) for name, session in sessions.items()}
        self.focus = next(iter(self.plcs))
        """The PLC that is stepped through."""
        self.checks: dict[str, ScanCheck] = {}
        """By PLC what stops a run between two scans."""
        self._say = say
        self._said_up_to: dict[str, Position] = {name: Position() for name in self.plcs}
        self._runners: dict[str, Runner] = {}
        self._next: dict[str, int] = {}
        """While a move runs: the next scan of each PLC."""

    @property
    def here(self) -> Debugged:
        """The PLC that is stepped through."""
        return self.plcs[self.focus]

    @property
    def session(self) -> Session | PastSession:
        """Its session."""
        return self.here.session

    def choose(self, name: str) -> None:
        """Steps through another PLC from now on, from the position at which it is at this time."""
        if name != self.focus:
            self.focus = name
            self.follow_focus()

    # --- inside a scan

    def step(self, ends: Ends) -> Move:
        """Goes to the next statement of this scan for which `ends` returns True, or to the end of its program; from there to the
        beginning of the next scan."""
        session, here = self.session, self.session.here
        if session.statement is None:
            return (yield from self.scan(1))
        looked = self.here.stops.look(here.scan, after=here.step, ends=ends, passes=self.here.passes(here))
        self._tell(looked)
        session.here = Position(here.scan, session.player.count)
        return looked.reached or self._trapped()

    def into(self) -> Move:
        """Goes to the next statement, into blocks."""
        return self.step(lambda number, statement: True)

    def over(self, levels: int = 0) -> Move:
        """Goes to the next statement of this body, or of the one `levels` above it."""
        statement = self.session.statement
        most = depth(statement.frame) - levels if statement else 0
        return self.step(lambda number, next_one: depth(next_one.frame) <= most)

    def back_over(self) -> None:
        """Goes one statement back, over calls; from the beginning of a scan to the end of the program in the scan before."""
        session, here = self.session, self.session.here
        most, found = depth(session.statement.frame) if session.statement else 1, -1

        def stop(number: int, statement: Statement) -> bool:
            nonlocal found
            if number < here.step and depth(statement.frame) <= most:
                found = number
            return number >= here.step

        session.play(here.scan, stop)
        if found >= 0:
            session.go_to(Position(here.scan, found))
        else:
            session.back()
        self.follow_focus()

    # --- forwards

    def scan(self, count: int) -> Move:
        """Goes to the beginning of the scan `count` scans later."""
        return self.resume(self.session.here.scan + count)

    def resume(self, until: int = END) -> Move:
        """Goes on to a breakpoint, at the latest to the beginning of scan `until`, or to the end of a recording."""
        looked = self.here.stops.look(self.session.here.scan, after=self.session.here.step,
                                      passes=self.here.passes(self.session.here))  # fmt: skip
        self._tell(looked)
        if looked.reached:
            self.session.here = Position(self.session.here.scan, self.session.player.count)
            return looked.reached
        self.session.here = Position(self.session.here.scan, self.session.player.count)
        if trapped := self._trapped():
            return trapped
        try:
            reached = yield from self._run(until, looked)
        finally:
            self._end_run()
        return reached

    def _run(self, until: int, looked: Looked) -> Move:
        """Executes scans of all PLCs in the order of their times, from the next one of the focus on."""
        self._begin_run(looked)
        while (name := self._earliest()) and self._next[self.focus] < until:
            runner = self._runner(name)
            if runner is None:
                return self._stand(Position(self.plcs[name].end - 1, END))
            if len(self.plcs) == 1 and runner.many(until):
                self._next[name] = runner.plc.scans
                self._tell_runner(name, runner)
                yield None
                continue
            scan = runner.plc.scans
            if runner.scan():
                return self._stopped(name, runner, scan)
            self._next[name] = runner.plc.scans
            self._tell_runner(name, runner)
            if runner.plc.trap:
                self.focus = name
                return self._stand(Position(scan, END))
            if runner.stops_behind() and runner.check:
                self.focus = name
                self._stand(Position(scan + 1))
                return Reached(name, Position(scan + 1), NO_SITE, (), (runner.check.found,), runner.check.kind)
            yield None
        return self._stand(Position(self._next[self.focus]))

    def _begin_run(self, looked: Looked) -> None:
        """Says for each PLC which scan comes next, and makes its runner."""
        here = self.session.here
        if self.here.world:
            self.here.world.begin()
            self.here.world.advance(self.focus, here.scan + 1)
        self._runners, self._next = {}, {}
        for name, plc in self.plcs.items():
            self._next[name] = here.scan + 1 if name == self.focus else plc.session.here.scan
        self._states = {self.focus: looked.state}
        self._passes = {self.focus: looked.passes}

    def _runner(self, name: str) -> Runner | None:
        """The runner of the next scan of a PLC: of one that is recorded, or of one that is not executed yet; None at the end of a
        recording."""
        plc, scan = self.plcs[name], self._next[name]
        runner = self._runners.get(name)
        is_past = scan < plc.end
        if runner is not None and is_past == isinstance(runner, PastRunner):
            return runner
        state = runner.rows.state if runner else self._states.get(name)
        passes = self._passes.get(name) or plc.passes(Position(scan, BEFORE))
        check = self.checks.get(name)
        if is_past:
            made: Runner = PastRunner(plc.recorded, scan, plc, plc.breakpoints, state, passes, check)
        elif plc.world is None:
            return None
        else:
            made = LiveRunner(plc.world, name, plc, plc.breakpoints, state, passes, check)
        self._runners[name] = made
        return made

    def _earliest(self) -> str:
        """The PLC whose scan comes next; "" if none has one."""
        waiting = [name for name, plc in self.plcs.items()
                   if not (plc.world and plc.world[name].trap and self._next[name] >= plc.end)]
        return min(waiting, key=lambda name: self._time_of(name), default="")

    def _time_of(self, name: str) -> int:
        plc, scan = self.plcs[name], self._next[name]
        if plc.world:
            return plc.world.time_of(name, scan)
        return plc.recorded.now_ns(min(scan, plc.recorded.scans.stop - 1)) if plc.recorded.scans else 0

    def _stopped(self, name: str, runner: Runner, scan: int) -> Reached | None:
        """Stands where a breakpoint was reached in a scan."""
        plc = self.plcs[name]
        if isinstance(runner, LiveRunner):
            runner.undo()
            runner.end()
        looked = plc.stops.look(scan, state=runner.state)
        self._tell(looked, name)
        self.focus = name
        self._stand(looked.reached.position if looked.reached else Position(scan))
        return looked.reached

    def _stand(self, position: Position) -> Reached | None:
        """Goes to a position of the focus, and with the other PLCs to where they are at that time."""
        self.session.go_to(position)
        self.follow_focus()
        return self._trapped()

    def follow_focus(self) -> None:
        """Lets the other PLCs stand where they are at the time of the focus."""
        world = self.here.world
        if world is None or len(self.plcs) == 1:
            return
        now_ns = self.session.now_ns
        for name, plc in self.plcs.items():
            if name != self.focus:
                plc.session.goto(world.beside(self.focus, name, now_ns))

    def _trapped(self) -> Reached | None:
        """The trap at which the focus stands, as a stop."""
        trap = self.session.trap
        if trap is None:
            return None
        return Reached(self.focus, self.session.here, NO_SITE, (), (str(trap),), "trap")

    def _end_run(self) -> None:
        for runner in self._runners.values():
            if isinstance(runner, LiveRunner):
                runner.end()
        self._runners = {}

    def pause(self) -> None:
        """Stands at the beginning of the scan that comes next, after a move that was given up."""
        if self._next:
            self._stand(Position(min(self._next[self.focus], self.here.end)))
            self._next = {}

    # --- backwards

    def reverse(self, breakpoints: Mapping[str, Sequence[Breakpoint]] | None = None) -> Move:
        """Goes back to the last position at which a breakpoint is reached, else to the oldest scan.

        `breakpoints`, by PLC, take the place of those that are set."""
        kept = {name: plc.breakpoints for name, plc in self.plcs.items()}
        found: list[tuple[int, int, Reached]] = []
        try:
            if breakpoints is not None:
                for name, plc in self.plcs.items():
                    plc.stops.put(breakpoints.get(name, ()))
            for index, (name, plc) in enumerate(self.plcs.items()):
                rows = kept[name] if breakpoints is None else tuple(breakpoints.get(name, ()))
                reached = yield from self._last(plc, rows)
                if reached:
                    found.append((self._began_ns(plc, reached.position.scan), index, reached))
        finally:
            for name, plc in self.plcs.items():
                plc.stops.put(kept[name])
        if not found:
            self._stand(Position(max(self.session.first(), self.here.recorded.scans.start)))
            return None
        reached = max(found, key=lambda row: row[:2])[2]
        self.focus = reached.plc
        self._stand(reached.position)
        return reached

    def _began_ns(self, plc: Debugged, scan: int) -> int:
        return plc.world.time_of(plc.name, scan) if plc.world else plc.recorded.now_ns(scan)

    def _last(self, plc: Debugged, rows: Sequence[Breakpoint]) -> Generator[None, None, Reached | None]:
        """The last position of a PLC before here at which one of its breakpoints is reached."""
        here, check = plc.session.here, self.checks.get(plc.name)
        if not rows and check is None:
            return None
        held = plc.recorded.scans
        if here.step:
            state = plc.seen_before(here.scan)
            looked = plc.stops.look(here.scan, before=here.step, state=state, last=True,
                                    passes=plc.passes(Position(here.scan, BEFORE)))  # fmt: skip
            if looked.reached:
                return looked.reached
        for stretch in stretches(held.start, min(here.scan, held.stop)):
            passes = plc.passes(Position(stretch.start, BEFORE))
            runner = PastRunner(plc.recorded, stretch.start, plc, rows, plc.seen_before(stretch.start), passes, check)
            found = yield from last_in(runner, stretch.stop, Position(stretch.stop) < here)
            if found and found[2] and check:
                return Reached(plc.name, Position(found[0] + 1), NO_SITE, (), (check.found,), check.kind)
            if found:
                return plc.stops.look(found[0], state=found[1], last=True).reached
        return None

    # --- log points

    def _tell(self, looked: Looked, name: str = "") -> None:
        """Passes on what log points said in a scan that was played, if it was not said before."""
        name = name or self.focus
        for number, said in looked.said:
            at = Position(said.scan, number)
            if at >= self._said_up_to[name]:
                self._said_up_to[name] = Position(said.scan, number + 1)
                self._say(said)

    def _tell_runner(self, name: str, runner: Runner) -> None:
        """Passes on what log points said in scans that were executed."""
        for told in runner.rows.take_told():
            if Position(told.scan) >= self._said_up_to[name]:
                self._say(Said(name, told.site, told.scan, told.now_ns, told.text))
        self._said_up_to[name] = max(self._said_up_to[name], Position(runner.plc.scans))

    def forget(self) -> None:
        """Called after a change from outside: what log points said later is said again."""
        for name, plc in self.plcs.items():
            self._said_up_to[name] = min(self._said_up_to[name], plc.session.here)
