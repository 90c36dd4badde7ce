"""Parses what users write to places in memory: `Main.conn.ENO`, `Main.a[3].b`, `D200`, `CIO 1509.15`, `D200..D202`.

The name of a variable goes before an address; `%D200` is always an address.  Values are read by `places`.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches

from fbvm.base.areas import FLAG_AREAS, PORTABLE_AREAS, Address, AddressError, Area, parse_address
from fbvm.base.digits import whole_number
from fbvm.base.types import (
    BOOL,
    BYTE,
    DWORD,
    LWORD,
    WORD,
    ArrayType,
    Elementary,
    Field,
    RefType,
    StringType,
    StructType,
    Type,
    base,
    characters,
    fold,
)


class UnknownPlace(LookupError):
    """The text names nothing in this PLC; the message says which part and what would.

    `unheard` is the name that it begins with, if nothing in the whole program is called so."""

    def __init__(self, message: str, unheard: str = "") -> None:
        super().__init__(message)
        self.unheard = unheard


@dataclass(frozen=True)
class Place:
    """One value in the buffer: `offset` in bytes, `bit` 0..7 for a BOOL that shares its byte.

    `hops` is not empty if the way leads through references: at each step the 64 bits at the place are a reference, and
    the value lies the given number of bytes behind where it points.  `area` names the Omron area of an address."""

    name: str
    type: Type
    offset: int
    bit: int | None = None
    hops: tuple[int, ...] = ()
    area: str = ""
    constant: bool = False
    hexadecimal: bool = False
    """True if a pragma of the declaration asks for hexadecimal."""

    @property
    def is_generated(self) -> bool:
        """True for a variable that the compiler has added, such as the memory of an edge in a rung, or `pump ENO`."""
        return "$" in self.name or not self.area and _OF_WORDS.search(self.name) is not None

    def inner(self, name: str, type_: Type, distance: int, bit: int | None = None) -> Place:
        """The part of this place that begins `distance` bytes behind its start."""
        if self.hops:
            return replace(self, name=name, type=type_, hops=(*self.hops[:-1], self.hops[-1] + distance), bit=bit)
        return replace(self, name=name, type=type_, offset=self.offset + distance, bit=bit)


@dataclass(frozen=True)
class Span:
    """Several places of an area in a row, `D200..D202`: read and written as a list."""

    name: str
    places: tuple[Place, ...]


_TOKEN = re.compile(
    r"\s*(?:(?P<name>[^\W\d]\w*)|(?P<bit>\.\s*%?X?\d+(?!\w))|(?P<dot>\.)|\[(?P<index>[^\]]*)\]|(?P<hat>\^))", re.I
)
_NAMES = re.compile(r"\s*([^\W\d]\w*)(?:\s*\.\s*([^\W\d]\w*))?")
_FIRST = re.compile(r"\s*([^\W\d]\w*)")
_SPACED = re.compile(r"\s*[A-Z]\w*\s+\d+(\.\d+)?\s*", re.I)
"""`D 10`: a name with a space before a number is an address, whatever is called D."""
_OF_WORDS = re.compile(r"\w \w")
"""A space within a name, as the compiler writes them; between subscripts it stands behind a comma."""
_ADDRESS_TYPES = {8: BYTE, 16: WORD, 32: DWORD, 64: LWORD}


def find(symbols: Mapping[str, Field], areas: Mapping[str, Area], text: str) -> Place | Span:
    """The place or the span that `text` names.

    `symbols` are the program's variables by folded name, `areas` the memory areas of the PLC.  Raises UnknownPlace.

    >>> from fbvm.base.areas import AREAS
    >>> find({}, AREAS, "D200").offset == AREAS["D"].offset + 400
    True
    >>> [place.name for place in find({}, AREAS, "CIO 0.14..1.00").places]
    ['CIO 0.14', 'CIO 0.15', 'CIO 1.00']
    """
    if ".." in text:
        return _span(areas, text)
    first = _FIRST.match(text)
    top = _top(symbols, text)
    if top is not None and not _SPACED.fullmatch(text):
        return _walk(*top, text)
    try:
        address = parse_address(text, areas)
    except AddressError as error:
        raise _unknown(symbols, text, first[1] if first else "", str(error)) from None
    return _at(areas, address)


def find_place(symbols: Mapping[str, Field], areas: Mapping[str, Area], text: str) -> Place:
    """The one place that `text` names.  Raises UnknownPlace, also for a span."""
    found = find(symbols, areas, text)
    if isinstance(found, Span):
        raise UnknownPlace(f"{text} is a range; name one place")
    return found


def _unknown(symbols: Mapping[str, Field], text: str, first: str, reason: str) -> UnknownPlace:
    """The error about a name that is neither a symbol nor an address."""
    if meant := _meant(text):
        return UnknownPlace(f"there is no {text.strip()}; did you mean {meant}?")
    if not first or re.fullmatch(r"\s*(%.*|[A-Za-z]{1,3}\s*\d+(\.\d+)?|\d+(\.\d+)?|E\w\s*[_:]\s*\d+.*)", text):
        return UnknownPlace(reason)
    if holder := _holder(symbols, first):
        return UnknownPlace(f"there is no {first}; did you mean {holder}.{text.strip()}?")
    listed = sorted(field.name for field in symbols.values() if field.space.upper() == first.upper())
    if listed:
        return UnknownPlace(f"{text.strip()}: the list has no such variable; it has {', '.join(listed[:8])}")
    programs_first = sorted(symbols.values(), key=lambda field: (not isinstance(field.type, StructType), field.name))
    known = _listed(first, [field.name for field in programs_first], 8)
    said = f"; known here: {known}" if known else " (the program declares nothing)"
    return UnknownPlace(f"there is no {first}{said}", first)


def _listed(wanted: str, names: list[str], most: int) -> str:
    """Names that there are, for a message; where they are too many, those like the wanted one come first."""
    if len(names) <= most:
        return ", ".join(names)
    shown = {fold(name): name for name in names}
    near = [shown[name] for name in get_close_matches(fold(wanted), shown, 2)]
    return ", ".join([*near, *(name for name in names if name not in near)][:most]) + ", ..."


def _holder(symbols: Mapping[str, Field], name: str) -> str:
    """The shortest path of an instance that declares a variable `name`, "" if none does."""
    known: set[int] = set()
    waiting = deque((field.name, field.type) for field in symbols.values() if not field.reference)
    while waiting:
        path, kind = waiting.popleft()
        if isinstance(kind, ArrayType):
            path, kind = f"{path}[{', '.join(str(low) for low, _ in kind.bounds)}]", kind.element
        if not isinstance(kind, StructType) or not kind.block or id(kind) in known:
            continue
        if kind.member(name):
            return path
        known.add(id(kind))
        waiting += [(f"{path}.{field.name}", field.type) for field in kind.fields.values()
                    if not field.reference and "$" not in field.name]
    return ""


_OTHER_NAMES = {"EM": "E", "HR": "H", "WR": "W", "AR": "A", "TIM": "T", "CNT": "C", "DR": "D", "IR": "CIO "}
"""Names of areas in other software and in older manuals."""
_OTHER = re.compile(rf"\s*%?({'|'.join(_OTHER_NAMES)})\s*([0-9A-F]\s*[_:]\s*)?(\d+(?:\.\d+)?)\s*", re.I)
_FLAG = re.compile(r"\s*%?(T|C)(?:IM|NT)?\s*(\d+)\s*\.\s*(Q|CF|DN)\s*", re.I)


def _meant(text: str) -> str:
    """The spelling here of an address as other software writes it; "" for a text that is none."""
    if match := _FLAG.fullmatch(text):
        return ("TF" if match[1].upper() == "T" else "CNF") + match[2]
    match = _OTHER.fullmatch(text)
    if not match or bool(match[2]) != (match[1].upper() == "EM"):
        return ""
    meant = _OTHER_NAMES[match[1].upper()] + re.sub(r"\s*[_:]\s*", "_", match[2] or "").upper() + match[3]
    try:
        return str(parse_address(meant))
    except AddressError:
        return ""


def _span(areas: Mapping[str, Area], text: str) -> Span:
    addresses = address_range(areas, text)
    return Span(f"{addresses[0]}..{addresses[-1]}", tuple(_at(areas, address) for address in addresses))


def address_range(areas: Mapping[str, Area], text: str) -> list[Address]:
    """The addresses of `D200..D202`, both ends included.  Raises UnknownPlace for a text that is no range of addresses."""
    low_text, _, high_text = text.partition("..")
    low, high = (_span_end(areas, part, text) for part in (low_text, high_text))
    same = (low.area, low.size_bits, low.bit is None) == (high.area, high.size_bits, high.bit is None)
    if not same or (low.number, low.bit or 0) > (high.number, high.bit or 0):
        raise UnknownPlace(f"{text} is no range: both ends must lie in one area, the lower end first")
    if low.bit is None:
        return [replace(low, number=number) for number in range(low.number, high.number + 1)]
    width = 8 if low.area in PORTABLE_AREAS else 16
    bits = range(low.number * width + low.bit, high.number * width + (high.bit or 0) + 1)
    return [replace(low, number=bit // width, bit=bit % width) for bit in bits]


def _span_end(areas: Mapping[str, Area], part: str, text: str) -> Address:
    try:
        return parse_address(part, areas)
    except AddressError as error:
        raise UnknownPlace(f"{text} is no range of addresses: {error}") from None


def _at(areas: Mapping[str, Area], address: Address) -> Place:
    """The place of an address.  Raises UnknownPlace if this PLC does not have the area (an E bank not in use)."""
    area = areas.get(address.area)
    if area is None:
        raise UnknownPlace(f"{address}: this PLC has no {address.area} bank; the program does not use it")
    offset = area.offset + address.byte_offset()
    if address.bit is not None or address.area in FLAG_AREAS:
        return Place(str(address), BOOL, offset, address.bit_in_byte(), area=address.area)
    return Place(str(address), _ADDRESS_TYPES[address.size_bits or 16], offset, area=address.area)


# --- names ------------------------------------------------------------------------------------------------------------


def _top(symbols: Mapping[str, Field], text: str) -> tuple[Field, int] | None:
    """The symbol at the beginning of a path, and its end: `Main`, `GVL.level`, or `level` if only one list has it."""
    names = _NAMES.match(text)
    if names is None:
        return None
    first, second = names[1].upper(), (names[2] or "").upper()
    if first in symbols:
        return symbols[first], names.end(1)
    listed = symbols.get(f"{first}.{second}") or symbols.get(second)
    if second and listed is not None and (f"{first}.{second}" in symbols or listed.space.upper() == first):
        return listed, names.end(2)
    fitting = [field for name, field in symbols.items() if field.space and name == f"{field.space}.{first}".upper()]
    return (fitting[0], names.end(1)) if len(fitting) == 1 else None


def _walk(field: Field, at: int, text: str) -> Place:
    """Follows a path step by step through the types, from a symbol on."""
    place = whole = _of(Place(field.name, field.type, 0), field, field.name, field.offset)
    dot = False
    while at < len(text.rstrip()):
        match = _TOKEN.match(text, at)
        if not match or match["name"] and not dot:
            raise UnknownPlace(f"{text.strip()!r} is not a path of names, subscripts and members")
        at = match.end()
        if match["dot"]:
            dot = True
        else:
            whole, place = place, _step(_named_step(whole, place, match["name"]), match)
            dot = False
    if dot:
        raise UnknownPlace(f"{text.strip()!r} ends too early")
    return place


def _named_step(whole: Place, place: Place, member_name: str | None) -> Place:
    """In front of `.X`: the flags of the step that is called as the variable `place` of the POU `whole`; else `place`.

    See check/declarations/same_names.py."""
    if member_name is None or not isinstance(whole.type, StructType) or whole is place:
        return place
    flags = whole.type.member(f"{place.name.rpartition('.')[2]} step")
    if flags is None or not isinstance(flags.type, StructType) or flags.type.member(member_name) is None:
        return place
    return member(whole, flags.name)


def _step(place: Place, match: re.Match[str]) -> Place:
    if match["name"]:
        return member(place, match["name"])
    if match["index"] is not None:
        return _element(place, match["index"])
    if match["hat"]:
        if not isinstance(place.type, RefType) or place.type.target is None:
            raise UnknownPlace(f"{place.name} is no reference")
        return replace(place, name=f"{place.name}^", type=place.type.target, hops=(*place.hops, 0))
    bit = match["bit"][1:].strip()
    if isinstance(place.type, StructType) and bit[0] in "Xx":
        return member(place, bit)  # a member that is called as a bit is written
    return _part(place, whole_number(bit.lstrip("%Xx")))


def _of(parent: Place, field: Field, name: str, distance: int) -> Place:
    """The place of a member: absolute if it is located, behind a reference if it is an in-out."""
    if field.frame_at:
        place = Place(name, field.type, field.frame_at[0], field.bit, (*field.frame_at[1:], field.offset))
    elif field.absolute:
        place = Place(name, field.type, field.offset, field.bit)
    else:
        place = parent.inner(name, field.type, distance, field.bit)
    if field.reference:
        place = replace(place, hops=(*place.hops, 0))
    place = _followed(place)
    return replace(place, constant=field.constant or parent.constant, hexadecimal=field.hexadecimal)


def _followed(place: Place) -> Place:
    """What a REFERENCE TO is bound to; any other place as it is."""
    if isinstance(place.type, RefType) and place.type.follows and place.type.target is not None:
        return replace(place, type=place.type.target, hops=(*place.hops, 0))
    return place


def member(place: Place, name: str) -> Place:
    """A member of a structure or an instance.  Raises UnknownPlace."""
    field = place.type.member(name) if isinstance(place.type, StructType) else None
    if field is None:
        if not isinstance(place.type, StructType):
            raise UnknownPlace(f"{place.name} is {place.type.name} and has no member {name}")
        known = _listed(name, [f.name for f in place.type.fields.values()], 12)
        raise UnknownPlace(f"{place.name} has no {name}; it has {known or 'no members'}")
    return _of(place, field, f"{place.name}.{field.name}", field.offset)


def _element(place: Place, text: str) -> Place:
    kind = characters(place.type) if isinstance(place.type, StringType) else place.type
    if not isinstance(kind, ArrayType):
        raise UnknownPlace(f"{place.name} is {place.type.name}, not an array")
    try:
        indexes = [whole_number(part) for part in text.split(",")]
    except ValueError:
        raise UnknownPlace(f"{place.name}[{text}]: a subscript is a whole number") from None
    bounds = kind.bounds
    if len(indexes) != len(bounds):
        raise UnknownPlace(f"{place.name} has {len(bounds)} subscripts, {len(indexes)} given")
    at = 0
    for index, (low, high) in zip(indexes, bounds, strict=True):
        if not low <= index <= high:
            raise UnknownPlace(f"{place.name}[{text}]: {index} is outside {low}..{high}")
        at = at * (high - low + 1) + index - low
    return element(place, kind, at)


def element(place: Place, kind: ArrayType, number: int) -> Place:
    """The element of an array with index `number` in memory order, counted from 0."""
    name = f"{place.name}[{kind.subscripts(number)}]"
    if place.bit is not None:
        return place.inner(name, kind.element, (place.bit + number) // 8, (place.bit + number) % 8)
    return _followed(place.inner(name, kind.element, number * kind.element.size))


def _part(place: Place, bit: int) -> Place:
    """Bit number `bit` of an integer or bit string."""
    kind = base(place.type)
    if not isinstance(kind, Elementary) or kind.machine[0] not in "iu":
        raise UnknownPlace(f"{place.name} is {place.type.name} and has no bits")
    if bit >= kind.bits:
        raise UnknownPlace(f"{place.name} has bits 0..{kind.bits - 1}; {bit} does not exist")
    return place.inner(f"{place.name}.{bit}", BOOL, bit // 8, bit % 8)
