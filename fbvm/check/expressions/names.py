"""Names and addresses as values: variables, members of enumerations, programs, %IX0.3."""

from __future__ import annotations

from fbvm.base.areas import FLAG_AREAS, AddressError
from fbvm.base.types import BOOL, BYTE, DWORD, LWORD, WORD, ArrayType, EnumType, Type, fold
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
    if found is not None and _is_member_there(scope, expr, found, want):
        scope.error("S0193", expr, f"{expr.text} is a member of {want}, not the result of {found.name}, which is {found.type}",
                    "give the member or the method another name")
        return _enumerated(scope, expr, want)
    if found is not None:
        return variable(scope, expr, found)
    if objects.is_self(scope, expr):
        return objects.pointer_to_self(scope, expr, want)
    return _enumerated(scope, expr, want)


def _is_member_there(scope: Scope, expr: tree.NameRef, found: Variable, want: Type | None) -> bool:
    """True for the name of a result where a dialect takes a member of the enumeration that is needed, as `state := EXECUTE` in
    a METHOD Execute : BOOL."""
    return found.kind == "RESULT" and isinstance(want, EnumType) and fold(expr.text) in want.members and \
        scope.dialect.numbers_of_enumerations and found.type == BOOL


def _enumerated(scope: Scope, expr: tree.NameRef, want: Type | None) -> Type | None:
    """The type of a name that is a member of an enumeration, else a diagnostic."""
    seen = _members(scope, expr, want)
    free = [m for m in seen if "qualified_only" not in m[0].attributes]
    near = [m for m in free if m[2] == scope.source.library]
    wanted = [m for m in free if m[0] == want] or _of_own_variables(scope, free) or near or free
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


def _of_own_variables(scope: Scope, members: list[tuple[EnumType, int, str]]) -> list[tuple[EnumType, int, str]]:
    """Those members whose enumeration is written out at a variable of the POU, or else of its block, or of a base of that."""
    pou = scope.pou
    if pou is None or len(members) < 2:
        return []
    levels = [pou, *(pou.own_block.lineage() if pou.own_block is not None and pou.own_block is not pou else ())]
    for level in levels:
        inherited = level.base.variables if level.base is not None else {}
        written = {_innermost(each.type).name for name, each in level.variables.items() if name not in inherited}
        found = [m for m in members if m[0].name.startswith("(") and m[0].name in written]
        if found:
            return found
    return []


def _innermost(kind: Type) -> Type:
    """The type of the elements of an array, of those of an array of arrays; any other type as it is."""
    while isinstance(kind, ArrayType):
        kind = kind.element
    return kind


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
