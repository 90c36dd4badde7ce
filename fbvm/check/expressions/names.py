"""Names and addresses as values: variables, members of enumerations, programs, %IX0.3."""

from __future__ import annotations

from fbvm.base.areas import FLAG_AREAS, AddressError
from fbvm.base.types import BOOL, BYTE, DWORD, LWORD, WORD, EnumType, Type, fold
from fbvm.check.expressions import objects, unknown_names
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.facts import Variable
from fbvm.syntax import tree


def name(scope: Scope, expr: tree.NameRef, want: Type | None) -> Type | None:
    """The type of the variable, or of the member of an enumeration, that a name means."""
    if scope.pou is not None and scope.pou.later and fold(expr.text) in scope.pou.later:
        constant = scope.context.rules.later_constant(scope.context, scope.pou, expr)
        return variable(scope, expr, constant) if constant is not None else None
    found = scope.own_variable(expr.text)
    if found is None and scope.pou is not None:
        is_property, kind = objects.value_of_property(scope, expr)
        if is_property:
            return kind
    found = found or scope.variable(expr.text)
    if found is not None:
        return variable(scope, expr, found)
    if objects.is_self(scope, expr):
        return objects.pointer_to_self(scope, expr, want)
    return _enumerated(scope, expr, want)


def _enumerated(scope: Scope, expr: tree.NameRef, want: Type | None) -> Type | None:
    """The type of a name that is a member of an enumeration, else a diagnostic."""
    seen = _members(scope, expr, want)
    free = [m for m in seen if "qualified_only" not in m[0].attributes]
    near = [m for m in free if m[2] == scope.source.library]
    wanted = [m for m in free if m[0] == want] or near or free
    if len({kind.name for kind, _, _ in wanted}) == 1:
        scope.facts.constants[expr] = wanted[0][1]
        return wanted[0][0]
    if wanted:
        scope.error("S0201", expr, f"{expr.text} is a member of several enumerations",
                    "write which: " + " or ".join(f"{kind}#{expr.text}" for kind, _, _ in wanted))
    elif seen:
        scope.error("S0201", expr, f"{expr.text} is named with its enumeration, which is qualified_only",
                    "write " + " or ".join(f"{kind}.{expr.text}" for kind, _, _ in seen))
    else:
        unknown_names.report_unknown(scope, expr)
    return None


def _members(scope: Scope, expr: tree.NameRef, want: Type | None) -> list[tuple[EnumType, int, str]]:
    """The members of enumerations that a name may mean: enumeration, value, library."""
    own = scope.source.library
    return [m for m in scope.project.enum_members.get(fold(expr.text), ())
            if (m[2] or not own) and (m[0] == want or _is_seen(scope, m[0]))]


def _is_seen(scope: Scope, kind: EnumType) -> bool:
    """True if an enumeration can be named without its namespace, so that its members can be named by themselves."""
    return "." not in kind.name or scope.named_type(kind.name.rpartition(".")[2]) == kind


def variable(scope: Scope, expr: tree.Expr, meant: Variable) -> Type | None:
    """The type of an expression that names a variable; None if the value of that is wrong, which is reported."""
    if meant.wrong:
        return None
    scope.facts.variables[expr] = meant
    if meant.constant and meant.value is not None:
        scope.facts.constants[expr] = meant.value
    return meant.type


def program(scope: Scope, expr: tree.NameRef) -> bool:
    """True for the name of a program that stands for its one instance, which has its type and variable from then on."""
    if expr in scope.facts.types or expr in scope.facts.wrong:
        return False
    pou = scope.project.pou(expr.text, scope.source) if scope.variable(expr.text) is None else None
    instance = scope.context.program_instance(pou, expr) if pou is not None and pou.kind == "PROGRAM" else None
    if instance is None:
        return False
    scope.facts.types[expr], scope.facts.variables[expr] = instance.type, instance
    return True


def address(scope: Scope, expr: tree.Direct, want: Type | None) -> Type | None:
    """The type of a directly represented variable: BOOL or a bit string of its width."""
    try:
        meant = scope.context.address(expr.text, scope.source)
    except AddressError as error:
        scope.error("S0601", expr, str(error))
        return None
    scope.facts.directs[expr] = meant
    scope.context.use_area(meant.area)
    if meant.bit is not None or meant.area in FLAG_AREAS:
        return BOOL
    return {8: BYTE, 32: DWORD, 64: LWORD}.get(meant.size_bits, WORD)
