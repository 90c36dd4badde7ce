"""Lowering of operators, and of the expressions that only ladder has: edges and observed elements."""

from __future__ import annotations

from fbvm.base.arithmetic import limits
from fbvm.base.types import BOOL, ELEMENTARY, LREAL, RefType, Type, base, machine
from fbvm.check.expressions import constants
from fbvm.check.expressions.values import is_any
from fbvm.code.builder.conversions import day_start, to_float
from fbvm.code.lowering import pointers
from fbvm.code.lowering.context import BodyContext, ValueRules
from fbvm.code.operations import Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

_ARITHMETIC = {"+": "add", "-": "sub", "*": "mul", "/": "div", "MOD": "mod", "**": "pow",
               "AND": "and", "OR": "or", "XOR": "xor"}
_TIMES = frozenset(kind for kind in ELEMENTARY.values() if is_any(kind, "ANY_DURATION", "ANY_DATE"))
_COMPARE = {"=": "eq", "<>": "ne", "<": "lt", ">": "gt", "<=": "le", ">=": "ge"}


def _unary(body: BodyContext, expr: tree.Unary) -> Node:
    meaning = body.facts.rewritten.get(expr)
    if meaning is not None:
        return body.value(meaning)
    node = body.value(expr.operand)
    form = machine(body.facts.types[expr])
    if expr.op == "+":
        return node
    return _on_bits("not", form, node) if expr.op == "NOT" else ("neg", form, node)


def _binary(body: BodyContext, expr: tree.Binary) -> Node:
    meaning = body.facts.rewritten.get(expr)
    if meaning is not None:
        return body.value(meaning)
    if expr.op in ("AND_THEN", "OR_ELSE"):
        return _short_circuit(body, expr)
    operand = base(body.facts.operands[expr])
    if expr.op in ("AND", "OR", "&") and operand == BOOL and body.dialect.short_circuits:
        return _short_circuit(body, expr)
    if isinstance(operand, RefType):
        return pointers.binary(body, expr)
    compares = expr.op in _COMPARE
    if operand in _TIMES and not compares:
        return _time(body, expr, operand)
    if expr.op == "**":
        return _power(body, expr, operand)
    a, b = body.operands((expr.left, operand), (expr.right, operand))
    form = machine(operand)
    if compares:
        return (_COMPARE[expr.op], "b", form, a, b)
    name = _ARITHMETIC[expr.op]
    if name in ("and", "or", "xor"):
        return _on_bits(name, form, a, b)
    return (name, form, a, b, body.site(expr)) if name in ("div", "mod") else (name, form, a, b)


def _on_bits(name: str, form: str, *operands: Node) -> Node:
    """A bitwise operation; on signed integers, which dialects allow, it is done on their bits."""
    if form[0] != "i":
        return (name, form, *operands)
    bits = f"u{form[1:]}"
    return ("convert", form, bits, (name, bits, *(("convert", bits, form, node) for node in operands)))


def _power(body: BodyContext, expr: tree.Binary, operand: Type) -> Node:
    left, right = base(body.facts.types[expr.left]), base(body.facts.types[expr.right])
    a, b = body.operands((expr.left, None), (expr.right, None))
    form = machine(operand)
    return ("pow", form, to_float(a, left, form), to_float(b, right, form))


def _short_circuit(body: BodyContext, expr: tree.Binary) -> Node:
    """AND_THEN and OR_ELSE: the right side is evaluated only if the left one leaves the result open."""
    left = body.value(expr.left, BOOL)
    with body.block() as inner:
        right = body.value(expr.right, BOOL)
    name = "or_else" if expr.op in ("OR", "OR_ELSE") else "and_then"
    if not inner:
        return (name, "b", left, right)
    result = body.to_temporary(left, always=True)
    inner.append(("let", result[2], "b", right))
    condition = result if name == "and_then" else ("not", "b", result)
    body.emit(("if", ((condition, tuple(inner)),), ()))
    return result


def _time(body: BodyContext, expr: tree.Binary, operand: Type) -> Node:
    """Sums and differences of times and dates, products and quotients with numbers."""
    right = base(body.facts.types[expr.right])
    if expr.op in "+-":
        a, b = body.operands((expr.left, None), (expr.right, None))
        if operand.name.endswith("TIME_OF_DAY"):
            return _time_of_day(body, (_ARITHMETIC[expr.op], "i64", a, _time_of_day(body, b)))
        if constants.is_moment(base(body.facts.types[expr.left])):
            return _moment(body, expr, a, b)
        return (_ARITHMETIC[expr.op], "i64", a, b)
    if not is_any(right, "ANY_REAL"):
        a, b = body.operands((expr.left, None), (expr.right, None))
        b = b if machine(right) == "i64" else ("convert", "i64", machine(right), b)
        return ("mul", "i64", a, b) if expr.op == "*" else ("div", "i64", a, b, body.site(expr))
    a, b = body.operands((expr.left, None), (expr.right, LREAL))
    a = ("convert", "f64", "i64", a)
    product = ("mul", "f64", a, b) if expr.op == "*" else ("div", "f64", a, b, body.site(expr))
    return ("nearest", "i64", "f64", product, body.site(expr))


def _moment(body: BodyContext, expr: tree.Binary, a: Node, b: Node) -> Node:
    """A sum or difference with a DATE or DT in front: traps (R0105) where 64 bits of ns do not hold it."""
    a, b = body.to_temporary(a), body.to_temporary(b)
    zero, least, most = (("const", "i64", value) for value in (0, *limits("i64")))
    below, above = ("min", "i64", b, zero), ("max", "i64", b, zero)
    span = (("sub", "i64", least, below), ("sub", "i64", most, above)) if expr.op == "+" else \
        (("add", "i64", least, above), ("add", "i64", most, below))
    return (_ARITHMETIC[expr.op], "i64", ("within", "i64", a, *span, "R0105", body.site(expr)), b)


def _time_of_day(body: BodyContext, node: Node) -> Node:
    """A number of ns modulo 24 h."""
    moment = body.to_temporary(node)
    return ("sub", "i64", moment, day_start(moment))


# --- ladder -----------------------------------------------------------------------------------------------------------


def _edge(body: BodyContext, expr: ladder.Edge) -> Node:
    """Whether a condition rises or falls; its memory is written where the edge is evaluated."""
    memory = body.place(expr.memory)
    here = body.to_temporary(body.value(expr.of, BOOL), always=True)
    before = body.to_temporary(memory.load(), always=True)
    body.emit(memory.store(here, body.site(expr)))
    now, then = (before, here) if expr.falling else (here, before)
    return ("and", "b", now, ("not", "b", then))


def _element(body: BodyContext, expr: ladder.Element) -> Node:
    """The state of a contact, or the power at an output, which is observed."""
    here = body.to_temporary(body.value(expr.value, BOOL), always=True)
    body.emit(("observe", "contact", body.site(expr), (expr.step, here)))
    return here


def _null(body: BodyContext, expr: tree.NullLiteral) -> Node:
    return ("const", "ref", 0)


VALUES: ValueRules = {
    tree.Unary: _unary, tree.Binary: _binary, tree.NullLiteral: _null, ladder.Edge: _edge, ladder.Element: _element,
}
