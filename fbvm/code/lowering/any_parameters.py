"""What the caller tells a block about a variable that it passes to an ANY: size, BOOLs or bits, type."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
from fbvm.code.lowering.places import Place
from fbvm.code.operations import Node
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering

NUMBERS = (ANY_SIZE, ANY_BITS, ANY_STRIDE, ANY_CLASS)


def described(body: BodyLowering, expr: tree.Expr) -> list[tuple[int, Node]]:
    """The numbers of the slot of an ANY, as i32 by their places in it, for what is passed."""
    kind = body.facts.types[expr]
    if isinstance(kind, AnyType):
        return [(offset, _narrow(body.places.any_number(expr, offset))) for offset in NUMBERS]
    size = size_of(body, expr, kind)
    if isinstance(kind, ArrayType) and kind.packed:
        whole = kind.count // 8 if not body.places.of(expr).bit else 0
        size = ("const", "i64", whole)
    rows: tuple[Node, Node, Node]
    if base(kind) == BOOL:
        fills = _fills_bytes(body.places.of(expr))
        rows = (fills, ("const", "i64", 1), ("const", "i64", 8))
    elif isinstance(kind, ArrayType) and kind.packed:
        rows = (size, ("const", "i64", kind.count), ("const", "i64", 1))
    elif _leaf(kind) == BOOL:
        rows = (size, size, ("const", "i64", 8))
    else:
        rows = (size, ("mul", "i64", size, ("const", "i64", 8)), ("const", "i64", 1))
    number = body.checker.type_classes().members[type_class(kind)]
    return [(offset, _narrow(row)) for offset, row in zip(NUMBERS, (*rows, ("const", "i64", number)), strict=True)]


def _narrow(node: Node) -> Node:
    return ("const", "i32", node[2]) if node[0] == "const" else ("convert", "i32", "i64", node)


def _leaf(kind: Type) -> Type:
    """What an array of arrays is made of."""
    while isinstance(kind, ArrayType | OpenArrayType):
        kind = kind.element
    return base(kind)


def size_of(body: BodyLowering, expr: tree.Expr, kind: Type) -> Node:
    """Bytes of a variable, as i64; of ARRAY [*] by the bounds that it brings."""
    if not isinstance(kind, OpenArrayType):
        return ("const", "i64", kind.size)
    size: Node = ("const", "i64", kind.element.size)
    bounds = iter(body.places.bounds(expr))
    for low, high in zip(bounds, bounds, strict=True):
        count = ("add", "i64", ("sub", "i64", high, low), ("const", "i64", 1))
        size = ("mul", "i64", size, count)
    return size


def _fills_bytes(place: Place) -> Node:
    """1 for a BOOL that fills a byte, 0 for one on a bit, as i64: behind a reference only that tells."""
    if not place.is_reference or place.bit is not None:
        return ("const", "i64", int(place.bit is None))
    (_, pointer, _), _, _ = place.address
    bit = ("and", "u64", ("bits", "u64", "ref", pointer), ("const", "u64", WHOLE_BYTES))
    return ("convert", "i64", "b", ("eq", "b", "u64", bit, ("const", "u64", WHOLE_BYTES)))
