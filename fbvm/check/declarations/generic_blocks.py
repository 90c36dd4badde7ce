"""Blocks with generic constants: `Buffer<100>` is the block Buffer with 100 as its constant, a block of its own.

CODESYS, "Generic constant variables: VAR_GENERIC CONSTANT"; TwinCAT 3.1 from build 4026 on."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.types import fold
from fbvm.check.expressions.constant_integers import integer
from fbvm.check.expressions.constants import limits
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree
from fbvm.syntax.tree.node import changed, copied

DEEPEST = 16
"""How many blocks that are made for constants may ask for one another."""


def lacks_constants(pou: Pou) -> bool:
    """True for a block some of whose generic constants have no value of their own: it is only checked for given ones."""
    return pou.template is not None and any(declared.initial is None for declared, _ in _constants(pou.template))


def sections(scope: Scope, pou: Pou) -> Iterator[tree.VarSection]:
    """The sections of a POU, with VAR_GENERIC of a block as VAR; what is wrong with that is reported."""
    for section in pou.tree.sections:
        if section.kind != "VAR_GENERIC" or pou.kind != "FUNCTION_BLOCK":
            yield section
        elif _is_right(scope, section):
            yield changed(section, kind="VAR")
        else:
            pou.failed_names.update(fold(name.text) for declared in section.variables for name in declared.names)


def _is_right(scope: Scope, section: tree.VarSection) -> bool:
    """True for constants of integer types in VAR_GENERIC; else a diagnostic."""
    if [fold(word.text) for word in section.qualifiers] != ["CONSTANT"]:
        scope.error("S0206", section, "VAR_GENERIC is CONSTANT", "write VAR_GENERIC CONSTANT")
        return False
    for declared in section.variables:
        if _span(scope, declared.spec) is None:
            if not isinstance(declared.spec, tree.SubrangeSpec):  # else what is wrong with a bound is reported
                scope.error("S0205", declared.spec, f"{scope.text(declared.spec)} is no type of a generic constant",
                            "its type is an integer, or a subrange of one")
            return False
    return True


def _span(scope: Scope, spec: tree.TypeSpec) -> tuple[int, int] | None:
    """The least and the largest value of a type of integers; None for another type."""
    if isinstance(spec, tree.SubrangeSpec):
        low, high = integer(scope, spec.low), integer(scope, spec.high)
        return (low, high) if low is not None and high is not None else None
    names = (spec.text, spec.text.rpartition(".")[2]) if isinstance(spec, tree.NamedType) else ()
    kind = next((kind for name in names if (kind := scope.context.named_type(fold(name), scope.source)) is not None), None)
    return limits(kind) if kind is not None and is_any(kind, "ANY_INT", "ANY_BIT") else None


def chosen(scope: Scope, pou: Pou, spec: tree.NamedType) -> Pou | None:
    """The block that a name with constants behind it means, resolved later; None after a diagnostic."""
    if pou.template is None and not spec.constants:
        return pou
    declared = _constants(pou.template) if pou.template is not None else []
    if not spec.constants:
        lacking = [name.text for variable, name in declared if variable.initial is None]
        if lacking:
            scope.error("S0404", spec, f"{pou.name} needs its constant {' and '.join(lacking)}", f"write {pou.name}<100>")
        return None if lacking else pou
    if len(declared) != len(spec.constants):
        count = f"{len(declared) or 'no'} generic constant{'' if len(declared) == 1 else 's'}"
        scope.error("S0402", spec, f"{pou.name} has {count}, {len(spec.constants)} given")
        return None
    values = [_value(scope, pou, variable, given) for (variable, _), given in zip(declared, spec.constants, strict=True)]
    return _made(scope, pou, spec, [value for value in values if value is not None]) if None not in values else None


def _constants(template: tree.Pou) -> list[tuple[tree.VarDecl, tree.Name]]:
    """The generic constants of a block, in the order of their declaration."""
    return [(declared, name) for section in template.sections if section.kind == "VAR_GENERIC"
            for declared in section.variables for name in declared.names]


def _value(scope: Scope, pou: Pou, declared: tree.VarDecl, given: tree.Expr) -> int | None:
    """The value of a constant that is given for a block; None after a diagnostic."""
    value = _of_own_constant(scope, given)
    if value is None:
        value = integer(scope, given)
    span = _span(Scope(scope.context, pou.source, None), declared.spec)
    if value is None or span is None:
        return None
    if not span[0] <= value <= span[1]:
        scope.error("S0702", given, f"{value} does not fit {declared.names[0].text}, which holds {span[0]} to {span[1]}")
        return None
    return value


def _of_own_constant(scope: Scope, given: tree.Expr) -> int | None:
    """The value of a name behind EXTENDS that is a generic constant of the block itself, whose variables are not known yet."""
    if scope.pou is None or not scope.pou.busy or not isinstance(given, tree.NameRef):
        return None
    own = (declared.initial for declared, name in _constants(scope.pou.tree) if fold(name.text) == fold(given.text))
    value = next(own, None)
    return value.value if isinstance(value, tree.Literal) and isinstance(value.value, int) else None


def _made(scope: Scope, pou: Pou, spec: tree.NamedType, values: list[int]) -> Pou | None:
    """The block for some values, made when they are asked for first."""
    assert pou.template is not None
    scope.project.dependencies.repeatable = False
    key = pou, tuple(("", str(value)) for value in values)
    if key not in scope.project.instantiated:
        nesting = scope.pou.owner.nesting + 1 if scope.pou is not None else 1
        if nesting > DEEPEST:
            scope.error("S0207", spec, f"{pou.name} holds an instance of itself, for ever new constants",
                        "an instance can hold instances of other blocks only")
            return None
        made = Pou(f"{pou.name}<{', '.join(map(str, values))}>", pou.kind, pou.source, _with_values(pou.template, values),
                   other_names=pou.other_names, modifiers=pou.modifiers, nesting=nesting, as_written=False)
        made.written_actions = [(copied(action), source) for action, source in pou.written_actions]
        scope.project.instantiated[key] = made
        scope.project.new_pous.append(made)
    return scope.project.instantiated[key]


def _with_values(template: tree.Pou, values: list[int]) -> tree.Pou:
    """A block anew, with these values of its generic constants."""
    made: tree.Pou = copied(template)
    rest = iter(values)
    sections = tuple(changed(section, variables=tuple(
        changed(declared, names=(name,), initial=tree.Literal(declared.start, declared.end, "int", value, None, str(value)))
        for declared in section.variables for name in declared.names for value in (next(rest),)))
        if section.kind == "VAR_GENERIC" else section for section in made.sections)
    return changed(made, sections=sections)
