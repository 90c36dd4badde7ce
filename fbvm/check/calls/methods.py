"""Calls of methods: `m()` in its own block, `instance.m()`, `THIS^.m()`, `SUPER^.m()`, through pointers and interfaces."""

from __future__ import annotations

from fbvm.base.types import Type
from fbvm.check.calls.binding import bind
from fbvm.check.expressions import objects
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.facts import PouCall
from fbvm.syntax import tree


def call(scope: Scope, node: tree.Call) -> tuple[bool, Type | str | None]:
    """Whether a call is one of a method, and its result's type: "" if it has none, None after a diagnostic."""
    found = objects.find(scope, node.callee, ("{}",))
    if found is None:
        return False, None
    (method,), instance = found
    assert method is not None
    name = node.callee.name if isinstance(node.callee, tree.Member) else node.callee
    if not objects.may_name(scope, name, method) or not scope.context.interface(method, scope.source, node) or \
            not objects.has_body(scope, name, method, instance):
        for argument in node.arguments:
            if argument.value is not None:
                scope.infer(argument.value)
        return True, None
    bound = PouCall(method, instance, dynamic=objects.is_dynamic(scope, method, instance))
    bind(scope, node, method, bound)
    scope.facts.calls[node] = bound
    if method.tree.result is not None and method.result is None:
        return True, None
    return True, method.result.type if method.result is not None else ""
