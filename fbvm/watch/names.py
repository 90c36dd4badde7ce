"""The names of memory: the path or the address of the variable to which a byte of the flat memory belongs.

A variable of the program is named by its path, a word or bit of an area by the variable that is located there, else by
its address.  Frames of functions have no names that outlive a call, and none here.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fbvm.base.areas import FLAG_AREAS, PAGE_BYTES, SLOTS_OFFSET, Address, Area
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import ArrayType, Elementary, Field, RefType, StructType, Type, base, followed
from fbvm.code.image import Image
from fbvm.code.operations import BIT_MASK, BUFFER_OBJECT, FIRST_OBJECT, LEASED, OBJECT_SHIFT, OFFSET_MASK, OFFSET_SHIFT
from fbvm.watch.paths import Place, Span, find_place, member
from fbvm.watch.values import Value, as_read

REFERENCE = RefType("reference", 8, 8, None)
_LETTERS = {2: "W", 4: "D", 8: "L"}
"""Size prefixes of addresses of several bytes (table 16)."""


class Names:
    """The names of all variables and addresses in the memory of one program; values are not read here.

    `symbols` and `areas` are those of the program, `extents` the first and last byte offsets of its objects, by which a
    pointer that points behind its variable is recognised, `heap` the bytes from which __NEW takes."""

    def __init__(self, symbols: Mapping[str, Field], areas: Mapping[str, Area],
                 extents: Sequence[tuple[int, int]] = (), heap: range = range(0)) -> None:  # fmt: skip
        self._symbols, self._areas, self._extents, self._heap = symbols, areas, extents, heap
        symbols_places = [Place(field.name, _bound(field.type) if field.reference else field.type, field.offset, field.bit)
                for field in symbols.values()]
        self._slots = sorted((place for place in symbols_places if self._in_slots(place)), key=lambda place: place.offset)
        self._starts = [place.offset for place in self._slots]
        self._located = [place for place in symbols_places if not self._in_slots(place)]
        for place in self._slots:
            self._located += _located_in(place)
        whole = {(area.offset, area.size_bytes) for area in areas.values()}  # arrays with which libraries compute addresses
        self._located = [place for place in self._located if (place.offset, place.type.size) not in whole]
        self._known: dict[tuple[int, int | None], Place | None] = {}
        self._instances: dict[int, Place] = {}
        self._reference_names: dict[tuple[int, str], str] = {}

    @classmethod
    def of(cls, image: Image, areas: Mapping[str, Area]) -> Names:
        """The names in the memory of a program that runs."""
        layout = image.layout
        return cls(image.symbols, areas, image.objects.extents, range(layout.heap_at, layout.heap_at + layout.heap_bytes))

    def _in_slots(self, place: Place) -> bool:
        return place.offset >= SLOTS_OFFSET and all(area.offset > place.offset or place.offset >= _end(area)
                                                    for area in self._areas.values())  # fmt: skip

    def at(self, offset: int, bit: int | None = None) -> Place | None:
        """The single value to which byte `offset`, or bit `bit` of it, belongs; None for a byte without a name."""
        key = offset, bit
        if key not in self._known:
            self._known[key] = self._slot(offset) or self._in_area(offset, bit)
        return self._known[key]

    def within(self, offset: int, size: int) -> Iterator[Place]:
        """The single values that lie in some bytes, from low to high."""
        at, end = offset, offset + size
        while at < end:
            place = self.at(at)
            if place is None:
                at += 1
                continue
            yield place
            at = max(at + 1, place.offset + place.type.size)

    def instance(self, offset: int) -> str:
        """The path of the program or function block whose instance begins at a byte, "" if none does."""
        if offset not in self._instances:
            found = self._instance(offset)
            self._instances[offset] = found or Place("", REFERENCE, offset)
        return self._instances[offset].name

    def address(self, place: Place) -> str:
        """The address at which a variable is located, "" for one in the program's own memory."""
        for area in self._areas.values():
            if area.offset <= place.offset < _end(area):
                return _address(self._areas, area, place.offset, place.bit).name
        return ""

    # --- references

    def read(self, read: Callable[[Any], Value], where: Place | Span) -> Value:
        """The value that the function `read` returns for a place, with names in place of references (see `name_references`)."""
        value = read(where)
        if not isinstance(where, Place) or isinstance(where.type, Elementary):
            return value
        return self.name_references(where.type, value)

    def name_references(self, kind: Type, value: Value) -> Value:
        """The value of a variable of type `kind`, with a text such as `-> Main.a[3]` in place of each reference in it."""
        plain = base(as_read(kind))
        if isinstance(plain, RefType) and type(value) is int:
            return self.reference_name(value, plain.target)
        if isinstance(value, list) and isinstance(plain, ArrayType):
            return [self.name_references(plain.element, item) for item in value]
        if isinstance(value, dict) and isinstance(plain, StructType):
            kinds = {field.name: field.type for field in plain.fields.values()}
            return {name: self.name_references(kinds[name], item) for name, item in value.items()}
        return value

    def reference_name(self, reference: int, target: Type | None) -> str:
        """The variable that a reference points to: `-> Main.a[3]`, `-> D200`; `outside of Main.a`
        if the reference has left its variable.

        `reference` are the 64 bits of the reference, `target` is its declared target type, None for NULL."""
        key = reference, target.name if target else ""
        if key not in self._reference_names:
            self._reference_names[key] = self._find_reference_name(reference, target)
        return self._reference_names[key]

    def _find_reference_name(self, reference: int, target: Type | None) -> str:
        number, offset = reference >> OBJECT_SHIFT, reference >> OFFSET_SHIFT & OFFSET_MASK
        row = number - FIRST_OBJECT
        if 0 <= row < len(self._extents):
            start, end = self._extents[row]
            if not start <= offset < end:
                return f"outside of {self._whole(start, end)}"
        bit = reference & BIT_MASK
        place = self._fitting(offset, None if bit == WHOLE_BYTES else bit, target)
        if offset in self._heap and number >= LEASED:
            return f"-> {target.name if target else 'a variable'} of __NEW (16#{offset:X})"
        if place is None:
            local = number == BUFFER_OBJECT or number >= LEASED
            return "-> a local variable" if local else f"no variable (16#{reference:016X})"
        behind = offset - place.offset
        return f"-> {place.name}" + (f" + {behind} byte{'s' * (behind != 1)}" if behind else "")

    def _whole(self, start: int, end: int) -> str:
        """The name of the variable, or of the area, that fills these bytes."""
        for area in self._areas.values():
            if (area.offset, _end(area)) == (start, end):
                return area.name
        chain = list(self._chain(start, None))
        fitting = [place for place in chain if (place.offset, place.type.size) == (start, end - start)]
        return (fitting or chain[-1:] or [Place("its variable", REFERENCE, start)])[0].name

    def _fitting(self, offset: int, bit: int | None, target: Type | None) -> Place | None:
        """The variable that a reference to a byte means: of those that begin there the one of the target's type."""
        chain = list(self._chain(offset, bit))
        same = [place for place in chain
                if place.offset == offset and target and base(place.type).name == base(target).name]
        return next(iter(same), None) or self._addressed(offset, target) or self.at(offset, bit) or next(reversed(chain), None)

    def _addressed(self, offset: int, target: Type | None) -> Place | None:
        """The word, double word or long word of an area of bytes, %MW20, in which no variable is located."""
        area = next((area for area in self._areas.values() if area.offset <= offset < _end(area)), None)
        if target is None or target.size not in _LETTERS or area is None or area.unit_bits != 8 or self._at_area(offset, None):
            return None
        number, rest = divmod(offset - area.offset, target.size)
        if rest or area.address_bits not in (0, 8 * target.size):
            return None
        return find_place({}, self._areas, f"%{area.name.lstrip('%')[0]}{_LETTERS[target.size]}{number}")

    def _chain(self, offset: int, bit: int | None) -> Iterator[Place]:
        """The variables to which a byte belongs: each is followed by its element or member that holds the byte."""
        top = self._top(offset)
        for start in [top] if top else self._at_area(offset, bit):
            place: Place | None = start
            while place is not None:
                yield place
                place = _part(place, offset) if isinstance(base(place.type), ArrayType | StructType) else None

    # --- the slots of the program

    def _top(self, offset: int) -> Place | None:
        number = bisect_right(self._starts, offset) - 1
        if number < 0 or offset >= self._slots[number].offset + self._slots[number].type.size:
            return None
        return self._slots[number]

    def _slot(self, offset: int) -> Place | None:
        place = self._top(offset)
        while place is not None and isinstance(base(place.type), ArrayType | StructType):
            place = _part(place, offset)
        return place

    def _instance(self, offset: int) -> Place | None:
        place = self._top(offset)
        while place is not None:
            if place.offset == offset and isinstance(place.type, StructType) and place.type.block:
                return place
            if not isinstance(place.type, ArrayType | StructType):
                return None
            place = _part(place, offset)
        return None

    # --- areas

    def _at_area(self, offset: int, bit: int | None) -> list[Place]:
        """The located variables that have a byte, the smallest first."""
        fitting = [place for place in self._located
                   if place.offset <= offset < place.offset + place.type.size and place.bit in (None, bit)]
        return sorted(fitting, key=lambda place: (place.type.size, place.bit is None))

    def _in_area(self, offset: int, bit: int | None) -> Place | None:
        for place in self._at_area(offset, bit):
            inner: Place | None = place
            while inner is not None and isinstance(base(inner.type), ArrayType | StructType):
                inner = _part(inner, offset)
            if inner is not None and (inner.bit is not None or bit is None):
                return inner
        area = next((area for area in self._areas.values() if area.offset <= offset < _end(area)), None)
        return _address(self._areas, area, offset, bit) if area else None


def _bound(kind: Type) -> RefType:
    """The type of the 64-bit reference in the slot of an in-out or a REFERENCE TO."""
    return replace(REFERENCE, target=followed(kind))


def _end(area: Area) -> int:
    return area.offset + area.size_bytes


def _located_in(place: Place) -> Iterator[Place]:
    """The located variables in a program or a block; all elements of an array have the same ones."""
    if isinstance(place.type, ArrayType):
        first = ", ".join(str(low) for low, _ in place.type.bounds)
        yield from _located_in(place.inner(f"{place.name}[{first}]", place.type.element, 0))
    elif isinstance(place.type, StructType):
        for field in place.type.fields.values():
            inner = member(place, field.name)
            if field.absolute and inner.offset >= PAGE_BYTES:
                yield inner
            elif not field.absolute and not inner.hops:
                yield from _located_in(inner)


def _part(place: Place, offset: int) -> Place | None:
    """The element or member of a place that holds a byte; None for what lies between members."""
    kind = base(place.type)
    if isinstance(kind, ArrayType):
        size = kind.element.size
        number = (offset - place.offset) // size
        name = f"{place.name}[{kind.subscripts(number)}]"
        return place.inner(name, kind.element, number * size)
    assert isinstance(kind, StructType)
    for field in kind.fields.values():
        size = 8 if field.reference else field.type.size
        if not field.absolute and place.offset + field.offset <= offset < place.offset + field.offset + size:
            inner = member(place, field.name)
            return replace(inner, type=_bound(field.type), hops=()) if inner.hops else inner
    return None


def _address(areas: Mapping[str, Area], area: Area, offset: int, bit: int | None) -> Place:
    """The word, byte, bit or flag of an area; each byte of one, and each bit, has an address."""
    distance = offset - area.offset
    text = ""
    if area.name in FLAG_AREAS:
        address = Address(area.name, distance * 8 + (bit or 0))
        text = f"{area.name}{address.number}"  # T0005 alone means the present value
    elif area.address_bits > 8 and bit is None:
        address = Address(area.name, distance * 8 // area.address_bits, None, area.address_bits)
    elif area.unit_bits == 8:
        bit = 0 if area.address_bits == 1 and bit is None else bit
        address = Address(area.name, distance, bit, 1 if bit is not None else 8)
    else:
        address = Address(area.name, distance // 2, None if bit is None else distance % 2 * 8 + bit)
    return find_place({}, areas, text or str(address))


def is_single(place: Place) -> bool:
    """True for a value that is no array, structure or instance."""
    return not isinstance(base(place.type), ArrayType | StructType)
