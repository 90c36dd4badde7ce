"""Scans inside machine code: what a scan does up to its refresh, one or several, without coming back in between.

What their functions are made of is in `scans.code`, what they are told and tell in `scans.parameters`."""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count

from fbvm.base.memory import STRUCTS, Memory
from fbvm.engine.clock import Clock
from fbvm.engine.native.llvm import cache as native_cache
from fbvm.engine.native.llvm.cache import Stored, name_of
from fbvm.engine.native.llvm.compiler import Linked, compile_text
from fbvm.engine.native.llvm.entry_points import EntryPoint
from fbvm.engine.native.scans import code as native_scan_code
from fbvm.engine.native.scans.code import NEXT_NS, TASK_ROW, WATCHED_ROW, ClockWordTable
from fbvm.engine.native.scans.parameters import COUNT, Parameters
from fbvm.engine.native.scans.units import Shape, UnitInCode


@dataclass
class ScheduledTask:
    """A task's entry in the order of a scan."""

    task: int
    """Its number in the image."""
    interval_ns: int = 0
    """0 for a task that runs in every scan."""
    next_ns: int = 0
    """From which time on it is due, if it has an interval."""


_number = STRUCTS["i64"].unpack_from
NO_LIMIT = 1 << 62
"""As many statements as nobody spends."""


class NativeScans:
    """Machine code of the scans of one PLC, for its tasks in the order of `tasks`.

    `memory_at` and `context_at` are the addresses of the memory and of the context, `entries` the entry points of the image's
    tasks.  A scan writes its time, the step budget and the clock words, runs the tasks that are due and counts itself.

    `watched` has a list for each unit: the offsets of eight bytes each that the unit looks at in the PLC's memory.  A scan after
    which these bytes are not what they were at the last `expect` is the last one of a `run`.  With `units` instead, each scan
    ends with the I/O refresh of these, and a scan in whose refresh the program of a unit has run is the last one of a `run`.
    A burst, which the caller starts by `call_burst`, ends with a scan whose refresh gives no reason for another scan, and comes
    back before its end when units ask something of their networks."""

    def __init__(self, memory: Memory, memory_at: int, context_at: int, entries: Sequence[EntryPoint],
                 tasks: Sequence[ScheduledTask], clock_words: ClockWordTable, watched: Sequence[Sequence[int]] = (),
                 units: Sequence[UnitInCode] = ()) -> None:  # fmt: skip
        self._entries = entries  # which stay while machine code calls them
        self.tasks = tasks
        """Their times move on; the caller may put others of the same tasks in their place."""
        self.units = units
        self._timed = [(row, COUNT + TASK_ROW * row + NEXT_NS) for row, task in enumerate(tasks) if task.interval_ns]
        """Which tasks have an interval, and where among the numbers their next time is."""
        offsets = [offset for group in watched for offset in group]
        numbers = array("q", bytes(8 * COUNT))
        for task in tasks:
            numbers.extend((entries[task.task].function_at, task.interval_ns, task.next_ns, 0))
        at = count(len(numbers) + 1, WATCHED_ROW)
        self._memory = memory
        self._expected = [[(offset, next(at)) for offset in group] for group in watched]
        """For each unit the offsets of what it watches, and where among the numbers the expected bytes are."""
        for offset in offsets:
            numbers.extend((offset, 0))
        for unit in units:
            self._expected.append([(offset, len(numbers) + at) for offset, at in unit.expected])
            numbers.extend(unit.parameters(memory_at))
        self._numbers = numbers
        """The parameters, and the rows behind them."""
        self.parameters = Parameters.from_buffer(numbers)
        parameters = self.parameters
        parameters.memory, parameters.context = memory_at, context_at
        parameters.most_scans, parameters.spend = 1, NO_LIMIT
        self.parameters_at = numbers.buffer_info()[0]
        """Their address, which `call` and `call_burst` take."""
        self.clock: Clock | None = None
        self.most = 0
        """Of how many scans a burst is at most."""
        self.times = array("q")
        """The times of the last burst's scans."""
        self.times_at = 0
        shapes = tuple(unit.shape for unit in units)
        made = _functions(tuple(task.interval_ns > 0 for task in tasks), clock_words, len(offsets), shapes)
        self.call, self.call_burst, self.call_all = made
        """Machine code of scans, of a burst, which there is only with `units`, and of scans of several PLCs of one shape."""

    @property
    def changed(self) -> bool:
        """True if after the last scan watched bytes were not as expected, or the program of a unit has run."""
        return self.parameters.changed != 0

    def expect(self, unit: int) -> None:
        """From now on the bytes that a unit (by its number) watches are expected to stay as they are."""
        content = self._memory.map
        for offset, at in self._expected[unit]:
            self._numbers[at] = _number(content, offset)[0]

    def set_clock(self, clock: Clock, most: int) -> None:
        """From now on bursts have at most so many scans, at the times that this clock tells."""
        self.clock, self.most = clock, most
        self.times = array("q", bytes(8 * most))
        self.times_at = self.times.buffer_info()[0]
        parameters = self.parameters
        parameters.times_end = self.times_at + 8 * most
        parameters.clock_function, parameters.clock_number = clock.function_at, clock.number
        parameters.clock_zero_ns = clock.zero_ns

    def load_times(self) -> None:
        """Tells machine code when the tasks with an interval are due."""
        for row, at in self._timed:
            self._numbers[at] = self.tasks[row].next_ns

    def store_times(self) -> None:
        """Takes over from machine code when the tasks with an interval are due."""
        for row, at in self._timed:
            self.tasks[row].next_ns = self._numbers[at]

    def once(self, now_ns: int, budget: int) -> int:
        """One scan at `now_ns` that may execute `budget` statements.

        Returns the point of the trap that ended it (`NativeEngine.trap_at`), OVER, or ASKED."""
        parameters = self.parameters
        parameters.time_ns, parameters.scan_budget = now_ns, budget
        if not self._timed:
            return self.call(self.parameters_at)
        self.load_times()
        point = self.call(self.parameters_at)
        self.store_times()
        return point

    def run(self, n: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, int]:
        """Up to n scans, the first at `now_ns`, each `step_ns` later than the one before, of `budget` statements at most.

        No further scan begins when all together have executed `spend` statements.  Returns how many scans there were, and
        what `once` returns for the last one."""
        parameters = self.parameters
        parameters.most_scans, parameters.step_ns, parameters.spend = n, step_ns, spend
        point = self.once(now_ns, budget)
        parameters.most_scans, parameters.spend = 1, NO_LIMIT
        return parameters.done, point


Call = Callable[[int], int]
"""A function of machine code: takes the address of the parameters, returns a point or one of the answers of `scans.code`."""


CallAll = Callable[[int, int, int, int], int]
"""`@all` of `scans.code`: takes the address of the rows, the first one, how many there are, and the time."""


@cache
def _functions(intervals: tuple[bool, ...], clock_words: ClockWordTable, watched: int,
               shapes: tuple[Shape, ...]) -> tuple[Call, Call, CallAll]:  # fmt: skip
    """The functions @scans, @burst and @all for a shape; where there are no units, @scans in place of @burst."""
    text = native_scan_code.text(intervals, clock_words, watched, shapes)
    name = name_of("scans", text)
    stored = native_cache.read(name)
    if stored is None:
        stored = Stored({}, compile_text(text, 1))
        native_cache.write(name, stored)
    names = ["scans", "burst" if shapes else "scans", "all"]
    linked = Linked(stored.compiled, names)
    _LOADED.append(linked)
    of_address = ctypes.PYFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)
    of_rows = ctypes.PYFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)
    scans, burst, every = map(linked.address, names)
    return of_address(scans), of_address(burst), of_rows(every)


_LOADED: list[Linked] = []
"""The objects that stay in memory because their functions were given out."""
