"""Programs in Structured Text made at random, on every build of every engine and beside a tree walker.

`python tests/property/st_programs.py 10000` compares that many; `... 1 SEED` one of them.  A program on which they differ
is made as small as it can be and printed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parent.parent.parent)]

from st_making import Maker, Node, Pou, Program
from st_oracle import Oracle, Trapped
from st_text import text_of

from fbvm.base.types import StructType, base
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine import native
from fbvm.engine.native import NativeEngine
from fbvm.plc import Plc
from fbvm.watch.paths import Place

SCANS = 3
BUDGET = 20_000
"""Statements that a scan may execute; the tree walker does not count them."""


CONSTANT = ("S0702", "S0703", "S0504")
"""Refusals of what is found to trap while it is compiled: constant subscripts, expressions, steps."""


def _native(level: int) -> Callable[[Image], Plc]:
    def make(image: Image) -> Plc:
        plc = Plc(image, budget=BUDGET, engine="python")
        plc.engine = NativeEngine(image, plc.memory, level)
        return plc

    return make


def _guarded(image: Image) -> Plc:
    """A build that could be stopped, by nothing that happens."""
    plc = _native(0)(image)
    plc.breakpoints.change("D31999")
    guarded = plc.breakpoints.guarding(plc.engine)
    guarded._native = NativeEngine(image, plc.memory, 0, plc.breakpoints._stops)
    return plc


BUILDS: dict[str, Callable[[Image], Plc]] = {
    "python plain": lambda image: Plc(image, budget=BUDGET, engine="python"),
    "python observed": lambda image: Plc(image, budget=BUDGET, observed=True, engine="python"),
}
if native.available():
    BUILDS |= {"native 0": _native(0), "native 2": _native(2), "native with stops": _guarded}
"""What executes an image; the first one is compared with the tree walker."""


def made(seed: int) -> Program:
    return Maker(Random(seed)).program()


def difference(program: Program) -> str:
    """What differs, in words that begin with its kind; "" if nothing does."""
    text, lines = text_of(program)
    compilation = compile_text(text)
    if compilation.image is None:
        wrong = next(d for d in compilation.diagnostics if d.severity == "error")
        if wrong.code in CONSTANT:
            return ""
        return f"refused {wrong.code}: {wrong.render()}"
    plcs = {name: build(compilation.image) for name, build in BUILDS.items()}
    first = plcs["python plain"]
    oracle: Oracle | None = Oracle(program, lines)
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
    return ""


def _beside(oracle: Oracle, plc: Plc) -> str:
    """What differs between the tree walker and a PLC after another scan."""
    trapped = oracle.scan()
    if plc.trap and plc.trap.code == "R0104":
        return ""  # by now the tree walker has done what the PLC was kept from
    mine = (trapped.code, trapped.line) if isinstance(trapped, Trapped) else None
    its = (plc.trap.code, plc.trap.site.line) if plc.trap else None
    if mine != its:
        return f"trap {mine} where the PLC has {plc.trap}"
    return next((f"{name} is {wanted!r} where the PLC has {found!r}"
                 for name, wanted, found in _values(oracle.variables, plc, "Main") if not _same(wanted, found)), "")


def _values(variables: dict[str, Any], plc: Plc, path: str) -> Iterator[tuple[str, Any, Any]]:
    for name, wanted in variables.items():
        if name == "x":
            continue  # an in-out of an instance
        where = f"{path}.{name}"
        place = plc.find(where)
        assert isinstance(place, Place)
        kind = base(place.type)
        if isinstance(kind, StructType) and kind.block:
            yield from _values(wanted, plc, where)
        elif not isinstance(wanted, tuple) and wanted is not None:  # a reference has no value outside
            yield where, wanted, plc.read(place)


def _same(wanted: Any, found: Any) -> bool:
    if isinstance(wanted, list):
        return len(wanted) == len(found) and all(map(_same, wanted, found))
    if isinstance(wanted, dict):
        return all(_same(value, found[name]) for name, value in wanted.items())
    return repr(wanted) == repr(found)


# --- small programs ---------------------------------------------------------------------------------------------------


def smallest(program: Program, differs: Callable[[Program], bool]) -> Program:
    """The program without all that it can lose while it still differs."""
    while True:
        for smaller in _smaller(program):
            if differs(smaller):
                program = smaller
                break
        else:
            return program


def _smaller(program: Program) -> Iterator[Program]:
    for at, pou in enumerate(program.pous):
        for changed in _smaller_pous(pou):
            yield replace(program, pous=(*program.pous[:at], changed, *program.pous[at + 1:]))
        if pou.kind != "PROGRAM":
            yield replace(program, pous=(*program.pous[:at], *program.pous[at + 1:]))
    if program.structs:
        yield replace(program, structs=program.structs[:-1])


def _smaller_pous(pou: Pou) -> Iterator[Pou]:
    for body in _smaller_blocks(pou.body):
        yield replace(pou, body=body)
    used = repr(pou.body)
    for at, row in enumerate(pou.variables):
        if f"'{row.name}'" not in used:
            yield replace(pou, variables=(*pou.variables[:at], *pou.variables[at + 1:]))
        elif row.initial is not None:
            yield replace(pou, variables=(*pou.variables[:at], replace(row, initial=None), *pou.variables[at + 1:]))


def _is_block(item: Any) -> bool:
    return isinstance(item, tuple) and all(_is_statement(part) for part in item)


def _is_statement(item: Any) -> bool:
    return isinstance(item, tuple) and len(item) > 1 and isinstance(item[0], str) and isinstance(item[1], int)


def _is_value(item: Any) -> bool:
    return isinstance(item, tuple) and len(item) > 2 and item[0] in (
        "get", "widen", "convert", "truncate", "binary", "compare", "unary", "call", "user")


def _smaller_blocks(block: tuple[Node, ...]) -> Iterator[tuple[Node, ...]]:
    """Blocks with fewer statements, or smaller ones; big pieces go first."""
    size = len(block) // 2
    while size > 1:
        for at in range(0, len(block), size):
            yield block[:at] + block[at + size:]
        size //= 2
    for at, statement in enumerate(block):
        yield block[:at] + block[at + 1:]
        for inner in _blocks_in(statement):
            yield block[:at] + inner + block[at + 1:]
    for at, statement in enumerate(block):
        for changed in _smaller_nodes(statement):
            yield (*block[:at], changed, *block[at + 1:])


def _blocks_in(item: Any) -> Iterator[tuple[Node, ...]]:
    for part in item:
        if part and _is_block(part):
            yield part
        elif isinstance(part, tuple):
            yield from _blocks_in(part)


def _smaller_nodes(item: Any) -> Iterator[Any]:
    """A node with one of its parts made smaller."""
    for at, part in enumerate(item):
        if not isinstance(part, tuple):
            continue
        if part and _is_block(part):
            changes: Iterator[Any] = _smaller_blocks(part)
        else:
            changes = _smaller_values(part) if _is_value(part) else _smaller_nodes(part)
        for changed in changes:
            yield (*item[:at], changed, *item[at + 1:])


def _smaller_values(node: Node) -> Iterator[Node]:
    """A literal, a part of the same type, the same operation with a smaller part."""
    kind = node[1]
    yield "literal", kind, {"BOOL": False, "STRING": "", "REAL": 1.0, "LREAL": 1.0}.get(kind, 1)
    yield from (part for part in _values_in(node) if part[1] == kind and part is not node)
    yield from _smaller_nodes(node)


def _values_in(item: Any) -> Iterator[Node]:
    for part in item:
        if _is_value(part) or (isinstance(part, tuple) and part[:1] == ("literal",)):
            yield part
        if isinstance(part, tuple):
            yield from _values_in(part)


def report(seed: int) -> str:
    """What differs for the program of a seed, with the smallest program that shows it; "" if nothing does."""
    program = made(seed)
    found = difference(program)
    if not found:
        return ""
    kind = found.partition(":")[0]

    def differs(other: Program) -> bool:
        try:
            return difference(other).partition(":")[0] == kind
        except (KeyError, StopIteration, RecursionError):  # what was left out is used somewhere
            return False

    program = smallest(program, differs)
    return f"seed {seed}: {difference(program)}\n{text_of(program)[0]}"


if __name__ == "__main__":
    from fbvm.base import cache

    cache.switch(False)
    first, count = int(sys.argv[2]) if len(sys.argv) > 2 else 0, int(sys.argv[1])
    differing = 0
    for seed in range(first, first + count):
        if told := report(seed):
            differing += 1
            print(told, flush=True)
    print(f"{count} programs compared, {differing} differ")
    sys.exit(differing > 0)
