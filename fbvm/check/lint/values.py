"""Warnings about values: reals compared for equality, fractions that are lost, results and assignments without effect."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from typing import Any

from fbvm.base.types import BOOL, LREAL, StructType, Type, base, is_real
from fbvm.check.expressions.constants import wrap
from fbvm.check.expressions.values import is_any
from fbvm.check.expressions.writes import place
from fbvm.check.lint.body import Body
from fbvm.check.symbols.facts import Pou, PouCall, StandardCall, Variable
from fbvm.syntax import tree

_NO_PLACES = frozenset((tree.Binary, tree.Unary, tree.Literal))


def _binary(body: Body, node: tree.Binary) -> None:
    kind = body.facts.operands.get(node)
    if node.op == "**":
        _signed_power(body, node)
    if kind is None or not is_real(kind):
        if kind is not None and node in body.facts.constants:
            _overflow(body, node, kind)
        return
    if node.op in ("=", "<>"):
        _equality(body, node, node.op, (node.left, node.right), kind)
    _fraction(body, node.left, kind)
    _fraction(body, node.right, kind)


def _signed_power(body: Body, node: tree.Binary) -> None:
    """Warn of `-a ** b`: compilers disagree about what the sign belongs to."""
    left = node.left
    if not isinstance(left, tree.Unary) or left.op != "-" or node.start != left.start:
        return
    inside, behind = (re.sub(r"(?s)\(\*.*?\*\)|//[^\n]*", "", body.pou.source.text[start:end]) for start, end in (
        (left.start, left.operand.start), (left.end, node.op_start)))
    if inside.count("(") >= behind.count(")"):
        base, power = body.text(left.operand), body.text(node.right)
        body.warn("S0392", node, f"the sign belongs to {base} here, and to the whole power for other compilers",
                  f"write (-{base}) ** {power}, or -({base} ** {power})")


def _overflow(body: Body, node: tree.Binary, kind: Type) -> None:
    """Warn of a constant that is cut to the width of its type."""
    left, right = (body.facts.constants.get(each) for each in (node.left, node.right))
    work_out = _EXACT.get(node.op)
    if not work_out or not is_any(kind, "ANY_INT") or not isinstance(left, int) or not isinstance(right, int):
        return
    exact = work_out(left, right)
    if exact != wrap(kind, exact):
        body.warn("S0791", node, f"{kind} cannot hold {exact}: it becomes {wrap(kind, exact)}",
                  "work it out in a wider type, such as DINT#...")


def _converted(body: Body, node: tree.Call, called: StandardCall) -> None:
    """Warn of a conversion that cuts bits off a constant.  One that only reads the same bits as another number is deliberate."""
    value, target = body.facts.constants.get(called.arguments[0][0]), called.detail[1]
    if is_any(target, "ANY_INT", "ANY_BIT") and target != BOOL and type(value) is int:
        bits = target.size * 8
        if not -(1 << bits - 1) <= value < 1 << bits:
            body.warn("S0791", node, f"{target} cannot hold {value}: it becomes {wrap(target, value)}")


def _equality(body: Body, node: tree.Expr, op: str, sides: Sequence[tree.Expr], kind: Type) -> None:
    """Warn of reals that are compared for equality, but with 0 (guards a division) or with themselves (finds NaN)."""
    constants = body.facts.constants
    left, right = (body.text(side) for side in sides[:2])
    if left.casefold() != right.casefold() and not any(constants.get(side) == 0 for side in sides) and node not in constants:
        body.warn("S0390", node, f"two {kind} are compared by {op}, and rounding decides",
                  f"compare how far apart they are: ABS({left} - {right}) {'<' if op in ('=', 'EQ') else '>'} 0.001")


def _fraction(body: Body, expr: tree.Expr, kind: Type) -> None:
    """Warn of a division of integers within a value that becomes a real only afterwards."""
    if not is_real(kind):
        return
    todo = [expr]
    while todo:
        node = todo.pop()
        node = body.facts.rewritten.get(node, node)
        if isinstance(node, tree.Unary):
            todo.append(node.operand)
        elif isinstance(node, tree.Binary) and not is_any(body.facts.operands.get(node, LREAL), "ANY_REAL") and \
                not any(isinstance(body.facts.constants.get(side), float) for side in (node.left, node.right)):
            if node.op == "/":
                _divided(body, node, kind)
            elif node.op in ("+", "-", "*"):
                todo += (node.left, node.right)


def _divided(body: Body, node: tree.Binary, kind: Type) -> None:
    left, right = (body.facts.constants.get(side) for side in (node.left, node.right))
    if isinstance(left, int) and isinstance(right, int) and right and left % right == 0:
        return
    literal = isinstance(node.right, tree.Literal) and isinstance(right, int | float)
    hint = f"write {body.text(node.right)}.0" if literal else f"convert first: TO_{base(kind)}({body.text(node.left)}) / ..."
    body.warn("S0391", node, f"this divides integers and drops the fraction before the value becomes {kind}", hint)


def _assign(body: Body, node: tree.Assign) -> None:
    facts = body.facts
    kind = facts.types.get(node.targets[-1])
    if kind is not None:
        _fraction(body, node.value, kind)
    _kept_address(body, node)
    if node.op != ":=" or len(node.targets) > 1:
        return
    if type(node.value) in _NO_PLACES:
        return
    there = place(facts, node.targets[0])
    if there is not None and there == place(facts, node.value):
        body.warn("S0594", node, f"{body.text(node.targets[0])} is assigned to itself")


def _call(body: Body, node: tree.Call) -> None:
    called = body.facts.calls.get(node)
    if isinstance(called, PouCall):
        for parameter, value in called.inputs:
            _fraction(body, value, parameter.type)
    elif isinstance(called, StandardCall):
        for value, kind in called.arguments:
            _fraction(body, value, kind)
        if called.key in ("EQ", "NE") and is_any(called.detail[0], "ANY_REAL"):
            _equality(body, node, called.key, [value for value, _ in called.arguments], called.detail[0])
        if called.key == "TO":
            _converted(body, node, called)


def _statement(body: Body, node: tree.CallStatement) -> None:
    """Warn of a call that has no effect but its result, which the statement drops."""
    call, facts = node.call, body.facts
    if not isinstance(call, tree.Call) or call not in facts.types or call in facts.guards:
        return
    called = facts.calls.get(call)
    if isinstance(called, PouCall) and (called.outputs or called.in_outs or called.enabled
                                        or not _has_no_effect(body, called.pou, {})):
        return
    name = body.text(call.callee)
    body.warn("S0491", call, f"the result of {name} is not used, and the call does nothing else",
              f"assign it: x := {name}(...)")


def _has_no_effect(body: Body, pou: Pou, known: dict[Pou, bool]) -> bool:
    """True for a function that changes nothing but variables of its own; `known` has the results so far."""
    if pou not in known:
        known[pou] = pou.is_function and _changes_nothing(body, pou, known)
    return known[pou]


def _changes_nothing(body: Body, pou: Pou, known: dict[Pou, bool]) -> bool:
    for node in Body(pou, body.context).nodes:
        called = body.facts.calls.get(node) if isinstance(node, tree.Call) else None
        if isinstance(called, PouCall) and not _has_no_effect(body, called.pou, known):
            return False
        targets = node.targets if isinstance(node, tree.Assign) else (node.variable,) if isinstance(node, tree.For) else ()
        if isinstance(called, PouCall):
            targets = tuple(value for _, value, _ in called.outputs)
        roots = [body.facts.root(target) for target in targets]
        if not all(root not in body.facts.followed and _own(body.facts.variables.get(root), pou) for root in roots):
            return False
    return True


def _own(variable: Variable | None, pou: Pou) -> bool:
    return variable is not None and variable.owner is pou and not variable.reference and variable.location is None


_EXACT: dict[str, Callable[[int, int], int]] = {"+": operator.add, "-": operator.sub, "*": operator.mul}
def _kept_address(body: Body, node: tree.Assign) -> None:
    """Warn of a reference to a variable that ends with the call, in one that lasts longer (SA0021 of CODESYS)."""
    made = body.facts.calls.get(node.value) if isinstance(node.value, tree.Call) else None
    if not isinstance(made, StandardCall) or made.key != "REF":
        return
    place = made.arguments[0][0]
    referred = _temporary(body, place)
    kept = [target for target in node.targets if _temporary(body, target) is None]
    if referred is not None and kept:
        body.warn("S0296", node.value, f"{referred.name} ends with the call, and {body.text(kept[0])} keeps its address",
                  f"keep the value, or make {referred.name} a VAR of a block or program")


def _temporary(body: Body, expr: tree.Expr) -> Variable | None:
    """The variable of which a place is a part, if it ends with the call; None for others and for what a pointer points to."""
    root = body.facts.root(expr)
    variable = body.facts.variables.get(root) if root not in body.facts.followed else None
    if variable is None or variable.reference or variable is body.pou.result or variable.kind in ("VAR_OUTPUT", "VAR_STAT"):
        return None
    ends = variable.kind == "VAR_TEMP" or variable.owner is not None and (
        variable.owner.is_function or variable.owner.kind == "METHOD")
    return variable if ends else None


def _member(body: Body, node: tree.Member) -> None:
    """Warn of a VAR of a function block that is used through an instance, which the standard forbids (6.5.2)."""
    field, whole = body.facts.fields.get(node), body.facts.types.get(node.of)
    if field is None or field.kind != "VAR" or not isinstance(whole, StructType) or not whole.block or \
            (node.of.of if isinstance(node.of, tree.Deref) else node.of) in body.facts.selves:
        return
    if body.context.block_of(whole).kind != "PROGRAM":
        body.warn("S0295", node.name, f"{field.name} is a VAR of {whole}, which the standard leaves to its body",
                  "make it a VAR_OUTPUT if it is read, a VAR_INPUT if it is written")


RULES: dict[type, Callable[[Body, Any], None]] = {
    tree.Member: _member, tree.Binary: _binary, tree.Assign: _assign, tree.Call: _call, tree.CallStatement: _statement,
}
"""By class of node the rule that looks at it."""
