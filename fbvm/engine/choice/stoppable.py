"""Runs that stop inside a scan: before a line, at a change of watched bytes, where a condition becomes TRUE.

Machine code looks into the table of `stops`.  A hit ends its run: the memory goes back to what it was at the start, and the
observed Python build does the run again up to the same observation.  There it stands until `go_on`."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import NamedTuple

from fbvm.base.areas import BUDGET
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine.allowance import Allowance
from fbvm.engine.choice.tiers import STATEMENTS_TO_PAY
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.engine.native.scans.code import ClockWordTable
from fbvm.engine.native.scans.scans import ScheduledTask
from fbvm.engine.observation import NO_SITE, Observation
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.stops import STOPPED, State, StopTable
from fbvm.engine.trap import Trap

STATEMENTS = ("statement", "rung")


class Call(NamedTuple):
    """A body in execution."""

    body: int
    """Its number."""
    base: int
    """Byte of the memory at which its instance begins."""
    site: int
    """Number of the site of the statement that called it; NO_SITE for a program."""


class StoppableEngine:
    """An engine whose runs stop where `stops` says.  `seen` is the observation at which a run stands, None if none does.

    `choice` is that of `tiers.engine_for`; `substitutes` are Python functions in place of bodies, by their numbers, with
    which everything runs in Python."""

    def __init__(self, image: Image, memory: Memory, stops: StopTable, choice: str,
                 substitutes: Mapping[int, Callable[[int], None]]) -> None:  # fmt: skip
        self._image, self._memory, self._stops = image, memory, stops
        self._python = PythonEngine(image, memory, observed=True)
        for body, function in substitutes.items():
            self._python.substitute(body, function)
        compiles = choice != "python" and not substitutes and native.available()
        self._code = code_of(image, stops=True) if compiles else None
        self._native = native.NativeEngine(image, memory, stops=stops) if compiles and choice == "native" else None
        self._kept = (ctypes.c_char * memory.size)()
        self._place = (ctypes.c_char * memory.size).from_buffer(memory.map)
        self._executed = 0
        self._steps: Generator[Observation, None, Trap | None] | None = None
        self.seen: Observation | None = None
        self.calls: list[Call] = []
        """The bodies in execution where a run stands, the innermost last."""
        self._begun = self._generated = 0

    @property
    def statement(self) -> int:
        """How many statements and rungs the run had begun when it stopped, without those of calls that the compiler has added."""
        return self._begun - (self.seen is not None and self.seen[0] in STATEMENTS)

    @property
    def native(self) -> bool:
        """True if machine code runs."""
        return self._native is not None

    def allow(self, allowance: Allowance) -> None:
        """Sets how much of the step budget runs may use up."""
        self._python.allowance = allowance
        if self._native:
            self._native.allowance = allowance

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of a task up to their end, a trap, or a stop, after which `seen` is set.

        Returns the trap that ended them, if any.  Raises what the test of a breakpoint raises."""
        if self._native is None and self._code and self._code.ready:
            self._native = native.NativeEngine(self._image, self._memory, 2, self._stops)
            self._native.allowance = self._python.allowance
        if self._native is None:
            return self._observe(task_index)
        self.seen = None  # of a run that was given up where it stood
        seen = self._keep()
        trap = self._native.run(task_index)
        if not self._undone(trap, seen):
            return trap
        return self._observe(task_index)

    def run_many(self, tasks: Sequence[ScheduledTask], n: int, step_ns: int, clock_words: ClockWordTable, *,
                 spend: int) -> tuple[int, Trap | None]:  # fmt: skip
        """Does `NativeEngine.run_many` up to the scan before the one that would stop; the caller does that one by `run`."""
        if self._native is None:
            return 0, None
        seen, times = self._keep(), [task.next_ns for task in tasks]
        done, trap = self._native.run_many(tasks, n, step_ns, clock_words, spend=spend)
        if not self._undone(trap, seen):
            return done, trap
        for task, next_ns in zip(tasks, times, strict=True):
            task.next_ns = next_ns
        return self._native.run_many(tasks, done - 1, step_ns, clock_words, spend=spend)

    def _keep(self) -> State:
        """Keeps a copy of the memory.  Returns what watchpoints saw at their last look."""
        ctypes.memmove(self._kept, self._place, len(self._kept))
        return self._stops.state

    def _undone(self, trap: Trap | None, seen: State) -> bool:
        """If machine code stopped at a breakpoint: brings back memory and watchpoints, and returns True.

        Raises what a test has raised."""
        if trap is None or trap.code != STOPPED:
            return False
        failure, self._stops.failure = self._stops.failure, None
        ctypes.memmove(self._place, self._kept, len(self._kept))
        self._stops.back(seen)
        if failure:
            raise failure
        return True

    def _observe(self, task_index: int) -> Trap | None:
        """Does what `run` does on the observed Python build."""
        before = int(self._memory.read(BUDGET, "i64"))
        self._steps, self.calls = self._python.observe(task_index), []
        self._begun = self._generated = 0
        trap = self.go_on()
        self._executed += before - int(self._memory.read(BUDGET, "i64"))
        if self._code and self._executed >= STATEMENTS_TO_PAY:
            self._code.request()
        return trap

    def go_on(self) -> Trap | None:
        """Goes on from where the run stands, up to its end, a trap or the next stop.  Returns the trap, if any."""
        assert self._steps is not None
        self.seen = None
        while True:
            try:
                seen = next(self._steps)
            except StopIteration as end:
                self._steps = None
                trap: Trap | None = end.value
                return trap
            if self._hit(seen):
                self.seen = seen
                return None

    def _hit(self, seen: Observation) -> bool:
        """Keeps `calls` up to date.  Returns True if the run stops at this observation."""
        kind, site, detail = seen
        if kind == "call":
            body, base = detail
            self._generated += bool(self._generated) or bool(self.calls) and site == NO_SITE
            self.calls.append(Call(body, base, site))
        elif kind == "return":
            if site == NO_SITE and not self._generated and self._stops.hit(NO_SITE, False):
                return True  # before the program is taken off: the run stands at its end
            self._generated -= bool(self._generated)
            self.calls.pop()
        elif kind == "write":
            return self._stops.hit(site, False)
        elif kind in STATEMENTS:
            self._begun += not self._generated
            return self._stops.hit(site, True, self.calls[-1].base)
        return False
