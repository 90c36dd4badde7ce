"""What lies at a byte: the way back from the flat memory to the paths and addresses that people know.

A variable of the program is named by its path, a word or bit of an area by the variable that is located there, else by
its address.  Frames of functions have no names that outlive a call, and none here.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import replace

from fbvm.base.areas import FLAG_AREAS, PAGE_BYTES, SLOTS_OFFSET, Address, Area
from fbvm.base.types import ArrayType, Field, RefType, StructType, base
from fbvm.watch.paths import Place, UnknownPlace, find_place, member

REFERENCE = RefType("reference", 8, 8, None)


class Names:
    """The names of everything in the memory of one program.  Knows where things lie, not what they hold."""

    def __init__(self, symbols: Mapping[str, Field], areas: Mapping[str, Area]) -> None:
        self._symbols, self._areas = symbols, areas
        tops = [Place(field.name, REFERENCE if field.reference else field.type, field.offset, field.bit)
                for field in symbols.values()]
        self._slots = sorted((place for place in tops if self._in_slots(place)), key=lambda place: place.offset)
        self._starts = [place.offset for place in self._slots]
        self._located = [place for place in tops if not self._in_slots(place)]
        for place in self._slots:
            self._located += _located_in(place)
        self._known: dict[tuple[int, int | None], Place | None] = {}
        self._instances: dict[int, Place] = {}

    def _in_slots(self, place: Place) -> bool:
        return place.offset >= SLOTS_OFFSET and all(area.offset > place.offset or place.offset >= _end(area)
                                                    for area in self._areas.values())  # fmt: skip

    def at(self, offset: int, bit: int | None = None) -> Place | None:
        """The single value to which a byte, or one bit of it, belongs; None for what has no name."""
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
                found = _address(self._areas, area, place.offset, place.bit)
                return found.name if found else ""
        return ""

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

    def _in_area(self, offset: int, bit: int | None) -> Place | None:
        fitting = [place for place in self._located
                   if place.offset <= offset < place.offset + place.type.size and place.bit in (None, bit)]
        for place in sorted(fitting, key=lambda place: (place.type.size, place.bit is None)):
            inner: Place | None = place
            while inner is not None and isinstance(base(inner.type), ArrayType | StructType):
                inner = _part(inner, offset)
            if inner is not None and (inner.bit is not None or bit is None):
                return inner
        area = next((area for area in self._areas.values() if area.offset <= offset < _end(area)), None)
        return _address(self._areas, area, offset, bit) if area else None


def _end(area: Area) -> int:
    return area.offset + area.size_bytes


def _located_in(place: Place) -> Iterator[Place]:
    """The located variables in a program or a block; all elements of an array have the same ones."""
    if isinstance(place.type, ArrayType):
        yield from _located_in(place.inner(f"{place.name}[{place.type.bounds[0][0]}]", place.type.element, 0))
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
        name = f"{place.name}[{', '.join(map(str, _subscripts(kind, number)))}]"
        return place.inner(name, kind.element, number * size)
    assert isinstance(kind, StructType)
    for field in kind.fields.values():
        size = 8 if field.reference else field.type.size
        if not field.absolute and place.offset + field.offset <= offset < place.offset + field.offset + size:
            inner = member(place, field.name)
            return replace(inner, type=REFERENCE, hops=()) if inner.hops else inner
    return None


def _subscripts(kind: ArrayType, number: int) -> list[int]:
    subscripts: list[int] = []
    for low, high in reversed(kind.bounds):
        number, rest = divmod(number, high - low + 1)
        subscripts.insert(0, low + rest)
    return subscripts


def _address(areas: Mapping[str, Area], area: Area, offset: int, bit: int | None) -> Place | None:
    """The word, byte, bit or flag of an area."""
    distance = offset - area.offset
    text = ""
    if area.name in FLAG_AREAS:
        address = Address(area.name, distance * 8 + (bit or 0))
        text = f"{area.name}{address.number}"  # T0005 alone means the present value
    elif area.unit_bits == 8:
        address = Address(area.name, distance, bit, 1 if bit is not None else 8)
    else:
        address = Address(area.name, distance // 2, None if bit is None else distance % 2 * 8 + bit)
    try:
        return find_place({}, areas, text or str(address))
    except UnknownPlace:
        return None


def is_single(place: Place) -> bool:
    """True for a value that is no array, structure or instance."""
    return not isinstance(base(place.type), ArrayType | StructType)
