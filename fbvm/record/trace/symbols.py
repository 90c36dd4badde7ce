"""Symbols as plain data and back: a trace keeps the symbols of its image, so it can be shown without the source.

Structures are written once and named by number.  A type that a reader does not know is bytes of some size.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from fbvm.base.types import (
    DEEPEST_TYPE,
    ELEMENTARY,
    ArrayType,
    Elementary,
    EnumType,
    Field,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    array,
    fold,
    string,
)


class SymbolError(ValueError):
    """The data are no symbols that `to_data` has written."""


def to_data(symbols: Mapping[str, Field]) -> dict[str, Any]:
    """Symbols as lists and dictionaries that JSON can write."""
    writer = _Writer()
    fields = [writer.field(field) for field in symbols.values()]
    writer.write_waiting()
    return {"types": writer.structures, "symbols": fields}


def from_data(data: Mapping[str, Any]) -> dict[str, Field]:
    """The symbols again, by folded name.  Raises SymbolError for what `to_data` did not write."""
    try:
        reader, known = _Reader(data["types"]), dict[int, int]()
        fields = {fold(field.name): field for field in map(reader.field, data["symbols"])}
        reader.read_waiting()
        if max((_depth(field.type, known) for field in fields.values()), default=0) > DEEPEST_TYPE + 1:  # what it holds is 1
            raise SymbolError(f"no symbols: types are nested deeper than {DEEPEST_TYPE}")
        return fields
    except SymbolError:
        raise
    except (ArithmeticError, KeyError, TypeError, ValueError, IndexError, AttributeError, RecursionError) as error:
        raise SymbolError(f"no symbols: {type(error).__name__} {error}") from None


def _depth(kind: Type, known: dict[int, int]) -> int:
    """How many types a type has one in the other.  `known` are those of types that were seen, 0 while one is looked at.

    Raises SymbolError for a type that holds itself, which only damage makes."""
    if not isinstance(kind, ArrayType | StructType):
        return 1
    if id(kind) not in known:
        known[id(kind)] = 0
        inner = [kind.element] if isinstance(kind, ArrayType) else [field.type for field in kind.fields.values()]
        known[id(kind)] = 1 + max((_depth(each, known) for each in inner), default=0)
    if not known[id(kind)]:
        raise SymbolError(f"no symbols: {kind.name} holds itself")
    return known[id(kind)]


class _Writer:
    def __init__(self) -> None:
        self.structures: list[Any] = []
        self._numbers: dict[int, int] = {}
        self._waiting: deque[tuple[int, StructType]] = deque()
        """Structures whose rows are not written yet: references may lead from one to the next by thousands."""

    def write_waiting(self) -> None:
        """Write the rows of all structures that were named."""
        while self._waiting:
            number, kind = self._waiting.popleft()
            fields = [self.field(field) for field in kind.fields.values()]
            self.structures[number] = [kind.name, kind.size, kind.align, kind.block, fields]

    def field(self, field: Field) -> list[Any]:
        flags = field.absolute | field.reference << 1 | field.constant << 2 | field.hexadecimal << 3
        rest = (field.space, *field.frame_at) if field.space or field.frame_at else ()
        return [field.name, self.type(field.type), field.offset, field.kind, field.bit, flags, *rest]

    def type(self, kind: Type) -> Any:
        """A type as data: an elementary type is its name, any other type a list with its kind in front."""
        if isinstance(kind, Elementary):
            return kind.name
        if isinstance(kind, StringType):
            return ["wstring" if kind.wide else "string", kind.capacity]
        if isinstance(kind, ArrayType):
            return ["array", [list(pair) for pair in kind.bounds], self.type(kind.element)]
        if isinstance(kind, StructType):
            return ["struct", self._structure(kind)]
        if isinstance(kind, EnumType):
            return ["enum", kind.name, kind.base.name, {str(value): name for value, name in kind.shown.items()}]
        if isinstance(kind, SubrangeType):
            return ["subrange", kind.name, kind.base.name, kind.low, kind.high]
        if isinstance(kind, RefType):
            return ["ref", kind.name, None if kind.target is None else self.type(kind.target), kind.moves, kind.follows]
        return ["bytes", kind.name, kind.size, kind.align]

    def _structure(self, kind: StructType) -> int:
        number = self._numbers.get(id(kind))
        if number is None:
            number = self._numbers[id(kind)] = len(self.structures)
            self.structures.append(None)
            self._waiting.append((number, kind))
        return number


class _Reader:
    def __init__(self, structures: list[Any]) -> None:
        self._rows = structures
        self._made: dict[int, StructType] = {}
        self._waiting: deque[int] = deque()
        """Structures whose members are not read yet."""

    def read_waiting(self) -> None:
        """Read the members of all structures that were named."""
        while self._waiting:
            number = self._waiting.popleft()
            for field in map(self.field, self._rows[number][4]):
                self._made[number].fields[fold(field.name)] = field

    def field(self, row: list[Any]) -> Field:
        name, kind, offset, section, bit, flags, *rest = row
        return Field(str(name), self.type(kind), int(offset), str(section), bit, bool(flags & 1), bool(flags & 2),
                     bool(flags & 4), bool(flags & 8), str(rest[0]) if rest else "", tuple(map(int, rest[1:])))  # fmt: skip

    def type(self, data: Any) -> Type:
        if isinstance(data, str):
            return ELEMENTARY[data]
        made: Type = _MAKERS[data[0]](self, *data[1:])
        return made

    def structure(self, number: int) -> Type:
        if number not in self._made:
            name, size, align, block, _ = self._rows[number]
            self._made[number] = StructType(str(name), int(size), int(align), {}, bool(block))
            self._waiting.append(number)
        return self._made[number]

    def array(self, bounds: list[list[int]], element: Any) -> Type:
        return array(tuple((int(low), int(high)) for low, high in bounds), self.type(element))

    def enumeration(self, name: str, base: str, shown: dict[str, str]) -> Type:
        kind, names = ELEMENTARY[base], {int(value): text for value, text in shown.items()}
        members = {fold(text): value for value, text in names.items()}
        return EnumType(name, kind.size, kind.align, kind, members, names)

    def subrange(self, name: str, base: str, low: int, high: int) -> Type:
        kind = ELEMENTARY[base]
        return SubrangeType(name, kind.size, kind.align, kind, low, high)

    def reference(self, name: str, target: Any, moves: bool, follows: bool) -> Type:
        return RefType(name, 8, 8, None if target is None else self.type(target), moves, follows)


_MAKERS: dict[str, Any] = {
    "string": lambda reader, capacity: string(capacity),
    "wstring": lambda reader, capacity: string(capacity, wide=True),
    "array": _Reader.array, "struct": _Reader.structure, "enum": _Reader.enumeration, "subrange": _Reader.subrange,
    "ref": _Reader.reference, "bytes": lambda reader, name, size, align: Type(name, size, align),
}  # fmt: skip
