"""What a file holds, for an editor's outline, for folding, and for the lines above programs that run them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fbvm.analysis.parts import File, Part
from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder, sfc
from fbvm.syntax.tree.node import walk

_FOLDED = (tree.If, tree.Case, tree.For, tree.While, tree.Repeat, tree.Try, tree.VarSection, ladder.Ladder, ladder.Rung, sfc.Step,
           sfc.Transition, tree.Declaration, tree.StructSpec, tree.Resource)
_HAS_ELEMENTS = re.compile(r"\b(?:LADDER|STEP|INITIAL_STEP)\b", re.I)
_COMMENTS = re.compile(r"(?:^[ \t]*//[^\n]*\n){2,}|\(\*.*?\*\)|/\*.*?\*/", re.M | re.S)
_REGION = re.compile(r"\{\s*(region|endregion)\b[^}]*\}", re.I)


@dataclass
class Symbol:
    """Something that a file declares: where it stands as a whole, and its name, in characters of the file."""

    name: str
    kind: str
    """"FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "INTERFACE", "CLASS", "METHOD", "PROPERTY", "ACTION", "TYPE", "CONFIGURATION",
    "NAMESPACE", "VAR_GLOBAL", "variable", "constant", "member", "enumerator", "rung", "step", "resource", "task" or
    "instance"."""
    detail: str
    start: int
    end: int
    name_start: int
    name_end: int
    children: list[Symbol] = field(default_factory=list)


def outline(file: File) -> list[Symbol]:
    """What a file declares, in the order of the text."""
    return [symbol for part in file.parts for declared in part.syntax.declarations for symbol in _declaration(part, declared)]


def _symbol(part: Part, node: tree.Node, name: tree.Node, text: str, kind: str, detail: str = "") -> Symbol:
    base = part.base
    return Symbol(text, kind, detail, base + min(node.start, name.start), base + max(node.end, name.end), base + name.start,
                  base + name.end)


def _declaration(part: Part, declared: tree.Declaration) -> Iterator[Symbol]:
    if isinstance(declared, tree.Pou):
        made = _pou(part, declared)
        made.children += [_action(part, action) for action in declared.actions if action.start < action.name.start < action.end]
        made.children += _methods(part, declared)
        yield made
    elif isinstance(declared, tree.Action):
        yield _action(part, declared)
    elif isinstance(declared, tree.Actions):
        yield from (_action(part, action) for action in declared.actions)
    elif isinstance(declared, tree.Namespace):
        made = _symbol(part, declared, declared.name, declared.name.text, "NAMESPACE")
        made.children = [symbol for each in declared.declarations for symbol in _declaration(part, each)]
        yield made
    elif isinstance(declared, tree.TypeDecl):
        made = _symbol(part, declared, declared.name, declared.name.text, "TYPE")
        made.children = list(_members(part, declared.spec))
        yield made
    elif isinstance(declared, tree.GlobalVars):
        section = declared.section
        made = _symbol(part, section, tree.Node(section.start, section.start + len(section.kind)), section.kind, "VAR_GLOBAL")
        made.children = list(_variables(part, section))
        yield made
    elif isinstance(declared, tree.Configuration):
        made = _symbol(part, declared, declared.name, declared.name.text, "CONFIGURATION")
        for section in declared.sections:
            made.children += _variables(part, section)
        for resource in declared.resources:
            made.children += [_symbol(part, task, task.name, task.name.text, "task") for task in resource.tasks]
            made.children += [_symbol(part, run, run.name, run.name.text, "instance", run.type_name.text)
                              for run in resource.programs]
        yield made


def _pou(part: Part, declared: tree.Pou) -> Symbol:
    """A POU or method with its variables, rungs and steps."""
    made = _symbol(part, declared, declared.name, declared.name.text, declared.kind)
    made.detail = part.source.text[declared.result.start:declared.result.end] if declared.result is not None else ""
    for section in declared.sections:
        made.children += _variables(part, section) if not section.hidden else []
    made.children += _inside(part, declared.body)
    return made


def _methods(part: Part, block: tree.Pou) -> Iterator[Symbol]:
    """The methods and properties of a block; a property once, with what its accessors declare."""
    properties: dict[str, Symbol] = {}
    for method in block.methods:
        made = _pou(part, method)
        if method.kind == "METHOD":
            yield made
            continue
        known = properties.setdefault(fold(made.name), made)
        known.kind = "PROPERTY"
        if known is not made:
            known.detail, known.end = known.detail or made.detail, max(known.end, made.end)
            known.children += made.children
    yield from properties.values()


def _action(part: Part, action: tree.Action) -> Symbol:
    made = _symbol(part, action, action.name, action.name.text, "ACTION")
    made.children = list(_inside(part, action.body))
    return made


def _variables(part: Part, section: tree.VarSection) -> Iterator[Symbol]:
    kind = "constant" if any(each.text.upper() == "CONSTANT" for each in section.qualifiers) else "variable"
    for declared in section.variables:
        detail = " ".join(part.source.text[declared.spec.start:declared.spec.end].split())
        for name in declared.names:
            yield _symbol(part, declared, name, name.text, kind, f"{detail} ({section.kind})")


def _members(part: Part, spec: tree.TypeSpec) -> Iterator[Symbol]:
    if isinstance(spec, tree.EnumSpec):
        yield from (_symbol(part, name, name, name.text, "enumerator") for name, _ in spec.members)
    elif isinstance(spec, tree.StructSpec | tree.UnionSpec):
        for declared in spec.members:
            detail = " ".join(part.source.text[declared.spec.start:declared.spec.end].split())
            yield from (_symbol(part, declared, name, name.text, "member", detail) for name in declared.names)


def _inside(part: Part, body: tree.Block) -> Iterator[Symbol]:
    """The rungs and steps of a body."""
    if not _HAS_ELEMENTS.search(part.source.text):
        return
    for node in sorted(dict.fromkeys(walk(body)), key=lambda node: node.start):
        if isinstance(node, ladder.Rung):
            name = tree.Node(node.start, min(node.end, part.source.text.find("\n", node.start) % (len(part.source.text) + 1)))
            yield _symbol(part, node, name, f"rung {node.number} {node.comment}".strip(), "rung")
        elif isinstance(node, sfc.Step):
            yield _symbol(part, node, node.name, node.name.text, "step", "INITIAL_STEP" if node.initial else "STEP")


# --- folding ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fold:
    """Lines that an editor can fold, from 0; `kind` is "", "comment" or "region"."""

    first: int
    last: int
    kind: str = ""


def folds(file: File) -> list[Fold]:
    """The pieces of a file of more than one line that can be folded, each first line once."""
    found: dict[int, Fold] = {}
    for start, end, kind in sorted(_ranges(file), key=lambda each: (each[0], -each[1])):
        first, last = (file.source.place(at)[0] - 1 for at in (start, max(start, end - 1)))
        if last > first:
            found.setdefault(first, Fold(first, last, kind))
    return list(found.values())


def _ranges(file: File) -> Iterator[tuple[int, int, str]]:
    for part in file.parts:
        for node in part.nodes:
            if isinstance(node, _FOLDED) and not (isinstance(node, tree.VarSection) and node.hidden):
                yield part.base + node.start, part.base + node.end, ""
    for found in _COMMENTS.finditer(file.text):
        yield found.start(), found.end(), "comment"
    opened: list[int] = []
    for found in _REGION.finditer(file.text):
        if found[1].lower() == "region":
            opened.append(found.start())
        elif opened:
            yield opened.pop(), found.end(), "region"


# --- lines above programs -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lens:
    """A word above a declaration that a user clicks on: `command` is "run", "debug", "test", "chart" or "references"; `name`
    the POU that it is about."""

    start: int
    end: int
    command: str
    name: str


def lenses(file: File) -> list[Lens]:
    """Run, Debug and Chart above programs; Test and Debug above the programs of a file of tests."""
    is_test = Path(file.name).name.lower().startswith("test_")
    found = []
    for part in file.parts:
        for declared in part.syntax.declarations:
            if isinstance(declared, tree.Pou) and declared.kind == "PROGRAM":
                place = part.base + declared.start, part.base + declared.name.end
                found += [Lens(*place, word, declared.name.text)
                          for word in (("test", "debug test") if is_test else ("run", "debug", "chart"))]
    return found
