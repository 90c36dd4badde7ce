"""The call graph of an image: which bodies are executed at all, how deep calls are nested, where instances may begin."""

from __future__ import annotations

from collections.abc import Collection

from fbvm.code.image import Image
from fbvm.code.operations import CALLS, Address
from fbvm.code.shapes import statements
from fbvm.engine.ranges import RangeOf, value_range

Range = tuple[int, int]
"""First byte, and the byte behind the last."""
ANYWHERE: Range = (-(1 << 62), 1 << 62)
Calls = dict[int, list[tuple[int, Address | None]]]
"""For each body that is executed: the bodies that it calls, with the addresses of their instances.  A body comes behind those
that it calls, unless they call it again."""


def call_graph(image: Image) -> Calls:
    """The calls of every body that a task reaches."""
    graph: Calls = {}
    waiting = [run.body for task in image.tasks for run in task.programs]
    known: Calls = {}
    while waiting:
        number = waiting[-1]
        if number not in known:
            known[number] = [(node[1], node[2]) for node in statements(image.bodies[number].code) if node[0] in CALLS]
        missing = [called for called, _ in known[number] if called not in known]
        if missing:
            waiting += missing
            continue
        waiting.pop()
        graph[number] = known[number]
    return graph


def heights(graph: Calls) -> dict[int, int]:
    """For each body how many calls are nested below it at most, without those that come back to it; 0 if it calls none."""
    found: dict[int, int] = {}
    for number, called in graph.items():
        found[number] = max((found[other] + 1 for other, _ in called if other in found), default=int(bool(called)))
    return found


def instance_places(image: Image, graph: Calls, recursive: Collection[int]) -> dict[int, Range]:
    """For each body the range of bytes of the memory in which its instances begin; for one of `recursive`, which may be called
    again while they run, anywhere."""
    places: dict[int, Range] = dict.fromkeys(recursive, ANYWHERE)
    for task in image.tasks:
        for run in task.programs:
            _add(places, run.body, (run.offset, run.offset + 1))
    for caller, calls in reversed(graph.items()):
        for called, address in calls:
            _add(places, called, _called_at(address, places[caller]))
    return places


def _add(places: dict[int, Range], number: int, more: Range) -> None:
    low, high = places.get(number, more)
    places[number] = min(low, more[0]), max(high, more[1])


def _called_at(address: Address | None, caller: Range) -> Range:
    if address is None:
        return 0, 1
    if isinstance(address[0], tuple):
        return ANYWHERE
    low, high = reached(address, 1)
    return (low + caller[0], high + caller[1] - 1) if address[0] == "self" else (low, high)


def reached(address: Address, count: int, of: RangeOf = value_range) -> Range:
    """The range of bytes that an access of `count` bytes can touch, counted from the address's own base (memory or instance).

    The address has no reference in it.  `of` says what its subscripts can be."""
    _, low, terms = address
    high = low + count
    for stride, term in terms:
        edges = [stride * edge for edge in of(term)]
        low, high = low + min(edges), high + max(edges)
    return low, high
