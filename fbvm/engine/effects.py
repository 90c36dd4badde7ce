"""What statements store, by which an engine knows which values of the memory it may go on holding elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from fbvm.code.image import Image
from fbvm.code.operations import CALLS, SIZES, TEXT_UNITS, Address, Node
from fbvm.code.shapes import statements
from fbvm.engine.ranges import Range, RangeOf, value_range, with_temporaries

STORES: dict[str, Callable[[Node], tuple[Address, int]]] = {
    "store": lambda node: (node[2], SIZES[node[1]]), "store_raw": lambda node: (node[2], SIZES[node[1]]),
    "store_bit": lambda node: (node[1], 1), "store_flag": lambda node: (node[1], 1),
    "store_text": lambda node: (node[1], (node[2] + 1) * TEXT_UNITS[node[3][1]]), "copy": lambda node: (node[1], node[3]),
    "fill": lambda node: (node[1], len(node[2])), "reverse": lambda node: (node[1], node[2]),
}  # fmt: skip
"""By operation that stores: the address, and the number of bytes."""
MOST_SPANS = 32
"""Spans of one body that are told apart."""


class Span(NamedTuple):
    """Bytes from `first` to the one in front of `end`, counted from the start of the memory ("abs") or the instance ("self")."""

    base: str
    first: int
    end: int


Spans = tuple[Span, ...] | None
"""Where something may be stored; None: anywhere."""


def span(address: Address, size: int, of: RangeOf | None = None) -> Span | None:
    """The bytes that an access of `size` bytes may touch; None: any."""
    base, offset, terms = address
    if isinstance(base, tuple):
        return None
    first = last = offset
    for stride, term in terms:
        ends = [stride * end for end in (of or value_range)(term)]
        first, last = first + min(ends), last + max(ends)
    return Span(base, first, last + size)


def located(address: Address, instance: int | None) -> Address:
    """The address as one of the buffer, if the instance is known: it begins at that byte."""
    base, offset, terms = address
    return ("abs", instance + offset, terms) if base == "self" and instance is not None else address


class Effects:
    """Where the statements of an image store.  The system page is left out: nobody holds what machine and engine tell each other.

    `bases` are the lowest and the highest byte at which instances of a body begin, by its number, as far as they are known.
    `anywhere` are the numbers of bodies of which it is not known where they store, among them those that call each other in a
    circle."""

    def __init__(self, image: Image, bases: Mapping[int, Range], anywhere: Iterable[int]) -> None:
        self._image, self.bases = image, bases
        self._bodies: dict[int, Spans] = dict.fromkeys(anywhere)

    def of(self, node: Node, instance: int | None = None, range_of: RangeOf | None = None) -> Spans:
        """Where a statement stores, but not those inside it.  `instance` is the byte at which the body's instance begins, if that
        is known."""
        if node[0] in STORES:
            address, size = STORES[node[0]](node)
            found = span(located(address, instance), size, range_of)
            return None if found is None else (found,)
        return self._call(node, instance) if node[0] in CALLS else ()

    def _call(self, node: Node, caller: int | None) -> Spans:
        stored = self._of_body(node[1])
        if stored is None:
            return None
        spans = [each for each in stored if each.base == "abs"]
        if len(spans) < len(stored):
            instance = span(located(node[2] or ("abs", 0, ()), caller), self._image.bodies[node[1]].instance_size)
            if instance is None:
                return None
            spans.append(instance)
        return tuple(spans)

    def _of_body(self, number: int) -> Spans:
        """Where a body stores with all that it calls; the span of its own instance stands for any place in it."""
        waiting = [number]
        while waiting:  # those that it calls come first, however long the chain of calls is
            last = waiting[-1]
            called = (node[1] for node in statements(self._image.bodies[last].code) if node[0] in CALLS)
            if last in self._bodies:
                waiting.pop()
            elif inner := [each for each in called if each not in self._bodies]:
                waiting += inner
            else:
                self._bodies[last] = self._stored_in(last)
        return self._bodies[number]

    def _stored_in(self, number: int) -> Spans:
        """Where a body stores; what the bodies that it calls do is known."""
        found: set[Span] = set()
        code = self._image.bodies[number].code
        range_of = with_temporaries(code)
        for node in statements(code):
            spans = self.of(node, None, range_of)
            if spans is None:
                return None
            found.update(each if each.base == "abs" else Span("self", 0, 0) for each in spans)
        return tuple(sorted(found)) if len(found) <= MOST_SPANS else _hull(found)


def _hull(spans: set[Span]) -> tuple[Span, ...]:
    """One span in place of all at places of the memory."""
    places = [each for each in spans if each.base == "abs"]
    own = tuple(each for each in spans if each.base == "self")
    return (Span("abs", min(each.first for each in places), max(each.end for each in places)), *own)
