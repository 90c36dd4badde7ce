"""Names as they are written inside a POU: its own variables first, then those of the whole program, then addresses."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from itertools import islice

from fbvm.base.types import ArrayType, Field, StructType, fold
from fbvm.watch.paths import Place, Span, UnknownPlace, element
from fbvm.watch.paths import find as find_in

Find = Callable[[str], Place | Span]
_FIRST = re.compile(r"\s*([^\W\d]\w*)(?!\w*\s*#)")
_PATH = re.compile(r"\s*(?:THIS\s*\^?\s*\.\s*)?(.*)", re.I | re.S)


class Scope:
    """Finds names from inside an instance: `n` is `Main.P1.n` there.

    `find` finds what is no variable of the instance; `instance` is its place, None outside of all (then only `find` counts);
    `local` are variables that live while the body is executed, by folded name."""

    def __init__(self, find: Find, instance: Place | None = None, local: Mapping[str, Field] | None = None) -> None:
        self._find, self.instance, self.local = find, instance, local or {}

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names here.  Raises UnknownPlace."""
        first = _FIRST.match(text)
        if first and fold(first[1]) in self.local:
            return find_in(self.local, {}, text)
        if self.instance is not None and (rest := self.own(text)):
            return self._find(f"{self.instance.name}.{rest}")
        try:
            return self._find(text)
        except UnknownPlace as error:
            if near := self._near(error.unheard):
                raise UnknownPlace(f"there is no {error.unheard}; did you mean {near}?") from None
            raise

    def _near(self, name: str) -> str:
        """The variable of the body that is called like an unknown name, "" if none is."""
        kind = self.instance.type if self.instance is not None else None
        fields = [*self.local.values(), *(kind.fields.values() if isinstance(kind, StructType) else ())]
        shown = {fold(field.name): field.name for field in fields}
        near = get_close_matches(fold(name), shown, 1)
        return shown[near[0]] if near else ""

    def own(self, text: str) -> str:
        """`text` without THIS before it, if it begins with a variable of the instance, else ""."""
        kind = self.instance.type if self.instance is not None else None
        match = _PATH.match(text)
        rest = match[1] if match else text
        first = _FIRST.match(rest)
        return rest if first and isinstance(kind, StructType) and kind.member(first[1]) else ""


def instances(symbols: Mapping[str, Field], pou: str, most: int) -> list[Place]:
    """The first `most` instances of a program or function block, those nearest to the top first."""
    return list(islice(_instances(symbols, most, fold(pou)), most))


def every_instance(symbols: Mapping[str, Field], most_elements: int) -> Iterator[Place]:
    """The instances of all programs and function blocks, those nearest to the top first; of an array its first elements."""
    return _instances(symbols, most_elements, "")


def _instances(symbols: Mapping[str, Field], most_elements: int, pou: str) -> Iterator[Place]:
    holds: dict[int, bool] = {}
    waiting = deque(Place(field.name, field.type, field.offset) for field in symbols.values()
                    if not field.reference and _holds(field.type, pou, holds))  # fmt: skip
    while waiting:
        place = waiting.popleft()
        kind = place.type
        if isinstance(kind, ArrayType):
            waiting.extend(element(place, kind, number) for number in range(min(kind.count, most_elements)))
        elif isinstance(kind, StructType):
            if _is_instance(kind, pou):
                yield place
            for field in kind.fields.values():
                if not field.reference and _holds(field.type, pou, holds):
                    offset = field.offset if field.absolute else place.offset + field.offset
                    waiting.append(replace(place, name=f"{place.name}.{field.name}", type=field.type, offset=offset))


def _is_instance(kind: StructType, pou: str) -> bool:
    """Whether a value of a type is an instance of a POU, of any with ""."""
    return kind.block and pou in ("", fold(kind.name))


def _holds(kind: object, pou: str, known: dict[int, bool]) -> bool:
    """True if a value of a type is or has an instance of a POU, of any with ""."""
    if isinstance(kind, ArrayType):
        return _holds(kind.element, pou, known)
    if not isinstance(kind, StructType):
        return False
    if id(kind) not in known:
        known[id(kind)] = _is_instance(kind, pou) or any(
            _holds(field.type, pou, known) for field in kind.fields.values() if not field.reference)
    return known[id(kind)]


def place_of(find: Find, path: str) -> Place | None:
    """The place of an instance by its path, None for "" and for what is no place."""
    if not path:
        return None
    try:
        found = find(path)
    except UnknownPlace:
        return None
    return found if isinstance(found, Place) else None
