"""Search over all variables and addresses of a PLC, and the tree of an array or a structure."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from itertools import islice
from typing import Any

from fbvm.base.types import ArrayType, EnumType, Field, StructType, base
from fbvm.machine.plc import Plc
from fbvm.watch.names import is_single
from fbvm.watch.paths import Place, Span, UnknownPlace, element, find, member

MOST_FOUND = 200
MOST_PARTS = 500
"""Elements or members that are listed of one array or structure."""
MOST_SEARCHED = 200_000
STEP, LISTED = 50, 10
"""Places that are searched, and parts that are listed, in one step."""


Said = Callable[[Place], str]
"""What is said about a place: the comment of its declaration, or what its unit calls it."""


def search(plc: Plc, described: Mapping[str, str], said: Said, text: str) -> Generator[None, None, dict[str, Any]]:
    """The variables and addresses whose names, types, comments or descriptions have all words of `text`, as `found`; variables of
    programs first.  Searches in short steps.

    What is an address or a range as it stands comes before all."""
    found: dict[str, dict[str, Any]] = {}
    if text.strip():
        try:
            place = plc.find(text.strip())
            found[place.name] = row(place, said)
        except (UnknownPlace, ValueError):
            pass
    words = text.upper().split()
    for number, place in enumerate(_places(plc.image.symbols)):
        if len(found) >= MOST_FOUND:
            break
        if all(word in f"{place.name} {place.type.name} {said(place)}".upper() for word in words):
            found.setdefault(place.name, row(place, said))
        if number % STEP == STEP - 1:
            yield
    for number, (address, called) in enumerate(described.items()):
        if len(found) >= MOST_FOUND:
            break
        if all(word in f"{address} {called}".upper() for word in words):
            found.setdefault(address, row(plc.find(address), said))
        if number % STEP == STEP - 1:
            yield
    return {"found": list(found.values())}


def row(place: Place | Span, said: Said) -> dict[str, Any]:
    """What the page shows of a place beside its value: name, type, description, whether it has parts, and what it can be."""
    if isinstance(place, Span):
        return {"name": place.name, "type": f"{len(place.places)} x {place.places[0].type.name}", "said": "", "tree": False}
    kind = base(place.type)
    made: dict[str, Any] = {"name": place.name, "type": place.type.name, "said": said(place),
                            "tree": not is_single(place), "bytes": kind.size, "constant": place.constant}  # fmt: skip
    if isinstance(kind, EnumType):
        made["members"] = list(kind.shown.values())[:200]
    return made


def parts(plc: Plc, said: Said, name: str) -> Generator[None, None, list[dict[str, Any]]]:
    """The elements of an array, the members of a structure or an instance, found in short steps.  Raises UnknownPlace."""
    place = plc.find(name)
    rows = []
    for part in islice(place.places, MOST_PARTS) if isinstance(place, Span) else _parts(place):
        rows.append(row(part, said))
        if len(rows) % LISTED == 0:
            yield
    return rows


def _parts(place: Place) -> Iterator[Place]:
    kind = base(place.type)
    if isinstance(kind, ArrayType):
        for number in range(min(kind.count, MOST_PARTS)):
            yield element(place, kind, number)
    elif isinstance(kind, StructType):
        for field in list(kind.fields.values())[:MOST_PARTS]:
            if "$" not in field.name:
                yield member(place, field.name)


def _places(symbols: Mapping[str, Field]) -> Iterator[Place]:
    """All variables by breadth, so that a program's own come before those of its blocks; elements of arrays are left out, and
    what lies behind references is not followed."""
    areas: dict[str, Any] = {}
    waiting = [found for field in symbols.values() if isinstance(found := find(symbols, areas, field.name), Place)]
    count = 0
    while waiting and count < MOST_SEARCHED:
        level, waiting = waiting, []
        for place in level:
            if place.is_generated:
                continue
            count += 1
            yield place
            if isinstance(base(place.type), StructType) and not place.hops:
                waiting += _parts(place)
