"""Lowering of names: the place of a variable, a member, a bit, an address or a dereference, and the value that lies there."""

from __future__ import annotations

from fbvm.base.areas import FLAG_AREAS
from fbvm.base.types import AnyType, Field, RefType, StructType, Type, fold
from fbvm.check.symbols.facts import Variable
from fbvm.code.builder.places import Place
from fbvm.code.lowering import any_parameters, arrays, plc_addresses, pointers
from fbvm.code.lowering.context import BodyContext, PlaceRules, ValueRules
from fbvm.code.operations import Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder


def loaded(body: BodyContext, expr: tree.Expr) -> Node:
    """The value at the place that an expression names, whose read is observed."""
    place = body.place(expr)
    body.record_read(place, expr)
    return place.load()


def member_value(body: BodyContext, expr: tree.Member) -> Node:
    """The value of a member; `x.pValue` of an ANY is a reference to what was passed."""
    meaning = body.facts.rewritten.get(expr)
    if meaning is not None:
        return body.value(meaning)
    if expr in body.facts.holders and isinstance(body.facts.types.get(expr.of), AnyType):
        return pointers.to_parameter(body, expr)
    return loaded(body, expr)


def _direct(body: BodyContext, expr: tree.Direct, kind: Type) -> Place:
    address = body.facts.directs[expr]
    start, offset = body.program.area(address.area)
    is_bit = address.bit is not None or address.area in FLAG_AREAS
    return Place((start, offset + address.byte_offset(), ()), kind, address.bit_in_byte() if is_bit else None)


def _member(body: BodyContext, expr: tree.Member, kind: Type) -> Place:
    whole = body.facts.types.get(expr.of)
    if isinstance(whole, AnyType):
        return any_parameters.member(body, expr, kind)
    bit = body.facts.bits.get(expr)
    if bit is not None:
        return _part(body, bit, kind)
    member = body.facts.fields[expr]
    if member.absolute:
        assert isinstance(whole, StructType)
        slot = body.slot(_located(body, member, whole))
        return Place(slot.address, kind, slot.bit)
    slot = body.place(expr.of).moved(member.offset, kind, member.bit)
    return slot.target(body.site(expr)) if member.reference else slot


def _located(body: BodyContext, member: Field, whole: StructType) -> Variable:
    """The variable behind a member of a block that lies in no instance."""
    block = body.checker.block_of(whole)
    known = block.variables[fold(member.name)]
    return known if known.name == member.name else next(v for v in block.order if v.name == member.name)


def _part(body: BodyContext, expr: tree.Part, kind: Type) -> Place:
    whole = body.place(expr.of)
    if expr.size == "X":
        return whole.moved(expr.index // 8, kind, expr.index % 8)
    return whole.moved(expr.index * kind.size, kind)


def _dereferenced(body: BodyContext, expr: tree.Deref, kind: Type) -> Place:
    if expr.of in body.facts.selves:
        return _own_instance(body, expr.of, kind)
    return Place((("ref", body.value(expr.of), body.site(expr)), 0, ()), kind)


def _own_instance(body: BodyContext, expr: tree.Expr, kind: Type) -> Place:
    """The place of THIS and SUPER: the instance whose body is executed."""
    return Place(("self", 0, ()), kind)


def _name(body: BodyContext, expr: tree.NameRef) -> Node:
    """The value of a variable, or THIS as a pointer."""
    if expr not in body.facts.selves:
        return loaded(body, expr)
    own = body.pou.own_block
    assert own is not None and own.type is not None
    return body.instance_reference(Place(("self", 0, ()), own.type), own.type)


def _index(body: BodyContext, expr: tree.Index, kind: Type) -> Place:
    if isinstance(body.facts.types.get(expr.of), RefType):
        return pointers.element(body, expr, kind)
    return arrays.element(body, expr, kind)


def _words(body: BodyContext, expr: ladder.Words | ladder.Contents, kind: Type) -> Place:
    place = body.place(expr.of)
    return place if place.type == kind else Place(place.address, kind)


def _contents(body: BodyContext, expr: ladder.Contents) -> Node:
    meaning = body.facts.rewritten.get(expr)
    return loaded(body, expr) if meaning is None else body.value(meaning)


PLACES: PlaceRules = {
    tree.NameRef: _own_instance,
    tree.Direct: _direct, tree.Member: _member, tree.Part: _part, tree.Deref: _dereferenced, tree.Index: _index,
    ladder.Memory: plc_addresses.place_at, ladder.Words: _words, ladder.Contents: _words,
}
VALUES: ValueRules = {
    tree.Member: member_value,
    tree.NameRef: _name,
    **dict.fromkeys((tree.Direct, tree.Part, tree.Deref, tree.Index, ladder.Memory, ladder.Words), loaded),
    ladder.Contents: _contents,
}
