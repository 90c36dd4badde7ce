"""Subscripts of arrays, of strings and behind pointers."""

from __future__ import annotations

from fbvm.base.types import BOOL, DINT, ArrayType, EnumType, OpenArrayType, RefType, StringType, Type, base, characters
from fbvm.check.expressions.assignability import as_number, mismatch_hint
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.syntax import tree

_ANY_NUMBER = -(1 << 63), (1 << 63) - 1
"""Bounds that are known only when the program runs."""


def element(scope: Scope, expr: tree.Index, want: Type | None) -> Type | None:
    """The type of the element, or None after a diagnostic."""
    whole = scope.infer(expr.of)
    kinds = [scope.settle(subscript) for subscript in expr.subscripts]
    if whole is None or None in kinds:
        return None
    if isinstance(whole, OpenArrayType):
        return _open(scope, expr, whole, kinds)
    if isinstance(whole, RefType) and whole.moves:
        return _behind(scope, expr, whole, kinds)
    if isinstance(whole, StringType):
        if not scope.is_variable(expr.of):
            scope.error("S0407", expr.of, "characters have subscripts in a variable only",
                        "MID(s, 1, n) is character n of any text")
            return None
        whole = characters(whole)
    if not isinstance(whole, ArrayType):
        scope.error("S0304", expr.of, f"this is {whole}, not an array", _bit_hint(scope, expr, whole))
        return None
    element: Type = whole
    rest = list(zip(expr.subscripts, kinds, strict=True))
    while rest:
        if not isinstance(element, ArrayType) or len(rest) < len(element.bounds):
            _wrong_number(scope, expr, whole, len(whole.bounds))
            return None
        for (subscript, kind), (low, high) in zip(rest, element.bounds, strict=False):
            if not _fits(scope, subscript, kind, low, high, element):
                return None
        rest = rest[len(element.bounds):]
        element = element.element
    return element


def _bit_hint(scope: Scope, expr: tree.Index, whole: Type) -> str:
    """How the bit is written that a subscript may mean; "" for what has no bits."""
    if len(expr.subscripts) != 1 or not is_any(whole, "ANY_INT", "ANY_BIT") or base(whole) == BOOL:
        return ""
    of, number, bits = scope.text(expr.of), scope.facts.constants.get(expr.subscripts[0]), 8 * whole.size
    if isinstance(number, int) and 0 <= number < bits:
        return f"a bit is written {of}.{number}"
    return f"bits are written {of}.0 to {of}.{bits - 1}"


def _open(scope: Scope, expr: tree.Index, whole: OpenArrayType, kinds: list[Type | None]) -> Type | None:
    """Subscripts of ARRAY [*]: their bounds are known when the program runs."""
    if len(kinds) != whole.dimensions:
        _wrong_number(scope, expr, whole, whole.dimensions)
        return None
    for subscript, kind in zip(expr.subscripts, kinds, strict=True):
        if not _fits(scope, subscript, kind, *_ANY_NUMBER, whole):
            return None
    return whole.element


def _behind(scope: Scope, expr: tree.Index, whole: RefType, kinds: list[Type | None]) -> Type | None:
    """`p[i]` of a pointer: the object that lies i times the size of its target behind the target."""
    if len(kinds) != 1:
        _wrong_number(scope, expr, whole, 1)
        return None
    return whole.target if _fits(scope, expr.subscripts[0], kinds[0], *_ANY_NUMBER, whole) else None


def _wrong_number(scope: Scope, expr: tree.Index, whole: Type, needed: int) -> None:
    written = len(expr.subscripts)
    scope.error("S0305", expr, f"{whole} needs {needed} subscript{'s' if needed > 1 else ''}, "
                f"{written} {'are' if written > 1 else 'is'} written", "a[1, 2] is an element of two dimensions" if
                needed > written else "")


def _fits(scope: Scope, expr: tree.Expr, kind: Type | None, low: int, high: int, whole: Type) -> bool:
    assert kind is not None
    counted = as_number(kind, scope.dialect)
    if not is_any(counted, "ANY_INT") and not isinstance(kind, EnumType):
        scope.error("S0301", expr, f"a subscript is an integer, not {kind}", mismatch_hint(expr, kind, DINT))
        return False
    value = scope.facts.constants.get(expr)
    if isinstance(value, int) and not low <= value <= high:
        scope.error("S0702", expr, f"subscript {value} is outside {low}..{high} of {whole}")
        return False
    return True


