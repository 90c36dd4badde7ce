"""Chooses the engine of an image: Python at once, machine code when that pays and is ready.

A run begins in Python, which needs no compiling.  After enough statements the program is compiled in a helper process, and
a later scan runs as machine code.  The results are the same, because all state is in the memory.  A run that is observed
statement by statement stays in Python.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from fbvm.base.areas import BUDGET
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine.allowance import WHOLE_BUDGET, Allowance
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.powered import UNMARKED
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.trap import Trap

CHOICES = ("auto", "python", "native")
STATEMENTS_TO_PAY = 300_000
"""Statements after which machine code is asked for: about a tenth of a second in Python."""
LARGE_PROGRAM = 1000
"""Sites of a program that begins as quick machine code: to make that takes about as long as to make Python, its scans take a
hundredth of the time, and it is kept on disk for the next start."""


class Engine(Protocol):
    """What executes the tasks of an image on a memory."""

    @property
    def machine(self) -> NativeEngine | None:
        """The machine code that runs now; None if none does."""

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of one task once.  Returns the trap that ended them, if any.

        The caller has written time and step budget into the memory's system page."""

    allowance: Allowance
    """How much of the step budget runs may use up."""


def engine_for(image: Image, memory: Memory, choice: str = "auto", observed: bool = False) -> Engine:
    """A new engine for an image and its memory.

    `choice` is "python", "native" (machine code at once) or "auto" (Python, and machine code when that pays); `observed` asks for
    the build that reports each statement, which only Python has.

    Raises ValueError for another name, or for "native" where llvmlite is missing or observations are wanted."""
    if choice not in CHOICES:
        raise ValueError(f"there is no engine {choice!r}; engines are {', '.join(CHOICES)}")
    if choice == "native":
        if observed:
            raise ValueError("machine code tells nothing about statements: observe with the python engine")
        if not native.available():
            raise ValueError("the native engine needs the package llvmlite, which is not installed")
        return NativeEngine(image, memory)
    if choice == "python" or observed or not native.available():
        return PythonEngine(image, memory, observed=observed)
    return TieredEngine(image, memory)


def again_choice(image: Image, choice: str, substituted: bool) -> str:
    """The choice for executing again what ran on the engine of a `choice`: machine code if that is loaded, since a replay is over
    before it would pay to make some.  With `substituted` bodies Python."""
    if substituted or choice == "python":
        return "python"
    return "native" if code_of(image).ready else choice


def choice_of(engine: object) -> str:
    """The choice by which `engine_for` makes such an engine.  Raises ValueError for what it does not make."""
    for choice, kind in (("auto", TieredEngine), ("python", PythonEngine), ("native", NativeEngine)):
        if isinstance(engine, kind):
            return choice
    raise ValueError("somebody looks into every scan already: a run with breakpoints is another one")


def substitutes_of(engine: object) -> Mapping[int, Callable[[int], None]]:
    """The Python functions that run in place of bodies (`PythonEngine.substitute`), by the numbers of the bodies."""
    return engine.substitutes if isinstance(engine, PythonEngine | TieredEngine) else {}


def counts_of(engine: object) -> list[int]:
    """How often each counter of the engine's image was reached; [] for an engine that somebody looks into."""
    return list(engine.counts) if isinstance(engine, PythonEngine | TieredEngine | NativeEngine) else []


def add_counts(engine: object, counts: Sequence[int]) -> None:
    """Adds to the counters of an engine what another engine has counted in its place."""
    while isinstance(engine, TieredEngine):
        engine = engine.first
    if isinstance(engine, PythonEngine | NativeEngine):
        for number, count in enumerate(counts):
            engine.counted[number] += count


def marks_of(engine: object) -> bytes:
    """The notes of power of an engine whose image has them: of those tiers that have been running the last one counts."""
    tiers = engine.tiers if isinstance(engine, TieredEngine) else [engine]
    found = b""
    for tier in tiers:
        if isinstance(tier, PythonEngine | NativeEngine):
            found = bytes(old if new == UNMARKED[0] else new for old, new in zip(found or tier.marks, tier.marks, strict=True))
    return found


def forget_marks(engine: object) -> None:
    """Forgets all notes of power."""
    for tier in engine.tiers if isinstance(engine, TieredEngine) else [engine]:
        if isinstance(tier, PythonEngine | NativeEngine):
            tier.marks[:] = UNMARKED * len(tier.marks)


def image_of(engine: object, plain: Image) -> Image:
    """The image that an engine runs, which may be one with counters; `plain` for an engine that has none."""
    return engine.image if isinstance(engine, PythonEngine | NativeEngine | TieredEngine) else plain


def python_of(engine: object) -> PythonEngine:
    """The Python engine inside an engine.  As soon as it has substitutes, the run stays in Python.

    Raises ValueError for an engine that is machine code only."""
    if isinstance(engine, TieredEngine):
        return engine.python
    if not isinstance(engine, PythonEngine):
        raise ValueError("Python in place of a block needs the Python engine")
    return engine


class TieredEngine:
    """An engine that begins in Python and goes over to fast machine code; a large program begins as quick machine code."""

    def __init__(self, image: Image, memory: Memory) -> None:
        self.image, self._memory = image, memory
        self._python: PythonEngine | None = None
        self._code = code_of(image)
        self._budget = memory.views["i64"]
        self._done = 0
        self._asked = False
        self._allowance = WHOLE_BUDGET
        self._fast: NativeEngine | None = None
        self.first = NativeEngine(image, memory, level=0) if len(image.sites) >= LARGE_PROGRAM else self.python
        self._engine: Engine = self.first

    @property
    def python(self) -> PythonEngine:
        """The Python engine, made when first needed: a large program may never need it."""
        if self._python is None:
            self._python = PythonEngine(self.image, self._memory)
            self._python.allowance = self._allowance
        return self._python

    @property
    def substitutes(self) -> Mapping[int, Callable[[int], None]]:
        """The Python functions that run in place of bodies; with any the run stays in Python."""
        return self._python.substitutes if self._python else {}

    @property
    def machine(self) -> NativeEngine | None:
        """Fast machine code, once it runs and as long as nothing stands in place of bodies."""
        return None if self._python and self._python.substitutes else self._fast

    @property
    def counts(self) -> list[int]:
        """How often each counter of the image was reached, on all tiers together."""
        return [sum(counts) for counts in zip(*(engine.counts for engine in self.tiers), strict=True)]

    @property
    def tiers(self) -> list[PythonEngine | NativeEngine]:
        """The engines that have run, the one that runs now at the end."""
        now = self._fast or self._engine
        found = {id(engine): engine for engine in (self._python, self.first, self._fast) if engine}
        return sorted(found.values(), key=lambda engine: engine is now)

    @property
    def native(self) -> bool:
        """True once fast machine code runs."""
        return self._fast is not None

    @property
    def allowance(self) -> Allowance:
        """How much of the step budget runs may use up."""
        return self._allowance

    @allowance.setter
    def allowance(self, allowance: Allowance) -> None:
        self._allowance = allowance
        for engine in (self._engine, self._fast, self._python):
            if engine is not None:
                engine.allowance = allowance

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of one task once, on the engine of the present tier."""
        if self.substitutes:
            self._engine, self._fast = self.python, None
        if self._fast:
            return self._fast.run(task_index)
        if self._asked:
            self._change()
        before = self._budget[BUDGET // 8]
        trap = self._engine.run(task_index)
        self._done += before - self._budget[BUDGET // 8]
        if self._done >= STATEMENTS_TO_PAY and not self._asked:
            self._asked = True
            self._code.request()
        return trap

    def _change(self) -> None:
        """Goes over to fast machine code if that is ready."""
        if self._code.ready and not self.substitutes:
            self._engine = self._fast = NativeEngine(self.image, self._memory, level=2)
            self._fast.allowance = self._allowance
