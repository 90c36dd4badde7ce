"""Writes: which places a program may write, and warnings about inputs and loop counters that it writes."""

from __future__ import annotations

from fbvm.base.areas import AREAS, Address
from fbvm.base.dialects import takers
from fbvm.base.types import Field, StructType, fold
from fbvm.check.expressions import objects
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.facts import Facts, Variable, is_block
from fbvm.syntax import tree

_WRITTEN_BY_OWN_BODY = {"VAR": "a variable of its own body", "VAR_OUTPUT": "an output"}
"""Kinds of members of instances that only their own body writes."""
_ROLES = {"step": "a step", "action": "an ACTION of a chart"}
Path = tuple[object, ...]
"""A variable or address, and the steps from it to a part."""


_PASSED = "be passed to the in-out"


def writable(scope: Scope, expr: tree.Expr, purpose: str, rebinds: bool = False) -> bool:
    """True if the place may be written here; else a diagnostic with the reason.

    What a REFERENCE TO is bound to may be written by everybody who sees it.  With `rebinds` the place is a REFERENCE TO that is
    bound anew.  `purpose` says in the message what is done, such as "be written"."""
    facts, inner = scope.facts, expr
    while True:
        if inner in facts.followed and not (rebinds and inner is expr):
            return True
        if inner in facts.fields and not _is_writable_member(scope, expr, inner, purpose):
            return False
        if not (facts.is_part(inner) or inner is expr and rebinds and isinstance(inner, tree.Member | tree.Index)):
            break
        inner = inner.of
    address, variable = facts.directs.get(inner), facts.variables.get(inner)
    if variable is not None:
        address = variable.location
        if not _is_writable_variable(scope, expr, variable, purpose):
            return False
    if address is not None and _is_read_only(scope, address):
        scope.error("S0501", expr, f"{address} is read-only for programs and cannot {purpose}")
        return False
    return True


def _is_writable_member(scope: Scope, expr: tree.Expr, inner: tree.Expr, purpose: str) -> bool:
    """True if `inner`, a part of what `expr` writes, is no member that only its own body writes; else a diagnostic."""
    member = scope.facts.fields[inner]
    if not (member.constant or member.kind in _WRITTEN_BY_OWN_BODY) or _is_written_by_others(scope, inner, member):
        return True
    if member.kind == "VAR_OUTPUT" and purpose.startswith(_PASSED) and scope.dialect.outputs_are_passed:
        scope.error("S0193", expr, f"the output {member.name} is passed to an in-out, which may write it",
                    "pass a variable, and give it the value of the output first")
        return True
    what = "a constant" if member.constant else _WRITTEN_BY_OWN_BODY[member.kind]
    scope.error("S0501", expr, f"{member.name} is {what} and cannot {purpose} from here",
                _hint(scope, inner) if member.kind == "VAR" and not member.constant else
                f"pass a variable, or take {takers('outputs_are_passed', other='locals_are_written')}"
                if purpose.startswith(_PASSED) else "")
    return False


def _is_writable_variable(scope: Scope, expr: tree.Expr, variable: Variable, purpose: str) -> bool:
    """True for a variable that is no constant, step or action; else a diagnostic.  Marks the variable as written."""
    pou = scope.pou
    if variable.kind == "VAR_GLOBAL" and pou is not None and fold(variable.name) in pou.owner.constant_externals:
        scope.error("S0501", expr, f"{variable.name} is CONSTANT here and cannot {purpose}",
                    "write VAR_EXTERNAL without CONSTANT to write the global variable")
        return False
    if variable.constant and variable.by_reference:
        scope.error("S0501", expr, f"{variable.name} is an input that is read where it lies, and cannot {purpose}",
                    "make it a VAR_IN_OUT" + (f", or take {takers('instances_are_values')}" if is_block(variable.type) else ""),
                    (variable.source, variable.node.start, "declared here"))
        return False
    if variable.constant:
        scope.error("S0501", expr, f"{variable.name} is CONSTANT and cannot {purpose}", "",
                    (variable.source, variable.node.start, "declared here"))
        return False
    if variable.role and expr.end > expr.start:
        scope.error("S0501", expr, f"{variable.name} is {_ROLES[variable.role]} and cannot {purpose}",
                    "transitions and the qualifiers of actions decide it")
        return False
    variable.written = True
    _warn_of_written_input(scope, expr, variable)
    return True


def _hint(scope: Scope, expr: tree.Expr) -> str:
    """The hint for a VAR of another body: which dialects write that."""
    whole = scope.facts.types.get(expr.of) if isinstance(expr, tree.Member) else None
    program = isinstance(whole, StructType) and whole.block and scope.context.block_of(whole).kind == "PROGRAM"
    return f"make it a VAR_INPUT, or take {takers('programs_are_written' if program else 'locals_are_written')}"


def _is_written_by_others(scope: Scope, expr: tree.Expr, member: Field) -> bool:
    """True for a member of an instance that the dialect lets others write."""
    if isinstance(expr, tree.Member) and objects.is_own_instance(scope, expr.of):
        return not member.constant
    dialect, whole = scope.dialect, scope.facts.types.get(expr.of) if isinstance(expr, tree.Member) else None
    if member.constant or not isinstance(whole, StructType) or not whole.block:
        return False
    program = scope.context.block_of(whole).kind == "PROGRAM"
    return dialect.programs_are_written if program else dialect.locals_are_written


def _is_read_only(scope: Scope, address: Address) -> bool:
    """True for an address that the source may only read."""
    if address.area not in AREAS or address.number >= AREAS[address.area].read_only:
        return False
    return address.area not in scope.project.libraries.writes(scope.source.library)


def _warn_of_written_input(scope: Scope, expr: tree.Expr, variable: Variable) -> None:
    """Warn of an input that is written inside its block."""
    pou = scope.pou
    if pou is None:
        return
    raw = bool(pou.owner.edges) and any(edge.hidden is variable for edge in pou.owner.edges)
    if raw or variable.kind == "VAR_INPUT" and variable.owner is pou.owner:
        scope.error("S0591", expr, f"{variable.name.removesuffix(' edge')} is an input of {pou.name}"
                                   " and is written inside it")


def place(facts: Facts, expr: tree.Expr) -> Path | None:
    """The path of a variable or a part of one; None if a subscript is not known, or what a reference is bound to."""
    if expr in facts.followed:
        return None
    if not facts.is_part(expr):
        root = facts.variables.get(expr) or facts.directs.get(expr)
        return (root,) if root is not None else None
    outer = place(facts, expr.of)
    if isinstance(expr, tree.Index):
        steps = tuple(facts.constants.get(subscript) for subscript in expr.subscripts)
        return None if outer is None or None in steps else outer + steps
    step = fold(expr.name.text) if isinstance(expr, tree.Member) else f"{expr.size}{expr.index}"
    return None if outer is None else (*outer, step)


def warn_of_written_counter(scope: Scope, expr: tree.Expr) -> None:
    """Warn of a write to the counter of a loop around it, to a part of it, or to what it is part of."""
    if not scope.counters:
        return
    written = place(scope.facts, expr)
    for counter in scope.counters if written else ():
        if counter and all(a == b for a, b in zip(written or (), counter, strict=False)):
            fixed = scope.dialect.fixed_counters
            scope.error("S0504" if fixed else "S0590", expr, f"{scope.text(expr)} counts the FOR loop and is written inside it",
                        f"write WHILE, or take {takers('fixed_counters', False)}" if fixed else "")
            return
