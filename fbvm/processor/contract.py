"""What a program and Python have in common, as the compiled program says it: offsets, sizes and values of enumerations.

Nothing of this is written down a second time.  Python names fields and values, by the program's names; where they lie and
what they are comes from the symbols and types of its Image, once for each image.  A side that names what the other does not
is refused by a ContractError before anything runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import itemgetter
from struct import Struct
from typing import Any, NamedTuple

from fbvm.base.memory import FORMATS, STRUCTS
from fbvm.base.types import ArrayType, EnumType, StructType, Type, fold, machine
from fbvm.code.image import Image
from fbvm.watch.paths import Place, find_place

Packer = Callable[..., None]
"""Takes a buffer, an offset in bytes and the values of a row's fields."""
Unpacker = Callable[[memoryview, int], tuple[Any, ...]]
"""Takes a view and an offset in bytes; the fields of the row that begins there, in the order in which they were named."""
Rows = Callable[[memoryview], Iterator[tuple[Any, ...]]]
"""Takes a view of whole rows; the fields of each, in the order in which they were named."""


class ContractError(TypeError):
    """A program and Python do not name the same fields, or the same values; the message says which of them."""


class Leaf(NamedTuple):
    """One elementary value of a row: `offset` in bytes from the row's start, its machine type, and the type it has."""

    name: str
    offset: int
    machine: str
    type: Type


class Record:
    """A structure of a program as Python reads and writes it: `size` in bytes, and its values by name.

    A name is a path such as `local_port` or `host[0]`; as everywhere in ST, case does not matter."""

    def __init__(self, type_: StructType) -> None:
        self.name, self.size = type_.name, type_.size
        self._leaves = {fold(leaf.name): leaf for leaf in _leaves(type_, "", 0)}

    def __getitem__(self, name: str) -> Leaf:
        """The value of this name.  Raises ContractError if the program has none."""
        leaf = self._leaves.get(fold(name))
        if leaf is None:
            raise ContractError(f"{self.name} has no {name}; it has {_listed(leaf.name for leaf in self._leaves.values())}")
        return leaf

    def part(self, name: str) -> tuple[int, int]:
        """Offset and size in bytes of a value, or of all values of an array or a structure within the row."""
        inside = self._inside(name)
        if not inside:
            return self[name].offset, STRUCTS[self[name].machine].size
        return inside[0].offset, inside[-1].offset + STRUCTS[inside[-1].machine].size - inside[0].offset

    def _inside(self, name: str) -> list[Leaf]:
        folded = fold(name)
        return [leaf for known, leaf in self._leaves.items() if known.startswith((f"{folded}[", f"{folded}."))]

    def require(self, names: Iterable[str], who: str) -> None:
        """Raises ContractError unless the program's structure has these values and no other; `who` uses them.  The name of an
        array or a structure stands for all values in it."""
        named = {fold(leaf.name) for name in names for leaf in self._inside(name) or [self[name]]}
        if more := [leaf.name for folded, leaf in self._leaves.items() if folded not in named]:
            raise ContractError(f"{self.name} has {_listed(more)} in the program, of which {who} does not know")

    def enumeration(self, name: str) -> Enumeration:
        """The values that a field of enumerated type may have.  Raises ContractError for another type."""
        leaf = self[name]
        return Enumeration(leaf.type, f"{self.name}.{leaf.name}")

    def packer(self, *names: str) -> Packer:
        """A function `pack(buffer, offset, *values)` that writes these fields of a row, in this order, and 0 into all others.

        Fastest if they are named in the order in which they lie."""
        leaves = [self[name] for name in names]
        struct = self._struct(leaves)
        order = sorted(range(len(leaves)), key=lambda number: leaves[number].offset)
        if order == [*range(len(leaves))]:
            return struct.pack_into
        in_place = itemgetter(*order)
        return lambda buffer, offset, *values: struct.pack_into(buffer, offset, *in_place(values))

    def rows(self, *names: str) -> Rows:
        """A function that reads these fields, in this order, of all rows in a view.  Takes two names at least."""
        struct, as_named = self._named(names)
        return (lambda view: map(as_named, struct.iter_unpack(view))) if as_named else struct.iter_unpack

    def unpacker(self, *names: str) -> Unpacker:
        """A function that reads these fields, in this order, of one row.  Takes two names at least."""
        struct, as_named = self._named(names)
        return (lambda view, offset: as_named(struct.unpack_from(view, offset))) if as_named else struct.unpack_from

    def _named(self, names: Sequence[str]) -> tuple[Struct, itemgetter[Any] | None]:
        """What reads a row, and what puts its values into the order of the names, None if they lie in that order."""
        leaves = [self[name] for name in names]
        order = sorted(range(len(leaves)), key=lambda number: leaves[number].offset)
        if order == [*range(len(leaves))]:
            return self._struct(leaves), None
        return self._struct(leaves), itemgetter(*(order.index(number) for number in range(len(leaves))))

    def _struct(self, leaves: Iterable[Leaf]) -> Struct:
        """A whole row, of which everything but these values is padding."""
        form, at = "<", 0
        for leaf in sorted(leaves, key=lambda leaf: leaf.offset):
            form += f"{leaf.offset - at}x{FORMATS[leaf.machine]}"
            at = leaf.offset + STRUCTS[leaf.machine].size
        return Struct(f"{form}{self.size - at}x")


class Enumeration:
    """The values of an enumerated type of a program, by the program's names for them; case does not matter."""

    def __init__(self, type_: Type, where: str = "") -> None:
        if not isinstance(type_, EnumType):
            raise ContractError(f"{where or type_.name} is {type_.name} and no enumeration")
        self.name = type_.name
        self._members, self._shown = type_.members, type_.shown

    def __getitem__(self, name: str) -> int:
        value = self._members.get(fold(name))
        if value is None:
            raise ContractError(f"{self.name} has no {name}; it has {_listed(self._shown.values())}")
        return value

    def require(self, names: Iterable[str], who: str) -> None:
        """Raises ContractError unless the program's enumeration has these values and no other; `who` uses them."""
        known = {self[name] for name in names}
        if more := [name for value, name in self._shown.items() if value not in known]:
            raise ContractError(f"{self.name} has {_listed(more)} in the program, of which {who} does not know")


class Contract:
    """The variables of a program: where each lies in its memory, of which type it is, what its rows look like."""

    def __init__(self, image: Image) -> None:
        self.image = image
        self._places: dict[str, Place] = {}
        self._records: dict[str, Record] = {}

    def place(self, variable: str) -> Place:
        """Where a variable lies.  Raises UnknownPlace, and ValueError for one that does not fill bytes of its own."""
        place = self._places.get(variable)
        if place is None:
            place = find_place(self.image.symbols, self.image.layout.areas, variable)
            if place.hops or place.bit is not None:
                raise ValueError(f"{variable} does not lie in bytes of its own")
            self._places[variable] = place
        return place

    def offset(self, variable: str) -> int:
        """Where a variable lies in the program's memory, in bytes."""
        return self.place(variable).offset

    def size(self, variable: str) -> int:
        """How many bytes a variable has."""
        return self.place(variable).type.size

    def form(self, variable: str) -> str:
        """The machine type of a variable, or of the elements of an array; "u8" for what has fields."""
        type_ = self.place(variable).type
        while isinstance(type_, ArrayType):
            type_ = type_.element
        return "u8" if isinstance(type_, StructType) else _form(type_, variable)

    def array(self, variable: str) -> tuple[int, int, int]:
        """Of an array with one subscript: the lowest, how many elements there are, and how many bytes each has."""
        type_ = self.place(variable).type
        if not isinstance(type_, ArrayType) or len(type_.bounds) != 1:
            raise ContractError(f"{variable} is {type_.name}, and no array with one subscript")
        return type_.bounds[0][0], type_.count, type_.element.size

    def record(self, variable: str) -> Record:
        """The structure that a variable is, or that the elements of an array are."""
        record = self._records.get(variable)
        if record is None:
            type_ = self.place(variable).type
            element = type_.element if isinstance(type_, ArrayType) else type_
            if not isinstance(element, StructType):
                raise ContractError(f"{variable} is {type_.name} and has no fields")
            record = self._records[variable] = Record(element)
        return record

    def constant(self, variable: str) -> int:
        """The value that an integer, a TIME (in ns) or an enumeration has at power-on, as a VAR_GLOBAL CONSTANT has for ever."""
        place = self.place(variable)
        return int(STRUCTS[_form(place.type, variable)].unpack(self._initial_bytes(place))[0])

    def enumeration(self, type_: str) -> Enumeration:
        """The values of an enumerated type that the program uses."""
        found = self.image.types.get(fold(type_))
        if found is None:
            raise ContractError(f"the program uses no type {type_}")
        return Enumeration(found)

    def _initial_bytes(self, place: Place) -> bytes:
        found = bytearray(place.type.size)
        for offset, data in self.image.initial:
            for number in range(max(offset, place.offset), min(offset + len(data), place.offset + len(found))):
                found[number - place.offset] = data[number - offset]
        return bytes(found)


def _leaves(type_: Type, name: str, offset: int) -> Iterator[Leaf]:
    """The elementary values of which a type consists."""
    if isinstance(type_, StructType):
        for field in type_.fields.values():
            yield from _leaves(field.type, f"{name}.{field.name}" if name else field.name, offset + field.offset)
    elif isinstance(type_, ArrayType) and len(type_.bounds) == 1 and not type_.packed:
        low, element = type_.bounds[0][0], type_.element
        if isinstance(element, StructType | ArrayType):
            for number in range(type_.count):
                yield from _leaves(element, f"{name}[{low + number}]", offset + number * element.size)
        elif type_.count > 0:
            form = _form(element, f"{name}[{low}]")
            for number in range(type_.count):
                yield Leaf(f"{name}[{low + number}]", offset + number * element.size, form, element)
    else:
        yield Leaf(name, offset, _form(type_, name), type_)


def _form(type_: Type, name: str) -> str:
    form = machine(type_)
    if form not in FORMATS:
        raise ContractError(f"{name} is {type_.name}, which Python does not exchange with a program")
    return form


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)
