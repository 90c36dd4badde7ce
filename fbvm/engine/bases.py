"""Finds the bodies that run for one instance only, whose variables then have constant addresses."""

from __future__ import annotations

from fbvm.base.graphs import cycles
from fbvm.code.image import Image
from fbvm.code.operations import Node
from fbvm.code.shapes import statements


def fixed_bases(image: Image) -> dict[int, int]:
    """Where the instance begins, in bytes of the memory, of each body that runs for one instance only, by the body's number."""
    callers: dict[int, list[tuple[int, Node]]] = {number: [] for number in range(len(image.bodies))}
    for number, body in enumerate(image.bodies):
        for node in statements(body.code):
            if node[0] == "call":
                callers[node[1]].append((number, node))
    starts: dict[int, set[int | None]] = {number: set() for number in callers}
    for task in image.tasks:
        for run in task.programs:
            starts[run.body].add(run.offset)
    known: dict[int, int | None] = dict.fromkeys(recursive_bodies(image))
    waiting = list(callers)
    while waiting:  # a body is looked at again once all that call it are known
        number = waiting.pop()
        unknown = [caller for caller, _ in callers[number] if caller not in known]
        if unknown:
            waiting += [number, *unknown]
        elif number not in known:
            bases = starts[number] | {_base(known[caller], call) for caller, call in callers[number]}
            known[number] = bases.pop() if len(bases) == 1 else None
    return {number: base for number, base in known.items() if base is not None}


def recursive_bodies(image: Image) -> set[int]:
    """The numbers of the bodies that may be called again while they run."""
    called = [tuple({node[1]: None for node in statements(body.code) if node[0] == "call"}) for body in image.bodies]
    return {number for group in cycles(range(len(called)), called.__getitem__) for number in group}


def _base(caller: int | None, call: Node) -> int | None:
    """Where the instance of one call begins, if that is a constant; `caller` is where the caller's own begins, if known."""
    base, offset, terms = call[2] or ("abs", 0, ())
    if terms or isinstance(base, tuple) or (base == "self" and caller is None):
        return None
    return int(offset) + (caller or 0 if base == "self" else 0)
