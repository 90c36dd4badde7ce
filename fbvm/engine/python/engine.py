"""The Python engine, the reference: an Image becomes Python source over the flat memory, compiled by the host.

It runs everywhere, and its observed build can stop at every statement, read and write.  It decides nothing: every
meaning is in the table of operations."""

from __future__ import annotations

import linecache
import sys
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from types import CodeType
from typing import Any
from weakref import finalize

from fbvm.base.memory import WHOLE_BYTES, Memory
from fbvm.code.image import Body, Image, ProgramRun
from fbvm.engine.bases import fixed_bases
from fbvm.engine.depths import with_recursion_room
from fbvm.engine.python.runtime import NO_SITE, Observation, environment
from fbvm.engine.python.statements import BodyWriter, function_name
from fbvm.engine.trap import NO_INSTANCE, Stop, Trap, trap

_NUMBERS = count(1)
FRAMES_TO_SPARE = 400
"""Python frames that callers of an engine, and its own functions, may need besides those of the program."""
FRAMES_A_LEVEL = 5
"""Python frames that writing code takes for each level of tuples."""


@dataclass(frozen=True, eq=False)
class Program:
    """The Python code of an image, which any number of memories can share."""

    source: str
    code: CodeType
    constants: dict[str, Any] = field(repr=False)
    bases: dict[int, int]
    """Where the bodies run that were written for one instance."""
    frames: int
    """Python frames that a run takes at most: every body once (there is no recursion), and every part outlined."""


_programs: dict[tuple[int, bool, bool], Program] = {}
"""What has been made of the images that there are, which one test after the other may want."""


def translate(image: Image, observed: bool = False, anywhere: bool = False) -> Program:
    """The code of an image; the same object as long as there is the image.

    Bodies that have one instance are written for it, unless they shall run `anywhere`."""
    key = id(image), observed, anywhere
    known = _programs.get(key)
    if known is not None:
        return known
    name = f"<fbvm {'observed' if observed else 'plain'} {next(_NUMBERS)}>"
    program = with_recursion_room(image, FRAMES_A_LEVEL, partial(_written, image, observed, anywhere, name))
    source = program.source
    linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
    _programs[key] = program
    finalize(image, _forget, key, name)
    return program


def _forget(key: tuple[int, bool, bool], name: str) -> None:
    del _programs[key]
    linecache.cache.pop(name, None)


def _written(image: Image, observed: bool, anywhere: bool, name: str) -> Program:
    bases = {} if anywhere else fixed_bases(image)
    constants: dict[str, Any] = {}
    lines: list[str] = []
    frames = 0
    for number in range(len(image.bodies)):
        writer = BodyWriter(image, constants, observed, bases.get(number))
        lines += [*writer.write(number), ""]
        frames += 1 + len(writer.routines)
    source = "\n".join(lines)
    return Program(source, compile(source, name, "exec"), constants, bases, frames)


class PythonEngine:
    """Runs an image over a memory.

    The caller sets time and budget in the system page before a run.  `source` is the Python text that runs, which
    tracebacks show.  A program's mistakes come back as a Trap; memory is then what was stored before it."""

    machine = None
    """It runs no machine code."""

    def __init__(self, image: Image, memory: Memory, observed: bool = False) -> None:
        if memory.size < image.layout.size:
            raise ValueError(f"the image needs {image.layout.size} bytes of memory, here are {memory.size}")
        self.image, self.memory, self.observed = image, memory, observed
        self.substitutes: dict[int, Callable[[int], None]] = {}
        self._numbers = {function_name(number, body): number for number, body in enumerate(image.bodies)}
        self._program = translate(image, observed)
        self._bodies = self._bind(self._program)
        self._tasks = [[(self._bodies[run.body], run.offset) for run in task.programs] for task in image.tasks]

    def _bind(self, program: Program) -> list[Callable[[int], Any]]:
        """The bodies of a program over this memory."""
        names = environment(self.memory, self.image.objects) | program.constants
        exec(program.code, names)
        for number, function in self.substitutes.items():
            body = self.image.bodies[number]
            names[function_name(number, body)] = _reporting(function, body) if self.observed else function
        sys.setrecursionlimit(max(sys.getrecursionlimit(), program.frames + FRAMES_TO_SPARE))
        return [names[function_name(number, body)] for number, body in enumerate(self.image.bodies)]

    def substitute(self, body: int, function: Callable[[int], None]) -> None:
        """Python in place of a body, for tests: `function` is called with the byte offset of the instance.

        An observed run sees it as one write of the whole instance."""
        self.substitutes[body] = function
        self._bodies = self._bind(self._program)
        self._tasks = [[(self._bodies[run.body], run.offset) for run in task.programs] for task in self.image.tasks]

    @property
    def source(self) -> str:
        """The generated Python."""
        return self._program.source

    def run(self, task_index: int) -> Trap | None:
        """Execute the programs of a task in their order, until the end or a trap.

        An observed build runs to the end as well, with nobody looking."""
        return self._run(self._tasks[task_index])

    def call(self, body: int, base: int = 0) -> Trap | None:
        """Execute one body for the instance at `base`, as `run` does."""
        bodies = self._bodies
        if self._program.bases.get(body, base) != base:
            bodies = self._bind(translate(self.image, self.observed, anywhere=True))
        return self._run([(bodies[body], base)])

    def _run(self, calls: list[tuple[Callable[[int], Any], int]]) -> Trap | None:
        try:
            for body, base in calls:
                steps = body(base)
                if steps is not None:
                    deque(steps, 0)
        except Stop as stop:
            return trap(self.image, stop.code, stop.site, stop.values, self._instance_of(stop))
        return None

    def _instance_of(self, stop: Stop) -> int:
        """Where the instance begins whose body was stopped: the innermost body among the frames of the host."""
        found, at = NO_INSTANCE, stop.__traceback__
        while at is not None:
            number = self._numbers.get(at.tb_frame.f_code.co_name)
            if number is not None:
                found = NO_INSTANCE if self.image.bodies[number].kind == "FUNCTION" else at.tb_frame.f_locals["b1"]
            at = at.tb_next
        return found

    def observe(self, task_index: int) -> Generator[Observation, None, Trap | None]:
        """Execute a task step by step: yields every observation, returns like `run`.

        Raises ValueError for a plain build, which has none."""
        if not self.observed:
            raise ValueError("a plain build has no observations")
        return self._steps(self.image.tasks[task_index].programs)

    def _steps(self, programs: tuple[ProgramRun, ...]) -> Generator[Observation, None, Trap | None]:
        try:
            for run in programs:
                yield Observation("call", NO_SITE, (run.body, run.offset))
                yield from self._bodies[run.body](run.offset)
                yield Observation("return", NO_SITE, (run.body, run.offset))
        except Stop as stop:
            return trap(self.image, stop.code, stop.site, stop.values, self._instance_of(stop))
        return None



def _reporting(function: Callable[[int], None], body: Body) -> Callable[[int], Generator[Observation, None, None]]:
    """A substitute as an observed body."""

    def steps(base: int) -> Generator[Observation, None, None]:
        function(base)
        yield Observation("write", NO_SITE, (("", body.instance_size), base, WHOLE_BYTES))

    return steps
