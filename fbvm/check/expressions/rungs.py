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
    of = scope.infer(expr.of)
    if not expr.kind:
        return _pin(scope, expr.of, of, want)
    kind = ELEMENTARY[expr.kind]
    if of is not None and scope.is_variable(expr.of) and _is_read_as_it_lies(scope, expr.of, base(of), kind):
        return kind
    assert expr.converted is not None
    scope.facts.rewritten[expr] = expr.converted
    return scope.infer(expr.converted, want)


def _pin(scope: Scope, expr: tree.Expr, of: Type | None, want: Type | None) -> Type | None:
    """The type of what stands at a pin: that of the pin, if so many words begin at the variable."""
    if of is None or want is None or base(of) == base(want) or not isinstance(base(want), Elementary):
        return of
    kind, own = base(want), base(of)
    if not _is_number(kind) or not _is_number(own):
        return of
    return kind if own.size == kind.size or _is_read_as_it_lies(scope, expr, own, kind) else of


def _is_number(kind: Type) -> bool:
    """Whether a type is that of words: a number or a string of bits, not BOOL and no byte."""
    return isinstance(kind, Elementary) and bool(kind.families & {"ANY_NUM", "ANY_BIT"}) and kind.size >= 2


def _is_read_as_it_lies(scope: Scope, expr: tree.Expr, of: Type, kind: Type) -> bool:
    if not _is_number(of):
        return False
    if of.size == kind.size:
        return (of in _REALS) != (kind in _REALS)
    variable = scope.facts.variables.get(scope.facts.root(expr))
    return of.size > kind.size or expr in scope.facts.directs or variable is not None and variable.location is not None


def words(scope: Scope, expr: ladder.Words, want: Type | None) -> Type | None:
    """The type of what an instruction takes as words: all but BOOL."""
    kind = scope.infer(expr.of)
    if kind is not None and (base(kind) == BOOL or not scope.is_variable(expr.of)):
        scope.error("S0405", expr, f"words are needed here, this is {kind}")
        return None
    return kind and any_parameters.VIEWS["WORDS"]
