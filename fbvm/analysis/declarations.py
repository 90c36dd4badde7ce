"""What a key means in a checked program: the declaration, and where it stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from fbvm.analysis.names import Key, declared_name, method_of
from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.check.checker import Checker
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.check.symbols.symbol_table import TypeEntry
from fbvm.syntax import tree


@dataclass(frozen=True)
class Declared:
    """A declaration.  `source` and `node` are where its name stands; one of the others says what it is."""

    key: Key
    name: str
    source: Source
    node: tree.Node
    variable: Variable | None = None
    pou: Pou | None = None
    type: TypeEntry | None = None
    """The type; of a member the one that it belongs to."""


def find(checker: Checker, key: Key) -> Declared | None:
    """The declaration that a key means; None if there is none any more, and for standard functions."""
    found = _FIND[key[0]](checker, key)
    return replace(found, source=found.source.whole) if found is not None else None


def _pou(checker: Checker, key: Key) -> Declared | None:
    pou = checker.project.pous.get((key[1], key[2]))
    return Declared(key, pou.name, pou.source, pou.tree.name, pou=pou) if pou is not None else None


def _action(checker: Checker, key: Key) -> Declared | None:
    pou = checker.project.pous.get((key[1], key[2]))
    action = pou.actions.get(key[3]) if pou is not None else None
    return Declared(key, action.tree.name.text, action.source, action.tree.name, pou=action) if action is not None else None


def _method(checker: Checker, key: Key) -> Declared | None:
    block = checker.project.pous.get((key[1], key[2]))
    found = method_of(block, key[3]) if block is not None else None
    return Declared(key, found.tree.name.text, found.source, found.tree.name, pou=found) if found is not None else None


def _owner(checker: Checker, key: Key) -> Pou | None:
    """The POU of a variable: a method, or an accessor of a property, too."""
    parts = key[2].split(".")
    names = (".".join(parts[:count]) for count in range(len(parts), 0, -1))
    found = next((checker.project.pous[key[1], name] for name in names if (key[1], name) in checker.project.pous), None)
    if found is None or fold(found.name) == key[2]:
        return found
    return next((method for method in found.methods.values() if fold(method.name) == key[2]), None)


def shown_name(variable: Variable) -> str:
    """The name of a variable as it is written: VAR_INST of a method are kept with the name of the method in front."""
    return variable.name.rpartition(".")[2]


def _variable(checker: Checker, key: Key) -> Declared | None:
    pou = _owner(checker, key)
    if pou is None:
        return None
    edge = next((edge.raw for edge in pou.edges if fold(edge.raw.name) == key[3]), None)
    variable = edge or pou.variables.get(key[3])
    if variable is None and pou.block is not None:  # a VAR_INST
        variable = pou.block.variables.get(f"{fold(pou.tree.name.text)}.{key[3]}")
    if variable is not None:
        return Declared(key, shown_name(variable), variable.source, variable.node, variable=variable, pou=pou)
    name = declared_name(pou.tree, key[3]) if not pou.resolved else None
    return Declared(key, name.text, pou.source, name, pou=pou) if name is not None else None


def _global(checker: Checker, key: Key) -> Declared | None:
    variable = checker.project.globals.get((key[1], key[2]))
    return Declared(key, variable.name, variable.source, variable.node, variable=variable) if variable is not None else None


def _type(checker: Checker, key: Key) -> Declared | None:
    entry = checker.project.types.get((key[1], key[2]))
    return Declared(key, entry.tree.name.text, entry.source, entry.tree.name, type=entry) if entry is not None else None


def _member(checker: Checker, key: Key) -> Declared | None:
    entry = checker.project.types.get((key[1], key[2]))
    spec = entry.tree.spec if entry is not None else None
    names: list[tree.Name] = []
    if isinstance(spec, tree.StructSpec | tree.UnionSpec):
        names = [name for declared in spec.members for name in declared.names]
    elif isinstance(spec, tree.EnumSpec):
        names = [name for name, _ in spec.members]
    name = next((name for name in names if fold(name.text) == key[3]), None)
    return Declared(key, name.text, entry.source, name, type=entry) if entry is not None and name is not None else None


def _standard(checker: Checker, key: Key) -> Declared | None:
    return None


_FIND: dict[str, Callable[[Checker, Key], Declared | None]] = {
    "pou": _pou, "action": _action, "method": _method, "variable": _variable, "global": _global, "type": _type, "member": _member,
    "standard": _standard}
