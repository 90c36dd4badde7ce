"""Units whose own processors run as machine code, inside the scans of their PLC.

What is left for Python is what their networks have to know, and what these tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from fbvm.base.memory import STRUCTS
from fbvm.engine.clock import Clock
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.native.scans.code import ASKED, ASKED_BEFORE, OVER, SCANNED
from fbvm.engine.native.scans.scans import Turn
from fbvm.engine.native.scans.slots import Slot
from fbvm.engine.native.scans.units import CHANGED_WORDS, FieldAt, MovesAt, MoveShape, UnitExchange, UnitInCode
from fbvm.engine.trap import Trap
from fbvm.machine.clock_words import CLOCKWORK
from fbvm.machine.refresh import Exchange
from fbvm.net.journal import Journal
from fbvm.units.contract import MOVE_FIELDS, Moves, Processor, ProcessorUnit, Unit

BUDGETED, TIMES, DEFERRED, FIRST, KNOWN, ALONE = (
    Slot.BUDGETED, Slot.TIMES, Slot.DEFERRED, Slot.FIRST, Slot.KNOWN, Slot.ALONE)  # fmt: skip
COLLECTED, CHANGED, UNFINISHED = Slot.COLLECTED, Slot.CHANGED, Slot.UNFINISHED
"""Slots of every burst, looked up once."""


def can_run_in_code(exchange: Exchange) -> bool:
    """True if there are units, and each has a processor at work that runs as machine code."""
    for attached in exchange.units:
        exchanged = attached.unit.exchanged
        if exchanged is None or attached.unit.watched is None or exchanged.processor.machine is None:
            return False
    return bool(exchange.units)


def units_in_code(exchange: Exchange) -> list[UnitInCode]:
    """The units as machine code runs them; none if one of them cannot be."""
    return [_unit_in_code(attached.unit, exchange) for attached in exchange.units] if can_run_in_code(exchange) else []


def _unit_in_code(unit: Unit, exchange: Exchange) -> UnitInCode:
    exchanged, watched = unit.exchanged, unit.watched
    assert exchanged and watched is not None
    own = exchanged.processor.contract
    machine: NativeEngine = exchanged.processor.machine
    return machine.unit_in_code(UnitExchange(
        copies=tuple((exchange.offset(words.area, words.first), own.offset(words.variable), own.size(words.variable))
                     for words in exchanged.words),
        watched=tuple(exchange.offset(area, word) for area, word in watched),
        posted=own.offset(exchanged.posted),
        urgent=own.offset(exchanged.urgent),
        unfinished=tuple(map(own.offset, exchanged.unfinished)),
        wake=own.offset(exchanged.wake),
        moves=_moves(exchanged.processor, exchanged.moves, exchange) if exchanged.moves else None,
    ))  # fmt: skip


def _moves(processor: Processor, moves: Moves, exchange: Exchange) -> MovesAt:
    """Where a program says what is to be moved.  The program learns where the areas are that it wants to know of."""
    own = processor.contract
    targets, (first_target, _, _) = processor.view(moves.targets), own.array(moves.targets)
    for subscript, area in moves.areas.items():
        if area in exchange.memory.areas:
            targets[subscript - first_target] = exchange.offset(area, 0)
    row = own.record(moves.rows)
    first_ring, _, ring_bytes = own.array(moves.rings)
    fields = {name: FieldAt(row[name].offset, 8 * STRUCTS[row[name].machine].size) for name in MOVE_FIELDS}
    shape = MoveShape(row_bytes=row.size, first_ring=first_ring, ring_bytes=ring_bytes, **fields)
    return MovesAt(count=own.offset(moves.count), rows=own.offset(moves.rows), rings=own.offset(moves.rings), shape=shape)


class WithUnits:
    """Machine code of whole scans, with their I/O refreshes.  One in which no unit has anything to do is left out."""

    def __init__(self, exchange: Exchange, machine: NativeEngine, turns: list[Turn], found: Sequence[UnitInCode]) -> None:
        self._exchange, self._machine = exchange, machine
        self._series = machine.series(turns, CLOCKWORK, units=found)
        self._numbers, self._numbers_at = self._series.numbers, self._series.numbers_at
        self._is_timed = any(turn.interval_ns for turn in turns)
        self._rows = [(1 << number, cast(ProcessorUnit, attached.unit), attached.link)
                      for number, attached in enumerate(exchange.units)]  # fmt: skip
        self._counts = any(attached.network.virtual_time for attached in exchange.units)
        """There are links that want to know of each refresh."""
        self.is_outdated = False
        """It stays as it is."""
        self.is_open = False
        """What the units watch is expected to be as their last refresh left it."""

    def refresh(self, now_ns: int, journal: Journal | None = None) -> None:
        """An I/O refresh of a scan that goes another way."""
        self._exchange.refresh(now_ns, journal, self._series.expect)
        self.is_open = True

    def once(self, now_ns: int, budget: int) -> Trap | None:
        """One scan."""
        self._numbers[COLLECTED] = has_events = self._has_events()
        if has_events:
            self._collect_events(now_ns)
        point = self._series.once(now_ns, budget)
        if point > 0:
            return self._machine.trap_at(point)
        self._count()
        self._end(now_ns)
        return None

    def burst(self, times: list[int], most: int, now_ns: int, clock: Clock, budget: int) -> Trap | None:
        """Scans each at the time that the clock tells, one upon the other for as long as units have news for the program;
        `times` takes when they began.

        A refresh that was left out takes place now if there is something for it: waiting comes before the refresh, as in
        a PLC with a fixed cycle time (W394)."""
        series, numbers, exchange = self._series, self._numbers, self._exchange
        if clock is not series.clock or most != series.most:
            series.follow(clock, most)
        is_stepped, has_events, point = self._counts or not clock.function_at, self._has_events(), SCANNED
        numbers[BUDGETED], numbers[TIMES] = budget, series.times_at
        if self._is_timed:
            series.load_turns()
        if exchange.passed:
            exchange.passed -= 1
            numbers[DEFERRED] = 1
        try:
            while True:
                if is_stepped and point >= SCANNED:
                    now_ns = numbers[FIRST] = clock.now()
                    numbers[KNOWN] = 1
                if has_events:
                    has_events = self._collect_events(now_ns)
                    numbers[COLLECTED] = 1
                if has_events or is_stepped:
                    numbers[ALONE] = 1
                point = series.call_burst(self._numbers_at)
                if point == OVER:
                    self._count()
                    break
                if point > 0:
                    return self._machine.trap_at(point)
                if is_stepped:
                    self._count()
                now_ns = numbers[FIRST]
                if point in (ASKED, ASKED_BEFORE):
                    has_events = self._finish(now_ns) or has_events
        finally:  # Ctrl-C may come between two calls
            if self._is_timed:
                series.store_turns()
            if done := (numbers[TIMES] - series.times_at) // 8:
                times += series.times[:done]
                self._end(numbers[FIRST])
            else:
                exchange.passed += numbers[DEFERRED]
                numbers[DEFERRED] = numbers[KNOWN] = 0
        return None

    def many(self, most: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, Trap | None]:
        """Scans that follow the one at `now_ns`, each a step later, until a unit has something to do; how many there were.

        No other begins when all together have executed `spend` statements."""
        series, exchange = self._series, self._exchange
        if self._has_events():
            return 0, None
        done, point = series.run(most, now_ns + step_ns, step_ns, budget, spend)
        exchange.passed += done - 1
        if point > 0:
            return done, self._machine.trap_at(point)
        self._count()
        self._end(now_ns + done * step_ns)
        return done, None

    def _has_events(self) -> bool:
        """True if a link has something to tell."""
        for _, _, link in self._rows:  # noqa: SIM110 - a generator would cost as much as the rest of it
            if not link.is_quiet:
                return True
        return False

    def _collect_events(self, now_ns: int) -> bool:
        """Fetch what links have to tell, for the next refresh; whether they have more before they are asked for anything."""
        if self._exchange.passed:
            self._exchange.pass_by()
        if self._numbers[UNFINISHED]:
            self._finish(now_ns)
        has_events = False
        for _, unit, link in self._rows:
            if link.is_quiet:
                link.pass_by(1)
                continue
            events = link.events(now_ns)
            if events:
                unit.post(events)
            if not link.is_quiet:
                has_events = True
        return has_events

    def _count(self) -> None:
        """A refresh is over; links that were heard for it know of it, and others are told if it was not left out."""
        numbers = self._numbers
        if numbers[COLLECTED]:
            numbers[COLLECTED] = 0
            return
        exchange = self._exchange
        exchange.passed += 1
        if numbers[CHANGED]:
            exchange.pass_by()

    def _end(self, now_ns: int) -> None:
        """The last of some scans is over."""
        numbers = self._numbers
        if numbers[UNFINISHED]:
            self._finish(now_ns)
        self._exchange.changed_words = numbers[Slot.AGAIN] & CHANGED_WORDS != 0

    def _finish(self, now_ns: int) -> bool:
        """Have done what the processors ask for that ran; whether that made links have something to tell.

        Raises RuntimeError if the program of one has trapped, which is a fault of ours."""
        numbers, submitted = self._numbers, False
        if numbers[Slot.FAULTY]:
            number = numbers[Slot.FAULTY].bit_length() - 1
            raise RuntimeError(str(self._series.units[number].trap_at(numbers[Slot.POINT])))
        ran, numbers[UNFINISHED] = numbers[UNFINISHED], 0
        for bit, unit, link in self._rows:
            if ran & bit:
                requests = unit.finish()
                if requests:
                    link.submit(requests, now_ns)
                    submitted = True
        return submitted and self._has_events()
