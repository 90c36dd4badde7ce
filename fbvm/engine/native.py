"""The native engine: an Image becomes machine code over the same flat memory, with the same traps and step budget.

It has the surface of the Python engine and its results to the bit; it has no observations.  It decides nothing: every
meaning is in the table of operations."""

from __future__ import annotations

import ctypes
from weakref import finalize

from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine import native_compiler
from fbvm.engine.native_code import Code, code_of
from fbvm.engine.native_context import Context
from fbvm.engine.native_entries import Entry, entry, scans
from fbvm.engine.native_writer import Unsupported
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

    def run(self, task_index: int) -> Trap | None:
        """Execute the programs of a task in their order, until the end or a trap."""
        point = self._calls[task_index]()
        return self._trap(point) if point else None

    def run_n(self, task_index: int, n: int, step_ns: int) -> tuple[int, Trap | None]:
        """Execute a task up to n times while nobody needs to be told; returns how often, and the trap that ended it.

        Before each time the scan's time advances by `step_ns`, nothing is due, and the budget is what it is now; after
        each time the number of scans is one more."""
        done = ctypes.c_int64()
        point = scans()(self._code.address(task_index, self.level), self._memory_at, self._context.at, n, step_ns,
                        ctypes.addressof(done))
        return done.value, self._trap(point) if point else None

    def _trap(self, number: int) -> Trap:
        """What the point says, with the values that the context holds."""
        code, site, shown = self._code.points[number - 1]
        if code == STOPPED:
            return PAUSE
        return trap(self.image, code, site, tuple(self._context.values(shown)))
