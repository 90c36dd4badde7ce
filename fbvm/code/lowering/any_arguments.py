"""What the caller stores about a variable that it passes to an ANY: size, number and distance of BOOLs, type class."""

from __future__ import annotations

from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import (
    ANY_BITS,
    ANY_CLASS,
    ANY_SIZE,
    ANY_STRIDE,
    BOOL,
    AnyType,
    ArrayType,
    OpenArrayType,
    Type,
    base,
)
from fbvm.check.expressions.any_parameters import type_class
from fbvm.code.builder.places import Place
from fbvm.code.lowering import any_parameters
from fbvm.code.lowering.arrays import size_of
from fbvm.code.lowering.context import BodyContext
from fbvm.code.operations import Node
from fbvm.syntax import tree

NUMBERS = (ANY_SIZE, ANY_BITS, ANY_STRIDE, ANY_CLASS)


def described(body: BodyContext, expr: tree.Expr) -> list[tuple[int, Node]]:
    """The numbers in the slot of an ANY for the argument `expr`: the offset of each, and its value as i32."""
    kind = body.facts.types[expr]
    if isinstance(kind, AnyType):
        return [(offset, _narrow(any_parameters.number(body, expr, offset))) for offset in NUMBERS]
    number = body.checker.type_classes().members[type_class(kind)]
    rows = (*_extent(body, expr, kind), ("const", "i64", number))
    return [(offset, _narrow(row)) for offset, row in zip(NUMBERS, rows, strict=True)]


def _extent(body: BodyContext, expr: tree.Expr, kind: Type) -> tuple[Node, Node, Node]:
    """Size in bytes, number of BOOLs (of what is not made of BOOLs, of bits) and their distance in bits, as i64."""
    size = size_of(body, expr, kind)
    if isinstance(kind, ArrayType) and kind.packed:
        whole = kind.count // 8 if not body.place(expr).bit else 0
        return ("const", "i64", whole), ("const", "i64", kind.count), ("const", "i64", 1)
    if base(kind) == BOOL:
        filled: Node = ("const", "i64", 1) if expr in body.facts.copies else _fills_byte(body.place(expr))
        return filled, ("const", "i64", 1), ("const", "i64", 8)
    if _element(kind) == BOOL:
        return size, size, ("const", "i64", 8)
    return size, ("mul", "i64", size, ("const", "i64", 8)), ("const", "i64", 1)


def _narrow(node: Node) -> Node:
    return ("const", "i32", node[2]) if node[0] == "const" else ("convert", "i32", "i64", node)


def _element(kind: Type) -> Type:
    """The type of the elements of an array of arrays."""
    while isinstance(kind, ArrayType | OpenArrayType):
        kind = kind.element
    return base(kind)


def _fills_byte(place: Place) -> Node:
    """1 for a BOOL that fills a byte, 0 for one on a bit, as i64; behind a reference only the reference says which."""
    if not place.is_reference or place.bit is not None:
        return ("const", "i64", int(place.bit is None))
    (_, pointer, _), _, _ = place.address
    bit = ("and", "u64", ("bits", "u64", "ref", pointer), ("const", "u64", WHOLE_BYTES))
    return ("convert", "i64", "b", ("eq", "b", "u64", bit, ("const", "u64", WHOLE_BYTES)))
