"""The rules of expressions by class of node; those of calls are in `calls`."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.types import NULL, Type
from fbvm.check.expressions import aggregates, literals, members, names, operators, rungs, subscripts
from fbvm.check.expressions.scope import Scope
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder


def _null(scope: Scope, expr: tree.NullLiteral, want: Type | None) -> Type:
    return NULL


def _type(scope: Scope, expr: tree.TypeOperand, want: Type | None) -> None:
    scope.error("S0405", expr, "a type stands here, and a value is needed", "SIZEOF and __NEW take types")


RULES: dict[type, Callable[..., Type | None]] = {
    tree.Literal: literals.literal, tree.EnumLiteral: literals.enum_literal, tree.NullLiteral: _null, tree.TypeOperand: _type,
    tree.NameRef: names.name, tree.Direct: names.address,
    tree.Member: members.member, tree.Part: members.part, tree.Deref: members.target, tree.Index: subscripts.element,
    tree.ArrayInit: aggregates.aggregate, tree.StructInit: aggregates.aggregate,
    tree.Unary: operators.unary, tree.Binary: operators.binary,
    ladder.Edge: rungs.edge, ladder.Element: rungs.contact, ladder.Memory: rungs.memory, ladder.Words: rungs.words,
    ladder.Contents: rungs.contents,
}
"""`rule(scope, expr, want)` gives the type of an expression, or None after a diagnostic."""
