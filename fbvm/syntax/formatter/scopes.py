"""The names that a text declares, and the types of their values, for the spelling of names."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

from fbvm.base.types import fold
from fbvm.syntax.tree import (
    ArraySpec,
    Configuration,
    EnumSpec,
    GlobalVars,
    Pou,
    RefSpec,
    SourceText,
    StructSpec,
    TypeDecl,
    TypeSpec,
    UnionSpec,
    VarDecl,
    VarSection,
)


class Entry(NamedTuple):
    """A declared name as written, and the type of what it names."""

    text: str
    shape: TypeSpec | Pou | None


Scope = dict[str, Entry]
"""Names as they are compared -> what is declared; the first declaration counts."""


def global_scope(tree: SourceText) -> Scope:
    """The names of the whole text: types, POUs, global variables, members of enumerations, tasks."""
    scope: Scope = {}
    for declaration in tree.everything():
        if isinstance(declaration, TypeDecl):
            scope.setdefault(fold(declaration.name.text), Entry(declaration.name.text, declaration.spec))
            _enumerated(scope, declaration.spec)
        elif isinstance(declaration, Pou):
            scope.setdefault(fold(declaration.name.text), Entry(declaration.name.text, declaration))
        elif isinstance(declaration, GlobalVars):
            _variables(scope, [declaration.section])
        elif isinstance(declaration, Configuration):
            _configuration(scope, declaration)
    return scope


def _configuration(scope: Scope, configuration: Configuration) -> None:
    _variables(scope, configuration.sections)
    for resource in configuration.resources:
        _variables(scope, resource.sections)
        for task in resource.tasks:
            scope.setdefault(fold(task.name.text), Entry(task.name.text, None))


def declared_in(pou: Pou, outer: Scope) -> Scope:
    """The names of a POU besides: its own name and its variables; a VAR_EXTERNAL is spelt as the global variable."""
    scope: Scope = {fold(pou.name.text): Entry(pou.name.text, pou.result or pou)}
    _variables(scope, (section for section in pou.sections if section.kind != "VAR_EXTERNAL"))
    for section in pou.sections:
        if section.kind == "VAR_EXTERNAL":
            for variable in section.variables:
                for name in variable.names:
                    known = outer.get(fold(name.text))
                    scope.setdefault(fold(name.text), Entry(known.text if known else name.text, variable.spec))
    return scope


def _variables(scope: Scope, sections: Iterable[VarSection]) -> None:
    for section in sections:
        _declare(scope, section.variables)


def _declare(scope: Scope, variables: Iterable[VarDecl]) -> None:
    for variable in variables:
        for name in variable.names:
            scope.setdefault(fold(name.text), Entry(name.text, variable.spec))
        _enumerated(scope, variable.spec)


def _enumerated(scope: Scope, spec: TypeSpec | None) -> None:
    """The members of an enumeration that a declaration contains."""
    while isinstance(spec, (ArraySpec, RefSpec)):
        spec = element(spec)
    if isinstance(spec, EnumSpec):
        for name, _ in spec.members:
            scope.setdefault(fold(name.text), Entry(name.text, None))


def of_method(method: Pou, block: Scope, outer: Scope) -> Scope:
    """The names in a METHOD, or an accessor of a PROPERTY: its own, and those of its block."""
    return block | declared_in(method, outer)


def members(shape: TypeSpec | Pou | None) -> Scope:
    """The names that may follow a dot or name an argument."""
    scope: Scope = {}
    if isinstance(shape, (StructSpec, UnionSpec)):
        _declare(scope, shape.members)
    elif isinstance(shape, Pou):
        _variables(scope, shape.sections)
        for action in shape.actions:
            scope.setdefault(fold(action.name.text), Entry(action.name.text, None))
        for method in shape.methods:
            value = method.result if method.kind == "GET" else _given(method) if method.kind == "SET" else method
            scope.setdefault(fold(method.name.text), Entry(method.name.text, value))
    return scope


def _given(setter: Pou) -> TypeSpec | None:
    """The type of a property that has only SET: that of its input."""
    inputs = (section for section in setter.sections if section.kind == "VAR_INPUT")
    return next((variable.spec for section in inputs for variable in section.variables), None)


def with_inherited(pou: Pou, named: Callable[[str], TypeSpec | Pou | None]) -> Scope:
    """The names of a block or an interface and of all that it extends, its own first; `named` knows what a name stands for."""
    scope: Scope = {}
    waiting, seen = [pou], {pou}
    while waiting:
        here = waiting.pop(0)
        scope = {**members(here), **scope}
        for written in (*here.bases, *(here.interfaces if here.kind == "INTERFACE" else ())):
            base = named(written.text)
            if isinstance(base, Pou) and base not in seen:
                seen.add(base)
                waiting.append(base)
    return scope


def element(shape: TypeSpec | Pou | None) -> TypeSpec | None:
    """The type of an array's elements, or of what a reference leads to."""
    if isinstance(shape, ArraySpec):
        return shape.element
    return shape.target if isinstance(shape, RefSpec) else None
