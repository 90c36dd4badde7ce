"""Parts of variables: members, bits, and what references refer to."""

from __future__ import annotations

from fbvm.base.types import (
    BOOL,
    BYTE,
    DINT,
    DWORD,
    LWORD,
    WORD,
    AnyType,
    ArrayType,
    Elementary,
    EnumType,
    Field,
    OpenArrayType,
    RefType,
    StructType,
    Type,
    base,
    fold,
)
from fbvm.check.expressions import any_parameters, literals, names, objects, qualified, references, unknown_names
from fbvm.check.expressions.assignability import BOUNDS_HINT
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import Variable
from fbvm.syntax import tree

PARTS = {"X": BOOL, "B": BYTE, "W": WORD, "D": DWORD, "L": LWORD}
"""The types of %X, %B, %W, %D and %L behind a point."""
READABLE = ("", "VAR_INPUT", "VAR_OUTPUT")
"""Kinds of members that may be named from outside of an instance."""


def member(scope: Scope, expr: tree.Member, want: Type | None) -> Type | None:
    """The type of `of.name`: a field, a bit, a member of an enumeration, a global variable of a list."""
    of = expr.of
    if not isinstance(of, tree.NameRef) or scope.variable(of.text) is None:
        meant = qualified.member(scope, expr)
        if isinstance(meant, EnumType):
            return literals.enum_value(scope, expr, meant, expr.name)
        if isinstance(meant, Variable):
            return names.variable(scope, expr, meant)
        if qualified.is_space(scope, of):
            _report_unlisted(scope, qualified.last_name(of), expr.name)
            return None
        if isinstance(of, tree.NameRef):
            objects.program(scope, of)
    if isinstance(of, tree.NameRef):
        scope.qualifiers.add(of)
    is_property, kind = objects.value_of_property(scope, expr)
    if is_property:
        return kind
    whole = objects.instance_of(scope, of) if objects.is_self(scope, of) else _step_of(scope, expr) or scope.infer(of)
    if isinstance(whole, RefType) and whole.interface:
        whole = whole.target
    if isinstance(whole, StructType):
        return _field(scope, expr, whole)
    if isinstance(whole, AnyType):
        return _of_any(scope, expr, whole)
    return _of_value(scope, expr, whole, want) if whole is not None else None


def _step_of(scope: Scope, expr: tree.Member) -> Type | None:
    """The type of the flags of a step, if `expr` is one of them and a variable has the step's name; None for all else."""
    if not isinstance(expr.of, tree.NameRef) or scope.pou is None:
        return None
    variable = scope.pou.variables.get(fold(expr.of.text))
    if variable is None or variable.step is None or not isinstance(variable.step.type, StructType) or \
            variable.step.type.member(expr.name.text) is None:
        return None
    scope.facts.variables[expr.of], scope.facts.types[expr.of] = variable.step, variable.step.type
    return variable.step.type


def _report_unlisted(scope: Scope, space: str, name: tree.Name) -> None:
    """Report that a list of global variables or a library has no such name, unless its declaration has an error."""
    project = scope.project
    if not any(project.is_failed_global(text, scope.source) for text in (name.text, f"{space}.{name.text}")):
        scope.error("S0210", name, f"{space} has no {name.text}", project.choices(name.text, project.names_in(space)))


def _field(scope: Scope, expr: tree.Member, whole: StructType) -> Type | None:
    """The type of a member of a structure or an instance."""
    name = expr.name
    field = whole.member(name.text)
    if field is not None and (not whole.block or field.kind in READABLE or _is_readable_local(scope, whole, field) or
                              objects.is_own_instance(scope, expr.of) and field.kind != "VAR_INST"):
        scope.facts.fields[expr] = field
        return field.type
    eno = _eno(scope, expr) if field is None and whole.block else None
    if eno is not None:
        return eno
    if field is not None:
        unknown_names.report_internal(scope, name, field, whole)
    elif not whole.block or not scope.context.block_of(whole).is_failed(name.text):
        readable = [f.name for f in whole.fields.values() if not whole.block or f.kind in READABLE]
        scope.error("S0210", name, f"{whole} has no {name.text}", scope.project.choices(name.text, readable))
    return None


def _eno(scope: Scope, expr: tree.Member) -> Type | None:
    """BOOL for `instance.ENO` of a block that declares none: whether its last call in this POU has run it."""
    variable = scope.facts.variables.get(expr.of)
    if fold(expr.name.text) != "ENO" or variable is None or variable.eno is None:
        return None
    meant = tree.NameRef(expr.start, expr.end, variable.eno.name)
    scope.facts.rewritten[expr] = meant
    scope.facts.variables[meant] = variable.eno
    scope.facts.types[meant] = BOOL
    return BOOL


def _is_readable_local(scope: Scope, whole: StructType, field: Field) -> bool:
    """True for a VAR of an instance that others may read: of a program, or in a dialect that lets them; for an in-out, too, in a
    dialect that has it stand for the argument of the last call."""
    if field.kind == "VAR_IN_OUT":
        return scope.dialect.in_outs_are_read
    return field.kind == "VAR" and (scope.dialect.locals_are_read or scope.context.block_of(whole).kind == "PROGRAM")


def _of_value(scope: Scope, expr: tree.Member, whole: Type, want: Type | None) -> Type | None:
    """The type of a name behind a value that has no members: a bit that a constant names, else a diagnostic."""
    if qualified.is_bit(scope, expr, whole):
        return part(scope, scope.facts.bits[expr], want)
    if isinstance(whole, EnumType) and isinstance(expr.of, tree.NameRef) and scope.named_type(expr.of.text) is whole:
        return literals.enum_value(scope, expr, whole, expr.name)  # a variable that is called like its type
    hint = ""
    if isinstance(whole, RefType) and isinstance(whole.target, StructType):
        hint = f"what it points to has: write {scope.text(expr.of)}^.{expr.name.text}"
    elif isinstance(whole, ArrayType | OpenArrayType):
        hint = BOUNDS_HINT
    scope.error("S0304", expr.of, f"this is {whole} and has no members", hint)
    return None


def _of_any(scope: Scope, expr: tree.Member, whole: AnyType) -> Type | None:
    """The type of a member of an ANY parameter (see `any_parameters`), or None after a diagnostic."""
    name = fold(expr.name.text)
    if name == "TYPECLASS":
        return scope.context.type_classes()
    if name in any_parameters.NUMBERS:
        return DINT
    if name == any_parameters.POINTER:
        return references.to_parameter(scope, expr)
    views = any_parameters.VIEWS
    if name not in views:
        scope.error("S0210", expr.name, f"{whole} has no {expr.name.text}",
                    scope.project.choices(expr.name.text, ("pValue", "diSize", "TypeClass", *views)))
    return views.get(name)


def part(scope: Scope, expr: tree.Part, want: Type | None) -> Type | None:
    """The type of bits of a number: `x.3`, `x.%B1`."""
    whole = scope.infer(expr.of)
    if whole is None:
        return None
    kind = base(whole)
    bits = kind.bits if isinstance(kind, Elementary) and is_any(kind, "ANY_BIT", "ANY_INT") else 0
    part = PARTS[expr.size]
    if bits <= part.bits or (expr.index + 1) * part.bits > bits:
        text = f".{expr.index}" if expr.size == "X" else f".%{expr.size}{expr.index}"
        scope.error("S0210", expr, f"{whole} has no part {text}")
        return None
    if not scope.is_in_memory(expr.of):
        scope.error("S0407", expr.of, "a part can be taken of a variable only")
        return None
    return part


def target(scope: Scope, expr: tree.Deref, want: Type | None) -> Type | None:
    """The type of what a reference refers to: `r^`."""
    if objects.is_self(scope, expr.of):
        assert isinstance(expr.of, tree.NameRef)
        return objects.self_type(scope, expr.of)
    kind = scope.infer(expr.of)
    if kind is None:
        return None
    if not isinstance(kind, RefType) or kind.interface:
        scope.error("S0304", expr.of, f"this is {kind}, not a reference: ^ has nothing to follow")
        return None
    return kind.target
