"""Names of values that mean nothing: the diagnostic, and the hint that comes with it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain

from fbvm.base.areas import AddressError, parse_address
from fbvm.base.dialects import takers
from fbvm.base.types import Field, StructType, fold
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols import vendor_names
from fbvm.check.symbols.report import with_article
from fbvm.syntax import tree

_USES = {
    "FUNCTION": "call it: {}(...)",
    "FUNCTION_BLOCK": "declare an instance, such as  my_{0} : {0};  and name an output of it",
    "CLASS": "declare an instance, such as  my_{0} : {0};  and call one of its methods",
    "INTERFACE": "declare a variable of it, and assign an instance that implements it",
    "PROGRAM": "a task runs it; what others need of it belongs in a VAR_GLOBAL",
}
"""What to do with a POU of each kind that is named where a value is needed."""

_WITH_BIT = re.compile(r"\w+(\.\d+)*")
"""A name, and the number of a bit behind it, which is a part of the address."""


def is_reported(scope: Scope, expr: tree.Expr) -> bool:
    """True if it is reported already why nothing is known under this name."""
    if not isinstance(expr, tree.NameRef):
        return False
    pou = scope.pou
    return pou is not None and pou.is_failed(expr.text) or scope.context.is_failed_global(expr, scope.source)


def report_unknown(scope: Scope, expr: tree.NameRef) -> None:
    """Report that a name means no value here, unless the reason is reported already."""
    if is_reported(scope, expr):
        return
    name = expr.text
    pou = scope.project.pou(name, scope.source)
    if pou is None and (why := scope.project.why_unseen(name, scope.source)) is not None:
        scope.error(why[0], expr, *why[1:])
    elif pou is None:
        scope.error("S0201", expr, f"{name} is not declared", _hint(scope, expr))
    else:
        scope.error("S0201", expr, f"{name} is {with_article(pou.kind)} and has no value", _USES[pou.kind].format(pou.name))


def report_internal(scope: Scope, name: tree.Name, member: Field, block: StructType) -> None:
    """Report that a member of an instance cannot be named from outside."""
    what, hint = "internal to", f"make it a VAR_OUTPUT, or take {takers('locals_are_read')}"
    if member.kind != "VAR":
        what, hint = "an in-out of", f"read the variable that is passed, or take {takers('in_outs_are_read')}"
    scope.error("S0210", name, f"{member.name} is {what} {block} and cannot be reached from outside", hint)


def _hint(scope: Scope, expr: tree.NameRef) -> str:
    name, project = expr.text, scope.project
    if address := _address_hint(scope, expr):
        return address
    known = (v.name for v in scope.pou.order) if scope.pou else ()
    hint = (vendor_names.VALUES.get(fold(name)) or vendor_names.duration(name) or vendor_names.library_of(name)
            or project.nearest_global(name, chain(known, _members(scope))))  # fmt: skip
    if not hint and expr in scope.qualifiers:
        return "if it is a library, an enumeration or a file of global variables, give its source with the files"
    return hint


def _address_hint(scope: Scope, expr: tree.NameRef) -> str:
    """What to write for an address without its %, such as W0.00, Q0.1 or MW10; "" if the name is none."""
    written = _WITH_BIT.match(scope.source.text, expr.start)
    if written is None:  # a name that the repair of a syntax error has put here
        return ""
    for spelling in (written[0], f"%{written[0]}"):
        with suppress(AddressError):
            address = parse_address(spelling, scope.context.areas)
            return f"for the address write %{written[0]}, or declare a variable AT {address}"
    return ""


def _members(scope: Scope) -> Iterator[str]:
    """The names of the members of all enumerations that the user declares."""
    for rows in scope.project.enum_members.values():
        yield from (kind.shown[value] for kind, value, library in rows if not library)
