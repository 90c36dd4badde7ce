"""Names of values that mean nothing: what to say of them, and when nothing because the reason was told."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from fbvm.base.areas import AddressError, parse_address
from fbvm.base.dialects import takers
from fbvm.base.types import Field, StructType, fold
from fbvm.check.symbols import vendor_names
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.check.expressions.infer import Expressions

_USES = {
    "FUNCTION": "call it: {}(...)",
    "FUNCTION_BLOCK": "declare an instance, such as  my_{0} : {0};  and name an output of it",
    "PROGRAM": "a task runs it; what others need of it belongs in a VAR_GLOBAL",
}
"""What to do with a POU of each kind that is named where a value is needed."""


def told(expressions: Expressions, expr: tree.Expr) -> bool:
    """True if it has been said why nothing is known under this name."""
    if not isinstance(expr, tree.NameRef):
        return False
    pou = expressions.pou
    return pou is not None and pou.lost(expr.text) or expressions.checker.globals.is_told(expr, expressions.source)


def complain(expressions: Expressions, expr: tree.NameRef) -> None:
    """Say that a name means no value here, unless the reason was told."""
    if told(expressions, expr):
        return
    name = expr.text
    pou = expressions.project.pou(name, expressions.source)
    if pou is None:
        expressions.error("S0201", expr, f"{name} is not declared", _hint(expressions, expr))
    else:
        expressions.error("S0201", expr, f"{name} is a {pou.kind} and has no value", _USES[pou.kind].format(pou.name))


def complain_internal(expressions: Expressions, name: tree.Name, member: Field, block: StructType) -> None:
    """Say that a member of an instance is not for others."""
    what, hint = "internal to", f"make it a VAR_OUTPUT, or take {takers('locals_are_read')}"
    if member.kind != "VAR":
        what, hint = "an in-out of", ""
    expressions.error("S0210", name, f"{member.name} is {what} {block} and cannot be reached from outside", hint)


def _hint(expressions: Expressions, expr: tree.NameRef) -> str:
    name, project = expr.text, expressions.project
    try:
        address = parse_address(name, expressions.checker.areas)
        return f"for the address write %{name}, or declare a variable AT {address}"
    except AddressError:
        known = [v.name for v in expressions.pou.order] if expressions.pou else []
    hint = (vendor_names.VALUES.get(fold(name)) or vendor_names.duration(name) or vendor_names.library_of(name)
            or project.nearest_global(name, [*known, *_members(expressions)]))  # fmt: skip
    if not hint and expr in expressions.spaces:
        return "if it is a library, an enumeration or a file of global variables, give its source with the files"
    return hint


def _members(expressions: Expressions) -> Iterator[str]:
    """The members of all enumerations of the user's own."""
    for rows in expressions.project.enum_members.values():
        yield from (kind.shown[value] for kind, value, library in rows if not library)
