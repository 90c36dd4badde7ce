"""Reading and writing the value at a place: Python values on one side, the bytes of a PLC on the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from fbvm.base.memory import STRUCTS, WHOLE_BYTES, Memory
from fbvm.base.strings import packed, units
from fbvm.base.types import (
    AnyType,
    ArrayType,
    OpenArrayType,
    StringType,
    StructType,
    Type,
    base,
    families,
    machine,
)
from fbvm.code.operations import BIT_MASK, OFFSET_MASK, OFFSET_SHIFT
from fbvm.watch.paths import Place, Span, member
from fbvm.watch.values import Value, as_read, conform, parse_value, split_list


def read(memory: Memory, place: Place) -> Value:
    """The value at a place as a Python value (see `values`); None if a reference on the way to it is null."""
    at = _follow(memory, place)
    if at is None:
        return None
    return _read(memory, place.type, *at)


def reader(memory: Memory, place: Place) -> Callable[[], Value]:
    """A function that returns what `read` does; of a single number or BOOL without looking at its type again."""
    plain = base(place.type)
    form = machine(plain)
    if place.hops or form not in STRUCTS or form == "ref" or as_read(plain) is not plain or "ANY_CHAR" in families(plain):
        return partial(read, memory, place)
    offset, buffer, unpack = place.offset, memory.map, STRUCTS[form].unpack_from
    if place.bit is not None and form == "b":
        mask = 1 << place.bit
        return lambda: buffer[offset] & mask != 0
    return (lambda: buffer[offset] != 0) if form == "b" else lambda: unpack(buffer, offset)[0]


def write(memory: Memory, place: Place, value: object) -> None:
    """Writes a Python value to a place, wholly or not at all.

    Raises ValueError (out of range, constant, null reference) or TypeError (a value of another kind)."""
    for offset, data, bit in list(_pieces(memory, place, value)):
        if bit is None:
            memory.u8[offset : offset + len(data)] = data
        else:
            memory.write(offset, "b", data != b"\0", bit)


def write_all(memory: Memory, values: Mapping[Place, object]) -> None:
    """Writes each value to its place, as `write` does."""
    for place, value in values.items():
        write(memory, place, value)


def read_found(memory: Memory, found: Place | Span) -> Value:
    """The value at a place, or the list of values in a span of places."""
    return [read(memory, place) for place in found.places] if isinstance(found, Span) else read(memory, found)


def write_found(memory: Memory, found: Place | Span, value: object) -> None:
    """Writes a value to a place, or a list of values to a span of places.

    Raises as `write`, and ValueError for a list of another length."""
    if isinstance(found, Place):
        write(memory, found, value)
        return
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != len(found.places):
        raise ValueError(f"{found.name} takes a list of {len(found.places)} values")
    for place, item in zip(found.places, value, strict=True):
        write(memory, place, item)


def dereferenced(memory: Memory, place: Place) -> Place | None:
    """The place with its references followed: an offset and a bit, no hops; None if a reference on the way is null."""
    at = _follow(memory, place)
    return None if at is None else replace(place, offset=at[0], bit=at[1], hops=())


def _follow(memory: Memory, place: Place) -> tuple[int, int | None] | None:
    """Byte offset and bit where a place lies now, references followed."""
    offset, bit = place.offset, place.bit
    for distance in place.hops:
        reference = int(memory.read(offset, "ref"))
        if reference == 0:
            return None
        pointed = reference & BIT_MASK
        offset = (reference >> OFFSET_SHIFT & OFFSET_MASK) + distance
        bit = place.bit if pointed == WHOLE_BYTES else pointed
    return offset, bit


def _read(memory: Memory, kind: Type, offset: int, bit: int | None) -> Value:
    plain = base(kind)
    if isinstance(plain, OpenArrayType | AnyType):
        return None  # the argument may have ended, and only the called POU knows its bounds
    if isinstance(plain, ArrayType):
        return [_read(memory, plain.element, *_element(plain, offset, bit, number)) for number in range(plain.count)]
    if isinstance(plain, StructType):
        members: dict[str, Value] = {}
        for field in plain.fields.values():
            start = field.offset if field.absolute else offset + field.offset
            if field.reference:
                members[field.name] = read(memory, Place(field.name, field.type, start, field.bit, (0,)))
            else:
                members[field.name] = _read(memory, field.type, start, field.bit)
        return members
    if isinstance(plain, StringType):
        return _text(memory, plain, offset)
    if (kind := as_read(plain)) is not plain:
        return read(memory, Place("", kind, offset, bit, (0,)))
    form = machine(plain)
    value = memory.read(offset, form, WHOLE_BYTES if bit is None else bit)
    if form == "b":
        return bool(value)
    if form == "ref":
        return int(value) or None
    if "ANY_CHAR" in families(plain):
        return chr(int(value))
    return value


def _element(kind: ArrayType, offset: int, bit: int | None, number: int) -> tuple[int, int | None]:
    if bit is not None:
        return offset + (bit + number) // 8, (bit + number) % 8
    return offset + number * kind.element.size, None


def _text(memory: Memory, kind: StringType, offset: int) -> str:
    data = bytes(memory.u8[offset : offset + kind.size])
    if not kind.wide:
        return data.decode("latin-1").partition("\0")[0]
    return packed(units(data).partition("\0")[0]).decode("utf-16-le", "replace")


def _pieces(memory: Memory, place: Place, value: object) -> Iterator[tuple[int, bytes, int | None]]:
    """The bytes of `value` at a place, as (offset, bytes, bit); raises before the first one is written if any does not fit."""
    if place.constant:
        raise ValueError(f"{place.name} is CONSTANT")
    at = _follow(memory, place)
    if at is None:
        raise ValueError(f"{place.name} lies behind a reference that is null now")
    offset, bit = at
    plain = base(place.type)
    if isinstance(plain, ArrayType):
        if not isinstance(value, list | tuple) or len(value) != plain.count:
            raise ValueError(f"{place.name} is {place.type.name} and takes a list of {plain.count} values")
        for number, item in enumerate(value):
            element_offset, element_bit = _element(plain, offset, bit, number)
            element = Place(f"{place.name}[{number}]", plain.element, element_offset, element_bit)
            yield from _pieces(memory, element, item)
    elif isinstance(plain, StructType) and isinstance(value, dict):
        for name, item in value.items():
            yield from _pieces(memory, member(replace(place, offset=offset, hops=()), name), item)
    else:
        yield offset, _encoded(plain, conform(place.type, value, place.name)), bit


def parse_for(where: Place | Span, text: str) -> Value:
    """The value of a text such as `T#10ms` for a place; for a span a list of values, which commas separate in the text.

    Raises ValueError (out of range, no literal) or TypeError (another kind of literal), with the name of the place."""
    if isinstance(where, Place):
        return parse_value(where.type, text, where.name)
    texts = split_list(text)
    if len(texts) != len(where.places):
        raise ValueError(f"{where.name} takes {len(where.places)} values parted by commas, {len(texts)} given")
    return [parse_value(place.type, part, place.name) for place, part in zip(where.places, texts, strict=True)]


def _encoded(kind: Type, value: Value) -> bytes:
    if isinstance(kind, StringType) and isinstance(value, str):
        return packed(f"{value}\0") if kind.wide else f"{value}\0".encode("latin-1")
    if isinstance(value, str):
        value = ord(value)
    return STRUCTS[machine(kind)].pack(value)
