"""Names with something in front: a list of global variables (its file), a library, a program.

    GVL.pressure        the VAR_GLOBAL that the file GVL.st declares
    Standard.TON        a name of a library, which says by itself what is meant
    SysFile.SysTypes.RTS_IEC_RESULT     the same behind the name of another library
    PLC_PRG.step        a variable of a program, of which there is one instance then
    Motor.LIMIT         a CONSTANT of a block, in some dialects
    word.READY          the bit of that number, where READY is a constant

The qualifier only has to be known: it never decides between two declarations of a library.
"""

from __future__ import annotations

from fbvm.base.types import Elementary, EnumType, Type, base, fold
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import Variable
from fbvm.syntax import tree


def bare(scope: Scope, expr: tree.Expr) -> str | None:
    """The name that an expression is, without a library in front, but with a namespace; None for anything else."""
    if isinstance(expr, tree.NameRef):
        return expr.text if scope.variable(expr.text) is None else None
    if isinstance(expr, tree.Member) and is_space(scope, expr.of):
        space = dotted(expr.of)
        return f"{space}.{expr.name.text}" if scope.project.namespaces.space(space, scope.source) is not None else expr.name.text
    return _in_library(scope, expr) if isinstance(expr, tree.Member) else None


def _in_library(scope: Scope, expr: tree.Member) -> str | None:
    """The full name of what a user's library may declare in a NAMESPACE that no text has named yet, in a file of its name."""
    name, first, project = dotted(expr), _first(expr), scope.project
    if not name or not project.libraries.has_own_file(fold(expr.name.text)) or not isinstance(first, tree.NameRef) or \
            scope.variable(first.text) is not None:
        return None
    found = project.pou(name, scope.source) or project.type_entry(name, scope.source)
    return name if found is not None else None


def dotted(expr: tree.Expr) -> str:
    """What names with points between them are as one name; "" for anything else."""
    if isinstance(expr, tree.NameRef):
        return expr.text
    outer = dotted(expr.of) if isinstance(expr, tree.Member) else ""
    return f"{outer}.{expr.name.text}" if isinstance(expr, tree.Member) and outer else ""


def _first(expr: tree.Expr) -> tree.Expr:
    while isinstance(expr, tree.Member):
        expr = expr.of
    return expr


def is_space(scope: Scope, expr: tree.Expr) -> bool:
    """True for the name of a library, of a list of global variables or of a namespace, where no variable is called so; also
    behind another one, as in SysFile.SysTypes."""
    first, name = _first(expr), dotted(expr)
    return bool(name) and isinstance(first, tree.NameRef) and scope.variable(first.text) is None and \
        scope.project.is_space(name, scope.source)


def last_name(space: tree.Expr) -> str:
    """The name of a library or list without those in front of it."""
    assert isinstance(space, tree.NameRef | tree.Member)
    return space.name.text if isinstance(space, tree.Member) else space.text


def member(scope: Scope, expr: tree.Member) -> Type | Variable | None:
    """What `X.name` means where X is no variable: a member of an enumeration (its type), a global variable, or nothing."""
    outer = bare(scope, expr.of)
    if outer is None:
        return None
    named = scope.named_type(outer)
    if isinstance(named, EnumType):
        return named
    if is_space(scope, expr.of):
        space, name = fold(last_name(expr.of)), fold(expr.name.text)
        return scope.context.listed(space, name, scope.source) or _enumeration(scope, space, name)
    return _constant_of_block(scope, outer, expr)


def _constant_of_block(scope: Scope, name: str, expr: tree.Member) -> Variable | None:
    """The CONSTANT of a block or program that is named behind its type, where a dialect takes that: it is the same in all
    instances."""
    if not scope.dialect.locals_are_read:
        return None
    found = scope.project.pou(name, scope.source)
    if found is None or found.kind not in ("FUNCTION_BLOCK", "PROGRAM"):
        return None
    if not found.busy and found is not scope.pou:
        scope.context.interface(found, scope.source, expr)
    variable = found.variables.get(fold(expr.name.text))
    return variable if variable is not None and variable.constant and variable.value is not None else None


def _enumeration(scope: Scope, space: str, name: str) -> EnumType | None:
    """The enumeration of the library `space` that has a member of that name."""
    return next((kind for kind, _, library in scope.project.enum_members.get(name, ())
                 if scope.project.libraries.is_in_space(library, space)), None)


def is_bit(scope: Scope, expr: tree.Member, whole: Type) -> bool:
    """True for `word.READY` with an integer constant READY, which CODESYS takes as the bit of that number."""
    variable = scope.variable(expr.name.text)
    kind = base(whole)
    if variable is None or not variable.constant or not isinstance(kind, Elementary) or not is_any(kind, "ANY_BIT", "ANY_INT"):
        return False
    name = tree.NameRef(expr.name.start, expr.name.end, expr.name.text)
    scope.infer(name)
    number = scope.facts.constants.get(name)
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        return False
    scope.facts.bits[expr] = tree.Part(expr.start, expr.end, expr.of, "X", number)
    return True
