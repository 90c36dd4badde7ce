"""Scans inside machine code: what a scan does up to its refresh, for as long as nobody outside has to be told.

What their functions are made of is in `scans.code`."""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count

from fbvm.base.memory import Memory
from fbvm.engine.clock import Clock
from fbvm.engine.native import cache as native_cache
from fbvm.engine.native.cache import Stored, name_of
from fbvm.engine.native.compiler import Linked, compile_text
from fbvm.engine.native.entries import Entry
from fbvm.engine.native.scans import code as native_scan_code
from fbvm.engine.native.scans.code import ROW, WATCHED_BYTES, WATCHED_ROW, Clockwork
from fbvm.engine.native.scans.slots import ROWS, Slot
from fbvm.engine.native.scans.units import Shape, UnitInCode


@dataclass
class Turn:
    """A task in its turn: its number, its interval or 0, and when it runs next if it has one."""

    task: int
    interval_ns: int = 0
    next_ns: int = 0


NO_LIMIT = 1 << 62
FIRST, BUDGETED, CHANGED = Slot.FIRST, Slot.BUDGETED, Slot.CHANGED  # looked up once, not in each scan


class Series:
    """Scans of one PLC: its memory and context by their addresses, its tasks by their entries, in the order of `turns`.

    In each scan there is a time, nothing is due, the budget is full, the clockwork is written; then the tasks that are
    due take their turns, and the number of scans grows.  `watched` are offsets of eight bytes each, by who watches them: a
    scan after which they are not as `expect` saw them last is the last one.  In place of it there may be `units`: then
    each scan ends with a refresh, and the one in whose refresh one of them ran is the last one; in a burst, which its caller
    begins by `call_burst`, one that gives no reason for another scan, or in which they ask for something."""

    def __init__(self, memory: Memory, memory_at: int, context_at: int, tasks: Sequence[Entry], turns: Sequence[Turn],
                 clockwork: Clockwork, watched: Sequence[Sequence[int]] = (),
                 units: Sequence[UnitInCode] = ()) -> None:  # fmt: skip
        rows: list[tuple[int, ...]] = [
            (tasks[turn.task].function_at, turn.interval_ns, turn.next_ns, 0) for turn in turns]  # fmt: skip
        offsets = [offset for group in watched for offset in group]
        rows += [(offset, 0) for offset in offsets]
        self._tasks = tasks  # which stay while machine code calls them
        self.turns = turns
        """These move on, or others of the same tasks."""
        self._timed = [(row, ROWS + ROW * row + 2) for row, turn in enumerate(turns) if turn.interval_ns]
        """Which turns have an interval, and where their next time is."""
        given: dict[int, int] = {Slot.MEMORY: memory_at, Slot.CONTEXT: context_at, Slot.LEFT: 1, Slot.SPEND: NO_LIMIT}
        self.numbers = numbers = array("q", [given.get(number, 0) for number in range(ROWS)])
        """The parameters, for who calls `call` himself."""
        numbers.extend(number for row in rows for number in row)
        at = count(ROWS + ROW * len(turns) + 1, WATCHED_ROW)
        self._expected = [[(memory.u8[offset : offset + WATCHED_BYTES].cast("q"), next(at)) for offset in group]
                          for group in watched]  # fmt: skip
        """What is watched, and where what is expected of it is, by who watches it: of each unit, if there are any."""
        self.units = units
        for unit in units:
            self._expected.append([(view, len(numbers) + at) for view, at in unit.expected(memory)])
            numbers.extend(unit.parameters(memory_at))
        shape = tuple(turn.interval_ns > 0 for turn in turns), clockwork, len(offsets)
        self.numbers_at = numbers.buffer_info()[0]
        self.clock: Clock | None = None
        self.most = 0
        """Of how many scans a burst is at most."""
        self.times = array("q")
        """When those of the last one began."""
        self.times_at = 0
        self.call, self.call_burst = _scans(*shape, tuple(unit.shape for unit in units))
        """Machine code of scans, and of a burst: they take the address of the parameters."""

    @property
    def changed(self) -> bool:
        """True if after the last scan something that is watched was not as expected, or a unit ran."""
        return self.numbers[CHANGED] != 0

    def expect(self, number: int) -> None:
        """From now on what this one watches shall be as it is."""
        for view, at in self._expected[number]:
            self.numbers[at] = view[0]

    def follow(self, clock: Clock, most: int) -> None:
        """Bursts are of no more scans than so many from now on, at the time of this clock."""
        self.clock, self.most = clock, most
        self.times = array("q", bytes(8 * most))
        self.times_at = self.times.buffer_info()[0]
        numbers = self.numbers
        numbers[Slot.ENDS], numbers[Slot.CLOCK] = self.times_at + 8 * most, clock.function_at
        numbers[Slot.NUMBER], numbers[Slot.ZERO] = clock.number, clock.zero_ns

    def load_turns(self) -> None:
        """Take over when the tasks run next."""
        for row, at in self._timed:
            self.numbers[at] = self.turns[row].next_ns

    def store_turns(self) -> None:
        """Give back when the tasks run next."""
        for row, at in self._timed:
            self.turns[row].next_ns = self.numbers[at]

    def once(self, now_ns: int, budget: int) -> int:
        """One scan; the point of its trap, 0, or ASKED."""
        numbers = self.numbers
        numbers[FIRST], numbers[BUDGETED] = now_ns, budget
        if not self._timed:
            return self.call(self.numbers_at)
        self.load_turns()
        point = self.call(self.numbers_at)
        self.store_turns()
        return point

    def run(self, n: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, int]:
        """Up to n scans, a step of time between them; how many there were, and what `once` says of the last.

        No other begins when all together have executed `spend` statements."""
        numbers = self.numbers
        numbers[Slot.LEFT], numbers[Slot.STEP], numbers[Slot.SPEND] = n, step_ns, spend
        point = self.once(now_ns, budget)
        numbers[Slot.LEFT], numbers[Slot.SPEND] = 1, NO_LIMIT
        return numbers[Slot.DONE], point


Call = Callable[[int], int]


@cache
def _scans(intervals: tuple[bool, ...], clockwork: Clockwork, watched: int, shapes: tuple[Shape, ...]) -> tuple[Call, Call]:
    """The functions for a shape: scans, and a burst, which is never called where there are no units."""
    text = native_scan_code.text(intervals, clockwork, watched, shapes)
    name = name_of("scans", text)
    stored = native_cache.read(name)
    if stored is None:
        stored = Stored({}, compile_text(text, 1))
        native_cache.write(name, stored)
    names = ["scans", "burst"] if shapes else ["scans"]
    linked = Linked(stored.compiled, names)
    _LOADED.append(linked)
    of_address = ctypes.PYFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)
    return of_address(linked.address(names[0])), of_address(linked.address(names[-1]))


_LOADED: list[Linked] = []
"""What functions that were given out lie in."""
