"""Runs a program of the corpus on every build of every engine and compares with what its comments expect."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lang_corpus import Item, Program
from lang_values import parts, same, value

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.memory import compare
from fbvm.base.types import fold
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.watch.paths import Place, Span, UnknownPlace

BUDGET = 100_000
"""Statements that a program of the corpus may execute in one scan: endless ones end soon."""

LINTED = "warnings"
"""The folder of the programs that are looked at for what is hardly meant.  The others show one thing each, which is often
that: a variable that only its initial value is asked of, a loop without end."""

BUILDS: dict[str, Callable[[Image, int], Plc]] = {
    "python plain": lambda image, cycle_ns: Plc(image, cycle_ns, budget=BUDGET),
    "python observed": lambda image, cycle_ns: Plc(image, cycle_ns, budget=BUDGET, observed=True),
}
"""Everything that can execute an Image, by name; the first one is the reference."""
REFERENCE = {"python plain": BUILDS["python plain"]}
"""What is enough to see that a program does what its comments say."""


def check(program: Program, builds: Mapping[str, Callable[[Image, int], Plc]] = BUILDS) -> None:
    """Compiles and runs a program of the corpus and compares with its expectations, and what `builds` leave in memory with
    each other."""
    compilation = compile_sources([Source(program.name, program.text)], runnable=True, dialect=program.dialect,
                                  lint=program.path.parent.name == LINTED)
    _check_diagnostics(program, compilation.diagnostics)
    if program.runs:
        assert compilation.image is not None, "no errors, and no image"
        _check_run(program, {name: build(compilation.image, program.cycle_ns) for name, build in builds.items()})
    else:
        assert compilation.image is None, "an image in spite of errors"
        assert not program.expected and program.trap is None, "a program with errors does not run"


def _check_diagnostics(program: Program, diagnostics: list[Diagnostic]) -> None:
    wanted = list(program.diagnostics)
    unexpected = []
    for diagnostic in diagnostics:
        fitting = [m for m in wanted if m.fits(diagnostic.line, diagnostic.code, f"{diagnostic.message}\n{diagnostic.hint}")]
        if fitting:
            wanted.remove(fitting[0])
        else:
            unexpected.append(diagnostic.render())
    missing = [f"{program.name}:{m.line}: {m.code} {m.part}" for m in wanted]
    assert not unexpected and not missing, "\n".join(["not expected:", *unexpected, "missing:", *missing])


def _check_run(program: Program, plcs: dict[str, Plc]) -> None:
    reference, *others = plcs.values()
    for scan in range(1, program.scans + 1):
        for plc in plcs.values():
            for item in _at(program.written, scan):
                plc.write(place := _place(plc, item), _value(place, item.value))
            plc.scan()
        if others:
            memory = reference.memory.snapshot()
            for name, plc in plcs.items():
                assert repr(plc.trap) == repr(reference.trap), name
                assert compare(plc.memory.snapshot(), memory) == [], f"{name}: memory after scan {scan}"
        for item in _at(program.expected, scan):
            _check_value(program, reference, item)
        if reference.trap:
            assert scan == program.scans, reference.trap
    _check_trap(program, reference)


def _at(items: list[Item], scan: int) -> list[Item]:
    return [item for item in items if item.scan == scan]


def _place(plc: Plc, item: Item) -> Place | Span:
    """The place that an item names: in Main first."""
    main = plc.image.symbols.get(fold("Main"))
    if main is not None:
        try:
            return plc.find(f"Main.{item.name}")
        except UnknownPlace:
            pass
    return plc.find(item.name)


def _value(place: Place | Span, text: str) -> object:
    if isinstance(place, Place):
        return value(place.type, text)
    return [value(inner.type, part.strip()) for inner, part in zip(place.places, parts(text[1:-1]), strict=True)]


def _check_value(program: Program, plc: Plc, item: Item) -> None:
    where = f"{program.name}:{item.line}: {item.name} after scan {item.scan}"
    place = _place(plc, item)
    want, got = _value(place, item.value), plc.read(place)
    assert same(got, want), f"{where} is {got!r}, not {want!r}; trap: {plc.trap}"


def _check_trap(program: Program, plc: Plc) -> None:
    if program.trap is None:
        assert plc.trap is None, plc.trap
        return
    assert plc.trap is not None, f"{program.name}:{program.trap.line}: no trap {program.trap.code}"
    site = plc.trap.site
    assert program.trap.fits(site.line, plc.trap.code, plc.trap.message), f"{plc.trap}, not {program.trap}"
    assert site.file == program.name, site
