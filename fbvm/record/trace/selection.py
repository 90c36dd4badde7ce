"""The values that a trace keeps: path patterns (`Main.*.Q`, `Main.Pump`), addresses and ranges (`D200..D299`)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fbvm.base.areas import Area
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import ArrayType, Field, StructType, followed
from fbvm.watch.paths import Place, Span, UnknownPlace, element, find, member

MOST_ELEMENTS = 4096
"""Elements of an array that are compared with a pattern with a star."""

FEW_ELEMENTS = 32
"""Elements that an array may have to be shown by default."""


@dataclass(frozen=True)
class Selection:
    """The selected places, or `everything` if there is no pattern."""

    places: tuple[Place, ...]
    everything: bool

    def covers(self, offset: int, size: int, bit: int) -> bool:
        """True if an access to some bytes, or to bit `bit`, reads or writes a selected value."""
        return self.everything or any(
            place.offset < offset + size and offset < place.offset + place.type.size
            and (place.bit is None or bit in (place.bit, WHOLE_BYTES)) for place in self.places)  # fmt: skip

    def extents(self, start: int, end: int, step: int) -> list[tuple[int, int]]:
        """The byte ranges of the selected values between `start` and `end`, in multiples of `step` and without overlap."""
        if self.everything:
            return [(start, end)]
        steps = sorted({number for place in self.places
                        for number in range(place.offset // step, (place.offset + place.type.size - 1) // step + 1)})  # fmt: skip
        extents: list[tuple[int, int]] = []
        for number in steps:
            if extents and extents[-1][1] == number * step:
                extents[-1] = extents[-1][0], (number + 1) * step
            else:
                extents.append((number * step, (number + 1) * step))
        return extents


def select(symbols: Mapping[str, Field], areas: Mapping[str, Area], patterns: Sequence[str]) -> Selection:
    """The values that patterns name; a structure or an instance selects all its members.

    Raises UnknownPlace for a pattern without a match."""
    places: dict[Place, None] = {}
    for pattern in patterns:
        places.update(dict.fromkeys(_matching_places(symbols, areas, pattern)))
    inner = [part for place in places for part in (place, *_located(place))]
    return Selection(tuple(inner), not patterns)


def _matching_places(symbols: Mapping[str, Field], areas: Mapping[str, Area], pattern: str) -> Iterator[Place]:
    if "*" not in pattern:
        found = find(symbols, areas, pattern)
        yield from found.places if isinstance(found, Span) else (found,)
        return
    fits = re.compile(".*".join(re.escape(part.strip()) for part in pattern.split("*")), re.I).fullmatch
    chosen = [place for top in symbol_places(symbols) for place in _within(top, fits)]
    if not chosen:
        raise UnknownPlace(f"no variable is called like {pattern}")
    yield from chosen


def _within(place: Place, fits: object) -> Iterator[Place]:
    assert callable(fits)
    if fits(place.name):
        yield place
    elif isinstance(place.type, StructType):
        for inner in _members(place):
            yield from _within(inner, fits)
    elif isinstance(place.type, ArrayType):
        elements = [element(place, place.type, number) for number in range(min(place.type.count, MOST_ELEMENTS))]
        if not isinstance(place.type.element, StructType | ArrayType) and all(fits(each.name) for each in elements):
            yield place
            return
        for each in elements:
            yield from _within(each, fits)


def symbol_places(symbols: Mapping[str, Field]) -> Iterator[Place]:
    """The places of all symbols that are no references."""
    return (Place(field.name, field.type, field.offset, field.bit) for field in symbols.values()
            if not field.reference and followed(field.type) is field.type)


def _members(place: Place) -> Iterator[Place]:
    assert isinstance(place.type, StructType)
    for field in place.type.fields.values():
        inner = member(place, field.name)
        if not inner.hops:
            yield inner


def single_places(place: Place) -> Iterator[Place]:
    """All single values in a place, without arrays of more than FEW_ELEMENTS elements."""
    if isinstance(place.type, StructType):
        for inner in _members(place):
            yield from single_places(inner)
    elif isinstance(place.type, ArrayType):
        if place.type.count <= FEW_ELEMENTS:
            for number in range(place.type.count):
                yield from single_places(element(place, place.type, number))
    else:
        yield place


def _located(place: Place) -> Iterator[Place]:
    """Variables of an instance that are located in an area (AT)."""
    if isinstance(place.type, StructType):
        for inner in _members(place):
            outside = not place.offset <= inner.offset < place.offset + place.type.size
            yield from (inner,) if outside else _located(inner)
