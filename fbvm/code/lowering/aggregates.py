"""Lowering of arrays and structures that are written out in statements: `a := [1, 2, x]`."""

from __future__ import annotations

from fbvm.base.types import RefType, Type, machine
from fbvm.check.symbols.facts import AggregatePart
from fbvm.code.builder.places import Place
from fbvm.code.lowering import pointers
from fbvm.code.lowering.context import BodyContext, PlaceRules, ValueRules
from fbvm.code.lowering.variables import loaded
from fbvm.code.operations import Node
from fbvm.syntax import tree


def written_out(body: BodyContext, expr: tree.ArrayInit | tree.StructInit | tree.NameRef, kind: Type) -> Place:
    """The place of the whole in the frame of the POU, with its values stored there: all are evaluated first, in order."""
    whole = body.facts.aggregates[expr]
    place, site = body.slot(whole.place), body.site(expr)
    single = [part for part in whole.parts if machine(part.kind)]
    nodes = body.sequence(_value(body, part) for part in single)
    body.emit(("fill", place.address, whole.content))
    for at, start in body.program.references_in(place.type, whole.content):
        body.emit(place.moved(at, start.kind).store(pointers.initial(body, start), site))
    for part, node in zip(single, nodes, strict=True):
        value = body.to_temporary(node)
        body.emit(*(place.moved(at, part.kind, part.bit).store(value, site) for at in part.places))
    for part in whole.parts:
        if not machine(part.kind):
            source = body.reusable(body.aggregate(part.value))
            body.emit(*(("copy", place.moved(at, part.kind).address, source.address, part.kind.size) for at in part.places))
    return place


def _value(body: BodyContext, part: AggregatePart) -> Node:
    if isinstance(part.kind, RefType) and part.kind.follows:
        return pointers.binding(body, part.value)
    return body.value(part.value, part.kind)


def _structure(body: BodyContext, expr: tree.StructInit | tree.NameRef, kind: Type) -> Place:
    """The place of a structure that is written out, or that an ANY stands for, or of the variable that `(a := b)` assigns."""
    assignment = body.facts.assignments.get(expr)
    if assignment is None:
        return written_out(body, expr, kind)
    body.lower((assignment,))
    return body.place(assignment.targets[0])


PLACES: PlaceRules = {tree.ArrayInit: written_out, tree.StructInit: _structure}
VALUES: ValueRules = dict.fromkeys((tree.ArrayInit, tree.StructInit), loaded)
