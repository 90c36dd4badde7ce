"""Initial values that name variables, in dialects that take them.

In a block, a program or a list of global variables such a name stands for the initial value of its variable, which is known
before the program runs.  Variables of a FUNCTION and VAR_TEMP get their initial values at each start of their body: there the
expression becomes an assignment in front of the body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fbvm.base.types import ArrayType, RefType, StructType, Type, fold, machine
from fbvm.check.expressions import references
from fbvm.check.expressions.constants import decode
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.facts import Pou, Variable, holds_block, is_block
from fbvm.syntax import tree
from fbvm.syntax.tree.node import changed


def replace_by_values(scope: Scope, expr: tree.Expr) -> bool:
    """True if the initial values of all variables are known that an initial value names.

    They are the constants of these names in the facts then, and the expression can be inferred anew."""
    facts = scope.facts
    known = {}
    for place in _places(expr):
        if place in facts.constants:
            continue
        found = initial_value(scope, place)
        if found is None or machine(found[0]) in ("", "ref"):
            return False
        known[place] = decode(*found)
    for node in _nodes(expr):
        facts.types.pop(node, None)
    facts.constants.update(known)
    return bool(known)


def varies(scope: Scope, kind: Type, initial: tree.Initial) -> bool:
    """True for the initial value of a type that names a variable, or calls a function of the program's own.

    Instances have one that is known before the program runs, but for the inputs of a single one."""
    if isinstance(initial, tree.ArrayInit | tree.StructInit) and holds_block(kind) and not _gives_inputs(kind, initial):
        return False
    for node in _nodes(initial):
        if isinstance(node, tree.NameRef):
            variable = scope.variable(node.text)
            if variable is not None and not variable.constant:
                return True
        variable = _of_instance(scope, node)
        if variable is not None and not variable.constant:
            return True
        called = node.callee if isinstance(node, tree.Call) else None
        if isinstance(called, tree.NameRef) and scope.project.pou(called.text, scope.source) is not None:
            return True
    return False


def _gives_inputs(kind: Type, initial: tree.Initial) -> bool:
    """True for an instance of which inputs are given that hold no instances themselves: each can be assigned."""
    return is_block(kind) and isinstance(initial, tree.StructInit) and isinstance(kind, StructType) and all(
        (field := kind.member(name.text)) is not None and field.kind == "VAR_INPUT" and not holds_block(field.type)
        for name, _ in initial.fields)


def with_assignments(pou: Pou, declared: list[tree.VarDecl]) -> tree.Pou:
    """The tree of a POU whose body begins with assignments of the initial values of some declarations."""
    assigned: list[tree.Statement] = []
    for each in declared:
        assert isinstance(each.initial, tree.Expr)
        for name in each.names:
            kind = pou.variables[fold(name.text)].type
            target = tree.NameRef(name.start, name.end, name.text)
            if is_block(kind) and isinstance(each.initial, tree.StructInit):
                for pin, value in each.initial.fields:
                    place = tree.Member(pin.start, pin.end, target, pin)
                    assigned.append(tree.Assign(pin.start, value.end, (place,), ":=", value))
                continue
            binds = isinstance(kind, RefType) and kind.follows
            value = references.named(each.initial) if binds else each.initial
            assigned.append(tree.Assign(target.start, each.initial.end, (target,), "REF=" if binds else ":=", value))
    return changed(pou.tree, body=(*assigned, *pou.tree.body))


def initial_value(scope: Scope, place: tree.Expr) -> tuple[Type, bytes] | None:
    """Type and initial bytes of a variable or a part of one; None if they are not known."""
    facts = scope.facts
    variable = facts.variables.get(place) or _of_instance(scope, place)
    if variable is not None:
        return None if variable.reference else (variable.type, variable.initial)
    if isinstance(place, tree.Member) and place in facts.fields:
        outer, field = initial_value(scope, place.of), facts.fields[place]
        if outer is None or field.reference or field.absolute or field.bit is not None:
            return None
        return field.type, outer[1][field.offset:field.offset + field.type.size]
    if isinstance(place, tree.Index):
        outer = initial_value(scope, place.of)
        subscripts = [facts.constants.get(subscript) for subscript in place.subscripts]
        if outer is None or not isinstance(outer[0], ArrayType) or len(subscripts) != len(outer[0].bounds):
            return None
        at = 0
        for subscript, (low, high) in zip(subscripts, outer[0].bounds, strict=True):
            if not isinstance(subscript, int) or not low <= subscript <= high:
                return None
            at = at * (high - low + 1) + subscript - low
        size = outer[0].element.size
        return outer[0].element, outer[1][at * size:(at + 1) * size]
    return None


def _of_instance(scope: Scope, place: tree.Expr) -> Variable | None:
    """The variable that THIS^.name or SUPER^.name means, also where a local variable has that name."""
    if not isinstance(place, tree.Member) or scope.pou is None:
        return None
    followed = place.of.of if isinstance(place.of, tree.Deref) else place.of
    if not isinstance(followed, tree.NameRef) or fold(followed.text) not in ("THIS", "SUPER"):
        return None
    return (scope.pou.block or scope.pou).variables.get(fold(place.name.text))


def _places(expr: tree.Expr) -> Iterator[tree.Expr]:
    """The variables, members and elements that an expression reads, each as a whole."""
    if isinstance(expr, tree.NameRef | tree.Member | tree.Index):
        yield expr
    elif isinstance(expr, tree.Unary):
        yield from _places(expr.operand)
    elif isinstance(expr, tree.Binary):
        yield from _places(expr.left)
        yield from _places(expr.right)
    elif isinstance(expr, tree.Call):
        for argument in expr.arguments:
            if argument.value is not None:
                yield from _places(argument.value)


def _nodes(expr: tree.Expr) -> Iterator[tree.Expr]:
    """An expression and all expressions that it is made of."""
    yield expr
    if isinstance(expr, tree.Member | tree.Deref | tree.Part):
        yield from _nodes(expr.of)
    elif isinstance(expr, tree.Index):
        yield from _nodes(expr.of)
        for subscript in expr.subscripts:
            yield from _nodes(subscript)
    else:
        for part in _parts(expr):
            yield from _nodes(part)


def _parts(expr: tree.Expr) -> Sequence[tree.Expr]:
    """The operands, arguments or elements that an expression is made of."""
    if isinstance(expr, tree.Unary):
        return (expr.operand,)
    if isinstance(expr, tree.Binary):
        return expr.left, expr.right
    if isinstance(expr, tree.Call):
        return [argument.value for argument in expr.arguments if argument.value is not None]
    if isinstance(expr, tree.ArrayInit):
        return [part for item in expr.items for part in item if part is not None]
    return [value for _, value in expr.fields] if isinstance(expr, tree.StructInit) else ()
