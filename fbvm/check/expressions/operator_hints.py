"""Operators on types for which they are not defined: the diagnostic, and the hint that comes with it."""

from __future__ import annotations

from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, DATE, Elementary, EnumType, StringType, StructType, Type, base, common
from fbvm.check.expressions.assignability import UNSIGNED, conversion_hint, convertible, is_untyped
from fbvm.check.expressions.constants import limits
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import UNTYPED_INT
from fbvm.syntax import tree

COMPARISONS = ("=", "<>", "<", ">", "<=", ">=")


def report_undefined(scope: Scope, expr: tree.Binary, left: Type, right: Type, want: Type | None) -> None:
    """Report an operator on types for which it is not defined."""
    hint = _time_hint(scope, expr, left, right)
    if hint is None:
        hint = _logic_hint(expr.op, left, right, want)
    if hint is None:
        hint = _number_hint(scope, expr, left, right)
    switch = _switch(expr.op, left, right)
    if switch and "--dialect" not in hint:
        hint += f", or take {takers(switch)}" if hint else f"take {takers(switch)}"
    scope.error("S0302", expr, f"{expr.op} is not defined for {left} and {right}", hint)


def report_larger(scope: Scope, op: str, literal: tree.Expr, kind: Type) -> bool:
    """Report an integer that is compared with a type that does not hold it, which is smaller; True if it did."""
    value, span = scope.facts.constants.get(literal), limits(kind)
    if op not in COMPARISONS or not isinstance(value, int) or span is None or value <= span[1]:
        return False
    numbers = kind != BOOL and is_any(kind, "ANY_INT", "ANY_BIT")
    scope.error("S0702", literal, f"{value} does not fit {kind}, which holds {span[0]} to {span[1]}",
                f"convert the other side to a larger type, or take {takers('integers_and_bits')}" if numbers else "")
    return True


def _switch(op: str, left: Type, right: Type) -> str:
    """The switch of the dialects in which an operator is defined for the types; "" if there are none."""
    kinds = _kind(left), _kind(right)
    if op in ("AND", "OR", "XOR"):
        return "integers_and_bits" if set(kinds) <= {"integer", "bits"} else ""
    return _SWITCHES.get((op, *kinds), "")


def _kind(kind: Type) -> str:
    """What a type is in `_SWITCHES`."""
    if kind is UNTYPED_INT or is_any(kind, "ANY_INT"):
        return "integer"
    if is_any(kind, "ANY_BIT"):
        return "" if kind == BOOL else "bits"
    return "duration" if is_any(kind, "ANY_DURATION") else "real" if is_untyped(kind) or is_any(kind, "ANY_REAL") else ""


_SWITCHES = {
    ("*", "integer", "duration"): "number_times_duration", ("*", "real", "duration"): "number_times_duration",
    ("*", "duration", "bits"): "arithmetic_of_bits", ("/", "duration", "bits"): "arithmetic_of_bits",
    ("+", "duration", "integer"): "integers_are_nanoseconds", ("-", "duration", "integer"): "integers_are_nanoseconds",
    ("+", "integer", "duration"): "integers_are_nanoseconds"}
"""Operator and kinds of its operands -> the switch of the dialects that take it."""


def _time_hint(scope: Scope, expr: tree.Binary, left: Type, right: Type) -> str | None:
    """What to write where one operand is a duration; None if that is not the mistake."""
    timed = [is_any(kind, "ANY_DURATION") for kind in (left, right)]
    if expr.op == "*" and timed[1] and _kind(left) in ("integer", "real"):
        return f"the {right} stands in front: {scope.text(expr.right)} * {scope.text(expr.left)}"
    if expr.op in "+-" and left == DATE and timed[1]:
        date, time = scope.text(expr.left), scope.text(expr.right)
        return f"a DATE has no time of day: write DT_TO_DATE(CONCAT_DATE_TOD({date}, TOD#0:0:0) {expr.op} {time})"
    if any(timed) and expr.op in ("+", "-") and UNTYPED_INT in (left, right):
        return "a duration is written T#500ms"
    return None


def _logic_hint(op: str, left: Type, right: Type, want: Type | None) -> str | None:
    """What to write where AND, OR, XOR or + meets operands of other kinds; None if that is not the mistake."""
    bits = [is_any(kind, "ANY_BIT") for kind in (left, right)]
    if op in ("AND", "OR") and want == BOOL and not any(bits):
        return "compare each of them, for example with <> 0"
    if op in ("+", "AND") and isinstance(left, StringType):
        return "CONCAT(...) joins texts"
    if op in ("AND", "OR", "XOR"):
        wrong, other = (right, left) if bits[0] else (left, right)
        return bit_hint(wrong, other)
    return None


def _number_hint(scope: Scope, expr: tree.Binary, left: Type, right: Type) -> str:
    """What to write where arithmetic or a comparison meets operands that it does not take."""
    if isinstance(left, StructType) or isinstance(right, StructType):
        return "compare or combine the members"
    if expr.op in ("+", "-", "*", "/", "MOD") and is_any(left, "ANY_BIT") and (left == right or right is UNTYPED_INT):
        number = UNSIGNED.get(left.name, "INT")
        others = f", or take {takers('arithmetic_of_bits')}" if left.name in UNSIGNED else ""
        return f"{left} has no arithmetic: convert with {left}_TO_{number}(...){others}"
    if left == right and isinstance(left, EnumType):
        numbers = (f"TO_{left.base}({scope.text(side)})" for side in (expr.left, expr.right))
        return f"write {f' {expr.op} '.join(numbers)}, or take {takers('numbers_of_enumerations')}"
    return _meeting_hint(left, right) if common(left, right) is None else ""


def bit_hint(kind: Type, other: Type | None) -> str:
    """How to make bits of a number; a BOOL if the other operand or the place of the result is one."""
    if other == BOOL:
        return conversion_hint(kind, BOOL)
    names = {1: "BYTE", 2: "WORD", 4: "DWORD", 8: "LWORD"}
    if kind is UNTYPED_INT:
        return "write a typed literal such as WORD#16#FF"
    return f"convert with {base(kind)}_TO_{names[kind.size]}(...)" if is_any(kind, "ANY_INT") else ""


def _meeting_hint(left: Type, right: Type) -> str:
    named = all(isinstance(k, Elementary) and k.bits for k in (left, right)) and convertible("TO", right, left)
    return f"convert one side, for example with {right}_TO_{left}(...)" if named else ""
