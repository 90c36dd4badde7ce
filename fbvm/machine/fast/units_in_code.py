"""Units whose own processors run as machine code, inside the scans of their PLC.

What is left for Python is what their networks have to know, and what these tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from fbvm.base.areas import NEVER
from fbvm.base.memory import STRUCTS
from fbvm.engine.clock import Clock
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.native.scans.code import ASKED, ASKED_BEFORE, OVER, SCANNED
from fbvm.engine.native.scans.scans import NativeScans, ScheduledTask
from fbvm.engine.native.scans.units import CHANGED_WORDS, FieldAt, MovesAt, MoveShape, UnitExchange, UnitInCode
from fbvm.engine.trap import Trap
from fbvm.machine.scan.clock_words import CLOCK_WORDS
from fbvm.machine.scan.refresh import IORefresh
from fbvm.net.journal import Journal
from fbvm.units.contract import MOVE_FIELDS, Moves, Processor, ProcessorUnit, Unit


def can_run_in_code(io: IORefresh) -> bool:
    """True if there are units, and each has a processor at work that runs as machine code."""
    for attached in io.units:
        exchanged = attached.unit.exchanged
        if exchanged is None or attached.unit.watched is None or exchanged.processor.machine is None:
            return False
    return bool(io.units)


def units_in_code(io: IORefresh) -> list[UnitInCode]:
    """The units as machine code runs them; none if one of them cannot be."""
    return [_unit_in_code(attached.unit, io) for attached in io.units] if can_run_in_code(io) else []


def _unit_in_code(unit: Unit, io: IORefresh) -> UnitInCode:
    exchanged, watched = unit.exchanged, unit.watched
    assert exchanged and watched is not None
    own = exchanged.processor.contract
    machine: NativeEngine = exchanged.processor.machine
    return machine.unit_in_code(UnitExchange(
        copies=tuple((io.offset(words.area, words.first), own.offset(words.variable), own.size(words.variable))
                     for words in exchanged.words),
        watched=tuple(io.offset(area, word) for area, word in watched),
        posted=own.offset(exchanged.posted),
        urgent=own.offset(exchanged.urgent),
        unfinished=tuple(map(own.offset, exchanged.unfinished)),
        wake=own.offset(exchanged.wake),
        moves=_moves(exchanged.processor, exchanged.moves, io) if exchanged.moves else None,
    ))  # fmt: skip


def _moves(processor: Processor, moves: Moves, io: IORefresh) -> MovesAt:
    """Where a program says what is to be moved.  The program learns where the areas are that it wants to know of."""
    own = processor.contract
    targets, (first_target, _, _) = processor.view(moves.targets), own.array(moves.targets)
    for subscript, area in moves.areas.items():
        if area in io.memory.areas:
            targets[subscript - first_target] = io.offset(area, 0)
    row = own.record(moves.rows)
    first_ring, _, ring_bytes = own.array(moves.rings)
    fields = {name: FieldAt(row[name].offset, 8 * STRUCTS[row[name].machine].size) for name in MOVE_FIELDS}
    shape = MoveShape(row_bytes=row.size, first_ring=first_ring, ring_bytes=ring_bytes, **fields)
    return MovesAt(count=own.offset(moves.count), rows=own.offset(moves.rows), rings=own.offset(moves.rings), shape=shape)


class WithUnits:
    """The fast path of a PLC all of whose units run inside machine code: a scan with its I/O refresh is one call.

    A refresh in which no unit has anything to do is left out.  Python collects the events of networks before a scan and submits
    the requests that the units' programs have left behind."""

    is_outdated = False
    """Always False: a path that has its units in machine code is never replaced."""

    def __init__(self, io: IORefresh, machine: NativeEngine, tasks: list[ScheduledTask], units: Sequence[UnitInCode]) -> None:
        self._io, self._machine = io, machine
        self._scans = machine.scans(tasks, CLOCK_WORDS, units=units)
        self._parameters, self._parameters_at = self._scans.parameters, self._scans.parameters_at
        self._has_intervals = any(task.interval_ns for task in tasks)
        self._rows = [(number, cast(ProcessorUnit, attached.unit), attached.link)
                      for number, attached in enumerate(io.units)]  # fmt: skip
        """Of each unit the number of the bit by which machine code names it, the unit, and its link."""
        self._counts_refreshes = any(attached.network.virtual_time for attached in io.units)
        """True if there are links that want to know of each refresh, so that machine code comes back after each scan."""
        self.is_open = False
        """True if machine code knows the words that the units watch as their last refresh left them."""

    def refresh(self, now_ns: int, journal: Journal | None = None) -> None:
        """An I/O refresh in Python, at the end of a scan that took no fast path."""
        self._io.refresh(now_ns, journal, self._scans.expect)
        self.is_open = True

    def once(self, now_ns: int, budget: int) -> Trap | None:
        """One scan at `now_ns` in which the program may execute `budget` statements.  Returns the trap that ended it."""
        pending = self._has_pending_events()
        self._parameters.events_collected = pending
        if pending:
            self._collect_events(now_ns)
        return self.finish(now_ns, self._scans.once(now_ns, budget))

    def finish(self, now_ns: int, point: int) -> Trap | None:
        """The part of a scan at `now_ns` behind machine code, which has returned `point`.  Returns the trap that ended it."""
        if point > 0:
            return self._machine.trap_at(point)
        self._count_refresh()
        self._end(now_ns)
        return None

    def enter_batch(self, now_ns: int, budget: int) -> tuple[NativeScans, int] | None:
        """Prepares scans of several PLCs by one call of machine code, each of `budget` statements at most.

        Returns the machine code, and the time in ns from which on the PLC has to scan by itself again; None if a link has
        events, or could have some."""
        if self._has_pending_events() or self._parameters.unfinished:
            return None
        self._parameters.scan_budget, self._parameters.events_collected = budget, 0
        self._scans.load_times()
        return self._scans, NEVER

    def leave_batch(self, scans: int) -> None:
        """Called when machine code has done so many scans in which nobody wanted anything."""
        self._scans.store_times()
        self._io.skipped += scans
        self._io.changed_words = False

    def burst(self, times: list[int], most: int, now_ns: int, clock: Clock, budget: int) -> Trap | None:
        """Runs up to `most` scans back to back while units have changed words.

        Reads `clock` before each, whose time was `now_ns` at the call, and appends the time to `times`.  Returns the trap that
        ended the burst, if any.

        A refresh that was left out before takes place now if a unit has something to do: a PLC with a fixed cycle time waits
        before the refresh and not behind it (W394)."""
        scans, parameters, io = self._scans, self._parameters, self._io
        if clock is not scans.clock or most != scans.most:
            scans.set_clock(clock, most)
        is_stepped, pending, point = self._counts_refreshes or not clock.function_at, self._has_pending_events(), SCANNED
        parameters.scan_budget, parameters.times = budget, scans.times_at
        if self._has_intervals:
            scans.load_times()
        if io.skipped:
            io.skipped -= 1
            parameters.refresh_first = 1
        try:
            while True:
                if is_stepped and point >= SCANNED:
                    now_ns = parameters.time_ns = clock.now()
                    parameters.is_time_known = 1
                if pending:
                    pending = self._collect_events(now_ns)
                    parameters.events_collected = 1
                if pending or is_stepped:
                    parameters.is_single = 1
                point = scans.call_burst(self._parameters_at)
                if point == OVER:
                    self._count_refresh()
                    break
                if point > 0:
                    return self._machine.trap_at(point)
                if is_stepped:
                    self._count_refresh()
                now_ns = parameters.time_ns
                if point in (ASKED, ASKED_BEFORE):
                    pending = self._submit_requests(now_ns) or pending
        finally:  # Ctrl-C may come between two calls
            if self._has_intervals:
                scans.store_times()
            if done := (parameters.times - scans.times_at) // 8:
                times += scans.times[:done]
                self._end(parameters.time_ns)
            else:
                io.skipped += parameters.refresh_first
                parameters.refresh_first = parameters.is_time_known = 0
        return None

    def many(self, most: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, Trap | None]:
        """Up to `most` scans after the one at `now_ns`, each `step_ns` later than the one before and of `budget` statements at
        most, until the program of a unit has run.

        No further scan begins when all together have executed `spend` statements.  Returns how many scans there were, and the
        trap that ended the last one."""
        scans, io = self._scans, self._io
        if self._has_pending_events():
            return 0, None
        if io.recorder:
            io.recorder.before(now_ns + step_ns)
        done, point = scans.run(most, now_ns + step_ns, step_ns, budget, spend)
        io.skipped += done - 1
        if point > 0:
            return done, self._machine.trap_at(point)
        self._count_refresh()
        self._end(now_ns + done * step_ns)
        return done, None

    def _has_pending_events(self) -> bool:
        """True if a link has events for its unit."""
        for _, _, link in self._rows:  # noqa: SIM110 - a generator would cost as much as the rest of it
            if not link.is_quiet:
                return True
        return False

    def _collect_events(self, now_ns: int) -> bool:
        """Collects pending network events for the next I/O refresh.  Returns True if a link has more already."""
        if self._io.skipped:
            self._io.report_skipped()
        if self._parameters.unfinished:
            self._submit_requests(now_ns)
        more, recorder = False, self._io.recorder
        for number, unit, link in self._rows:
            if link.is_quiet:
                link.pass_by(1)
                continue
            events = link.events(now_ns)
            if events:
                unit.post(events)
                if recorder:
                    recorder.received(number, events)
            if not link.is_quiet:
                more = True
        return more

    def _count_refresh(self) -> None:
        """Called after each I/O refresh of machine code: adds it to those of which the links have not been told.

        Not if events were collected for this refresh, which has told the links.  Tells them at once if a unit's program ran."""
        parameters = self._parameters
        if parameters.events_collected:
            parameters.events_collected = 0
            return
        io = self._io
        io.skipped += 1
        if parameters.changed:
            io.report_skipped()

    def _end(self, now_ns: int) -> None:
        """Called after the last scan of a call: submits requests that are still unsent and updates `io.changed_words`."""
        parameters = self._parameters
        if parameters.unfinished:
            self._submit_requests(now_ns)
        self._io.changed_words = parameters.again & CHANGED_WORDS != 0

    def _submit_requests(self, now_ns: int) -> bool:
        """Submits what the units' programs have asked of their networks.  Returns True if links have events because of that.

        Raises RuntimeError if the program of a unit has trapped, which is a mistake of this package."""
        parameters, submitted = self._parameters, False
        if parameters.faulty:
            number = parameters.faulty.bit_length() - 1
            raise RuntimeError(str(self._scans.units[number].trap_at(parameters.point)))
        unfinished, parameters.unfinished = parameters.unfinished, 0
        for number, unit, link in self._rows:
            if unfinished >> number & 1 and (requests := unit.finish()):
                link.submit(requests, now_ns)
                submitted = True
        return submitted and self._has_pending_events()
