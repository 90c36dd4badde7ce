"""Types of literals; one without a prefix stays untyped until an operand or its place gives it a type."""

from __future__ import annotations

from fbvm.base.types import ELEMENTARY, LINT, EnumType, Type, base, fold, string
from fbvm.check.expressions.constants import convert
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL
from fbvm.syntax import tree
from fbvm.syntax.st.literals import WRONG

_KINDS = {"bool": "BOOL", "time": "TIME"}
"""The types of literals without one, by their kinds."""


def literal(scope: Scope, expr: tree.Literal, want: Type | None) -> Type | None:
    """The type of a number, text, time or truth, or None after a diagnostic."""
    if expr.kind == WRONG:
        return None
    if isinstance(expr.value, str):
        return _text(scope, expr, expr.value, want)
    constants = scope.facts.constants
    value = constants[expr] = expr.value
    if expr.type_name is None and expr.kind in ("int", "real"):
        return UNTYPED_INT if expr.kind == "int" else UNTYPED_REAL
    kind = ELEMENTARY[expr.type_name or _KINDS[expr.kind]]
    if is_any(kind, "ANY_REAL"):
        assert isinstance(value, int | float)
        constants[expr] = convert(value, kind)
    if expr.kind == "time" and isinstance(value, int) and value > LINT.high:
        return _unsigned(scope, expr, value, kind)
    return kind


def _unsigned(scope: Scope, expr: tree.Literal, value: int, kind: Type) -> Type | None:
    """The type of a LTIME of more than 292 years, which has its 64 bits where a dialect has LTIME without a sign."""
    if not scope.dialect.unsigned_ltime:
        scope.error("S0108", expr, f"`{expr.text.partition('#')[2]}` does not fit 64 bits of nanoseconds, about 292 years")
        return None
    scope.facts.constants[expr] = value - (1 << LINT.bits)
    return kind


def _text(scope: Scope, expr: tree.Literal, text: str, want: Type | None) -> Type:
    """A STRING or WSTRING, or of one character a CHAR or WCHAR where that is wanted."""
    kind = string(max(1, len(text)), expr.kind == "wstring")
    if expr.type_name in ("CHAR", "WCHAR"):
        scope.facts.constants[expr] = ord(text)
        return ELEMENTARY[expr.type_name]
    ended = text.partition("\0")[0]
    scope.facts.constants[expr] = ended if kind.wide else ended.encode("latin-1")
    return as_character(scope, expr, want) or kind


def as_character(scope: Scope, expr: tree.Expr, want: Type | None) -> Type | None:
    """The type of a text literal without type as one character, which becomes its constant; None if it is none."""
    if not isinstance(expr, tree.Literal) or expr.type_name is not None or not isinstance(expr.value, str) or \
            len(expr.value) != 1 or want is None or \
            base(want).name != ("WCHAR" if expr.kind == "wstring" else "CHAR"):
        return None
    scope.facts.constants[expr] = ord(expr.value)
    scope.facts.types[expr] = base(want)
    return base(want)


def enum_literal(scope: Scope, expr: tree.EnumLiteral, want: Type | None) -> Type | None:
    """The type of `Colour#Red`, or None after a diagnostic."""
    kind = scope.named_type(expr.type_name.text)
    if not isinstance(kind, EnumType):
        scope.error("S0204", expr.type_name, f"there is no enumeration {expr.type_name.text}")
        return None
    return enum_value(scope, expr, kind, expr.member)


def enum_value(scope: Scope, expr: tree.Expr, kind: EnumType, member: tree.Name) -> Type | None:
    """The type of a member of an enumeration, whose number is the constant; None after a diagnostic."""
    value = kind.members.get(fold(member.text))
    if value is None:
        scope.error("S0210", member, f"{kind} has no member {member.text}",
                    scope.project.choices(member.text, kind.shown.values()))
        return None
    scope.facts.constants[expr] = value
    return kind
