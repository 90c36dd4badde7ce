"""Data types: their names, sizes in memory, ranges, and implicit conversions.

Layout (little-endian, naturally aligned): BOOL one byte, STRING[n] n + 1 bytes, TIME and dates 64-bit nanoseconds,
references 64 bits.  Source: IEC 61131-3 ed. 3 tables 10 and 11, figures 5 and 11.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache, lru_cache


@lru_cache(1 << 16)
def fold(name: str) -> str:
    """A name in the form in which names are compared: in capitals, since case does not matter.

    Not for texts of a program: what was folded is kept."""
    return name.upper()


@dataclass(frozen=True)
class Type:
    """Any type: name for messages, size and alignment in bytes."""

    name: str
    size: int
    align: int

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, eq=False)
class Elementary(Type):
    """An elementary type, of which there is one object each.  `machine` is the form that code works on, `families` the
    generic types that hold it."""

    machine: str
    families: frozenset[str]
    low: int = 0
    high: int = 0
    bits: int = 0
    __eq__ = object.__eq__
    __hash__ = object.__hash__


@dataclass(frozen=True)
class StringType(Type):
    """STRING[capacity] or WSTRING[capacity]."""

    capacity: int
    wide: bool = False


DEEPEST_TYPE = 200
"""How many arrays, structures and instances one type may have in one another."""


@dataclass(frozen=True)
class ArrayType(Type):
    """ARRAY with constant bounds; the rightmost subscript varies fastest.  Of a `packed` one each BOOL is a bit."""

    bounds: tuple[tuple[int, int], ...]
    element: Type
    packed: bool = False

    @property
    def count(self) -> int:
        """The number of elements in all dimensions."""
        return _elements(self.bounds)

    def subscripts(self, number: int) -> str:
        """The subscripts of an element by its number in memory, from 0, as they are written: "2, -1"."""
        written: list[str] = []
        for low, high in reversed(self.bounds):
            number, behind = divmod(number, high - low + 1)
            written.insert(0, str(low + behind))
        return ", ".join(written)


@dataclass(frozen=True)
class OpenArrayType(Type):
    """ARRAY [*] of an in-out: the argument brings its bounds.  `size` is that of the parameter's slot: a reference and
    for each dimension the lower and the upper bound, 64 bits each."""

    dimensions: int
    element: Type

    def bound_offset(self, dimension: int, upper: bool) -> int:
        """The offset in the slot of a bound of `dimension` (from 0)."""
        return 8 + 16 * dimension + (8 if upper else 0)


@dataclass(frozen=True)
class AnyType(Type):
    """ANY or a narrower generic type as a parameter: the argument brings its place, size and type.

    `name` is that of the generic type.  `size` is that of the parameter's slot: a reference, and from ANY_SIZE on size and
    type of the argument."""


ANY_SIZE, ANY_BITS, ANY_STRIDE, ANY_CLASS = 8, 12, 16, 20
"""Where in the slot of an ANY its numbers lie, 32 bits each: whole bytes, BOOLs or bits, bits from one of these to the
next (8 for BOOLs that fill bytes), type class."""


@dataclass(unsafe_hash=True)
class Field:
    """A member of a structure or a variable of a POU, at `offset` bytes from the start of the whole.  It never changes: it is not
    `frozen`, since a program has thousands, and to make a frozen one takes six times as long.

    `kind` is "" for structure members, else the section's word (VAR_INPUT ...); `bit` is set for a BOOL located on a
    bit; `absolute` for a located variable, whose offset is one of the buffer; `reference` for an in-out, whose slot
    holds a reference to a value of `type`; `hexadecimal` for one that a pragma shows in hexadecimal."""

    name: str
    type: Type
    offset: int
    kind: str = ""
    bit: int | None = None
    absolute: bool = False
    reference: bool = False
    constant: bool = False
    hexadecimal: bool = False
    space: str = ""
    """Of a global variable the list that declares it, under which it can be named as well."""
    frame_at: tuple[int, ...] = ()
    """Of a variable in frames on the stack: where in the buffer the reference to the newest frame lies, from whose start `offset`
    counts then; for an older one, how far from the start of each newer frame the reference to the one before lies."""


@dataclass(frozen=True)
class StructType(Type):
    """A structure, or the instance of a function block or program (`block` TRUE), which begins with its type identifier."""

    fields: dict[str, Field] = field(hash=False, compare=False)
    block: bool = False
    other_names: dict[str, str] = field(default_factory=dict, hash=False, compare=False)
    """Names under which a member is known besides its own, folded."""
    parents: tuple[StructType, ...] = field(default=(), hash=False, compare=False)
    """What it EXTENDS and IMPLEMENTS, directly."""

    def member(self, name: str) -> Field | None:
        folded = fold(name)
        return self.fields.get(self.other_names.get(folded, folded))


@dataclass(frozen=True)
class EnumType(Type):
    """An enumeration; `members` by folded name to value."""

    base: Elementary
    members: dict[str, int] = field(hash=False, compare=False)
    shown: dict[int, str] = field(hash=False, compare=False)
    attributes: frozenset[str] = field(default=frozenset(), hash=False, compare=False, repr=False)
    """Those of qualified_only, strict and to_string that its declaration has; of no use once a program is compiled."""


@dataclass(frozen=True)
class SubrangeType(Type):
    """An integer type with narrower limits."""

    base: Elementary
    low: int
    high: int
    checked: bool = field(default=True, compare=False, repr=False)
    """False in dialects that store what is outside; of no use once a program is compiled."""


@dataclass(frozen=True)
class RefType(Type):
    """REF_TO target, or POINTER TO target, which `moves` by arithmetic; `target` None is the type of NULL.

    What is declared REFERENCE TO target `follows`: wherever it is named, what it is bound to is meant.  A variable of an
    `interface` holds a reference to an instance that implements it; its target has methods and no variables."""

    target: Type | None
    moves: bool = False
    follows: bool = False
    interface: bool = False


_PARENTS = {
    "ANY_SIGNED": "ANY_INT", "ANY_UNSIGNED": "ANY_INT", "ANY_INT": "ANY_NUM", "ANY_REAL": "ANY_NUM",
    "ANY_NUM": "ANY_MAGNITUDE", "ANY_DURATION": "ANY_MAGNITUDE", "ANY_MAGNITUDE": "ANY_ELEMENTARY",
    "ANY_BIT": "ANY_ELEMENTARY", "ANY_DATE": "ANY_ELEMENTARY", "ANY_CHARS": "ANY_ELEMENTARY",
    "ANY_CHAR": "ANY_CHARS", "ANY_STRING": "ANY_CHARS", "ANY_ELEMENTARY": "ANY", "ANY_DERIVED": "ANY",
}


def families_of(leaf: str) -> frozenset[str]:
    """A generic type and all that contain it (figure 5)."""
    names = [leaf]
    while names[-1] in _PARENTS:
        names.append(_PARENTS[names[-1]])
    return frozenset(names)


def _elementary() -> Iterator[Elementary]:
    yield Elementary("BOOL", 1, 1, "b", families_of("ANY_BIT"), 0, 1, 1)
    for bits, signed, unsigned, string in ((8, "SINT", "USINT", "BYTE"), (16, "INT", "UINT", "WORD"),
                                           (32, "DINT", "UDINT", "DWORD"), (64, "LINT", "ULINT", "LWORD")):
        size, top = bits // 8, (1 << bits) - 1
        yield Elementary(signed, size, size, f"i{bits}", families_of("ANY_SIGNED"), -(top // 2) - 1, top // 2, bits)
        yield Elementary(unsigned, size, size, f"u{bits}", families_of("ANY_UNSIGNED"), 0, top, bits)
        yield Elementary(string, size, size, f"u{bits}", families_of("ANY_BIT"), 0, top, bits)
    yield Elementary("REAL", 4, 4, "f32", families_of("ANY_REAL"), bits=32)
    yield Elementary("LREAL", 8, 8, "f64", families_of("ANY_REAL"), bits=64)
    yield Elementary("CHAR", 1, 1, "u8", families_of("ANY_CHAR"), 0, 0xFF, 8)
    yield Elementary("WCHAR", 2, 2, "u16", families_of("ANY_CHAR"), 0, 0xFFFF, 16)
    for names, family in ((("TIME", "LTIME"), "ANY_DURATION"),
                          (("DATE", "LDATE", "TIME_OF_DAY", "LTIME_OF_DAY", "DATE_AND_TIME", "LDATE_AND_TIME"),
                           "ANY_DATE")):
        for name in names:
            yield Elementary(name, 8, 8, "i64", families_of(family), -(1 << 63), (1 << 63) - 1, 64)


ELEMENTARY: dict[str, Elementary] = {t.name: t for t in _elementary()}
SHORT_NAMES = {
    "TOD": "TIME_OF_DAY", "LTOD": "LTIME_OF_DAY", "DT": "DATE_AND_TIME", "LDT": "LDATE_AND_TIME",
    "T": "TIME", "LT": "LTIME", "D": "DATE", "LD": "LDATE",
}
GENERIC = frozenset(_PARENTS) | {"ANY"}
ANYTHING = {name: AnyType(name, 24, 8) for name in GENERIC}
"""Parameters of generic type by name."""
DEFAULT_STRING = 80
"""Characters of a STRING declared without a length (as CODESYS; the standard leaves it to the maker)."""
DAY_NS = 86_400_000_000_000

BOOL, SINT, INT, DINT, LINT = (ELEMENTARY[n] for n in ("BOOL", "SINT", "INT", "DINT", "LINT"))
USINT, UINT, UDINT, ULINT = (ELEMENTARY[n] for n in ("USINT", "UINT", "UDINT", "ULINT"))
BYTE, WORD, DWORD, LWORD = (ELEMENTARY[n] for n in ("BYTE", "WORD", "DWORD", "LWORD"))
REAL, LREAL, TIME, LTIME = (ELEMENTARY[n] for n in ("REAL", "LREAL", "TIME", "LTIME"))
DATE, TOD, DT = (ELEMENTARY[n] for n in ("DATE", "TIME_OF_DAY", "DATE_AND_TIME"))
NULL = RefType("NULL", 8, 8, None)


def reference(target: Type) -> RefType:
    """REF_TO target."""
    return RefType(f"REF_TO {target.name}", 8, 8, target)


def character(kind: StringType) -> Elementary:
    """The type of one character of a string."""
    return ELEMENTARY["WCHAR" if kind.wide else "CHAR"]


def pointer(target: Type) -> RefType:
    """POINTER TO target."""
    return RefType(f"POINTER TO {target.name}", 8, 8, target, True)


def bound(target: Type) -> RefType:
    """REFERENCE TO target."""
    return RefType(f"REFERENCE TO {target.name}", 8, 8, target, follows=True)


def interface(target: StructType) -> RefType:
    """A variable of an INTERFACE, whose methods `target` has."""
    return RefType(target.name, 8, 8, target, interface=True)


def derives(kind: Type | None, target: Type | None) -> bool:
    """True if both are one type, or `kind` is a block or structure that extends or implements `target`, at whatever depth."""
    return kind == target or isinstance(kind, StructType) and any(derives(parent, target) for parent in kind.parents)


def followed(kind: Type) -> Type:
    """The type of the value that a variable of type `kind` names: of a REFERENCE TO its target."""
    return kind.target if isinstance(kind, RefType) and kind.follows and kind.target is not None else kind


@cache
def string(capacity: int = DEFAULT_STRING, wide: bool = False) -> StringType:
    """STRING[capacity] or WSTRING[capacity], the same object for the same length."""
    return _string(capacity, wide)


@cache
def _string(capacity: int, wide: bool) -> StringType:
    unit = 2 if wide else 1
    name = "WSTRING" if wide else "STRING"
    return StringType(f"{name}[{capacity}]", (capacity + 1) * unit, unit, capacity, wide)


def array(bounds: tuple[tuple[int, int], ...], element: Type) -> ArrayType:
    """ARRAY [bounds] OF element."""
    shown = ", ".join(f"{low}..{high}" for low, high in bounds)
    return ArrayType(f"ARRAY [{shown}] OF {element.name}", _elements(bounds) * element.size, element.align, bounds, element)


def _elements(bounds: tuple[tuple[int, int], ...]) -> int:
    return math.prod(high - low + 1 for low, high in bounds)


def characters(text: StringType) -> ArrayType:
    """A string as subscripts see it: bytes or words from 0 on, the one that ends the longest text among them."""
    return array(((0, text.capacity),), WORD if text.wide else BYTE)


def on_bits(kind: ArrayType) -> ArrayType:
    """An ARRAY OF BOOL that is located on bits of an area."""
    return ArrayType(f"{kind.name} on bits", (kind.count + 7) // 8, 1, kind.bounds, kind.element, True)


def open_array(dimensions: int, element: Type) -> OpenArrayType:
    """ARRAY [*, ...] OF element."""
    name = f"ARRAY [{', '.join('*' * dimensions)}] OF {element.name}"
    return OpenArrayType(name, 8 + 16 * dimensions, 8, dimensions, element)


def base(kind: Type) -> Type:
    """The type that operations see: of a subrange the one that it is a part of; others, enumerations too, are themselves."""
    return kind.base if isinstance(kind, SubrangeType) else kind


def families(kind: Type) -> frozenset[str]:
    """The generic types that hold `kind`."""
    if isinstance(kind, Elementary):
        return kind.families
    kind = base(kind)
    if isinstance(kind, Elementary):
        return kind.families
    if isinstance(kind, StringType):
        return _TEXTS
    return _NO_FAMILIES if isinstance(kind, AnyType) else _DERIVED


_TEXTS, _DERIVED, _NO_FAMILIES = families_of("ANY_STRING"), families_of("ANY_DERIVED"), frozenset[str]()


def is_real(kind: Type) -> bool:
    """True for REAL and LREAL."""
    return kind is REAL or kind is LREAL


def machine(kind: Type) -> str:
    """The machine form of a value of `kind`: b, i8..u64, f32, f64, s8, s16, ref; "" for aggregates."""
    if isinstance(kind, Elementary):
        return kind.machine
    kind = base(kind)
    if isinstance(kind, Elementary):
        return kind.machine
    if isinstance(kind, EnumType):
        return kind.base.machine
    if isinstance(kind, StringType):
        return "s16" if kind.wide else "s8"
    return "ref" if isinstance(kind, RefType) else ""


_IMPLICIT = {
    "SINT": "INT DINT LINT REAL LREAL", "INT": "DINT LINT REAL LREAL", "DINT": "LINT LREAL", "LINT": "",
    "USINT": "UINT UDINT ULINT INT DINT LINT REAL LREAL", "UINT": "UDINT ULINT DINT LINT REAL LREAL",
    "UDINT": "ULINT LINT LREAL", "ULINT": "", "REAL": "LREAL",
    "BYTE": "WORD DWORD LWORD", "WORD": "DWORD LWORD", "DWORD": "LWORD",
    "TIME": "LTIME", "DATE": "LDATE", "TIME_OF_DAY": "LTIME_OF_DAY", "DATE_AND_TIME": "LDATE_AND_TIME",
}
IMPLICIT: dict[str, tuple[str, ...]] = {name: tuple(to.split()) for name, to in _IMPLICIT.items()}
"""The implicit conversions of each type, smallest first (figure 11; contested rows: LINT and ULINT to LREAL explicit)."""


def converts(source: Type, target: Type) -> bool:
    """True if a value of type `source` is converted implicitly to type `target`, or the types are equal.

    >>> converts(INT, DINT), converts(DINT, INT)
    (True, False)
    """
    source, target = base(source), base(target)
    if source == target:
        return True
    if isinstance(source, StringType) and isinstance(target, StringType):
        return source.wide == target.wide
    if isinstance(target, StringType):
        return source is character(target)
    if isinstance(source, RefType) and isinstance(target, RefType):
        return source.follows == target.follows and (
            source.target is None or source.moves and target.moves or
            source.interface == target.interface and derives(source.target, target.target))
    return isinstance(source, Elementary) and target.name in IMPLICIT.get(source.name, ()) \
        and isinstance(target, Elementary)


def common(left: Type, right: Type) -> Type | None:
    """The smallest type to which both are converted implicitly, or None.

    >>> common(INT, UINT).name
    'DINT'
    """
    left, right = base(left), base(right)
    if converts(left, right):
        return right
    if converts(right, left):
        return left
    for name in IMPLICIT.get(left.name, ()):
        if name in IMPLICIT.get(right.name, ()):
            return ELEMENTARY[name]
    return None
