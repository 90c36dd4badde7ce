"""Global variables: each is declared in the order of the text, or earlier if another declaration or a body names it."""

from __future__ import annotations

from pathlib import Path

from fbvm.base.types import fold
from fbvm.check.declarations.inheritance import refuse_abstract
from fbvm.check.declarations.locations import is_open
from fbvm.check.declarations.variables import check_qualifiers, initialized, make_variable, type_of
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.dependencies import Dependencies, Key
from fbvm.check.symbols.facts import GLOBAL_SLOT
from fbvm.check.symbols.symbol_table import GlobalDeclaration, SymbolTable, list_name
from fbvm.syntax.st.pragmas import attributes_before, init_slot


def enroll(context: Context) -> None:
    """Make the names of all VAR_GLOBAL sections known that were read since the last call."""
    project = context.project
    new, project.sections = project.sections, []
    for section, source in new:
        check_qualifiers(context.report, section, source, "program", context.project.dialect)
    for section, source in new:
        for declared in section.variables:
            declaration = GlobalDeclaration(declared, section, source)
            for key in _keys(project, declaration):
                project.global_declarations.setdefault(key, declaration)
            project.undeclared.append(declaration)


def declare(context: Context) -> None:
    """Declare the variables of all VAR_GLOBAL sections that were read."""
    project = context.project
    enroll(context)
    while project.undeclared:
        declarations, project.undeclared = project.undeclared, []
        for declaration in declarations:
            _declare(context, declaration)
        enroll(context)


def declare_early(context: Context, key: Key) -> None:
    """Declare the global variable of that name, if a declaration of it was read and not resolved yet."""
    enroll(context)
    declaration = context.project.global_declarations.get(key)
    if declaration is not None:
        _declare(context, declaration)


def _keys(project: SymbolTable, declaration: GlobalDeclaration) -> list[Key]:
    """The names under which the variables of a declaration are found: behind that of their list if it is qualified_only."""
    space = f"{list_name(declaration.source)}." if declaration.section in project.qualified_only else ""
    return [(declaration.source.library, f"{space}{fold(name.text)}") for name in declaration.declared.names]


def _declare(context: Context, declaration: GlobalDeclaration) -> None:
    if declaration.done:
        return
    declaration.done = True
    project, declared, source = context.project, declaration.declared, declaration.source
    keys = _keys(project, declaration)
    project.busy_globals.update(keys)
    resolved = None
    with context.chain.link(source, declared.names[0], declared.names[0].text), project.recording(Dependencies()):
        scope = Scope(context, source, None)
        resolved = type_of(scope, declared)
        if resolved is not None:
            resolved = initialized(scope, declared, resolved)
    project.busy_globals.difference_update(keys)
    if resolved is None:
        project.failed_globals.update(keys)
        return
    for name, key in zip(declared.names, keys, strict=True):
        made = make_variable(context, declared, name, declaration.section, source, resolved)
        made.init_slot = init_slot(attributes_before(source.text, declaration.section.start), GLOBAL_SLOT)
        made.qualified = declaration.section in project.qualified_only
        made.space = Path(source.name).stem if list_name(source) in project.lists else ""
        refuse_abstract(context, made.type, source, name)
        made.place = "area" if declared.location is not None and not is_open(declared.location, made.type) else "abs"
        if not project.size_limits.reserve(made.type.size, f"{name.text} takes", source, name):
            project.failed_globals.add(key)
            continue
        other = project.globals.setdefault(key, made)
        if other is made:
            context.global_order.append(made)
        else:
            context.report.add("S0202", source, name, f"the global {name.text} is declared twice", "",
                               (other.source, other.node.start, "first declared here"))
