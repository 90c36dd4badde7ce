"""References: what may be referred to, REF(), ADR(), SIZEOF() and REF= (IEC 61131-3 ed. 3, table 12, and CODESYS's forms).

A reference is bound to a variable that lives as long as the program: never to VAR_TEMP, to variables of functions or to
what an in-out stands for, which may be gone when the reference is followed.  There is no arithmetic on references.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.types import DINT, UDINT, AnyType, ArrayType, OpenArrayType, Type, reference
from fbvm.check.facts import StandardCall, Variable
from fbvm.check.writes import writable
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.check.expressions import Expressions

MAKERS = ("REF", "ADR")


def refer(expressions: Expressions, expr: tree.Expr) -> Type | None:
    """The type of the variable that a reference is made to, or None after a diagnostic."""
    kind = expressions.infer(expr)
    if kind is None:
        return None
    if not expressions.is_variable(expr):
        expressions.error("S0407", expr, "a reference can be made to a variable only, not to a value")
        return None
    root = root_of(expr)
    variable = expressions.facts.variables.get(root)
    if variable is not None and (reason := _short_lived(variable)):
        expressions.error("S0407", expr, f"{variable.name} is {reason}, which may end before the reference is followed")
        return None
    if not writable(expressions, expr, "be referred to"):
        return None
    return kind


def root_of(expr: tree.Expr) -> tree.Expr:
    """The variable, address or dereference that a place begins with."""
    while isinstance(expr, tree.Index | tree.Member | tree.Part):
        expr = expr.of
    return expr


def _short_lived(variable: Variable) -> str:
    if variable.kind == "VAR_IN_OUT":
        return "an in-out"
    if variable.kind == "VAR_TEMP":
        return "a VAR_TEMP"
    return "a variable of a function" if variable.owner is not None and variable.owner.is_function else ""


def make(expressions: Expressions, call: tree.Call, value: tree.Expr) -> Type | None:
    """REF(x) and ADR(x)."""
    kind = refer(expressions, value)
    if kind is None:
        return None
    made = reference(kind)
    expressions.facts.calls[call] = StandardCall("REF", [(value, kind)], (made,))
    return made


def bound(expressions: Expressions, call: tree.Call, name: str, value: tree.Expr, dimension: tree.Expr) -> Type | None:
    """LOWER_BOUND(array, dimension) and UPPER_BOUND, as DINT; a constant but for ARRAY [*]."""
    kind = expressions.infer(value)
    number = expressions.checker.values.integer(dimension, expressions.source)
    if kind is None or number is None:
        return None
    if not isinstance(kind, ArrayType | OpenArrayType):
        expressions.error("S0405", value, f"{name} needs an array, this is {kind}")
        return None
    count = kind.dimensions if isinstance(kind, OpenArrayType) else len(kind.bounds)
    if not 1 <= number <= count:
        expressions.error("S0405", dimension, f"{kind} has dimensions 1 to {count}, not {number}")
        return None
    if isinstance(kind, ArrayType):
        expressions.facts.constants[call] = kind.bounds[number - 1][name == "UPPER_BOUND"]
    else:
        expressions.facts.calls[call] = StandardCall(name, [(value, kind), (dimension, DINT)], (kind,))
    return DINT


def size(expressions: Expressions, call: tree.Call, value: tree.Expr) -> Type | None:
    """SIZEOF(x) of a variable or a type: bytes, known before the program runs but for ANY."""
    kind: Type | None = None
    if isinstance(value, tree.NameRef) and expressions.variable(value.text) is None:
        kind = expressions.checker.specs.named_type(value.text, expressions.source)
    if kind is None:
        kind = expressions.settle(value)
    if kind is None:
        return None
    if isinstance(kind, AnyType):
        expressions.facts.calls[call] = StandardCall("SIZEOF", [(value, kind)])
        return UDINT
    expressions.facts.constants[call] = kind.size
    return UDINT


def bind(expressions: Expressions, node: tree.Assign) -> None:
    """`r REF= x` for a variable declared REFERENCE TO."""
    target = node.targets[0]
    kind = expressions.infer(target)
    variable = expressions.facts.variables.get(target)
    if kind is None:
        expressions.infer(node.value)
        return
    if variable is None or not variable.reference or variable.kind == "VAR_IN_OUT":
        expressions.error("S0301", target, "REF= binds a variable that is declared REFERENCE TO",
                          "assign REF(...) to a REF_TO")
        return
    if isinstance(node.value, tree.NullLiteral):
        return
    bound = refer(expressions, node.value)
    if bound is not None and bound != kind:
        expressions.error("S0301", node.value, f"{variable.name} refers to {kind}, this is {bound}")
