"""Programs in Structured Text made at random, on every build of every engine and beside a tree walker.

`python tests/property/st_programs.py 10000` compares that many; `... 1 SEED` one of them; `... 100 0 codesys` programs in a
dialect, whose answers the tree walker does not know: there engines are compared.  A program on which they differ, or at which
something fails, is made as small as it can be and printed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parent.parent.parent)]

from st_kinds import Program
from st_making import Maker
from st_oracle import Oracle
from st_oracle_places import Pointer
from st_oracle_values import Trapped
from st_shrinking import smallest
from st_text import text_of

from fbvm.base.types import ArrayType, RefType, StructType, Type, base
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.engine.native.engine import NativeEngine
from fbvm.machine.plc import Plc
from fbvm.watch.paths import Place

SCANS, CYCLE_NS = 4, 10_000_000
ENOUGH, FEW = 20_000, 60
"""Statements that a scan may execute, as a rule and in every fourth program; the tree walker does not count them."""


CONSTANT = ("S0702", "S0703", "S0504")
"""Refusals of what is found to trap while it is compiled: constant subscripts, expressions, steps."""


class _Failed(Exception):
    """The tree walker itself does not know what to do."""


def budget(image: Image) -> int:
    """The step budget that a program gets: too small a one now and then, which has to end it at the same statement everywhere."""
    return FEW + len(image.sites) % 97 if len(image.sites) % 4 == 0 else ENOUGH


def _native(level: int) -> Callable[[Image], Plc]:
    def make(image: Image) -> Plc:
        plc = Plc(image, budget=budget(image), engine="python")
        plc.engine = NativeEngine(image, plc.memory, level)
        return plc

    return make


def _guarded(image: Image) -> Plc:
    """A build that could be stopped, by nothing that happens."""
    plc = Plc(image, budget=budget(image), engine="python")  # whose guard asks for no machine code of its own
    plc.breakpoints.change("D31999")
    guarded = plc.breakpoints.stoppable(plc.engine)
    guarded._native = NativeEngine(image, plc.memory, 0, plc.breakpoints._stops)
    return plc


BUILDS: dict[str, Callable[[Image], Plc]] = {
    "python plain": lambda image: Plc(image, budget=budget(image), engine="python"),
    "python observed": lambda image: Plc(image, budget=budget(image), observed=True, engine="python"),
}
if native.available():
    BUILDS |= {"native 0": _native(0), "native 2": _native(2), "native with stops": _guarded}
"""What executes an image; the first one is compared with the tree walker, the one with stops has every third program."""


def made(seed: int) -> Program:
    return Maker(Random(seed)).program()


def difference(program: Program, dialect: str = "standard") -> str:
    """What differs, in words that begin with its kind; "" if nothing does."""
    text, lines = text_of(program)
    oracle = Oracle(program, lines, CYCLE_NS) if dialect == "standard" else None
    try:
        compilation = compile_text(text, dialect=dialect)
        if compilation.image:
            return _differing(compilation.image, oracle)
    except _Failed:
        raise
    except Exception as error:
        return f"internal error {type(error).__name__}: {error}"
    wrong = next(d for d in compilation.diagnostics if d.severity == "error")
    return "" if wrong.code in CONSTANT or not oracle else f"refused {wrong.code}: {wrong.render()}"


def _differing(image: Image, oracle: Oracle | None) -> str:
    """What differs in the scans of an image."""
    plcs = {name: build(image) for name, build in BUILDS.items() if name != "native with stops" or len(image.sites) % 3 == 0}
    first = plcs["python plain"]
    for scan in range(SCANS):
        for plc in plcs.values():
            plc.scan()
        for name, plc in plcs.items():
            if repr(plc.trap) != repr(first.trap):
                return f"{name}: trap {plc.trap} where python plain has {first.trap}, scan {scan}"
            if bytes(plc.memory.u8) != bytes(first.memory.u8):
                return f"{name}: other memory after scan {scan}"
        if oracle and (found := _beside(oracle, first)):
            return f"tree walker: {found}, scan {scan}"
        if first.trap:
            break
    return _at_once(image, first)


def _at_once(image: Image, first: Plc) -> str:
    """What differs if many scans are done inside machine code."""
    if "native 2" not in BUILDS:
        return ""
    plc = BUILDS["native 2"](image)
    plc.run(scans=SCANS)
    if repr(plc.trap) != repr(first.trap):
        return f"many scans at once: trap {plc.trap} where python plain has {first.trap}"
    return "" if bytes(plc.memory.u8) == bytes(first.memory.u8) else "many scans at once: other memory"


def _beside(oracle: Oracle, plc: Plc) -> str:
    """What differs between the tree walker and a PLC after another scan."""
    try:
        trapped = oracle.scan()
    except Exception as error:
        raise _Failed from error
    if plc.trap and plc.trap.code == "R0104":
        return ""  # by now the tree walker has done what the PLC was kept from
    mine = (trapped.code, trapped.line) if isinstance(trapped, Trapped) else None
    its = (plc.trap.code, plc.trap.site.line) if plc.trap else None
    if mine != its:
        return f"trap {mine} where the PLC has {plc.trap}"
    values = oracle.values()
    return next((f"{name} is {wanted!r} where the PLC has {found!r}"
                 for name, wanted, found in _values(values, plc, "") if not _same(wanted, found)), "")


def _values(variables: dict[Any, Any], plc: Plc, path: str) -> Iterator[tuple[str, Any, Any]]:
    for name, wanted in variables.items():
        if not isinstance(name, str):
            continue  # the tree walker's own
        where = f"{path}.{name}" if path else name
        place = plc.find(where)
        if not isinstance(place, Place):  # an instance of a program
            yield from _values(wanted, plc, where)
            continue
        kind = base(place.type)
        if _is_block(kind):
            yield from _values(wanted, plc, where)
        elif isinstance(kind, ArrayType) and _is_block(base(kind.element)):
            for number, one in enumerate(wanted):
                yield from _values(one, plc, f"{where}[{number}]")
        elif not isinstance(kind, RefType) and not isinstance(wanted, Pointer) and wanted is not None:
            yield where, wanted, plc.read(place)


def _is_block(kind: Type) -> bool:
    return isinstance(kind, StructType) and kind.block


def _same(wanted: Any, found: Any) -> bool:
    if isinstance(wanted, list):
        return len(wanted) == len(found) and all(map(_same, wanted, found))
    if isinstance(wanted, dict):
        return all(_same(value, found[name]) for name, value in wanted.items())
    return repr(wanted) == repr(found)


def report(seed: int, dialect: str = "standard") -> str:
    """What differs for the program of a seed, with the smallest program that shows it; "" if nothing does."""
    program = made(seed)
    found = difference(program, dialect)
    if not found:
        return ""
    kind = found.partition(":")[0]

    def differs(other: Program) -> bool:
        try:
            return difference(other, dialect).partition(":")[0] == kind
        except (_Failed, KeyError, StopIteration, RecursionError):  # what was left out is used somewhere
            return False

    program = smallest(program, differs)
    return f"seed {seed}: {difference(program, dialect)}\n{text_of(program)[0]}"


if __name__ == "__main__":
    from fbvm.base import cache

    cache.switch(False)
    first, count = int(sys.argv[2]) if len(sys.argv) > 2 else 0, int(sys.argv[1])
    spoken = sys.argv[3] if len(sys.argv) > 3 else "standard"
    differing = 0
    for seed in range(first, first + count):
        if told := report(seed, spoken):
            differing += 1
            print(told, flush=True)
        if (done := seed - first + 1) % 100 == 0 and done < count:
            print(f"{done} programs compared so far, {differing} differ", flush=True)
    print(f"{count} programs compared, {differing} differ")
    sys.exit(differing > 0)
