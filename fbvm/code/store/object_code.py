"""Object code: bodies of shipped blocks, lowered once a process apart from any program, and linked into each that has them.

What differs from program to program stands in object code as a symbol: numbers of sites and of bodies, and where frames,
global variables and areas of a unit lie.  A body that depends on its program in any other way is lowered with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from fbvm.base.areas import AREAS
from fbvm.base.dialects import Dialect
from fbvm.base.types import ArrayType, RefType, StructType, Type, fold
from fbvm.check.checker import Checker
from fbvm.check.symbols.dependencies import Dependencies, Key, key_of
from fbvm.check.symbols.facts import Pou, Start, Variable
from fbvm.code.image import Body, Site
from fbvm.code.lowering.bodies import lower_body
from fbvm.code.lowering.program import Origin, Program
from fbvm.syntax import tree

# --- symbols ----------------------------------------------------------------------------------------------------------


class _BaseSymbol(str):
    """What an offset counts from, in place of "abs"; the offset of that in the buffer is added by the linker."""

    __slots__ = ()


class _SiteSymbol(int):
    """The number of a site among those of the body."""

    __slots__ = ()


class _BodySymbol(int):
    """The number of a body among those that this one calls."""

    __slots__ = ()


# --- linking ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ObjectCode:
    """A body with symbols.  In `code` a list stands for each tuple that holds a symbol, so that all others are shared."""

    name: str
    kind: str
    code: Any
    instance_size: int
    sites: tuple[tuple[int, Site], ...]
    """By number of a `_SiteSymbol`: the first character of the place in the source, and the site."""
    bodies: tuple[Key, ...]
    """By number of a `_BodySymbol`: the POU."""
    bases: dict[str, tuple[str, Key, str]]
    """By `_BaseSymbol`: the kind of base (see `_OFFSETS`), the POU or global variable, and the variable or area."""

    def link(self, program: Program, checker: Checker, pou: Pou) -> Body:
        """The body of `pou` in a program: the same code with numbers in place of symbols."""
        pous = checker.project.pous
        sites = [program.known_site(pou, start, site) for start, site in self.sites]
        bodies = [pous[key].number for key in self.bodies]
        bases = {name: _OFFSETS[kind](program, checker, key, of) for name, (kind, key, of) in self.bases.items()}
        code = _linked(self.code, sites, bodies, bases) if type(self.code) is list else self.code
        return Body(self.name, self.kind, code, self.instance_size)


def _linked(item: list[Any], sites: list[int], bodies: list[int], bases: dict[str, int]) -> tuple[Any, ...]:
    if type(item[0]) is _BaseSymbol:
        _, offset, terms = item
        return "abs", bases[item[0]] + offset, _linked(terms, sites, bodies, bases) if type(terms) is list else terms
    return tuple([
        _linked(part, sites, bodies, bases) if (kind := type(part)) is list else sites[part] if kind is _SiteSymbol else
        bodies[part] if kind is _BodySymbol else part for part in item])


_OFFSETS = {
    "frame": lambda program, checker, key, name: checker.project.pous[key].frame_offset,
    "static": lambda program, checker, key, name: checker.project.pous[key].variables[name].offset,
    "global": lambda program, checker, key, name: checker.project.globals[key].offset,
    "area": lambda program, checker, key, name: program.areas[name].offset,
}
"""Where in the buffer of a program a base begins: the frame or a VAR_STAT of a POU, a global variable, an area."""


# --- what a process keeps ---------------------------------------------------------------------------------------------


@dataclass
class ObjectLibrary:
    """The object code of shipped blocks in one dialect, by their trees, which live as long as the process."""

    dependencies: dict[tree.Pou, Dependencies] = field(default_factory=dict)
    """What the check of each block with object code asked for; the checker repeats that instead of checking the block."""
    code: dict[tree.Pou, ObjectCode | None] = field(default_factory=dict)
    """None for a block that is lowered with its program."""
    seen: set[tree.Pou] = field(default_factory=set)
    """Blocks that some program had, and that might have object code."""

    def body(self, program: Program, checker: Checker, pou: Pou) -> Body:
        """The body of a POU in a program: linked if it has object code, else lowered.

        Object code is made when a block is seen for the second time: to make it takes longer than to lower the block, and most
        processes compile one program only."""
        if any(each.stack_bytes for each in (pou, *pou.calls)):
            checker.check_repeated(pou)
            return lower_body(program, checker, pou)
        if pou in checker.dependencies and pou.tree not in self.code:
            if pou.tree in self.seen:
                self.code[pou.tree] = code = object_code(checker, pou)
                if code is not None:
                    self.dependencies[pou.tree] = checker.dependencies[pou]
            self.seen.add(pou.tree)
        known = self.code.get(pou.tree)
        return known.link(program, checker, pou) if known is not None else lower_body(program, checker, pou)


_libraries: dict[Dialect, ObjectLibrary] = {}


def library_for(dialect: Dialect) -> ObjectLibrary:
    """What this process keeps for programs in a dialect that see shipped libraries only, and have no VAR_CONFIG."""
    return _libraries.setdefault(dialect, ObjectLibrary())


# --- lowering apart from a program ------------------------------------------------------------------------------------


class _NotRelocatable(Exception):
    """The code of a body depends on its program in a way that no symbol says."""


class _RelocatableProgram(Program):
    """Stands for the program in which a body will be: answers with symbols.

    It has no other attribute of a program; to ask for one raises _NotRelocatable."""

    def __init__(self, checker: Checker) -> None:
        self.drawn, self.entry_references = False, {}
        self.checker = checker
        self.site_symbols: dict[int, _SiteSymbol] = {}
        self.known_sites: list[tuple[int, Site]] = []
        self.bodies: dict[Key, _BodySymbol] = {}
        self.bases: dict[str, tuple[str, Key, str]] = {}

    def __getattr__(self, name: str) -> Any:
        raise _NotRelocatable(name)

    def site(self, pou: Pou, node: tree.Node) -> int:
        number = self.site_symbols.get(node.start)
        if number is None:
            number = self.site_symbols[node.start] = _SiteSymbol(len(self.site_symbols))
            self.known_sites.append((node.start, Site(pou.source.name, pou.name, *pou.source.place(node.start))))
        return number

    def number(self, pou: Pou) -> int:
        return self.bodies.setdefault(self._key(pou), _BodySymbol(len(self.bodies)))

    def candidates(self, pou: Pou) -> dict[Pou, list[int]]:
        raise _NotRelocatable(pou.name)

    def frame(self, pou: Pou) -> Origin:
        return self._base("frame", self._key(pou)), 0

    def area(self, name: str) -> Origin:
        return ("abs", AREAS[name].offset) if name in AREAS else (self._base("area", ("", ""), name), 0)

    def origin(self, variable: Variable) -> Origin:
        place, owner = variable.place, variable.owner
        if place == "area" and variable.location is not None:
            base, offset = self.area(variable.location.area)
            return base, offset + variable.location.byte_offset()
        if place == "frame" and owner is not None:
            return self._base("frame", self._key(owner)), variable.offset
        key, name = (variable.source.library, fold(variable.name)), fold(variable.name)
        if place == "abs" and self.checker.project.globals.get(key) is variable:
            return self._base("global", key), 0
        if place == "abs" and owner is not None and owner.variables.get(name) is variable:
            return self._base("static", self._key(owner), name), 0
        raise _NotRelocatable(name)

    def references_in(self, kind: Type, content: bytes) -> Iterator[tuple[int, Start]]:
        raise _NotRelocatable("references in initial values")

    def _base(self, kind: str, key: Key, name: str = "") -> _BaseSymbol:
        base = _BaseSymbol(" ".join((kind, *key, name)))
        self.bases[base] = kind, key, name
        return base

    def _key(self, pou: Pou) -> Key:
        key = key_of(pou)
        if self.checker.project.pous.get(key) is not pou:
            raise _NotRelocatable(pou.name)
        return key


def object_code(checker: Checker, pou: Pou) -> ObjectCode | None:
    """The object code of a POU that was checked; None if it has to be lowered with its program."""
    initialized = [v for called in (pou, *pou.calls) for v in called.order if v.place == "frame" and not v.reference]
    if not all(_is_plain(variable.type) for variable in initialized):
        return None
    program = _RelocatableProgram(checker)
    try:
        body = lower_body(program, checker, pou)
    except _NotRelocatable:
        return None
    return ObjectCode(body.name, body.kind, _with_lists(body.code), body.instance_size,
                      tuple(program.known_sites), tuple(program.bodies), program.bases)


def _is_plain(kind: Type) -> bool:
    """True for a type whose initial value is the same in each program: it holds no instance and no reference."""
    if isinstance(kind, ArrayType):
        return _is_plain(kind.element)
    if isinstance(kind, StructType):
        return not kind.block and all(_is_plain(member.type) for member in kind.fields.values())
    return not isinstance(kind, RefType)


def _with_lists(item: Any) -> Any:
    """Code with a list for each tuple that holds a symbol, at whatever depth."""
    if type(item) is not tuple:
        return item
    parts = [_with_lists(part) for part in item]
    return parts if any(type(part) in (list, _BaseSymbol, _SiteSymbol, _BodySymbol) for part in parts) else item
