"""Generic functions: one text, instantiated for each set of types that it is called with.

All parameters of one generic type have the same type in a call; ANY_NUM and ANY_INT are two generic types.  A parameter whose
members are read (x.pValue, x.diSize, x.BYTES ...), or that is passed on to such a parameter, takes any argument as it is: the
function is not instantiated for its type.
"""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.diagnostics import Source
from fbvm.base.types import ANYTHING, AnyType, StringType, SubrangeType, Type, base, common, families, fold, string
from fbvm.check.calls.functions import RESULT_STRING
from fbvm.check.expressions.any_parameters import MEMBERS
from fbvm.check.expressions.assignability import is_untyped, same
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.elementary_types import elementary_type
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL, Pou, holds_block
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.syntax import tree
from fbvm.syntax.tree.node import changed, copied, walk

_ALIASES = 8
"""Other names for a type that are followed one behind the other."""


def variables(declared: tree.Pou) -> dict[str, str]:
    """The folded names of parameters and variables of generic type, each with the folded name of that type."""
    return {fold(name.text): fold(spec.text) for section in declared.sections for variable in section.variables
            if isinstance(spec := variable.spec, tree.NamedType) and fold(spec.text) in ANYTHING
            for name in variable.names}


def passed_as_is(pou: Pou, project: SymbolTable) -> frozenset[str]:
    """Folded names of parameters that take any argument as it is: the body, or a function that it calls, reads members of ANY."""
    if pou.passed_as_is is None:
        pou.passed_as_is = frozenset()
        found: set[str] = set()
        for node in walk(pou.tree.body):
            if isinstance(node, tree.Member) and isinstance(node.of, tree.NameRef) and fold(node.name.text) in MEMBERS:
                found.add(fold(node.of.text))
            elif isinstance(node, tree.Call) and isinstance(node.callee, tree.NameRef):
                found |= _passed_on(node, project.pou(node.callee.text, pou.source), project)
        pou.passed_as_is = frozenset(found)
    return pou.passed_as_is


def _passed_on(call: tree.Call, called: Pou | None, project: SymbolTable) -> set[str]:
    """Folded names that a call passes to parameters that take any argument as it is."""
    if called is None or not called.is_function:
        return set()
    as_is = passed_as_is(called, project) | _structures(called, project)
    return {fold(value.text) for name, value, _ in _given(call, called)
            if name in as_is and isinstance(value, tree.NameRef)}


def _structures(pou: Pou, project: SymbolTable) -> set[str]:
    """Folded names of the parameters that are declared as the structure AnyType, or a REFERENCE TO it."""
    return {fold(name.text) for section in pou.tree.sections for variable in section.variables
            if _is_description(variable.spec, pou.source, project) for name in variable.names}


def _is_description(spec: tree.TypeSpec, source: Source, project: SymbolTable) -> bool:
    """True for the name of the structure AnyType, another name for it, and REFERENCE TO it."""
    for _ in range(_ALIASES):
        spec = spec.target if isinstance(spec, tree.RefSpec) else spec
        if not isinstance(spec, tree.NamedType) or fold(spec.text).rpartition(".")[2] == "ANYTYPE":
            return isinstance(spec, tree.NamedType)
        entry = project.type_entry(spec.text, source)
        if entry is None or not isinstance(entry.tree.spec, tree.NamedType):
            return False
        spec, source = entry.tree.spec, entry.source
    return False


def _given(call: tree.Call, called: Pou) -> Iterator[tuple[str, tree.Expr, str]]:
    """Folded name of the parameter, argument and kind of section for each argument of a call."""
    parameters = [(fold(name.text), section.kind) for section in called.tree.sections
                  if section.kind in ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")
                  for variable in section.variables for name in variable.names]
    kinds = dict(parameters)
    for position, argument in enumerate(call.arguments):
        if argument.value is None:
            continue
        if argument.name is not None:
            name = fold(argument.name.text)
            yield name, argument.value, kinds.get(name, "")
        elif position < len(parameters):
            yield parameters[position][0], argument.value, parameters[position][1]


def is_generic(pou: Pou, project: SymbolTable) -> bool:
    """True for a function that is instantiated for the types of each call."""
    if not pou.is_function or pou.types:
        return False
    result = pou.tree.result
    names = variables(pou.tree)
    if isinstance(result, tree.NamedType) and fold(result.text) in ANYTHING:
        return True
    return bool(names.keys() - passed_as_is(pou, project)) if names else False


def function(scope: Scope, call: tree.Call, pou: Pou, want: Type | None) -> Pou | None:
    """The instantiated function for the types of a call; None after a diagnostic."""
    types = _types(scope, call, pou, want)
    if types is None:
        return None
    key = pou, tuple(sorted((name, kind.name) for name, kind in types.items()))
    if key not in scope.project.instantiated:
        made = Pou(pou.name, pou.kind, pou.source, _with_wide_texts(copied(pou.tree), types), types=types, as_written=False)
        scope.project.instantiated[key] = made
        scope.context.interface(made, pou.source, call)
        scope.context.check_body(made)
    return scope.project.instantiated[key]


def _with_wide_texts(declared: tree.Pou, types: dict[str, Type]) -> tree.Pou:
    """A function with "" in place of '', the initial value of a parameter of generic type that stands for WSTRING."""
    wide = {name for name, kind in types.items() if isinstance(kind, StringType) and kind.wide}
    if not wide:
        return declared
    sections = tuple(changed(section, variables=tuple(
        changed(variable, initial=changed(variable.initial, kind="wstring"))
        if isinstance(variable.spec, tree.NamedType) and fold(variable.spec.text) in wide
        and isinstance(variable.initial, tree.Literal) and (variable.initial.kind, variable.initial.value) == ("string", "")
        else variable for variable in section.variables)) for section in declared.sections)
    return changed(declared, sections=sections)


def _types(scope: Scope, call: tree.Call, pou: Pou, want: Type | None) -> dict[str, Type] | None:
    """The type that each generic type stands for in a call."""
    bound: dict[str, Type | None] = {}
    for name, kind, expr, exact in _arguments(scope, call, pou):
        if kind is None:
            return None
        met = bound.get(name)
        joined = _joined(met, kind, exact)
        if joined is None and met is not None:
            scope.error("S0405", expr, f"{name} is {met} and {kind} in one call of {pou.name}",
                        "all its places have the same type")
            return None
        bound[name] = joined
    if isinstance(pou.tree.result, tree.NamedType) and fold(pou.tree.result.text) in ANYTHING:
        bound.setdefault(fold(pou.tree.result.text), want)
    types: dict[str, Type] = {}
    for name, kind in bound.items():
        settled = _settled(scope, call, pou, name, kind, want)
        if settled is None:
            return None
        types[name] = settled
    return types


def _arguments(scope: Scope, call: tree.Call, pou: Pou) -> Iterator[tuple[str, Type | None, tree.Expr, bool]]:
    """Generic type, type, argument, and whether it has to be of exactly that type, for each generic parameter.

    A text that takes an output may be shorter or longer, as in assignments."""
    names = variables(pou.tree)
    as_is = passed_as_is(pou, scope.project)
    for name, value, section in _given(call, pou):
        if name in names and name not in as_is:
            kind = scope.infer(value)
            free = section == "VAR_OUTPUT" and isinstance(kind, StringType)
            yield names[name], kind, value, section != "VAR_INPUT" and not free


def _settled(scope: Scope, call: tree.Call, pou: Pou, name: str, kind: Type | None, want: Type | None) -> Type | None:
    """The type that a generic type stands for; None after a diagnostic if it is none of the generic type."""
    if kind is None or is_untyped(kind):
        wanted = base(want) if want is not None and name in families(want) else None
        literal = "DINT" if kind is UNTYPED_INT else "LREAL" if kind is UNTYPED_REAL else None
        if wanted is None and literal is None:
            scope.error("S0405", call, f"nothing tells which type {name} stands for in this call of {pou.name}",
                        f"pass an argument to a parameter of type {name}")
            return None
        kind = wanted or elementary_type(literal or "")
        assert kind is not None
    if name not in families(kind) or holds_block(kind) or isinstance(kind, AnyType):
        scope.error("S0405", call, f"{pou.name} takes {name}, this is {kind}")
        return None
    return kind


def _joined(met: Type | None, kind: Type, exact: bool) -> Type | None:
    """The type in which another argument and those before it meet; None if there is none.

    For a subrange an input has the base type; an in-out makes it the type of all."""
    if exact and isinstance(kind, SubrangeType):
        return kind if met in (None, kind, kind.base) or met is UNTYPED_INT else None
    kind = kind if exact else base(kind)
    if isinstance(met, SubrangeType) and met.base == kind:
        return met
    if met is None or met == kind:
        return kind if exact or not isinstance(kind, StringType) else string(max(kind.capacity, RESULT_STRING), kind.wide)
    if kind is UNTYPED_REAL:
        return met if is_any(met, "ANY_REAL") else kind
    if kind is UNTYPED_INT:
        return met
    if met is UNTYPED_REAL:
        return kind if is_any(kind, "ANY_REAL") else met
    if met is UNTYPED_INT:
        return kind
    if exact:
        return None
    return met if same(kind, met) else common(met, kind)
