"""The processor of a unit that has one: a program over a small memory of its own, whatever PLC the unit is in."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
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
from fbvm.watch.paths import Place, find_place

BUDGET_STATEMENTS = 2_000_000
"""Statements that one execution of the program may take; a program of ours takes far less."""
TASK = 0
"""The one task of its program."""


def processor(text: str, beside_bytes: int = 0) -> OwnProcessor:
    """A processor with a program of its own, before its first execution; the text is compiled once.

    Beside what the program uses, its memory has so many bytes (whole pages) for what others keep there.  Raises
    ValueError for a text that is not one PROGRAM and what it needs."""
    return _first(text, beside_bytes).another()


@cache
def _first(text: str, beside_bytes: int) -> OwnProcessor:
    """The one of a program that stays, and with it the code for all others."""
    return OwnProcessor(_compiled(text), beside_bytes, {})


def _compiled(text: str) -> Image:
    sources = [Source("unit.st", text)]
    name = image_cache.name(sources, [], ())
    known = image_cache.read(name, sources)
    if known:
        return known[0]
    made = compile_sources(sources, lint=False)
    if made.image is None or len(made.image.tasks) != 1:
        raise ValueError("\n".join(found.render() for found in made.diagnostics) or "one PROGRAM is wanted")
    image_cache.write(name, sources, made.image, [])
    return made.image


class OwnProcessor:
    """A `fbvm.units.contract.Processor`: machine code where that can be had, else Python."""

    def __init__(self, image: Image, beside_bytes: int, places: dict[str, Place]) -> None:
        self.image = image
        self._places = places
        """Where variables lie, as far as somebody has asked; the same for all with this image."""
        self.beside_at = image.layout.size
        self.memory = Memory(self.beside_at + beside_bytes, image.layout.areas)
        self.beside = self.memory.u8[self.beside_at :]
        for offset, data in image.initial:
            self.memory.u8[offset : offset + len(data)] = data
        self.machine = NativeEngine(image, self.memory) if native.available() else None
        """What runs it as machine code, if anything does."""
        self._engine = self.machine or PythonEngine(image, self.memory)
        self._system = self.memory.views["i64"]

    def _place(self, variable: str) -> Place:
        place = self._places.get(variable)
        if place is None:
            place = find_place(self.image.symbols, self.memory.areas, variable)
            if place.hops or place.bit is not None:
                raise ValueError(f"{variable} does not lie in bytes of its own")
            self._places[variable] = place
        return place

    def view(self, variable: str, machine: str) -> memoryview:
        """All of a variable as values of a machine type.  Raises UnknownPlace, and TypeError for what it has no room for."""
        place, size = self._place(variable), STRUCTS[machine].size
        if place.offset % size or place.type.size % size:
            raise TypeError(f"{variable} is no row of {machine}")
        return self.memory.views[machine][place.offset // size : (place.offset + place.type.size) // size]

    def offset(self, variable: str) -> int:
        """Where a variable lies in the processor's memory, in bytes.  Raises UnknownPlace."""
        return self._place(variable).offset

    def run(self, now_ns: int) -> None:
        """One execution of the program.  Raises RuntimeError if it traps: it is a program of ours."""
        system = self._system
        system[NOW // 8], system[DUE // 8], system[BUDGET // 8] = now_ns, NEVER, BUDGET_STATEMENTS
        trap = self._engine.run(TASK)
        if trap:
            raise RuntimeError(str(trap))

    def another(self) -> OwnProcessor:
        """Another processor with the same program, before its first execution."""
        return OwnProcessor(self.image, len(self.beside), self._places)

    def copy(self) -> OwnProcessor:
        """Another processor in the same state."""
        other = self.another()
        other.memory.restore(self.memory.snapshot())
        return other

    def __deepcopy__(self, memo: Mapping[int, Any]) -> OwnProcessor:
        return self.copy()
