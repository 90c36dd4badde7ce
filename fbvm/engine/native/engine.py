"""The native engine: runs an Image as machine code over the same flat memory, with the same traps and step budget.

It has the methods of the Python engine and its results to the bit, but no observations.  It decides no meaning: that is in
the table of operations (`fbvm.code.operations`)."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from operator import add
from weakref import finalize

from fbvm.base.areas import BUDGET, NOW
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine.allowance import WHOLE_BUDGET, Allowance
from fbvm.engine.native.code import Code, code_of
from fbvm.engine.native.emit.context import Context
from fbvm.engine.native.emit.counting import Counts
from fbvm.engine.native.emit.writer import Unsupported
from fbvm.engine.native.llvm import compiler as native_compiler
from fbvm.engine.native.llvm.entry_points import EntryPoint, entry
from fbvm.engine.native.scans.code import NO_CLOCK_WORDS, ClockWordTable
from fbvm.engine.native.scans.scans import NO_LIMIT, NativeScans, ScheduledTask
from fbvm.engine.native.scans.units import UnitExchange, UnitInCode
from fbvm.engine.powered import UNMARKED
from fbvm.engine.stops import PAUSE, STOPPED, StopTable
from fbvm.engine.trap import Trap, trap

__all__ = ["NativeEngine", "Unsupported", "available"]
available = native_compiler.available


class NativeEngine:
    """Runs an image over a memory.

    The caller writes time and step budget into the system page before a run.  `level` 0 is quick code, which is compiled soon,
    2 is fast code; None begins with quick code and goes over to fast code when that is ready.  A program's mistake comes
    back as a Trap; the memory then has what was stored before it.  With `stops` a run also ends, with the Trap PAUSE, where
    the table says.

    Raises ValueError for a memory that is too small, ImportError where llvmlite is missing (see `available`), Unsupported
    for code that the compiler never makes."""

    def __init__(self, image: Image, memory: Memory, level: int | None = None, stops: StopTable | None = None) -> None:
        if memory.size < image.layout.size:
            raise ValueError(f"the image needs {image.layout.size} bytes of memory, here are {memory.size}")
        self.image, self.memory, self.level = image, memory, level
        self._code: Code = code_of(image, stops is not None)
        self._code.prepare(level)
        self._context = Context(self._code.kept_bytes, self._code.context_bytes, memory.size,
                                0 if stops is None else stops.at)
        self._allowance = WHOLE_BUDGET
        self._counts = Counts(image.counters, self._context.at, self._code.counting) if image.counters else None
        marks_at = self._context.at + self._code.marks_at
        self.marks = (ctypes.c_ubyte * image.marks).from_address(marks_at) if image.marks else bytearray()
        """The notes of power of an image that has them."""
        self.marks[:] = UNMARKED * image.marks
        self.counted = [0] * image.counters
        """What another engine has counted in place of this one."""
        self._stops = stops  # which stays while machine code looks into it
        self._whole = memory.u8[:]  # without which the mapping could end
        self._memory_at = ctypes.addressof(ctypes.c_char.from_buffer(memory.map))
        self._entries = [self._entry(number) for number in range(len(image.tasks))]
        self._calls = [entry.call for entry in self._entries]
        self._scans: dict[tuple[tuple[tuple[int, int], ...], ClockWordTable], NativeScans] = {}

    def _entry(self, task: int) -> EntryPoint:
        bound = entry()
        bound.bind(self._memory_at, self._context.at)
        self._code.follow(bound, task, self.level)
        finalize(self, bound.release)
        return bound

    @property
    def source(self) -> str:
        """The module in LLVM's language, before optimisation."""
        return self._code.translation.text

    @property
    def optimised(self) -> bool:
        """True if runs execute the fast code."""
        return self._code.level_of(self.level) == 2

    @property
    def machine(self) -> NativeEngine:
        """The machine code that runs now: this engine."""
        return self

    @property
    def allowance(self) -> Allowance:
        """How much of the step budget runs may use up."""
        return self._allowance

    @allowance.setter
    def allowance(self, allowance: Allowance) -> None:
        self._allowance = allowance
        self._context.allow(allowance)

    @property
    def counts(self) -> list[int]:
        """How often each counter of the image was reached."""
        return list(map(add, self._counts.read(), self.counted)) if self._counts else []

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of a task in their order.  Returns the trap that ended them, if any."""
        point = self._calls[task_index]()
        return self.trap_at(point) if point else None

    def scans(self, tasks: Sequence[ScheduledTask], clock_words: ClockWordTable = NO_CLOCK_WORDS,
              watched: Sequence[Sequence[int]] = (), units: Sequence[UnitInCode] = ()) -> NativeScans:  # fmt: skip
        """Machine code of whole scans, with the tasks in this order; see `NativeScans` for `watched` and `units`."""
        return NativeScans(self.memory, self._memory_at, self._context.at, self._entries, tasks, clock_words, watched, units)

    def unit_in_code(self, exchange: UnitExchange) -> UnitInCode:
        """The first task of this image as the program of a unit, to be run inside the scans of a PLC (`scans`)."""
        return UnitInCode(self._entries[0].function_at, self._memory_at, self._context.at, self.trap_at, exchange)

    def run_many(self, tasks: Sequence[ScheduledTask], n: int, step_ns: int, clock_words: ClockWordTable = NO_CLOCK_WORDS, *,
                 spend: int = NO_LIMIT) -> tuple[int, Trap | None]:  # fmt: skip
        """Up to n scans of a PLC without units, each `step_ns` later than the one before, with the time and the step budget that
        stand in the system page now.

        No further scan begins when all together have executed `spend` statements.  Returns how many scans there were, and the
        trap that ended the last one."""
        if not tasks or n <= 0:
            return 0, None
        shape = tuple((task.task, task.interval_ns) for task in tasks), clock_words
        scans = self._scans.get(shape)
        if scans is None:
            scans = self._scans[shape] = self.scans(tasks, clock_words)
        scans.tasks = tasks
        system = self.memory.views["i64"]
        done, point = scans.run(n, system[NOW // 8] + step_ns, step_ns, system[BUDGET // 8], spend)
        return done, self.trap_at(point) if point else None

    def trap_at(self, number: int) -> Trap:
        """The trap for a point that machine code has returned, with the values that it left in the context."""
        code, site, shown = self._code.points[number - 1]
        if self._counts:
            self._counts.settle()
        if code == STOPPED:
            return PAUSE
        return trap(self.image, code, site, tuple(self._context.values(shown)), self._context.instance(shown),
                    self.memory)
