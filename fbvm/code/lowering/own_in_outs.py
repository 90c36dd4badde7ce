"""In-outs of instances that are written from outside, or left out of a call, in a dialect that takes this.

Such an in-out is bound to a hidden variable of its instance, which gets the value first that the in-out has had."""

from __future__ import annotations

from fbvm.base.types import StructType, fold
from fbvm.check.declarations.hidden import own_name
from fbvm.code.builder.places import Place, is_aggregate
from fbvm.code.lowering.context import BodyContext
from fbvm.syntax import tree


def written(body: BodyContext, target: tree.Expr) -> None:
    """Bind the in-outs of instances that a written place lies in to variables of these instances."""
    inner, facts = target, body.facts
    while isinstance(inner, tree.Member | tree.Index | tree.Part):
        whole = facts.types.get(inner.of)
        if isinstance(inner, tree.Member) and isinstance(whole, StructType) and (field := facts.fields.get(inner)) is not None:
            own = whole.fields.get(fold(own_name(field.name)))
            if field.kind == "VAR_IN_OUT" and own is not None:
                instance = body.reusable(body.place(inner.of))
                bind(body, instance.moved(field.offset, field.type), instance.moved(own.offset, own.type), body.site(target))
        inner = inner.of


def bind(body: BodyContext, slot: Place, own: Place, site: int) -> None:
    """Bind the in-out whose reference lies in `slot` to the variable `own`, which gets the in-out's value if it has one."""
    reference = body.to_temporary(("load", "ref", slot.address))
    with body.block() as copied:
        value = Place((("ref", reference, site), 0, ()), slot.type)
        if is_aggregate(slot.type):
            body.emit(("copy", own.address, value.address, slot.type.size))
        else:
            body.emit(own.store(value.load(), site))
    body.emit(("if", ((("ne", "b", "ref", reference, ("const", "ref", 0)), tuple(copied)),), ()),
              ("store", "ref", slot.address, own.reference()))
