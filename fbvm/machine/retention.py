"""What a changed program keeps of the one before it: retained variables by their names, and retained areas.

Offsets differ between programs, so `warm_start` of one PLC cannot do it."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.types import ArrayType, RefType, StructType, Type, base
from fbvm.machine.plc import Plc
from fbvm.watch.paths import Place, UnknownPlace, element, find, member


def start_with_retained(new: Plc, old: Plc) -> list[Place]:
    """Power off and on with another program: starts `new` with what a warm start of `old` would have kept.

    Whoever loads a program tells the instances of `old` before, see `endings.end_instances`.

    A RETAIN variable keeps its value if both programs have one of that name and its value fits; of structures and arrays that
    goes for each part.  Retained areas are kept as they are.  Returns the single variables that were kept."""
    for name, area in new.memory.areas.items():
        was = old.memory.areas.get(name)
        if area.retained and was is not None:
            size = min(area.size_bytes, was.size_bytes)
            new.memory.u8[area.offset : area.offset + size] = old.memory.u8[was.offset : was.offset + size]
    kept = [place for row in new.image.retained for place in _carried(old, new, row.name)]
    new.warm_start()
    return [place for place in kept if not place.name.startswith("__")]


def _carried(old: Plc, new: Plc, name: str) -> Iterator[Place]:
    try:
        source, target = (find(plc.image.symbols, plc.memory.areas, name) for plc in (old, new))
    except UnknownPlace:
        return
    if isinstance(source, Place) and isinstance(target, Place) and any(_covers(row.name, name) for row in old.image.retained):
        yield from _copied(old, new, source, target)


def _covers(whole: str, name: str) -> bool:
    """True if `name` is `whole`, or something in it, or what it is in."""
    longer, shorter = (whole.upper(), name.upper()) if len(whole) > len(name) else (name.upper(), whole.upper())
    return longer.startswith(shorter) and longer[len(shorter) :][:1] in ("", ".", "[")


def _copied(old: Plc, new: Plc, source: Place, target: Place) -> Iterator[Place]:
    """Copies the single values of a variable, and returns where they went."""
    was, kind = base(source.type), base(target.type)
    if source.hops or target.hops or isinstance(kind, RefType):
        return  # what a reference points to belongs to a program
    if isinstance(kind, StructType):
        for field in kind.fields.values():
            if isinstance(was, StructType) and was.member(field.name):
                yield from _copied(old, new, member(source, field.name), member(target, field.name))
    elif isinstance(kind, ArrayType):
        if isinstance(was, ArrayType) and len(was.bounds) == len(kind.bounds):
            yield from _copied_elements(old, new, (source, was), (target, kind))
    elif isinstance(was, type(kind)) and _same(was, kind):
        try:
            new.write(target, old.read(source))
        except ValueError:  # a text that is too long now, or a value outside of the new subrange
            return
        yield target


def _same(was: Type, kind: Type) -> bool:
    return was.name == kind.name or type(was).__name__ == "StringType"


def _copied_elements(old: Plc, new: Plc, source: tuple[Place, ArrayType], target: tuple[Place, ArrayType]) -> Iterator[Place]:
    """Copies elements by their subscripts, whatever the bounds are now."""
    before = {_subscripts(place): place for number in range(source[1].count) for place in (element(*source, number),)}
    for number in range(target[1].count):
        place = element(*target, number)
        if (found := before.get(_subscripts(place))) is not None:
            yield from _copied(old, new, found, place)


def _subscripts(place: Place) -> str:
    return place.name[place.name.rindex("[") :]
