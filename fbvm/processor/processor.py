"""The processor of a unit that has one: runs the unit's program over a small memory of its own.

The program is one PROGRAM in ST and what it names in `fblib/`.  What units and machine exchange with it they find by the
names of its variables (`fbvm.processor.contract`).  Knows no unit, no network, no PLC."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW
from fbvm.base.diagnostics import Source
from fbvm.base.memory import STRUCTS, Memory
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.code.store import cache as image_cache
from fbvm.engine.native import engine as native
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.python.engine import PythonEngine
from fbvm.processor.contract import Contract

BUDGET_STATEMENTS = 2_000_000
"""Statements that one execution of the program may take; a program of ours takes far less."""
TASK = 0
"""The number of the program's only task."""


def processor(text: str, engine: str = "auto") -> OwnProcessor:
    """A processor with the program `text` (ST), before its first execution; a text is compiled once.

    `engine` is that of a PLC: "python" runs the program in Python, any other one as machine code if this host can make it.
    Raises ValueError for a text that does not compile, or that has not exactly one PROGRAM."""
    return _first(text, engine).another()


def prepare(text: str, engine: str = "auto") -> None:
    """Compiles the program `text` for an engine, unless that has been done.  Raises ValueError as `processor` does."""
    _first(text, engine)


@cache
def contract(text: str, libraries: tuple[Path, ...] = ()) -> Contract:
    """What the program `text` (ST) says of its variables and types, for those who run it elsewhere or not at all.
    `libraries` are folders of libraries beside `fblib/`.

    Raises ValueError as `processor` does."""
    return Contract(_compiled(text, libraries))


@cache
def _first(text: str, engine: str) -> OwnProcessor:
    """The first processor of a program on an engine: it is kept, and with it the code for all others."""
    return OwnProcessor(contract(text), engine)


def _compiled(text: str, libraries: tuple[Path, ...]) -> Image:
    sources = [Source("unit.st", text)]
    name = image_cache.name(sources, libraries, ())
    known = image_cache.read(name, sources)
    if known:
        return known[0]
    made = compile_sources(sources, libraries=libraries, lint=False)
    if made.image is None or len(made.image.tasks) != 1:
        raise ValueError("\n".join(found.render() for found in made.diagnostics) or "one PROGRAM is wanted")
    image_cache.write(name, sources, made.image, [])
    return made.image


class OwnProcessor:
    """A `fbvm.units.contract.Processor`: runs its program as machine code if this host can make any, else in Python.

    With `engine` "python" it runs in Python anyway."""

    def __init__(self, contract: Contract, engine: str = "auto") -> None:
        image = contract.image
        self.contract = contract
        self.memory = Memory(image.layout.size, image.layout.areas)
        for offset, data in image.initial:
            self.memory.u8[offset : offset + len(data)] = data
        self._system = self.memory.views["i64"]
        self._take(engine)

    def _take(self, engine: str) -> None:
        image = self.contract.image
        self.engine = engine
        self.machine = NativeEngine(image, self.memory) if engine != "python" and native.available() else None
        """What runs the program as machine code; None if Python does."""
        self._engine = self.machine or PythonEngine(image, self.memory)

    def view(self, variable: str) -> memoryview:
        """All values of a variable, writable, in the form that the program declares: an `ARRAY[0..3] OF WORD` as four numbers
        of 16 bits, a TIME as nanoseconds in 64 bits, structures as bytes.

        Raises UnknownPlace for a name that the program does not have."""
        place, form = self.contract.place(variable), self.contract.form(variable)
        size = STRUCTS[form].size
        return self.memory.views[form][place.offset // size : (place.offset + place.type.size) // size]

    def run(self, now_ns: int) -> None:
        """Executes the program once at `now_ns`, the PLC's time in nanoseconds.

        Raises RuntimeError if the program traps: that is a fault of this product, not of a user."""
        system = self._system
        system[NOW // 8], system[DUE // 8], system[BUDGET // 8] = now_ns, NEVER, BUDGET_STATEMENTS
        trap = self._engine.run(TASK)
        if trap:
            raise RuntimeError(str(trap))

    def another(self) -> OwnProcessor:
        """Another processor with the same program and a memory of its own, before its first execution."""
        return OwnProcessor(self.contract, self.engine)

    def run_on(self, engine: str) -> None:
        """Goes on with the program on this engine, in the same memory."""
        if engine != self.engine:
            self._take(engine)

    def copy(self) -> OwnProcessor:
        """Another processor with the same program, and a memory of its own with the same contents."""
        other = self.another()
        other.memory.restore(self.memory.snapshot())
        return other

    def __deepcopy__(self, memo: Mapping[int, Any]) -> OwnProcessor:
        return self.copy()
