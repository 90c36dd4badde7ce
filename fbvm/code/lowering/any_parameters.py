"""Lowering of parameters of the type ANY, as their body sees them.

The slot of one holds a reference and four numbers (`base.types`: ANY_SIZE and what follows): size in bytes, number of
BOOLs, distance of those in bits, and type class of what was passed."""

from __future__ import annotations

from fbvm.base.types import ANY_BITS, ANY_SIZE, ANY_STRIDE, BOOL, DINT, OpenArrayType, Type, fold
from fbvm.check.expressions.any_parameters import NUMBERS, VIEWS
from fbvm.code.builder.places import Place
from fbvm.code.lowering.context import BodyContext
from fbvm.code.operations import Node
from fbvm.syntax import tree


def number(body: BodyContext, expr: tree.Expr, offset: int) -> Node:
    """The number at an offset in the slot of the parameter that `expr` names, as i64."""
    slot = body.slot(body.facts.variables[expr])
    return ("convert", "i64", "i32", ("load", "i32", slot.moved(offset, DINT).address))


def member(body: BodyContext, expr: tree.Member, kind: Type) -> Place:
    """A member of an ANY: a number in its slot, or the bytes of what was passed (BYTES, WORDS ...)."""
    offset = NUMBERS.get(fold(expr.name.text))
    variable = body.facts.variables[expr.of]
    return body.variable(variable, expr) if offset is None else body.slot(variable).moved(offset, kind)


def last_subscript(body: BodyContext, expr: tree.Member, kind: OpenArrayType) -> Node:
    """The last subscript of BITS, BYTES, WORDS ... of an ANY, as i64."""
    if kind is VIEWS["BITS"]:
        count = number(body, expr.of, ANY_BITS)
    else:
        count = ("floor_div", "i64", number(body, expr.of, ANY_SIZE), ("const", "i64", kind.element.size))
    return ("sub", "i64", count, ("const", "i64", 1))


def bit(body: BodyContext, expr: tree.Index) -> Place:
    """An element of BITS of an ANY, which lies behind a reference to a bit."""
    assert isinstance(expr.of, tree.Member)
    subscript, = expr.subscripts
    last = last_subscript(body, expr.of, VIEWS["BITS"])
    site = body.site(subscript)
    checked = ("within", "i64", body.as_i64(subscript), ("const", "i64", 0), last, "R0102", site)
    distance = ("mul", "i64", checked, number(body, expr.of.of, ANY_STRIDE))
    start = ("load", "ref", body.slot(body.facts.variables[expr.of.of]).address)
    return Place((("ref", ("bit_behind", "ref", start, distance), body.site(expr)), 0, ()), BOOL)
