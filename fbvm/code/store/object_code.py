"""Bodies of shipped blocks, lowered once a process apart from any program, and linked into each program that has them.

What a program decides stands in object code as a symbol: numbers of places in the source and of bodies, and where frames,
global variables and areas of a unit lie.  A body that needs more of its program than that is lowered with it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from fbvm.base.areas import AREAS
from fbvm.base.dialects import Dialect
from fbvm.base.types import ArrayType, RefType, StructType, Type, fold
from fbvm.check.checker import Checker
from fbvm.check.dependencies import Asked, Key, key_of
from fbvm.check.facts import Pou, Variable
from fbvm.code.image import Body, Site
from fbvm.code.lowering.bodies import lower_body
from fbvm.code.lowering.program import Origin, Program
from fbvm.syntax import tree


class _Base(str):
    """What an offset counts from, where only the program knows that."""

    __slots__ = ()


class _Place(int):
    """The number of a place in the source among those of the body."""

    __slots__ = ()


class _Body(int):
    """The number of a body among those that this one calls."""

    __slots__ = ()


@dataclass(frozen=True)
class ObjectCode:
    """A body with symbols: lists in `code` are tuples that hold one."""

    name: str
    kind: str
    code: Any
    instance_size: int
    statements: int
    sites: tuple[tuple[int, Site], ...]
    """The places in the source, and the first character of each."""
    bodies: tuple[Key, ...]
    bases: dict[str, tuple[str, Key, str]]
    """What each base is: "frame" of a POU, "area", "global", or a VAR_STAT of a POU ("static")."""

    def link(self, program: Program, checker: Checker, pou: Pou) -> Body:
        """The body in a program."""
        pous = checker.project.pous
        sites = [program.known_site(pou, start, site) for start, site in self.sites]
        bodies = [pous[key].number for key in self.bodies]
        bases = {name: _BASES[what](program, checker, key, of) for name, (what, key, of) in self.bases.items()}
        code = _linked(self.code, sites, bodies, bases) if type(self.code) is list else self.code
        return Body(self.name, self.kind, code, self.instance_size, self.statements)


def _linked(item: list[Any], sites: list[int], bodies: list[int], bases: dict[str, int]) -> tuple[Any, ...]:
    """Code with numbers in place of symbols."""
    if type(item[0]) is _Base:
        _, offset, terms = item
        return "abs", bases[item[0]] + offset, _linked(terms, sites, bodies, bases) if type(terms) is list else terms
    return tuple([
        _linked(part, sites, bodies, bases) if (kind := type(part)) is list else sites[part] if kind is _Place else
        bodies[part] if kind is _Body else part for part in item])


_BASES = {
    "frame": lambda program, checker, key, name: checker.project.pous[key].frame_offset,
    "static": lambda program, checker, key, name: checker.project.pous[key].variables[name].offset,
    "global": lambda program, checker, key, name: checker.project.globals[key].offset,
    "area": lambda program, checker, key, name: program.areas[name].offset,
}


@dataclass
class Shelf:
    """The object code of shipped blocks in one dialect, by their trees, which live as long as the process."""

    asked: dict[tree.Pou, Asked] = field(default_factory=dict)
    code: dict[tree.Pou, ObjectCode | None] = field(default_factory=dict)
    """None for what is lowered with its program."""
    met: set[tree.Pou] = field(default_factory=set)
    """Those that might have object code."""

    def body(self, program: Program, checker: Checker, pou: Pou) -> Body:
        """The body of a POU in a program.

        Object code is made when a shipped one is met again: it takes longer once, which most processes would not get back."""
        if pou in checker.asked and pou.tree not in self.code:
            if pou.tree in self.met:
                self.code[pou.tree] = code = made(checker, pou)
                if code is not None:
                    self.asked[pou.tree] = checker.asked[pou]
            self.met.add(pou.tree)
        known = self.code.get(pou.tree)
        return known.link(program, checker, pou) if known is not None else lower_body(program, checker, pou)


_shelves: dict[Dialect, Shelf] = {}


def shelf_of(dialect: Dialect) -> Shelf:
    """The shelf for programs in a dialect that see shipped libraries only, and have no VAR_CONFIG."""
    return _shelves.setdefault(dialect, Shelf())


class _Bound(Exception):
    """The code of a body depends on its program in a way that no symbol says."""


class _Apart(Program):
    """Stands for the program in which a body will be: whoever asks for more than symbols is told that there is no more."""

    def __init__(self, checker: Checker) -> None:
        self.drawn, self.entry_references = False, {}
        self.checker = checker
        self.places: dict[int, _Place] = {}
        self.known_sites: list[tuple[int, Site]] = []
        self.bodies: dict[Key, _Body] = {}
        self.bases: dict[str, tuple[str, Key, str]] = {}

    def __getattr__(self, name: str) -> Any:
        raise _Bound(name)

    def site(self, pou: Pou, node: tree.Node) -> int:
        number = self.places.get(node.start)
        if number is None:
            number = self.places[node.start] = _Place(len(self.places))
            self.known_sites.append((node.start, Site(pou.source.name, pou.name, *pou.source.place(node.start))))
        return number

    def number(self, pou: Pou) -> int:
        return self.bodies.setdefault(self._key(pou), _Body(len(self.bodies)))

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
        raise _Bound(name)

    def _base(self, what: str, key: Key, name: str = "") -> _Base:
        base = _Base(" ".join((what, *key, name)))
        self.bases[base] = what, key, name
        return base

    def _key(self, pou: Pou) -> Key:
        key = key_of(pou)
        if self.checker.project.pous.get(key) is not pou:
            raise _Bound(pou.name)
        return key


def made(checker: Checker, pou: Pou) -> ObjectCode | None:
    """The object code of a POU that was checked; None if its code is made with its program."""
    passed = [v for called in (pou, *pou.calls) for v in called.order if v.place == "frame" and not v.reference]
    if not all(_is_plain(variable.type) for variable in passed):
        return None
    program = _Apart(checker)
    try:
        body = lower_body(program, checker, pou)
    except _Bound:
        return None
    return ObjectCode(body.name, body.kind, _kept(body.code), body.instance_size, body.statements,
                      tuple(program.known_sites), tuple(program.bodies), program.bases)


def _is_plain(kind: Type) -> bool:
    """True for a type whose first value is the same in each program: it holds no instance and no reference."""
    if isinstance(kind, ArrayType):
        return _is_plain(kind.element)
    if isinstance(kind, StructType):
        return not kind.block and all(_is_plain(member.type) for member in kind.fields.values())
    return not isinstance(kind, RefType)


def _kept(item: Any) -> Any:
    """Code as it is kept: a tuple that holds a symbol as a list."""
    if type(item) is not tuple:
        return item
    parts = [_kept(part) for part in item]
    return parts if any(type(part) in (list, _Base, _Place, _Body) for part in parts) else item
