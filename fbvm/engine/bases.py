"""Finds the bodies that run for one instance only, whose variables then have constant addresses."""

from __future__ import annotations

from fbvm.base.graphs import cycles
from fbvm.code.image import Image
from fbvm.code.operations import CALLS, Node
from fbvm.code.shapes import statements
from fbvm.engine.ranges import Range, value_range


def fixed_bases(image: Image) -> dict[int, int]:
    """Where the instance begins, in bytes of the memory, of each body that runs for one instance only, by the body's number."""
    return {number: low for number, (low, high) in base_ranges(image).items() if low == high}


def base_ranges(image: Image) -> dict[int, Range]:
    """The lowest and the highest byte at which instances of a body begin, by its number; none where that is unknown."""
    callers: dict[int, list[tuple[int, Node]]] = {number: [] for number in range(len(image.bodies))}
    for number, body in enumerate(image.bodies):
        for node in statements(body.code):
            if node[0] in CALLS:
                callers[node[1]].append((number, node))
    starts: dict[int, list[Range | None]] = {number: [] for number in callers}
    for task in image.tasks:
        for run in task.programs:
            starts[run.body].append((run.offset, run.offset))
    known: dict[int, Range | None] = dict.fromkeys(recursive_bodies(image))
    waiting = list(callers)
    while waiting:  # a body is looked at again once all that call it are known
        number = waiting.pop()
        unknown = [caller for caller, _ in callers[number] if caller not in known]
        if unknown:
            waiting += [number, *unknown]
        elif number not in known:
            known[number] = _union(starts[number] + [_bases(known[caller], call) for caller, call in callers[number]])
    return {number: bases for number, bases in known.items() if bases is not None}


def recursive_bodies(image: Image) -> set[int]:
    """The numbers of the bodies that may be called again while they run."""
    called = [tuple({node[1]: None for node in statements(body.code) if node[0] in CALLS}) for body in image.bodies]
    return {number for group in cycles(range(len(called)), called.__getitem__) for number in group}


def _union(ranges: list[Range | None]) -> Range | None:
    known = [found for found in ranges if found]
    return (min(known)[0], max(high for _, high in known)) if known and len(known) == len(ranges) else None


def _bases(caller: Range | None, call: Node) -> Range | None:
    """Where instances of one call begin, if that is known; `caller` is where those of the caller do."""
    base, offset, terms = call[2] or ("abs", 0, ())
    if isinstance(base, tuple) or (base == "self" and caller is None):
        return None
    low, high = caller if base == "self" and caller else (0, 0)
    for stride, term in terms:
        ends = [stride * end for end in value_range(term)]
        low, high = low + min(ends), high + max(ends)
    return low + offset, high + offset
