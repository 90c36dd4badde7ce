"""Which variables the objects of a diagram read and write, and where two orders of evaluation differ in effect."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

from fbvm.interchange.plcopen.read.diagram import Object
from fbvm.interchange.plcopen.read.scope import Scope

WRITERS = ("coil", "outVariable", "inOutVariable")
MOST = 500
"""Most objects that touch one variable of which each pair is compared."""


class Access(NamedTuple):
    """The variables that an object reads, and those that it writes (`Scope.key`)."""

    reads: frozenset[str]
    writes: frozenset[str]

    def conflicts(self, other: Access) -> bool:
        """Whether it matters which of two comes first."""
        return bool(self.writes & other.writes or self.writes & other.reads or self.reads & other.writes)


def accesses(items: Iterable[Object], scope: Scope) -> dict[Object, Access]:
    """What each of some objects reads and writes."""
    return {item: _access(item, scope) for item in items}


def _access(item: Object, scope: Scope) -> Access:
    typed = frozenset().union(*(scope.keys(pin.expression) for pin in item.pins if pin.expression))
    if item.kind in ("contact", "inVariable"):
        return Access(scope.keys(item.text), frozenset())
    if item.kind in WRITERS:
        own = scope.keys(item.text)
        return Access(own if item.kind == "inOutVariable" or len(own) > 1 else frozenset(), own)
    if item.kind != "block":
        return Access(typed, frozenset())
    connected = frozenset().union(*(scope.keys(wire.source.text) for pin in item.in_outs for wire in pin.wires
                                    if wire.source.kind in ("inVariable", "inOutVariable")),
                                  *(scope.keys(pin.expression) for pin in item.in_outs if pin.expression))
    shared = scope.shared(item.text) | scope.keys(item.code)
    instance = frozenset((scope.key(item.instance),)) if item.instance else frozenset[str]()
    return Access(typed | connected | shared | instance, connected | shared | instance)


def swapped(first: Sequence[Object], second: Sequence[Object], known: dict[Object, Access]) -> tuple[Object, Object] | None:
    """Two objects that `first` evaluates in this order and `second` in the other one, and for whose effect that matters; None
    if the orders have the same effect.  Both have the same objects."""
    places = {item: at for at, item in enumerate(first)}, {item: at for at, item in enumerate(second)}
    touching: dict[str, list[Object]] = {}
    for item in first:
        for name in known[item].reads | known[item].writes:
            touching.setdefault(name, []).append(item)
    for name, items in touching.items():
        writing = [item for item in items if name in known[item].writes]
        for writer, other in product(writing[:MOST], items[:MOST]):
            before, behind = (place[other] < place[writer] for place in places)
            if before != behind:
                return (other, writer) if before else (writer, other)
    return None
