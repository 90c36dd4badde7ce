"""The Python engine, the reference: translates an Image into Python source over the flat memory and runs that.

It needs nothing but Python, and tells every statement, read and write to whoever wants that.  It decides no meaning: that is in
the table of operations (`fbvm.code.operations`)."""

from __future__ import annotations

import linecache
import marshal
from collections.abc import Callable, Generator, Iterator, Mapping, Set
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from itertools import count
from types import CodeType
from typing import Any, NamedTuple
from weakref import finalize

from fbvm.base.areas import BUDGET, MOST_FRAMES
from fbvm.base.memory import Memory
from fbvm.code.image import Image, ProgramRun
from fbvm.code.operations import RAISED, Address, caught
from fbvm.code.recursion import keep_room
from fbvm.engine.allowance import WHOLE_BUDGET, Allowance
from fbvm.engine.apart import run_apart
from fbvm.engine.bases import base_ranges, recursive_bodies
from fbvm.engine.depths import with_recursion_room
from fbvm.engine.effects import Effects
from fbvm.engine.inlining import Inlining
from fbvm.engine.observation import NO_SITE, Observation
from fbvm.engine.powered import UNMARKED
from fbvm.engine.python.bodies import BEGIN, END, function_name
from fbvm.engine.python.logged import ENDLESS, MOST_ENTRIES, Full, Log, LoggedWriter, Row
from fbvm.engine.python.runtime import OwnViews, environment
from fbvm.engine.python.statements import PlainWriter
from fbvm.engine.python.stepped import SteppedWriter, reporting
from fbvm.engine.ranges import Range
from fbvm.engine.trap import NO_INSTANCE, Stop, Trap, trap

_NUMBERS = count(1)
FRAMES_TO_SPARE = 400
"""Python frames that the callers of an engine, and its own functions, may need besides those of the program."""
PART_CHARACTERS, LONGEST_HERE = 1 << 18, 1 << 20
"""The length of text that Python's compiler gets at a time, and of text that it gets in this process: half a second of work."""
FRAMES_A_LEVEL = 5
"""Python frames that translating takes at most for each level of nested code."""


class Build(Enum):
    """What code says of itself while it runs: nothing; each observation, at which it waits; a log, out of which observations are
    made afterwards."""

    PLAIN = "plain"
    STEPPED = "stepped"
    LOGGED = "logged"


class Inlined(NamedTuple):
    """Lines of a part in which the code of a body stands in place of its call, with the operands of that."""

    part: str
    first: int
    last: int
    body: int
    address: Address | None


@dataclass(frozen=True, eq=False)
class Program:
    """The Python code of an image, which engines over any number of memories share."""

    build: Build
    source: str
    parts: tuple[CodeType, ...]
    constants: dict[str, Any] = field(repr=False)
    bases: dict[int, Range]
    """The lowest and the highest byte at which the instances begin that a body was written for, by the body's number; none for
    one that was written for any."""
    own: dict[int, tuple[str, ...]]
    """The types of the views that a body has of its instance, by the body's number."""
    frames: int
    """Python frames that a run takes at most: every body once, and every part outlined; all that the stack of frames holds of
    bodies that may be called again while they run."""
    inlined: tuple[Inlined, ...]
    """Where the code of bodies stands in place of calls, what is inside others behind these."""
    table: tuple[Row, ...]
    """What the numbers in the log mean; empty for other builds."""


_programs: dict[tuple[int, Build, bool, bool], Program] = {}
"""The programs of images that are still in use, by image, build, `anywhere` and `strangers`."""


def translate(image: Image, build: Build = Build.PLAIN, anywhere: bool = False, strangers: bool = False) -> Program:
    """The Python code of an image; the same object as long as the image is in use.

    Bodies are written for the instances that there are, unless `anywhere` is True.  With `strangers` Python functions may take
    the place of bodies, and store anywhere."""
    key = id(image), build, anywhere, strangers
    known = _programs.get(key)
    if known is not None:
        return known
    name = f"fbvm {build.value} {next(_NUMBERS)}"
    program = with_recursion_room(image, FRAMES_A_LEVEL, partial(_written, image, build, anywhere, strangers, name))
    _programs[key] = program
    finalize(image, _forget, key)
    return program


def _forget(key: tuple[int, Build, bool, bool]) -> None:
    for part in _programs.pop(key).parts:
        linecache.cache.pop(part.co_filename, None)


def _written(image: Image, build: Build, anywhere: bool, strangers: bool, name: str) -> Program:
    bases = {} if anywhere else base_ranges(image)
    own: dict[int, tuple[str, ...]] = {}
    constants: dict[str, Any] = {}
    table: list[Row] = []
    texts: list[str] = []
    lines: list[str] = []
    recursive = recursive_bodies(image)
    effects = Effects(image, bases, range(len(image.bodies)) if strangers else recursive)
    inlining = Inlining(image, recursive) if build is Build.PLAIN and not strangers else None
    inlined: list[Inlined] = []
    frames = most = size = 0
    for number in range(len(image.bodies)):
        writer = LoggedWriter(image, constants, effects, table) if build is Build.LOGGED else \
            SteppedWriter(image, constants, effects) if build is Build.STEPPED else \
            PlainWriter(image, constants, effects, inlining)  # fmt: skip
        body = [*writer.write(number), ""]
        if writer.inlined:
            inlined += _inlined(writer.inlined, body, _part_name(name, len(texts)), 1 + len(lines))
        lines += body
        own[number] = tuple(sorted(writer.own))
        frames += 1 + len(writer.routines)
        most = max(most, 1 + len(writer.routines)) if number in recursive else most
        size += sum(map(len, body))
        if size > PART_CHARACTERS:
            texts.append("\n".join(lines))
            lines, size = [], 0
    texts.append("\n".join(lines))
    parts = tuple(_compiled(text, _part_name(name, number)) for number, text in enumerate(texts))
    source = "\n".join(texts)
    return Program(build, source, parts, constants, bases, own, frames + MOST_FRAMES * most, tuple(inlined), tuple(table))


def _part_name(name: str, number: int) -> str:
    return f"<{name} {number}>" if number else f"<{name}>"


def _inlined(calls: list[tuple[int, Address | None]], lines: list[str], part: str, first: int) -> Iterator[Inlined]:
    """Where the code of bodies stands in the lines of a function, the first of which has that number."""
    around: list[tuple[int, int]] = []
    found: dict[int, Inlined] = {}
    for number, line in enumerate(lines, first):
        mark = line.lstrip()
        if mark.startswith(BEGIN):
            around.append((int(mark[len(BEGIN):].partition(":")[0]), number))
        elif mark.startswith(END):
            call, begin = around.pop()
            found[call] = Inlined(part, begin, number, *calls[call])
    return (found[call] for call in sorted(found))


def _compiled(text: str, name: str) -> CodeType:
    """The code of a part, whose lines tracebacks find; a long one is compiled in another process, since nothing breaks off
    Python's compiler."""
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    made = None
    if len(text) > LONGEST_HERE:
        made = run_apart(f"import marshal, sys\ntext = sys.stdin.buffer.read().decode()\n"
                         f"sys.stdout.buffer.write(marshal.dumps(compile(text, {name!r}, 'exec')))", text.encode(), ["-I", "-S"])
    code: CodeType = marshal.loads(made) if made else compile(text, name, "exec")
    return code


class PythonEngine:
    """Runs an image over a memory.

    The caller writes time and step budget into the system page before a run.  `source` is the Python text that runs, which
    tracebacks show.  A program's mistake comes back as a Trap; the memory then has what was stored before it.  Raises
    ValueError for a memory that is too small."""

    machine = None
    """The machine code that runs now: never any."""

    def __init__(self, image: Image, memory: Memory, observed: bool = False) -> None:
        if memory.size < image.layout.size:
            raise ValueError(f"the image needs {image.layout.size} bytes of memory, here are {memory.size}")
        self.image, self.memory, self.observed = image, memory, observed
        self._system = memory.views["i64"]
        self.counted = [0] * image.counters
        self.marks = bytearray(UNMARKED * image.marks)
        """The notes of power of an image that has them."""
        self.substitutes: dict[int, Callable[[int], None]] = {}
        self._numbers = {function_name(number, body): number for number, body in enumerate(image.bodies)}
        self._parts = frozenset(number for number, body in enumerate(image.bodies) if body.is_part)
        self._allowance = WHOLE_BUDGET
        self._spaces: list[dict[str, Any]] = []
        """The names of generated code, of each build that is bound."""
        self._program = translate(image, Build.LOGGED if observed else Build.PLAIN)
        self._log = Log(memory, self._program.table) if observed else None
        self._bodies = self._bind(self._program)
        self._standing: list[Callable[[int], Any]] | None = None
        """The bodies of the build that stands still, made for the first who steps."""
        self._tasks = [[(self._bodies[run.body], run.offset) for run in task.programs] for task in image.tasks]

    def _bind(self, program: Program) -> list[Callable[[int], Any]]:
        """The bodies of a program over this memory."""
        log = self._log if program.build is Build.LOGGED else None
        names = environment(self.memory, self.image.objects) | program.constants | (log.names if log else {})
        names["counts"], names["marks"] = self.counted, self.marks
        names["caught"] = partial(_caught, self._numbers, self._parts, self._system)
        for number, machines in program.own.items():
            if machines:
                names[f"own{number}"] = OwnViews(self.memory, machines)
        for part in program.parts:
            exec(part, names)
        self._spaces.append(names)
        self.allowance = self._allowance
        for number, function in self.substitutes.items():
            body = self.image.bodies[number]
            names[function_name(number, body)] = log.reporting(function, body) if log else \
                reporting(function, body) if program.build is Build.STEPPED else _counting(function, self._system)  # fmt: skip
        keep_room(program.frames + FRAMES_TO_SPARE)
        return [names[function_name(number, body)] for number, body in enumerate(self.image.bodies)]

    def substitute(self, body: int, function: Callable[[int], None]) -> None:
        """Runs a Python function in place of the body of that number, for tests.

        `function` is called with the byte of the memory at which the instance begins.  An observed run sees one write of the
        whole instance."""
        self.substitutes[body] = function
        self._spaces.clear()
        self._program = translate(self.image, self._program.build, strangers=not self.observed)
        self._bodies, self._standing = self._bind(self._program), None
        self._tasks = [[(self._bodies[run.body], run.offset) for run in task.programs] for task in self.image.tasks]

    @property
    def counts(self) -> list[int]:
        """How often each counter of the image was reached."""
        return list(self.counted)

    @property
    def source(self) -> str:
        """The generated Python."""
        return self._program.source

    @property
    def allowance(self) -> Allowance:
        """How much of the step budget runs may use up."""
        return self._allowance

    @allowance.setter
    def allowance(self, allowance: Allowance) -> None:
        self._allowance = allowance
        for names in self._spaces:
            names["least"], names["ask"] = allowance.least, partial(_ask, names, allowance)

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of a task in their order, and tells nobody.  Returns the trap that ended them, if any."""
        return self._run(self._tasks[task_index])

    def call(self, body: int, base: int = 0) -> Trap | None:
        """Executes one body for the instance that begins at byte `base`.  Returns the trap that ended it, if any."""
        program = self._program
        low, high = program.bases.get(body, (base, base))
        if low <= base <= high:
            return self._run([(self._bodies[body], base)])
        try:
            anywhere = translate(self.image, program.build, True, bool(self.substitutes) and not self.observed)
            return self._run([(self._bind(anywhere)[body], base)])
        finally:
            self._spaces.pop()

    def _run(self, calls: list[tuple[Callable[..., Any], int]]) -> Trap | None:
        left = self._system[BUDGET // 8]
        try:
            for body, base in calls:
                if self._log:
                    body(base)
                else:
                    left = body(base, left)
        except Stop as stop:
            instance, known = self._stopped(stop)
            if known is not None:
                self._system[BUDGET // 8] = known
            return trap(self.image, stop.code, stop.site, stop.values, instance, self.memory)
        finally:
            if self._log:
                self._log.entries.clear()
        if not self._log:
            self._system[BUDGET // 8] = left
        return None

    def _stopped(self, stop: Stop) -> tuple[int, int | None]:
        """Where the instance begins whose body was stopped, that of the innermost body among the Python frames, and how many
        steps were left then, None if the memory says that."""
        found, base, left, at = NO_INSTANCE, 0, None, stop.__traceback__
        while at is not None:
            number = self._numbers.get(at.tb_frame.f_code.co_name)
            if number is not None:
                names = at.tb_frame.f_locals
                base, left = names["b1"], names.get("n")
                found = self._instance(number, base)
            for code in self._program.inlined:
                if code.part == at.tb_frame.f_code.co_filename and code.first <= at.tb_lineno <= code.last:
                    start, offset, _ = code.address or ("abs", 0, ())
                    found = self._instance(code.body, base + offset if start == "self" else offset)
            at = at.tb_next
        return found, left

    def _instance(self, body: int, base: int) -> int:
        return NO_INSTANCE if self.image.bodies[body].kind == "FUNCTION" else base

    def observe(self, task_index: int) -> Generator[Observation, None, Trap | None]:
        """Executes a task step by step: a generator of observations, which returns what `run` returns.

        The run stands still at each observation, where the memory may be changed.  Raises ValueError for a plain build, which
        has no observations."""
        if self._log is None:
            raise ValueError("a plain build has no observations")
        if self._standing is None:
            self._standing = self._bind(translate(self.image, Build.STEPPED))
        return self._steps(self.image.tasks[task_index].programs, self._standing)

    def observations(self, task_index: int, most: int | None = None) -> Generator[Observation, None, Trap | None]:
        """Executes a task, and tells its observations afterwards: the generator yields and returns what that of `observe` does.

        At each of them the memory is as it was at that moment, but for the system page; whoever changes it changes nothing in
        the run.  Faster than `observe`.  With `most` a loop that has made so many entries of the log, one to three
        an observation, goes on untold, and "cut" is the last observation; not so where Python functions take the place of
        bodies.  An exception of such a function comes after the observations before.  Raises ValueError for a plain build."""
        if self._log is None:
            raise ValueError("a plain build has no observations")
        return self._told(self._log, task_index, most)

    def _told(self, log: Log, task_index: int, most: int | None) -> Generator[Observation, None, Trap | None]:
        found: Trap | None = None
        failure: Exception | None = None
        programs, memory = self.image.tasks[task_index].programs, self.memory.u8
        before, counted = bytes(memory), list(self.counted)
        log.most = ENDLESS if self.substitutes else most or MOST_ENTRIES
        self._spaces[0]["longest"] = min(log.most, MOST_ENTRIES)
        try:
            for run in programs:
                log.begin(run.body, run.offset)
                self._bodies[run.body](run.offset)
                log.end()
        except Full:
            memory[:] = before
            if most is None:
                return (yield from self.observe(task_index))
            self.counted[:] = counted
            return (yield from self._told_in_part(log, task_index))
        except Stop as stop:
            found = trap(self.image, stop.code, stop.site, stop.values, self._stopped(stop)[0], self.memory)
        except Exception as error:
            failure = error
        finally:
            log.most = 0
            self._spaces[0]["longest"] = MOST_ENTRIES
        after = bytes(memory)
        memory[:] = before
        try:
            yield from log.observations()
        finally:
            log.entries.clear()
        memory[:] = after
        if failure:
            raise failure
        return found

    def _told_in_part(self, log: Log, task_index: int) -> Generator[Observation, None, Trap | None]:
        """Does a task again whose log has become too long, tells what is in the log, and that there was more."""
        entries, memory = log.entries[:], self.memory.u8
        before = bytes(memory)
        log.most = 0
        log.entries.clear()
        self._spaces[0]["longest"] = MOST_ENTRIES
        found = self.run(task_index)
        after = bytes(memory)
        memory[:] = before
        log.entries[:] = entries
        try:
            yield from log.observations()
        finally:
            log.entries.clear()
        yield Observation("cut", NO_SITE, None)
        memory[:] = after
        return found

    def _steps(self, programs: tuple[ProgramRun, ...],
               bodies: list[Callable[[int], Any]]) -> Generator[Observation, None, Trap | None]:  # fmt: skip
        try:
            for run in programs:
                yield Observation("call", NO_SITE, (run.body, run.offset))
                yield from bodies[run.body](run.offset)
                yield Observation("return", NO_SITE, (run.body, run.offset))
        except Stop as stop:
            return trap(self.image, stop.code, stop.site, stop.values, self._stopped(stop)[0], self.memory)
        return None


def _caught(numbers: Mapping[str, int], parts: Set[int], system: memoryview, stop: Stop,
            traps: bool) -> tuple[int, int, list[tuple[int, int]]]:  # fmt: skip
    """Called by generated code with what has stopped the body of an attempt: what it gives; how many steps are left;
    and the bodies that have ended with it, as number and instance, the innermost first, without parts of others.

    Raises what it does not catch.  `numbers` are those of the bodies by the names of their functions, `parts` those of bodies
    that are parts of others."""
    number = caught(stop.code, traps)
    if not number:
        raise stop
    if number == RAISED:
        number, = stop.values
    ended: dict[int, tuple[int, int]] = {}
    left, at = None, stop.__traceback__ and stop.__traceback__.tb_next
    while at is not None:
        names, body = at.tb_frame.f_locals, numbers.get(at.tb_frame.f_code.co_name)
        if body is not None:
            left = names.get("n")
            if body not in parts:
                ended[id(at.tb_frame)] = body, names["b1"]
        at = at.tb_next
    return number, system[BUDGET // 8] if left is None else left, [*ended.values()][::-1]


def _counting(function: Callable[[int], None], system: memoryview) -> Callable[[int, int], int]:
    """A Python function in place of a body of the plain build, which finds the steps that are left in the memory."""

    def counted(base: int, left: int) -> int:
        system[BUDGET // 8] = left
        function(base)
        return system[BUDGET // 8]

    return counted


def _ask(names: dict[str, Any], allowance: Allowance, left: int, site: int) -> None:
    """Called by generated code with fewer steps left than `least`: ends the run, or allows more."""
    if allowance.ask is not None:
        names["least"] = least = allowance.ask(left)
        if left >= least:
            return
    raise Stop("R0104", site)
