"""Expressions that only rungs of ladder have: contacts, edges, words of memory."""

from __future__ import annotations

from fbvm.base.types import BOOL, ELEMENTARY, LREAL, REAL, UDINT, Elementary, Type, base
from fbvm.check.expressions import any_parameters
from fbvm.check.expressions.scope import Scope
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

_REALS = (REAL, LREAL)


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


def contents(scope: Scope, expr: ladder.Contents, want: Type | None) -> Type | None:
    """The type of what an instruction reads at a variable: `kind` if the variable has another width and the words are there,
    or if it is a REAL where a whole number is read, and the other way round."""
    of, kind = scope.infer(expr.of), ELEMENTARY[expr.kind]
    if of is not None and scope.is_variable(expr.of) and _is_read_as_it_lies(scope, expr.of, base(of), kind):
        return kind
    scope.facts.rewritten[expr] = expr.converted
    return scope.infer(expr.converted, want)


def _is_read_as_it_lies(scope: Scope, expr: tree.Expr, of: Type, kind: Type) -> bool:
    if not isinstance(of, Elementary) or not of.families & {"ANY_NUM", "ANY_BIT"} or of == BOOL or of.size < 2:
        return False
    if of.size == kind.size:
        return (of in _REALS) != (kind in _REALS)
    variable = scope.facts.variables.get(scope.facts.root(expr))
    return of.size > kind.size or variable is not None and variable.location is not None


def words(scope: Scope, expr: ladder.Words, want: Type | None) -> Type | None:
    """The type of what an instruction takes as words: all but BOOL."""
    kind = scope.infer(expr.of)
    if kind is not None and (base(kind) == BOOL or not scope.is_variable(expr.of)):
        scope.error("S0405", expr, f"words are needed here, this is {kind}")
        return None
    return kind and any_parameters.VIEWS["WORDS"]
