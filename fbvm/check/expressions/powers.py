"""Powers where an integer is needed: `**` and EXPT give a real number (IEC 61131-3 ed. 3, table 29), also of integers."""

from __future__ import annotations

from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, Type, base
from fbvm.check.expressions.assignability import UNSIGNED
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import Facts
from fbvm.syntax import tree


def power_in(facts: Facts, expr: tree.Expr) -> tree.Binary | None:
    """The power that makes an expression real: the expression itself, or an operand of its sums and products."""
    expr = facts.rewritten.get(expr, expr)
    if isinstance(expr, tree.Unary):
        return power_in(facts, expr.operand)
    if not isinstance(expr, tree.Binary) or expr.op not in ("**", "+", "-", "*", "/"):
        return None
    return expr if expr.op == "**" else power_in(facts, expr.left) or power_in(facts, expr.right)


def is_whole(facts: Facts, expr: tree.Expr) -> bool:
    """True for a constant with powers in it, made of integers only, whose value is an integer that LREAL holds exactly."""
    value = facts.constants.get(expr)
    return isinstance(value, float) and value.is_integer() and abs(value) <= 1 << 53 and \
        power_in(facts, expr) is not None and _of_integers(facts, expr)


def _of_integers(facts: Facts, expr: tree.Expr) -> bool:
    expr = facts.rewritten.get(expr, expr)
    if isinstance(expr, tree.Unary):
        return _of_integers(facts, expr.operand)
    if isinstance(expr, tree.Binary):
        return expr.op in ("**", "+", "-", "*") and _of_integers(facts, expr.left) and _of_integers(facts, expr.right)
    if isinstance(expr, tree.Literal):
        return expr.kind == "int"
    return isinstance(facts.constants.get(expr), int)


def message(target: Type) -> str:
    """What is wrong with a power where a value of the type `target` is needed."""
    return f"** gives a real number, of integers too, and {target} is needed here"


def hint(facts: Facts, expr: tree.Expr, text: str, target: Type) -> str:
    """What to write for such an expression, which reads `text`."""
    wanted = base(target)
    if not takes(wanted):
        return ""
    kind = facts.types.get(expr)
    source = kind.name if kind is not None and is_any(kind, "ANY_REAL") else "LREAL"
    number = UNSIGNED.get(wanted.name, wanted.name)
    written = f"{source}_TO_{number}({text})"
    if number != wanted.name:
        written = f"{number}_TO_{wanted}({written})"
    return f"write {written}, or take {takers('whole_powers' if is_whole(facts, expr) else 'narrowing')}"


def takes(kind: Type) -> bool:
    """True for a type that takes a whole power in a dialect that has the switch `whole_powers`."""
    return is_any(kind, "ANY_INT", "ANY_BIT") and kind != BOOL
