"""Lowering of arrays and structures that are written out in statements."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.types import RefType, machine
from fbvm.code.operations import Node
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.check.symbols.facts import AggregatePart
    from fbvm.code.lowering.bodies import BodyLowering
    from fbvm.code.lowering.places import Place


def written_out(body: BodyLowering, expr: tree.ArrayInit | tree.StructInit) -> Place:
    """The place of the whole, with its values put there: all are worked out first, in order."""
    whole = body.facts.aggregates[expr]
    place, site = body.places.slot(whole.place), body.site(expr)
    single = [part for part in whole.parts if machine(part.kind)]
    nodes = body.values.sequence(_value(body, part) for part in single)
    body.out.append(("fill", place.address, whole.content))
    for at, start in body.program.held.within(place.type, whole.content):
        body.out.append(body.places.store(place.moved(at, start.kind), body.pointers.to(start.place), site))
    for part, node in zip(single, nodes, strict=True):
        kept = body.keep(node)
        for at in part.places:
            body.out.append(body.places.store(place.moved(at, part.kind, part.bit), kept, site))
    for part in whole.parts:
        source = None if machine(part.kind) else body.places.fixed(body.aggregate(part.value))
        for at in part.places if source is not None else ():
            assert source is not None
            body.out.append(("copy", place.moved(at, part.kind).address, source.address, part.kind.size))
    return place


def _value(body: BodyLowering, part: AggregatePart) -> Node:
    if isinstance(part.kind, RefType) and part.kind.follows:
        return body.pointers.lent(part.value)
    return body.value(part.value, part.kind)
