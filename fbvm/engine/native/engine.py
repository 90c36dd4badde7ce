"""The native engine: an Image becomes machine code over the same flat memory, with the same traps and step budget.

It has the surface of the Python engine and its results to the bit; it has no observations.  It decides nothing: every
meaning is in the table of operations."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from weakref import finalize

from fbvm.base.areas import BUDGET, NOW
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine.native import compiler as native_compiler
from fbvm.engine.native.code import Code, code_of
from fbvm.engine.native.context import Context
from fbvm.engine.native.emit.writer import Unsupported
from fbvm.engine.native.entries import Entry, entry
from fbvm.engine.native.scans.code import NOTHING, Clockwork
from fbvm.engine.native.scans.scans import NO_LIMIT, Series, Turn
from fbvm.engine.native.scans.units import UnitExchange, UnitInCode
from fbvm.engine.stops import PAUSE, STOPPED, Stops
from fbvm.engine.trap import Trap, trap

__all__ = ["NativeEngine", "Unsupported", "available"]
available = native_compiler.available


class NativeEngine:
    """Runs an image over a memory.

    The caller sets time and budget in the system page before a run.  `level` 0 is code that is soon there, 2 is code
    that is fast, None begins with the one and goes on with the other.  A program's mistakes come back as a Trap; memory
    is then what was stored before it.  With `stops` a run also ends where these say, with the Trap PAUSE.  Raises
    ImportError where llvmlite is missing (see `available`), Unsupported for code that the compiler never makes."""

    def __init__(self, image: Image, memory: Memory, level: int | None = None, stops: Stops | None = None) -> None:
        if memory.size < image.layout.size:
            raise ValueError(f"the image needs {image.layout.size} bytes of memory, here are {memory.size}")
        self.image, self.memory, self.level = image, memory, level
        self._code: Code = code_of(image, stops is not None)
        self._code.prepare(level)
        self._context = Context(self._code.kept_bytes, self._code.context_bytes, memory.size,
                                0 if stops is None else stops.at)
        self._stops = stops  # which stays while machine code looks into it
        self._place = (ctypes.c_char * memory.size).from_buffer(memory.map)  # which stays while this does
        self._memory_at = ctypes.addressof(self._place)
        self._entries = [self._entry(number) for number in range(len(image.tasks))]
        self._calls = [entry.call for entry in self._entries]
        self._series: dict[tuple[tuple[tuple[int, int], ...], Clockwork], Series] = {}

    def _entry(self, task: int) -> Entry:
        bound = entry()
        bound.bind(self._memory_at, self._context.at)
        self._code.follow(bound, task, self.level)
        finalize(self, bound.give_back)
        return bound

    @property
    def source(self) -> str:
        """The module of LLVM's language, before optimisation."""
        return self._code.translation.text

    @property
    def optimised(self) -> bool:
        """True if the fast code is running."""
        return self._code.level_of(self.level) == 2

    @property
    def machine(self) -> NativeEngine:
        """What runs as machine code: all of it."""
        return self

    def run(self, task_index: int) -> Trap | None:
        """Execute the programs of a task in their order, until the end or a trap."""
        point = self._calls[task_index]()
        return self.trap_at(point) if point else None

    def series(self, turns: Sequence[Turn], clockwork: Clockwork = NOTHING, watched: Sequence[Sequence[int]] = (),
               units: Sequence[UnitInCode] = ()) -> Series:  # fmt: skip
        """Scans with the tasks in this order, which write the clockwork and end when what is watched changes or the
        program of a unit runs."""
        return Series(self.memory, self._memory_at, self._context.at, self._entries, turns, clockwork, watched, units)

    def unit_in_code(self, exchange: UnitExchange) -> UnitInCode:
        """This program, its first task, as that of a unit which exchanges this with a PLC."""
        return UnitInCode(self._entries[0].function_at, self._memory_at, self._context.at, self.trap_at, exchange)

    def run_many(self, turns: Sequence[Turn], n: int, step_ns: int, clockwork: Clockwork = NOTHING, *,
                 spend: int = NO_LIMIT) -> tuple[int, Trap | None]:  # fmt: skip
        """Up to n scans of a `Series`, each a step later than the one before, with the budget that there is now; how many
        there were, and the trap of the last."""
        if not turns or n <= 0:
            return 0, None
        shape = tuple((turn.task, turn.interval_ns) for turn in turns), clockwork
        series = self._series.get(shape)
        if series is None:
            series = self._series[shape] = self.series(turns, clockwork)
        series.turns = turns
        system = self.memory.views["i64"]
        done, point = series.run(n, system[NOW // 8] + step_ns, step_ns, system[BUDGET // 8], spend)
        return done, self.trap_at(point) if point else None

    def trap_at(self, number: int) -> Trap:
        """What the point says, with the values that the context holds."""
        code, site, shown = self._code.points[number - 1]
        if code == STOPPED:
            return PAUSE
        return trap(self.image, code, site, tuple(self._context.values(shown)), self._context.instance(shown))
