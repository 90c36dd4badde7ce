"""The PLC: a compiled program and its memory, the units on its backplane and their networks, one scan at a time.

`Plc.scan` is the scan cycle of W394.  A PLC is told the time and never waits; `fbvm.run` waits.  Scans on the fast paths of
`machine/fast` leave the same memory (docs/explanation/fast-paths.md)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW, SCANS
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine.choice.tiers import Engine, engine_for
from fbvm.engine.clock import Clock
from fbvm.engine.trap import Trap
from fbvm.machine.breakpoints import Breakpoints, Halt
from fbvm.machine.fast.paths import FastPath, FastPaths
from fbvm.machine.goal import Goal
from fbvm.machine.scan.clock_words import CLOCK_WORDS, ClockWords
from fbvm.machine.scan.inputs import InputRecorder
from fbvm.machine.scan.refresh import Attached, IORefresh
from fbvm.machine.scan.start import Kept, retained, start, write
from fbvm.machine.scan.tasks import TaskSchedule, too_short_intervals
from fbvm.machine.scan.values import NamedValues
from fbvm.machine.scan.watch_cycle import WatchCycle
from fbvm.machine.scan_times import Lateness, ScanTimes
from fbvm.machine.servicing.peripheral import PeripheralServicing
from fbvm.machine.state import RUN, Mode, Phase, State, Stopped
from fbvm.net.journal import Journal
from fbvm.units.contract import Unit
from fbvm.watch import places
from fbvm.wire.link import Network

__all__ = ["STEP_BUDGET", "Mode", "Phase", "Plc", "State", "Stopped"]
STEP_BUDGET = 2_000_000
"""Statements that one scan may execute before the watchdog ends it."""


class Plc(NamedValues):
    """One PLC with a compiled program, in RUN mode at time 0, before its first scan.

    `cycle_ns` is how far a scan advances virtual time; `budget` how many statements a scan may execute; `observed` runs the
    build that reports each statement; `engine` is "auto" (Python first, machine code when that pays), "python" (no machine
    code, neither for the program nor for units) or "native"; `journal` is told every input.

    A mistake of the program raises nothing: see `trap`.  Raises ValueError for a cycle that takes no time, an unknown engine,
    or "native" where llvmlite is missing.

    >>> from fbvm import compile_text
    >>> image = compile_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM").image
    >>> plc = Plc(image, cycle_ns=10_000_000)
    >>> plc.run(until="Main.n = 3")
    'until'
    >>> plc.scans, plc.elapsed_ns, plc.read("Main.n")
    (3, 30000000, 3)
    """

    _next_mode: Mode | None = None  # from the next scan on
    _recorder: InputRecorder | None = None  # both stand here, since more than 30 attributes of an object take it 1.5 KB

    def __init__(
        self,
        image: Image,
        cycle_ns: int = 10_000_000,
        *,
        budget: int = STEP_BUDGET,
        observed: bool = False,
        engine: str = "auto",
        journal: Journal | None = None,
    ) -> None:
        if cycle_ns <= 0:
            raise ValueError(f"a cycle takes time; {cycle_ns} ns is not possible")
        super().__init__(image, Memory(image.layout.size, image.layout.areas), journal)
        self.cycle_ns = cycle_ns
        self.budget = budget
        self.engine_choice = engine
        """What was asked for: "auto", "python" or "native"."""
        self.engine: Engine = engine_for(image, self.memory, engine, observed)
        self._system = self.memory.views["i64"]
        self._clock_words = ClockWords(self.memory)
        self.watch_cycle = WatchCycle(self.memory)
        self.units: list[Attached] = []
        self.watchers: list[Callable[[Plc], None]] = []
        """Called at the end of each scan, after its I/O refresh: recorders, watches."""
        self.phases: list[Callable[[Plc, Phase], None]] = []
        """Called within each scan when a phase is over: what looks inside."""
        self.now_ns = 0
        """Time of the last scan; `elapsed_ns` is where the next one begins in virtual time."""
        self.scans = 0
        self.warnings = tuple(too_short_intervals(image.tasks, cycle_ns))
        """What the program asks and this PLC does not do, for people: tasks that want to be quicker than the cycle."""
        self.scan_times = ScanTimes(cycle_ns)
        """How long scans took, where somebody with a clock measured it (`fbvm.run`)."""
        self.lateness = Lateness()
        """How late they began, where time is real."""
        self.trap: Trap | None = None
        self._mode, self._first = RUN, True
        self._due: list[int] = []
        self.breakpoints = Breakpoints(self)
        self._schedule = TaskSchedule(image.tasks, lambda path: self.read(path) is True)
        self._io = IORefresh(self.units, self.memory)
        self._fast_paths = FastPaths(self._io, self._schedule)
        self.servicing = PeripheralServicing(self, image)
        """FINS commands, and the PLC's clock."""
        write(self.memory, image.initial)
        if journal:
            journal.begin(image.fingerprint, cycle_ns, budget, self.memory)

    # --- one scan -----------------------------------------------------------------------------------------------------

    def scan(self, now_ns: int | None = None) -> Trap | None:
        """One cycle at time `now_ns`, or in virtual time one cycle after the last.  Returns the trap that stopped it.

        A scan that traps ends there: its outputs do not reach the units.  One that meets a breakpoint stands (`halted`);
        the next call ends it.  Raises Stopped if a trap was before, and ValueError if time runs backwards or real
        connections are to live in virtual time."""
        if self.trap:
            raise Stopped(self.trap)
        if not self.breakpoints.halted:
            now_ns = self._time(now_ns)
            if self._recorder:
                self._recorder.before(now_ns)
            if path := self.fast_path():
                return self.end_fast_scan(now_ns, path.once(now_ns, self.budget))
            self._begin(now_ns)
        elif self._recorder:
            self._recorder.changed()
        if self._mode is RUN:
            self.trap = self.watch_cycle.judged(self._execute())
            if self.halted:
                return None
            if self._forces:
                places.write_all(self.memory, self._forces)
            if self.phases:
                self._over(Phase.PROGRAM)
        self._end()
        return self.trap

    def end_fast_scan(self, now_ns: int, trap: Trap | None) -> Trap | None:
        """The part of a scan behind its fast path; `trap` is what has ended it, if anything."""
        self.now_ns, self.trap = now_ns, self.watch_cycle.judged(trap)
        self._serve_peripherals()
        self.scans += 1
        self._tell()
        return self.trap

    @property
    def input_recorder(self) -> InputRecorder | None:
        """Who is told the inputs, if anybody."""
        return self._recorder

    def record_inputs(self, recorder: InputRecorder | None) -> None:
        """Tells `recorder` every input from now on, None ends that.  Fast paths stay possible but for bursts."""
        self._recorder = self._io.recorder = recorder

    def fast_path(self) -> FastPath | None:
        """The fast path of the next scan; None if the scan has to be a plain one because somebody has a part in it."""
        machine = self.engine.machine
        if machine is None or self._first or self._forces or self.phases or self._journal or self._mode is not RUN:
            return None
        if self.breakpoints.armed or (self._recorder and self._recorder.wants_plain_scans):
            return None
        return self._fast_paths.path(machine)

    def _begin(self, now_ns: int) -> None:
        """The part of a plain scan before its program: time, forces, tasks that are due."""
        if self._journal:
            self._journal.before(self.scans, now_ns, self.budget, self.forces)
        self._oversee(now_ns)
        if self._mode is RUN:
            if self._forces:
                places.write_all(self.memory, self._forces)
            if self.phases:
                self._over(Phase.INPUTS)
            self._due = list(self._schedule.due(now_ns))  # nothing is left of a scan that a listener has interrupted

    def _end(self) -> None:
        """The part of a plain scan behind its program: the I/O refresh, and counting the scan."""
        if not self.trap:
            self._fast_paths.refresh(self.now_ns, self._journal)
            self._serve_peripherals()
            if self.phases:
                self._over(Phase.REFRESH)
        self.scans += 1
        self._system[SCANS // 8] = self.scans
        if self._journal:
            self._journal.after(self.watch_cycle.ended(self.trap, self.budget))
        self._tell()

    def _serve_peripherals(self) -> None:
        """Peripheral servicing, the last part of a scan; a change of mode that it brings is for the next scan."""
        if self.trap or not self.servicing.is_needed:
            return
        if self.servicing.serve(self.now_ns):
            self._io.changed_words = True
        if mode := self._next_mode:
            if self._recorder:
                self._recorder.changed()
            self._change_mode(mode)
            self._next_mode = None

    def _tell(self) -> None:
        """Called at the end of each scan: tells recorder and watchers."""
        if self._recorder:
            self._recorder.after(1, self.now_ns)
        for watcher in self.watchers:
            watcher(self)

    @property
    def halted(self) -> Halt | None:
        """Where the scan stands at a breakpoint; None if it does not."""
        return self.breakpoints.halted

    def _time(self, now_ns: int | None) -> int:
        """The time of the next scan: `now_ns`, or virtual time if that is None."""
        if now_ns is None:
            if not all(attached.network.virtual_time for attached in self.units):
                raise ValueError("real connections need real time: run this PLC with fbvm.run, or say scan(now_ns)")
            return self.elapsed_ns
        if now_ns < self.now_ns:
            raise ValueError(f"time runs forward only: {now_ns} ns is before {self.now_ns} ns")
        return now_ns

    def _oversee(self, now_ns: int) -> None:
        """Overseeing (W394): writes time, step budget, first-cycle flag, clock pulses and the cycle time of the cycle before."""
        cycle_time_ns = 0 if self._first else now_ns - self.now_ns
        self.now_ns = now_ns
        system = self._system
        system[NOW // 8], system[DUE // 8], system[BUDGET // 8] = now_ns, NEVER, self.budget
        self._clock_words.update(now_ns, cycle_time_ns, self._first and self._mode is RUN)

    def _over(self, phase: Phase) -> None:
        for told in self.phases:
            told(self, phase)

    def _execute(self) -> Trap | None:
        """Program execution: the tasks that are due, by priority.  One that stands at a breakpoint stays due."""
        due, breakpoints, fresh = self._due, self.breakpoints, self._schedule.fresh
        some_are_new = bool(fresh)
        while due:
            if some_are_new:
                self._clock_words.begin_task(due[0] in fresh)
            trap = breakpoints.run(due[0], self.engine) if breakpoints.armed else self.engine.run(due[0])
            if breakpoints.halted:
                return None
            fresh.discard(due.pop(0))
            if trap:
                return trap
        self._first = False
        return None

    @property
    def elapsed_ns(self) -> int:
        """Time from power-on to the end of the last cycle."""
        return self.now_ns + self.cycle_ns if self.scans else self.now_ns

    @property
    def due_ns(self) -> int:
        """The earliest time at which another scan can change anything, if no network has events before.

        0 if a unit changed words that the program has not seen; else when a timer of the program ends, an interval of a task
        has passed, or a unit changes something by itself."""
        return min(self._io.wake_ns(self._system[DUE // 8]), self._schedule.next_ns(self.now_ns), self.servicing.wake_ns)

    def run(
        self,
        *,
        scans: int | None = None,
        for_ns: int | None = None,
        until: str | Callable[[Plc], bool] | None = None,
        max_ns: int | None = None,
    ) -> str:
        """Scans in virtual time until the first of these: so many more `scans`, so much more time, a condition.

        `until` is a function of the PLC or an expression such as `Main.done AND D200 > 5`, looked at after each scan;
        `max_ns` bounds the time.  Returns what ended it: "scans", "time", "until", "max", "trap", or "break" for a scan
        that stands at a breakpoint; the next run goes on there."""
        goal = Goal(self, scans=scans, for_ns=for_ns, until=until, max_ns=max_ns)
        recorder = None if goal.calls_out or self.watchers else self._recorder
        if recorder:
            recorder.run_begins()
        try:
            while not (reason := goal.reached()):
                if (left := goal.cycles_left) < 2 or not self.scan_many(left):
                    self.scan()
        finally:
            if recorder:
                recorder.run_ends()
        return reason

    def scan_many(self, most: int) -> bool:
        """Up to `most` scans in virtual time without coming back from machine code, while no unit has anything to do.

        Returns False if there was none: if somebody has to be told between scans, use `scan`."""
        if self.watchers or self.servicing.is_needed:
            return False
        if self.breakpoints.armed:
            done, self.trap = self._many_stoppable(most)
        elif all(attached.network.virtual_time for attached in self.units) and (path := self.fast_path()):
            done, self.trap = path.many(most, self.now_ns, self.cycle_ns, self.budget, STEP_BUDGET)
        else:
            return False
        first_ns = self.now_ns + self.cycle_ns
        self.scans += done
        self.now_ns += done * self.cycle_ns
        if self._recorder:
            self._recorder.after(done, first_ns, self.cycle_ns)
        return done > 0

    def scan_at_once(self, most: int, now_ns: int, clock: Clock) -> list[int]:
        """Up to `most` scans back to back while units change words for the program (a burst).

        `clock` is read before each scan; `now_ns` is what it told last.  Returns the times of the scans.  Returns [] without a
        scan if somebody has a part in them or has to be told between them: use `scan`."""
        times: list[int] = []
        if self.watchers or self._recorder or self.trap or self.servicing.is_needed or not (path := self.fast_path()):
            return times
        try:
            self.trap = self.watch_cycle.judged(path.burst(times, most, now_ns, clock, self.budget))
        finally:  # Ctrl-C may come between two of them
            if times:
                self.scans += len(times)
                self.now_ns = times[-1]
        return times

    def _many_stoppable(self, most: int) -> tuple[int, Trap | None]:
        """Up to `most` scans inside machine code, before one that would stop; how many, and the trap of the last."""
        tasks = self._schedule.by_time()
        outside = self.units or self.phases or self._forces or self._journal
        if outside or not tasks or self._first or self._mode is not RUN or self.halted:
            return 0, None
        self._system[BUDGET // 8] = self.budget
        if self._recorder:
            self._recorder.before(self.now_ns + self.cycle_ns)
        return self.breakpoints.stoppable(self.engine).run_many(tasks, most, self.cycle_ns, CLOCK_WORDS, spend=STEP_BUDGET)

    # --- units --------------------------------------------------------------------------------------------------------

    def attach(self, unit: Unit, network: Network) -> None:
        """Puts a unit on the backplane and connects it to a network.  Raises ValueError if its address is taken."""
        if any(other.unit.name == unit.name for other in self.units):
            raise ValueError(f"{unit.name} is on the backplane already")
        attached = Attached(unit, network.attach(unit.address), network)
        if attached.own:
            attached.own.run_on(self.engine_choice)
        with self._acting("unit", self._journal.unit(unit) if self._journal else None):
            self.units.append(attached)
            attached.link.submit(unit.reset(self.memory), self.now_ns)

    # --- start, stop and travel ---------------------------------------------------------------------------------------

    @property
    def mode(self) -> Mode:
        """PROGRAM or RUN.  Setting RUN clears what is not retained, but CIO, W and timers stay if A500.12 is ON."""
        return self._mode

    @mode.setter
    def mode(self, mode: Mode) -> None:
        with self._acting("mode", mode.value):
            self._change_mode(mode)

    def _change_mode(self, mode: Mode) -> None:
        if mode is RUN and self._mode is not RUN:
            held = ("CIO", "W", "TF", "T") if self._clock_words.io_memory_held else ()
            self._restart(retained(self.memory, self.image, held))
        self._mode = mode

    @property
    def is_running(self) -> bool:
        return self._mode is RUN

    def servicing_changes_mode(self, running: bool) -> None:
        self._next_mode = RUN if running else Mode.PROGRAM

    def warm_start(self) -> None:
        """Power off and on: retained variables and areas keep their values, everything else begins anew."""
        with self._acting("start", "warm"):
            self._power_on(retained(self.memory, self.image))

    def cold_start(self) -> None:
        """Power off and on with an empty memory: everything, also what is retained, begins with its initial value."""
        with self._acting("start", "cold"):
            self._power_on([])

    def _acting(self, what: str, value: object) -> AbstractContextManager[None]:
        """Lets journal and recorder know of something that is done between scans."""
        if self._recorder:
            self._recorder.changed()
        return self._journal.acting(what, value) if self._journal else nullcontext()

    def _power_on(self, kept: Kept) -> None:
        self._restart(kept)
        self._mode = RUN
        for attached in self.units:
            attached.link.submit(attached.unit.reset(self.memory), self.now_ns)

    def _restart(self, kept: Kept) -> None:
        start(self.memory, self.image, [*kept, self.servicing.registers.kept()])
        self.watch_cycle.clear()
        self._schedule.reset()
        self._leave()
        self._first = True
        self._fast_paths.forget()
        self.trap = None

    def snapshot(self) -> State:
        """The state of the PLC itself at this moment; pages that did not change are shared, not copied.

        With units attached it can be taken, its memory compared, and `fork` goes on from the same state without units;
        only `restore` cannot.  Raises ValueError while a scan stands at a breakpoint."""
        if self.halted:
            raise ValueError("this scan stands at a breakpoint: end it by another scan() first")
        return State(
            self.memory.snapshot(), self.now_ns, self.scans, self._schedule.state(), dict(self._forces),
            self._mode, self._first, self.trap,
        )  # fmt: skip

    def restore(self, state: State) -> None:
        """Back to a snapshot.  Raises ValueError with units attached, whose connections do not travel in time, and with
        a journal, which goes forward only."""
        if self.units:
            raise ValueError("a PLC with units attached cannot go back: their connections do not travel in time")
        if self._journal:
            raise ValueError("a PLC that writes a journal cannot go back: fork it")
        self.resume(state)

    def resume(self, state: State, units: Sequence[Attached] = ()) -> None:
        """Goes on from a state with these units, which are in the state that belongs to it, and with their links."""
        if self._recorder:
            self._recorder.changed()
        self.units[:] = units
        self.memory.restore(state.memory)
        self.now_ns, self.scans, self.trap = state.now_ns, state.scans, state.trap
        self._mode, self._first, self._forces = state.mode, state.first, dict(state.forces)
        self._schedule.restore(state.schedule)
        self._fast_paths.forget()
        self._leave()

    def _leave(self) -> None:
        """Gives up a scan that stands at a breakpoint."""
        self.breakpoints.leave()
        self._due.clear()

    def fork(self) -> Plc:
        """A second PLC in the same state, without units, watchers and connections."""
        twin = Plc(self.image, self.cycle_ns, budget=self.budget, engine=self.engine_choice)
        twin.restore(self.snapshot())
        return twin
