"""Constant integer expressions: bounds, lengths, repetitions, values of enumerations."""

from __future__ import annotations

from collections.abc import Mapping

from fbvm.base.codes import CODES
from fbvm.base.types import DINT, LINT, fold
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import UNTYPED_INT
from fbvm.syntax import tree
from fbvm.syntax.tree.node import walk


def integer(scope: Scope, expr: tree.Expr, known: Mapping[str, int] | None = None) -> int | None:
    """The value of a constant integer expression, or None after a diagnostic.

    `known` are names, folded, that stand for numbers in it."""
    for name in walk(expr) if known else ():
        if known and isinstance(name, tree.NameRef) and fold(name.text) in known:
            scope.facts.types[name], scope.facts.constants[name] = UNTYPED_INT, known[fold(name.text)]
    kind = scope.settle(expr)
    if kind is None:
        return None
    value = scope.facts.constants.get(expr)
    if isinstance(value, float) and scope.takes_power(expr, LINT):
        return int(value)
    if isinstance(value, bool) or not isinstance(value, int) or is_any(kind, "ANY_DURATION", "ANY_DATE"):
        what = f"{kind}" if value is not None else "not known before the program runs"
        if value is None and is_undefined(scope, expr):
            return None
        scope.error("S0701", expr, f"a constant integer is needed here; this is {what}",
                    scope.power_hint(expr, DINT) or "write a number" if value is not None else
                    "write a literal, or declare the name in a VAR CONSTANT section")
        return None
    return _exact(scope, expr)


def _exact(scope: Scope, expr: tree.Expr) -> int:
    """The value of a constant with sums and products of any width: ARRAY[1..n * 40] of a UINT n never wraps."""
    if isinstance(expr, tree.Binary) and expr.op in ("+", "-", "*"):
        left, right = _exact(scope, expr.left), _exact(scope, expr.right)
        return left + right if expr.op == "+" else left - right if expr.op == "-" else left * right
    value = scope.facts.constants[expr]
    assert isinstance(value, int), "only integers make one"
    return value


def is_undefined(scope: Scope, expr: tree.Expr) -> bool:
    """True, with a diagnostic, if a call in a constant expression would trap."""
    for call, (where, code) in scope.facts.undefined.items():
        if where is scope.source and expr.start <= call.start and call.end <= expr.end:
            scope.error("S0703", call, f"this has no value: {CODES[code].title}")
            return True
    return False


def repeated(scope: Scope, repetition: tree.Expr | None, value: tree.Initial | None,
             ) -> tuple[tree.Expr | None, tree.Initial | None]:
    """How often an element of an array is repeated, and its value.

    `N(0)` reads as a call: where N is a constant it is a repetition."""
    if repetition is None and isinstance(value, tree.Call) and isinstance(value.callee, tree.NameRef) and \
            len(value.arguments) < 2 and all(not argument.kind for argument in value.arguments):
        variable = scope.variable(value.callee.text)
        if variable is not None and isinstance(variable.value, int):
            return value.callee, value.arguments[0].value if value.arguments else None
    return repetition, value
