"""Expressions that only rungs of ladder have: contacts, edges, words of memory."""

from __future__ import annotations

from fbvm.base.types import BOOL, ELEMENTARY, UDINT, Type, base
from fbvm.check.expressions import any_parameters
from fbvm.check.expressions.scope import Scope
from fbvm.syntax.tree import ladder


def edge(scope: Scope, expr: ladder.Edge, want: Type | None) -> Type | None:
    """The type of an edge of a condition, which has a memory bit."""
    scope.infer(expr.memory)
    scope.condition(expr.of, "an edge")
    return BOOL


def contact(scope: Scope, expr: ladder.Element, want: Type | None) -> Type | None:
    """The type of a contact."""
    scope.condition(expr.value, "a contact")
    return BOOL


def memory(scope: Scope, expr: ladder.Memory, want: Type | None) -> Type | None:
    """The type of a place in memory whose address is computed when the program runs."""
    scope.fit(expr.address, UDINT)
    return ELEMENTARY[expr.kind] if expr.kind else any_parameters.VIEWS["WORDS"]


def words(scope: Scope, expr: ladder.Words, want: Type | None) -> Type | None:
    """The type of what an instruction takes as words: all but BOOL."""
    kind = scope.infer(expr.of)
    if kind is not None and (base(kind) == BOOL or not scope.is_variable(expr.of)):
        scope.error("S0405", expr, f"words are needed here, this is {kind}")
        return None
    return kind and any_parameters.VIEWS["WORDS"]
