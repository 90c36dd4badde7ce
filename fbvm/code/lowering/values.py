"""Lowering of expressions: a tree's expression in, an operation out, in the machine type that is wanted."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from fbvm.base.types import (
    ANY_SIZE,
    BOOL,
    DAY_NS,
    LREAL,
    AnyType,
    RefType,
    Type,
    base,
    machine,
)
from fbvm.check.expressions.constants import convert as convert_constant
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import Guard, PouCall, StandardCall, Value
from fbvm.code.lowering import plc_addresses
from fbvm.code.lowering.functions import FUNCTIONS, saturated
from fbvm.code.operations import FLOATS, TEXT_UNITS, Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering
    from fbvm.code.lowering.st_rungs import Mark

DEEPEST = 40
"""Operations nested deeper than this are cut by a temporary, so that no back end meets deep nesting."""
_ARITHMETIC = {"+": "add", "-": "sub", "*": "mul", "/": "div", "MOD": "mod", "**": "pow",
               "AND": "and", "OR": "or", "XOR": "xor"}
_SEEN = ladder.Edge | ladder.Element
_COMPARE = {"=": "eq", "<>": "ne", "<": "lt", ">": "gt", "<=": "le", ">=": "ge"}


def constant(kind: Type, value: Value) -> Node:
    """A constant of `kind` as an operation."""
    form = machine(kind)
    if form in FLOATS:
        return ("const", form, float(value))
    return ("const", form, int(value) if form not in TEXT_UNITS else value)


def nothing(form: str) -> Node:
    """The constant that a value of a form is at first."""
    return ("const", form, b"" if form == "s8" else "" if form == "s16" else float(0) if form in FLOATS else 0)


class ValueLowering:
    """Lowers the expressions of one body.  Calls and cuts become statements of the body in front."""

    def __init__(self, body: BodyLowering) -> None:
        self.body = body
        self.facts = body.facts

    # --- entry points -----------------------------------------------------------------------------------------------

    def value(self, expr: tree.Expr, want: Type | None = None) -> Node:
        """The value of `expr`, converted to `want` if that is given."""
        if self.body.marked and (marks := self.body.marked.get(expr)):
            return self._seen(expr, marks)
        return self._value(expr, want)

    def _seen(self, expr: tree.Expr, marks: list[Mark]) -> Node:
        """A value of BOOL that is shown in a rung, for those who look."""
        here = self.body.keep(self._value(expr, BOOL), always=True)
        for mark in marks:
            shown: Node = ("not", "b", here) if mark.negated else here
            self.body.out.append(("observe", "contact", self.body.site(expr), (mark.step, shown)))
        return here

    def _value(self, expr: tree.Expr, want: Type | None) -> Node:
        kind = self.facts.types[expr]
        known = self.facts.constants.get(expr)
        if known is not None:
            target = base(kind if want is None else want)
            if machine(target) in FLOATS or machine(target) == "b" or machine(target) in TEXT_UNITS:
                known = convert_constant(known, target)
            return constant(target, known)
        node = self._plain(expr)
        return self.body.measured(node if want is None or want is kind else self.converted(node, kind, base(want)))

    def converted(self, node: Node, kind: Type, target: Type) -> Node:
        """A value of `kind` as one of `target`, to which it converts by itself."""
        source, wanted = machine(kind), machine(target)
        if source == wanted or wanted in ("ref", ""):
            return node
        if wanted in TEXT_UNITS:
            return ("character", wanted, node)
        if source in FLOATS and wanted not in FLOATS:
            return saturated(self.body, "truncate", node, wanted)
        return ("convert", wanted, source, node)

    def sequence(self, values: Iterable[Node]) -> list[Node]:
        """Operands in order, each lowered when it is asked for; what was worked out before a call is kept in a temporary
        across it."""
        nodes: list[Node] = []
        mark = len(self.body.out)
        for node in values:
            if len(self.body.out) > mark:
                nodes = [self.body.keep_at(mark, earlier) for earlier in reversed(nodes)][::-1]
                mark = len(self.body.out)
            nodes.append(node)
        return nodes

    def operands(self, *wanted: tuple[tree.Expr, Type | None]) -> list[Node]:
        """The values of several expressions, in order."""
        return self.sequence(self.value(expr, kind) for expr, kind in wanted)

    # --- kinds of expressions ---------------------------------------------------------------------------------------

    def _plain(self, expr: tree.Expr) -> Node:
        """The value of a non-constant expression in its own type."""
        if isinstance(expr, tree.Call) and (guard := self.facts.guards.get(expr)) is not None:
            return self._guarded(expr, guard)
        return self._unguarded(expr)

    def _guarded(self, call: tree.Call, guard: Guard) -> Node:
        """A standard function with EN or ENO: with EN FALSE the result is the default of its type."""
        body = self.body
        enable = body.keep(self.value(guard.enable, BOOL)) if guard.enable is not None else ("const", "b", 1)
        form = machine(self.facts.types[call])
        kept = body.keep(nothing(form), always=True)
        with body.block() as inner:
            inner.append(("let", kept[2], form, self._unguarded(call)))
        body.out.append(("if", ((enable, tuple(inner)),), ()))
        for target, negated in guard.enabled:
            body.write(body.places.of(target), ("not", "b", enable) if negated else enable, body.site(call))
        return kept

    def _unguarded(self, expr: tree.Expr) -> Node:
        meaning = self.facts.rewritten.get(expr)
        if meaning is not None:
            return self.value(meaning)
        if isinstance(expr, tree.Binary):
            return self._binary(expr)
        if isinstance(expr, tree.Unary):
            return self._unary(expr)
        if isinstance(expr, tree.Call) and expr not in self.facts.followed:
            return self.call(expr)
        if isinstance(expr, tree.Member) and isinstance(self.facts.types.get(expr.of), AnyType) and \
                expr in self.facts.holders:
            return self.body.pointers.to_parameter(expr)
        if isinstance(expr, tree.NullLiteral):
            return ("const", "ref", 0)
        if isinstance(expr, _SEEN):
            return self._edge(expr) if isinstance(expr, ladder.Edge) else self._element(expr)
        place = self.body.places.of(expr)
        self.body.note_read(place, expr)
        return self.body.places.load(place)

    def _edge(self, expr: ladder.Edge) -> Node:
        """Whether a condition rises or falls; its memory is written where it is worked out."""
        body = self.body
        memory = body.places.of(expr.memory)
        here = body.keep(self.value(expr.of, BOOL), always=True)
        before = body.keep(body.places.load(memory), always=True)
        body.out.append(body.places.store(memory, here, body.site(expr)))
        now, then = (before, here) if expr.falling else (here, before)
        return ("and", "b", now, ("not", "b", then))

    def _element(self, expr: ladder.Element) -> Node:
        """The state of a contact, or the power at an output, for those who look."""
        here = self.body.keep(self.value(expr.value, BOOL), always=True)
        self.body.out.append(("observe", "contact", self.body.site(expr), (expr.step, here)))
        return here

    def _unary(self, expr: tree.Unary) -> Node:
        node = self.value(expr.operand)
        form = machine(self.facts.types[expr])
        if expr.op == "+":
            return node
        return _on_bits("not", form, node) if expr.op == "NOT" else ("neg", form, node)

    def call(self, expr: tree.Call) -> Node:
        """The result of a call."""
        called = self.facts.calls[expr]
        if isinstance(called, PouCall):
            return self.body.calls.value(expr, called)
        return self.standard(called, expr)

    def standard(self, called: StandardCall, expr: tree.Call) -> Node:
        """A call of a standard function."""
        if called.key == "REF":
            return self.body.pointers.to(called.arguments[0][0])
        if called.key == "__ISVALIDREF":
            return ("ne", "b", "ref", self.body.pointers.bound(called.arguments[0][0]), ("const", "ref", 0))
        if called.key == "__PLC_ADDRESS":
            return plc_addresses.address_of(self.body, called.arguments[0][0])
        if called.key == "SIZEOF":
            return ("convert", "u32", "i64", self.body.places.any_number(called.arguments[0][0], ANY_SIZE))
        if called.key in ("LOWER_BOUND", "UPPER_BOUND"):
            return ("convert", "i32", "i64", self.body.places.bound(called, self.facts.constants))
        arguments = self.operands(*called.arguments)
        return FUNCTIONS[called.key](self.body, arguments, called, self.body.site(expr))

    def _binary(self, expr: tree.Binary) -> Node:
        if expr.op in ("AND_THEN", "OR_ELSE"):
            return self._short(expr)
        operand = base(self.facts.operands[expr])
        if isinstance(operand, RefType):
            return self.body.pointers.binary(expr)
        compares = expr.op in _COMPARE
        if not compares and is_any(operand, "ANY_DURATION", "ANY_DATE"):
            return self._time(expr, operand)
        if expr.op == "**":
            return self._power(expr, operand)
        a, b = self.operands((expr.left, operand), (expr.right, operand))
        form = machine(operand)
        if compares:
            return (_COMPARE[expr.op], "b", form, a, b)
        name = _ARITHMETIC[expr.op]
        if name in ("and", "or", "xor"):
            return _on_bits(name, form, a, b)
        return (name, form, a, b, self.body.site(expr)) if name in ("div", "mod") else (name, form, a, b)

    def _power(self, expr: tree.Binary, operand: Type) -> Node:
        left, right = base(self.facts.types[expr.left]), base(self.facts.types[expr.right])
        exponent = operand if is_any(right, "ANY_REAL") else LREAL
        a, b = self.operands((expr.left, None), (expr.right, None))
        form = machine(operand)
        return ("pow", form, self._to_float(a, left, form), self._to_float(b, right, machine(exponent), form))

    def _to_float(self, node: Node, kind: Type, *forms: str) -> Node:
        form = forms[-1]
        source = machine(kind)
        return node if source == form else ("convert", form, source, node)

    def _short(self, expr: tree.Binary) -> Node:
        """AND_THEN and OR_ELSE: the right side is worked out only if it matters."""
        left = self.value(expr.left, BOOL)
        with self.body.block() as inner:
            right = self.value(expr.right, BOOL)
        name = "and_then" if expr.op == "AND_THEN" else "or_else"
        if not inner:
            return (name, "b", left, right)
        kept = self.body.keep(left, always=True)
        inner.append(("let", kept[2], "b", right))
        condition = kept if name == "and_then" else ("not", "b", kept)
        self.body.out.append(("if", ((condition, tuple(inner)),), ()))
        return kept

    def _time(self, expr: tree.Binary, operand: Type) -> Node:
        """Sums and differences of times and dates, products with numbers."""
        right = base(self.facts.types[expr.right])
        if expr.op in "+-":
            a, b = self.operands((expr.left, None), (expr.right, None))
            node = (_ARITHMETIC[expr.op], "i64", a, b)
            if operand.name.endswith("TIME_OF_DAY"):
                return in_day(self.body, node)
            return node
        if not is_any(right, "ANY_REAL"):
            a, b = self.operands((expr.left, None), (expr.right, None))
            b = b if machine(right) == "i64" else ("convert", "i64", machine(right), b)
            return ("mul", "i64", a, b) if expr.op == "*" else ("div", "i64", a, b, self.body.site(expr))
        a, b = self.operands((expr.left, None), (expr.right, LREAL))
        a = ("convert", "f64", "i64", a)
        product = ("mul", "f64", a, b) if expr.op == "*" else ("div", "f64", a, b, self.body.site(expr))
        return ("nearest", "i64", "f64", product, self.body.site(expr))


def in_day(body: BodyLowering, node: Node) -> Node:
    """A number of ns brought into 0 .. 24 h."""
    kept = body.keep(node)
    return ("sub", "i64", kept, ("mul", "i64", ("floor_div", "i64", kept, ("const", "i64", DAY_NS)),
                                 ("const", "i64", DAY_NS)))


def _on_bits(name: str, form: str, *operands: Node) -> Node:
    """A bitwise operation; one on signed integers is done on their bits."""
    if form[0] != "i":
        return (name, form, *operands)
    bits = f"u{form[1:]}"
    return ("convert", form, bits, (name, bits, *(("convert", bits, form, node) for node in operands)))


def is_aggregate(kind: Type) -> bool:
    """True for arrays and structures, which are copied as bytes."""
    return machine(kind) == ""
