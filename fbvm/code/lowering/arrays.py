"""Lowering of arrays: elements of ARRAY, of ARRAY [*] and of arrays that are located on bits; bounds and sizes."""

from __future__ import annotations

from fbvm.base.types import BOOL, LINT, ArrayType, OpenArrayType, StringType, Type, characters
from fbvm.check.expressions.any_parameters import VIEWS
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.builder.places import Place
from fbvm.code.lowering import any_parameters, plc_addresses
from fbvm.code.lowering.context import BodyContext
from fbvm.code.operations import Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder


def element(body: BodyContext, expr: tree.Index, kind: Type) -> Place:
    """The place of an element of an array, or of a character of a STRING; a subscript out of bounds traps R0102."""
    whole = body.facts.types[expr.of]
    if whole is VIEWS["BITS"]:
        return any_parameters.bit(body, expr)
    if isinstance(whole, OpenArrayType):
        return _open_element(body, expr, whole)
    place = body.place(expr.of)
    if isinstance(place.type, ArrayType) and place.type.packed:
        return _bit_element(body, place, place.type, expr)
    start, offset, terms = place.address
    inner = characters(place.type) if isinstance(place.type, StringType) else place.type
    rest = list(expr.subscripts)
    while rest:
        assert isinstance(inner, ArrayType)
        stride = inner.size
        for low, high in inner.bounds:
            subscript = rest.pop(0)
            stride //= high - low + 1
            constant = body.facts.constants.get(subscript)
            offset -= low * stride
            if constant is not None:
                offset += int(constant) * stride
            else:
                terms = (*terms, (stride, _checked(body, subscript, low, high)))
        inner = inner.element
    return Place((start, offset, terms), kind)


def _checked(body: BodyContext, subscript: tree.Expr, low: int, high: int) -> Node:
    return ("check", "i64", body.as_i64(subscript), low, high, "R0102", body.site(subscript))


def _bit_element(body: BodyContext, place: Place, kind: ArrayType, expr: tree.Index) -> Place:
    """An element of an array that is located on bits."""
    number, stride = 0, kind.count
    distance: Node | None = None
    for (low, high), subscript in zip(kind.bounds, expr.subscripts, strict=True):
        stride //= high - low + 1
        known = body.facts.constants.get(subscript)
        if known is not None:
            number += (int(known) - low) * stride
            continue
        checked = _checked(body, subscript, low, high)
        step: Node = ("mul", "i64", ("sub", "i64", checked, ("const", "i64", low)), ("const", "i64", stride))
        distance = step if distance is None else ("add", "i64", distance, step)
    start, offset, terms = place.address
    if distance is None:
        number += place.bit or 0
        return Place((start, offset + number // 8, terms), BOOL, number % 8)
    bit = ("bit_behind", "ref", place.reference(), ("add", "i64", distance, ("const", "i64", number)))
    return Place((("ref", bit, body.site(expr)), 0, ()), BOOL)


def _open_element(body: BodyContext, expr: tree.Index, kind: OpenArrayType) -> Place:
    """An element of ARRAY [*], whose bounds lie beside the reference in the slot of the parameter."""
    place = body.place(expr.of)
    start, offset, terms = place.address
    distance: Node | None = None
    for dimension, subscript in enumerate(expr.subscripts):
        low, high = (_open_bound(body, expr.of, kind, dimension, upper) for upper in (False, True))
        checked = ("within", "i64", body.as_i64(subscript), low, high, "R0102", body.site(subscript))
        step: Node = ("sub", "i64", checked, low)
        if distance is not None:
            width = ("add", "i64", ("sub", "i64", high, low), ("const", "i64", 1))
            step = ("add", "i64", ("mul", "i64", distance, width), step)
        distance = step
    assert distance is not None
    return Place((start, offset, (*terms, (kind.element.size, distance))), kind.element)


# --- bounds and sizes -------------------------------------------------------------------------------------------------


def _open_bound(body: BodyContext, expr: tree.Expr, kind: OpenArrayType, dimension: int, upper: bool) -> Node:
    """A bound of an array whose bounds are known when the program runs, as i64: ARRAY [*], views of an ANY, words."""
    if isinstance(expr, ladder.Memory | ladder.Words):
        return plc_addresses.bound(body, expr, upper)
    if isinstance(expr, tree.Member):
        return any_parameters.last_subscript(body, expr, kind) if upper else ("const", "i64", 0)
    slot = body.slot(body.facts.variables[expr])
    return ("load", "i64", slot.moved(kind.bound_offset(dimension, upper), LINT).address)


def bounds(body: BodyContext, expr: tree.Expr) -> list[Node]:
    """The bounds of an array that is passed to ARRAY [*], as i64: lower and upper of each dimension."""
    kind = body.facts.types[expr]
    if isinstance(kind, OpenArrayType):
        return [_open_bound(body, expr, kind, d, upper) for d in range(kind.dimensions) for upper in (False, True)]
    assert isinstance(kind, ArrayType)
    return [("const", "i64", bound) for pair in kind.bounds for bound in pair]


def bound_of_dimension(body: BodyContext, called: StandardCall) -> Node:
    """LOWER_BOUND(array, dimension) or UPPER_BOUND, as i64, where one of the two is known when the program runs only."""
    (array, kind), (dimension, _) = called.arguments
    upper = called.key == "UPPER_BOUND"
    if isinstance(kind, OpenArrayType):
        known = [_open_bound(body, array, kind, number, upper) for number in range(kind.dimensions)]
    else:
        assert isinstance(kind, ArrayType)
        known = [("const", "i64", pair[upper]) for pair in kind.bounds]
    constant = body.facts.constants.get(dimension)
    if constant is not None:
        return known[int(constant) - 1]
    site = body.site(dimension)
    checked = ("check", "i64", body.as_i64(dimension), 1, len(known), "R0102", site)
    number = body.to_temporary(checked)
    found = known[0]
    for each, bound in enumerate(known[1:], start=2):
        found = ("select", "i64", ("eq", "b", "i64", number, ("const", "i64", each)), found, bound)
    return found


def size_of(body: BodyContext, expr: tree.Expr, kind: Type) -> Node:
    """Bytes of a variable, as i64; of ARRAY [*] by the bounds of what is passed."""
    if not isinstance(kind, OpenArrayType):
        return ("const", "i64", kind.size)
    size: Node = ("const", "i64", kind.element.size)
    pairs = iter(bounds(body, expr))
    for low, high in zip(pairs, pairs, strict=True):
        count = ("add", "i64", ("sub", "i64", high, low), ("const", "i64", 1))
        size = ("mul", "i64", size, count)
    return size
