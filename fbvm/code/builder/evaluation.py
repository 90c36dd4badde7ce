"""Constant folding of standard functions: a call of constants is lowered as ever, then its operations are evaluated."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any, cast

from fbvm.base import arithmetic, strings
from fbvm.base.dialects import Dialect
from fbvm.base.types import base, machine
from fbvm.check.expressions.constants import convert
from fbvm.check.symbols.facts import StandardCall, Value
from fbvm.code.builder.constants import constant
from fbvm.code.builder.emitter import Emitter
from fbvm.code.builder.functions import FUNCTIONS
from fbvm.code.operations import FLOATS, INTEGERS, TEXT_UNITS, Node
from fbvm.syntax.st import texts

VARYING = frozenset(("TIME", "LTIME", "__DUE", "__STOP", "__RAISE"))
"""Functions that have another value each time, or an effect."""


class _ConstantEmitter(Emitter):
    """Where calls of constants are lowered: no statement is needed in front, so an expression stands for its own value."""

    def to_temporary(self, node: Node, always: bool = False) -> Node:
        return node

    def cut_if_deep(self, node: Node) -> Node:
        return node


def evaluate(call: StandardCall, arguments: Sequence[Value], dialect: Dialect) -> Value | None:
    """The value of a call of a standard function.

    call: what the checker found out about the call.
    arguments: the values of its arguments.
    dialect: decides what compilers disagree about.

    None if only the running program can tell.  Raises `arithmetic.Undefined` for a trap."""
    kinds = [base(kind) for _, kind in call.arguments]
    if call.key not in FUNCTIONS or call.key in VARYING or not all(map(machine, kinds)):
        return None
    nodes = [constant(kind, convert(value, kind)) for kind, value in zip(kinds, arguments, strict=True)]
    node = FUNCTIONS[call.key](_ConstantEmitter(dialect), nodes, call, 0)
    value = value_of(node)
    return bool(value) if node[1] == "b" else cast("Value", value)


def value_of(node: Node) -> Any:
    """The value of an expression that has only constants as operands.  Raises `arithmetic.Undefined` for a trap."""
    name, form, *operands = node
    if name == "const":
        return operands[0]
    if name == "mux":
        number = value_of(operands[0])
        if not 0 <= number < len(operands[1]):
            raise arithmetic.Undefined("R0107", number, len(operands[1]) - 1)
        return value_of(operands[1][number])
    values = [value_of(operand) if isinstance(operand, tuple) and name != "enum_text" else operand for operand in operands]
    if name == "enum_text":
        return texts.enum_text(dict(operands[0]), value_of(operands[1]))
    return _ROWS[name](form, *values)


def _wrapped(function: Callable[..., Any]) -> Callable[..., Any]:
    """Arithmetic whose result is wrapped to the width of an integer, or rounded to 32 bits for f32."""
    def answer(form: str, *values: Any) -> Any:
        value = function(*values)
        return arithmetic.wrap(value, form) if form in INTEGERS else arithmetic.single(value) if form == "f32" else value
    return answer


def _extreme(function: Callable[..., Any], real: Callable[..., Any]) -> Callable[..., Any]:
    return lambda form, a, b: (real if form in FLOATS else function)(a, b)


def _compare(function: Callable[..., bool]) -> Callable[..., Any]:
    return lambda form, kind, a, b: function(a, b)


def _divide(form: str, a: Any, b: Any, site: int) -> Any:
    if form in FLOATS:
        return _wrapped(arithmetic.divide)(form, a, b)
    if b == 0:
        raise arithmetic.Undefined("R0101", a, b)
    return arithmetic.wrap(arithmetic.quotient(a, b), form)


def _check(form: str, value: int, low: int, high: int, code: str, site: int) -> int:
    if not low <= value <= high:
        raise arithmetic.Undefined(code, value, low, high)
    return value


_ROWS: dict[str, Callable[..., Any]] = {
    "add": _wrapped(operator.add), "sub": _wrapped(operator.sub), "mul": _wrapped(operator.mul), "div": _divide,
    "abs": _wrapped(abs), "pow": _wrapped(arithmetic.power), "atan2": _wrapped(arithmetic.arctangent),
    "math": lambda form, name, a: _wrapped(arithmetic.FUNCTIONS[name])(form, a),
    "and": lambda form, a, b: a & b, "or": lambda form, a, b: a | b, "xor": lambda form, a, b: a ^ b,
    "shl": lambda form, a, n, site: arithmetic.shift_left(a, n, form),
    "shr": lambda form, a, n, site: arithmetic.shift_right(a, n, form),
    "rol": lambda form, a, n, site: arithmetic.rotate_left(a, n, form),
    "ror": lambda form, a, n, site: arithmetic.rotate_right(a, n, form),
    **{name: _compare(getattr(operator, name)) for name in ("eq", "ne", "lt", "le", "gt", "ge")},
    "convert": lambda form, source, a: arithmetic.convert(a, source, form),
    "nearest": lambda form, source, a, site: arithmetic.nearest(a, form),
    "truncate": lambda form, source, a, site: arithmetic.truncate(a, form),
    "bits": lambda form, source, a: arithmetic.bits(a, source, form),
    "is_set": lambda form, source, a: a != 0,
    "select": lambda form, g, a, b: b if g else a,
    "min": _extreme(lambda a, b: a if a <= b else b, arithmetic.lesser),
    "max": _extreme(lambda a, b: a if a >= b else b, arithmetic.greater),
    "floor_div": lambda form, a, b: a // b, "check": _check,
    "from_bcd": lambda form, source, a, site: arithmetic.from_bcd(a, form),
    "to_bcd": lambda form, source, a, site: arithmetic.to_bcd(a, form),
    "length": lambda form, a: arithmetic.wrap(len(a), form), "find": lambda form, a, b: strings.find(a, b),
    "characters": lambda form, a: strings.characters(a), "units_of": lambda form, a, n: strings.units_of(a, n),
    "concat": lambda form, a, b: a + b,
    **{name: lambda form, *operands, _name=name: getattr(strings, _name)(*operands[:-1])
       for name in ("left", "right", "mid", "insert", "delete", "replace")},
    "character": lambda form, a: strings.character(a, TEXT_UNITS[form] == 2), "first": lambda form, a: strings.first(a),
    "recode": lambda form, a: strings.widened(a) if form == "s16" else strings.narrowed(a),
    "to_text": lambda form, kind, a: texts.to_text(kind, a),
    "from_text": lambda form, kind, a, site: texts.from_text(kind, a),
    "from_leading": lambda form, kind, whole, a: texts.from_leading(kind, whole, a),
}
"""What each operation yields, from its machine type and the values of the operands of its row."""
