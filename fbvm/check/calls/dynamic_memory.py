"""__NEW and __DELETE: what makes variables and ends them while the program runs.

    p := __NEW(INT);              one variable, with the initial value of its type
    p := __NEW(BYTE, n);          n of them behind one another, of a type that is no structure, array or block
    p := __NEW(Motor);            an instance: its initial values, then FB_init and methods with 'call_after_init'
    p := __NEW(Motor(speed := 5));     with arguments of FB_init
    __DELETE(p);                  FB_exit of an instance, then p is 0

Which FB_exit that is says the type of the instance, if the type of the pointer has one at all.

Source: CODESYS online help, Operator: __NEW, Operator: __DELETE, Attribute: enable_dynamic_creation; Beckhoff Information System,
the same; EcoStruxure Machine Expert, __DELETE (a pointer to a base without FB_Exit calls none)."""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.base.dialects import takers
from fbvm.base.types import ArrayType, RefType, StructType, Type, derives, fold, pointer, string
from fbvm.check.calls import methods
from fbvm.check.expressions import aggregates, objects, qualified
from fbvm.check.expressions.constant_integers import integer
from fbvm.check.expressions.constants import default
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.dynamic_facts import Ended, Made
from fbvm.check.symbols.facts import Pou, StandardCall, is_block
from fbvm.check.symbols.symbol_table import TypeEntry
from fbvm.syntax import tree

NEW, DELETE = "__NEW", "__DELETE"
_MARK = "enable_dynamic_creation"
_LONGEST = 65534
Found = tuple[Type, bytes, tuple[tree.Argument, ...]]
"""The type that is made, the bytes with which it begins, and the arguments of its FB_init."""


def _is_taken(scope: Scope, call: tree.Call, name: str) -> bool:
    """True if the dialect has dynamic memory; else a diagnostic."""
    if scope.dialect.dynamic_memory:
        return True
    scope.error("S0903", call.callee, f"{name} makes and ends variables while the program runs: the dialect {scope.dialect.name} "
                "does not take it", f"declare the variables, or an ARRAY of them, and point at one with ADR, or take "
                f"{takers('dynamic_memory')}")
    return False


# --- __NEW ------------------------------------------------------------------------------------------------------------


def new(scope: Scope, call: tree.Call) -> Type | None:
    """The type of __NEW: a pointer to what it makes; None after a diagnostic."""
    if not _is_taken(scope, call, NEW) or not _is_alone(scope, call):
        return None
    values = [each.value for each in call.arguments]
    found = _type(scope, values[0]) if values[0] is not None else None
    count = values[1] if len(values) > 1 else None
    if found is None or count is not None and not _is_count(scope, count, found[0]):
        return None
    kind, content, given = found
    held = _held(scope, call, pointer(kind))
    made = scope.facts.made[call] = Made(kind, content, count, held, [])
    made.construction += _calls(scope, scope.context.rules.construction(scope.context, scope.source, tree.Deref(
        held.start, held.end, held), kind, given))
    scope.facts.calls[call] = StandardCall(NEW, [])
    return pointer(kind)


def _is_alone(scope: Scope, call: tree.Call) -> bool:
    """True if a __NEW stands where it may; else a diagnostic."""
    wrong = next((each for each in call.arguments if each.kind), None)
    if wrong is not None or not 1 <= len(call.arguments) <= 2:
        scope.error("S0402", wrong or call, "__NEW takes a type, and how many of it", "write p := __NEW(BYTE, 100)")
    elif scope.pou is None or call not in scope.facts.assigned:
        scope.error("S0405", call, "__NEW stands alone behind := of a statement",
                    "assign it to a variable in a body or in FB_init: p := __NEW(...)")
    else:
        return True
    return False


def _type(scope: Scope, expr: tree.Expr) -> Found | None:
    """The type that stands in a __NEW, with the arguments of FB_init; None after a diagnostic."""
    if isinstance(expr, tree.TypeOperand):
        resolved = scope.context.rules.type_of(scope, expr.spec)
        return (*resolved, ()) if resolved is not None else None
    named, given = (expr.callee, expr.arguments) if isinstance(expr, tree.Call) else (expr, ())
    name = named.text if isinstance(named, tree.NameRef) else qualified.bare(scope, named)
    if name is None:
        scope.error("S0405", expr, "__NEW makes a variable of a type, this is none", "name a type or a FUNCTION_BLOCK")
        return None
    if given and fold(name) in ("STRING", "WSTRING"):
        return _text(scope, name, given)
    kind = scope.named_type(name)
    if kind is not None:
        entry = scope.project.type_entry(name, scope.source)
        content = entry.resolved[1] if entry is not None and entry.resolved is not None else default(kind)
        good = _has_no_arguments(scope, expr, kind, given) and _is_marked_type(scope, expr, entry, kind)
        return (kind, content, ()) if good else None
    return _block(scope, expr, named, name, given)


def _block(scope: Scope, expr: tree.Expr, named: tree.Expr, name: str, given: tuple[tree.Argument, ...]) -> Found | None:
    """A block that is made, whose name is written `named`."""
    pou = scope.project.pou(name, scope.source)
    if pou is None or pou.kind not in ("FUNCTION_BLOCK", "CLASS"):
        scope.error("S0203", named, f"there is no type {name}", scope.project.nearest(name, [
            *(each.name for each in scope.project.types.values()), *(each.name for each in scope.project.pous.values())]))
        return None
    if not scope.context.interface(pou, scope.source, named) or not _can_be_made(scope, expr, pou):
        return None
    assert pou.type is not None
    return pou.type, pou.initial, given


def _text(scope: Scope, name: str, given: tuple[tree.Argument, ...]) -> Found | None:
    if len(given) != 1 or given[0].value is None or (size := integer(scope, given[0].value)) is None:
        return None
    if not 1 <= size <= _LONGEST:
        scope.error("S0405", given[0], f"the length of {name} is a constant from 1 to {_LONGEST}")
        return None
    kind = string(size, fold(name) == "WSTRING")
    return kind, default(kind), ()


def _has_no_arguments(scope: Scope, expr: tree.Expr, kind: Type, given: tuple[tree.Argument, ...]) -> bool:
    if given:
        scope.error("S1011", expr, f"{kind} is no block, and has no FB_init that takes arguments", f"write __NEW({kind})")
    return not given


def _is_marked_type(scope: Scope, expr: tree.Expr, entry: TypeEntry | None, kind: Type) -> bool:
    if not isinstance(kind, StructType | ArrayType) or entry is None:
        return True
    return _is_marked(scope, expr, entry.name, entry.source.library, entry.attributes)


def _can_be_made(scope: Scope, expr: tree.Expr, pou: Pou) -> bool:
    """True if instances of a block can be made; else a diagnostic."""
    if "ABSTRACT" in pou.modifiers:
        scope.error("S1007", expr, f"{pou.name} is ABSTRACT and has no instances", "make one of a block that extends it")
        return False
    return _is_marked(scope, expr, pou.name, pou.source.library, scope.context.attributes(pou))


def _is_marked(scope: Scope, expr: tree.Expr, name: str, library: str, attributes: Iterable[str]) -> bool:
    """True if the declaration of a block, structure or array says that __NEW may make it, or is that of a library."""
    if scope.dialect.dynamic_memory != "marked" or library or _MARK in attributes:
        return True
    scope.error("S1012", expr, f"{name} is not made by __NEW: it has no {{attribute '{_MARK}'}}",
                "write it in the line above the declaration")
    return False


def _is_count(scope: Scope, count: tree.Expr, kind: Type) -> bool:
    counted = scope.settle(count)
    if isinstance(kind, StructType | ArrayType):
        scope.error("S0405", count, f"__NEW makes one {kind} at a time", "a number stands behind elementary types and pointers; "
                    "make an array of it a type of its own")
        return False
    if counted is not None and not is_any(counted, "ANY_INT", "ANY_BIT"):
        scope.error("S0405", count, f"how many is an integer, this is {counted}")
    return counted is not None and is_any(counted, "ANY_INT", "ANY_BIT")


# --- __DELETE ---------------------------------------------------------------------------------------------------------


def delete(scope: Scope, call: tree.Call) -> str | None:
    """Check __DELETE, which has no result: "", or None after a diagnostic."""
    if not _is_taken(scope, call, DELETE):
        return None
    operand = call.arguments[0].value if len(call.arguments) == 1 and not call.arguments[0].kind else None
    if operand is None:
        scope.error("S0402", call, "__DELETE takes one pointer", "write __DELETE(p)")
        return None
    kind = scope.infer(operand)
    if kind is None or scope.pou is None:
        return None
    if not isinstance(kind, RefType) or not kind.moves:
        scope.error("S0405", operand, f"__DELETE ends what a POINTER TO points at, this is {kind}",
                    "assign __NEW to a POINTER TO, and delete that")
        return None
    clears = scope.is_variable(operand) and not objects.is_self(scope, operand)
    if clears and not writable(scope, operand, "be set to 0"):
        return None
    scope.facts.ended[call] = Ended(operand, kind, clears, _held(scope, call, kind))
    scope.context.deletions.append((call, scope.source, scope.pou))
    scope.facts.calls[call] = StandardCall(DELETE, [])
    return ""


def find_exits(context: Context) -> None:
    """Find out which FB_exit each __DELETE may have to call: those of the types that the program makes."""
    blocks = [context.block_of(kind) for kind in dict.fromkeys(made.kind for made in context.facts.made.values())
              if isinstance(kind, StructType) and kind.block]
    for call, source, pou in context.deletions:
        scope, ended = Scope(context, source, pou), context.facts.ended[call]
        target = ended.kind.target if isinstance(ended.kind, RefType) else None
        if target is None:
            continue
        if not is_block(target):
            ended.parts += _calls(scope, context.rules.destruction(
                context, source, tree.Deref(ended.held.start, ended.held.end, ended.held), target, target))
            continue
        for block in blocks:
            if block.type is None or not derives(block.type, target) or block.identifier in ended.exits:
                continue
            held = tree.NameRef(ended.held.start, ended.held.end, ended.held.text)
            scope.facts.types[held] = pointer(block.type)
            scope.facts.variables[held] = scope.facts.variables[ended.held]
            ended.exits[block.identifier] = _calls(scope, context.rules.destruction(
                context, source, tree.Deref(held.start, held.end, held), block.type, target))


# --- both -------------------------------------------------------------------------------------------------------------


def _held(scope: Scope, call: tree.Call, kind: Type) -> tree.NameRef:
    """The name of a hidden variable for the pointer, in the frame of the POU."""
    made = tree.NameRef(call.start, call.end, f"${fold(scope.text(call.callee))}")
    scope.facts.variables[made] = aggregates.in_frame(scope, call, kind, made.text)
    scope.facts.types[made] = kind
    return made


def _calls(scope: Scope, statements: Iterable[tree.Statement]) -> list[tree.Call]:
    """The calls of hidden methods that construct or end an instance, checked."""
    found = []
    for statement in statements:
        assert isinstance(statement, tree.CallStatement) and isinstance(statement.call, tree.Call), "they are unrolled"
        methods.call(scope, statement.call)
        found.append(statement.call)
    return found
