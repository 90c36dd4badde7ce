"""Which engine runs an image: Python at once, machine code when it pays and is there.

A run begins in Python, which needs no compiling.  When a program has executed enough statements for machine code to be
worth while, it is compiled beside the run, and a later scan begins with it; nobody notices, because all state is in the
memory.  What is looked into statement by statement stays in Python.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from fbvm.base.areas import BUDGET
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.trap import Trap

CHOICES = ("auto", "python", "native")
STATEMENTS_TO_PAY = 300_000
"""Statements after which machine code is asked for: about a tenth of a second in Python."""
LARGE_PROGRAM = 1000
"""Places in the source of a program that takes about as long to be made into Python as into quick machine code, whose scans
take a hundredth of the time, and which is kept on disk for the next start."""


class Engine(Protocol):
    """What executes the tasks of an image on a memory."""

    @property
    def machine(self) -> NativeEngine | None:
        """The machine code that it runs now, if it does."""

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of one task once; time and budget are in the memory's system page."""


def engine_for(image: Image, memory: Memory, choice: str = "auto", observed: bool = False) -> Engine:
    """The engine of that name; "auto" begins in Python and goes on as machine code.

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


def choice_of(engine: object) -> str:
    """The choice by which `engine_for` makes such an engine.  Raises ValueError for what it does not make."""
    for choice, kind in (("auto", TieredEngine), ("python", PythonEngine), ("native", NativeEngine)):
        if isinstance(engine, kind):
            return choice
    raise ValueError("somebody looks into every scan already: a run with breakpoints is another one")


def substitutes_of(engine: object) -> Mapping[int, Callable[[int], None]]:
    """What stands in place of bodies, by their numbers."""
    return engine.substitutes if isinstance(engine, PythonEngine | TieredEngine) else {}


def python_of(engine: object) -> PythonEngine:
    """The Python engine of a run, which stays in Python from now on if it gets substitutes.

    Raises ValueError for a run that is all machine code."""
    if isinstance(engine, TieredEngine):
        return engine.python
    if not isinstance(engine, PythonEngine):
        raise ValueError("Python in place of a block needs the Python engine")
    return engine


class TieredEngine:
    """Python first, machine code later; a large program begins with machine code that is soon there."""

    def __init__(self, image: Image, memory: Memory) -> None:
        self._image, self._memory = image, memory
        self._python: PythonEngine | None = None
        self._code = code_of(image)
        self._budget = memory.views["i64"]
        self._done = 0
        self._asked = False
        self._fast: NativeEngine | None = None
        self._engine: Engine = NativeEngine(image, memory, level=0) if len(image.sites) >= LARGE_PROGRAM else self.python

    @property
    def python(self) -> PythonEngine:
        """The engine that takes Python in place of blocks, made when it is needed."""
        if self._python is None:
            self._python = PythonEngine(self._image, self._memory)
        return self._python

    @property
    def substitutes(self) -> Mapping[int, Callable[[int], None]]:
        """What stands in place of bodies; a run that has any stays in Python."""
        return self._python.substitutes if self._python else {}

    @property
    def machine(self) -> NativeEngine | None:
        """Fast machine code, once it runs and as long as nothing stands in place of bodies."""
        return None if self._python and self._python.substitutes else self._fast

    @property
    def native(self) -> bool:
        """True once fast machine code runs."""
        return self._fast is not None

    def run(self, task_index: int) -> Trap | None:
        """Execute the programs of a task once, in whatever tier the run is."""
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
        """Go over to machine code if it is there."""
        if self._code.ready and not self.substitutes:
            self._engine = self._fast = NativeEngine(self._image, self._memory, level=2)
