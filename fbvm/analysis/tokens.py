"""What each name is, for colours: the semantic tokens of a file; and the addresses that an editor shows behind names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.analysis.declarations import Declared, find
from fbvm.analysis.describe import PINS
from fbvm.analysis.names import Key
from fbvm.analysis.parts import File
from fbvm.analysis.program import Program
from fbvm.base.types import ArrayType, EnumType, fold
from fbvm.check.symbols.facts import Variable
from fbvm.syntax import tree

TYPES = ("variable", "parameter", "property", "enumMember", "function", "class", "type", "method", "macro")
MODIFIERS = ("declaration", "modification", "readonly", "static", "defaultLibrary")
_PATHS = 64
"""Elements of an array whose addresses are shown."""


@dataclass(frozen=True)
class Token:
    """A name in a file, in characters from 0: one of TYPES, and some of MODIFIERS."""

    start: int
    end: int
    type: str
    modifiers: frozenset[str] = frozenset()


def tokens(program: Program, file: File) -> list[Token]:
    """The names and addresses in a file, in the order of the text."""
    if program.checked is None:
        return []
    known: dict[Key, tuple[str, frozenset[str]]] = {}
    found: list[Token] = []
    for part in file.parts:
        for use in program.uses(part):
            if use.key not in known:
                known[use.key] = _kind(use.key, find(program.checked.checker, use.key))
            kind, modifiers = known[use.key]
            extra = {"declared": {"declaration"}, "written": {"modification"}}.get(use.role, set())
            found.append(Token(part.base + use.start, part.base + use.end, kind, modifiers | extra))
        found += [Token(part.base + node.start, part.base + node.end, "macro") for node in part.nodes
                  if isinstance(node, tree.Direct | tree.Location) and _stands(part.source.text, node)]
    placed = {token.start: token for token in found}
    return [placed[start] for start in sorted(placed)]


def _stands(text: str, node: tree.Direct | tree.Location) -> bool:
    """True for an address that is written where its node says; rungs have others."""
    return text[node.start:node.end] == node.text and "\n" not in node.text


def _kind(key: Key, declared: Declared | None) -> tuple[str, frozenset[str]]:
    library = frozenset(("defaultLibrary",)) if key[1] or key[0] == "standard" else frozenset[str]()
    if declared is None:
        return "function", library
    variable = declared.variable
    if variable is not None:
        modifiers = library | ({"readonly"} if variable.constant else set()) | ({"static"} if key[0] == "global" else set())
        return "parameter" if variable.kind in PINS else "variable", frozenset(modifiers)
    if key[0] == "member":
        kind = declared.type.resolved[0] if declared.type is not None and declared.type.resolved is not None else None
        return ("enumMember" if isinstance(kind, EnumType) else "property"), library
    if declared.pou is not None and key[0] == "method":
        return ("method" if declared.pou.kind == "METHOD" else "property"), library
    if declared.pou is not None and key[0] != "variable":
        return ("function" if declared.pou.is_function else "method" if key[0] == "action" else "class"), library
    return ("type" if key[0] == "type" else "variable"), library


# --- addresses behind names -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Hint:
    """A text that an editor shows behind a place of a file, which is not in the file."""

    at: int
    text: str


def address_hints(program: Program, file: File, start: int, end: int) -> list[Hint]:
    """The addresses of located variables, and of elements of located arrays, where bodies name them between two places."""
    return list(_addresses(program, file, start, end)) if program.checked is not None else []


def _addresses(program: Program, file: File, start: int, end: int) -> Iterator[Hint]:
    assert program.checked is not None
    checker = program.checked.checker
    for part in file.parts:
        if part.base > end or part.base + len(part.source.text) < start:
            continue
        elements = {node.of.end: node for node in part.nodes
                    if isinstance(node, tree.Index) and isinstance(node.of, tree.NameRef)}
        for use in program.uses(part):
            if use.role == "declared" or use.key[0] not in ("variable", "global") or not start <= part.base + use.start <= end:
                continue
            declared = find(checker, use.key)
            variable = declared.variable if declared is not None else None
            if variable is None or variable.location is None or fold(part.source.text[use.start:use.end]) != fold(variable.name):
                continue
            element = elements.get(use.end)
            if element is None:
                yield Hint(part.base + use.end, str(variable.location))
            elif (text := _element(checker.facts.constants.get(element.subscripts[0]), element, variable)) is not None:
                yield Hint(part.base + element.end, text)


def _element(number: object, element: tree.Index, variable: Variable) -> str | None:
    """The address of an element with a constant subscript of an array of words."""
    kind, location = variable.type, variable.location
    if not isinstance(kind, ArrayType) or len(kind.bounds) != 1 or not isinstance(number, int) or location is None:
        return None
    if kind.element.size != 2 or location.bit is not None or location.size_bits not in (0, 16):
        return None
    return str(type(location)(location.area, location.number + number - kind.bounds[0][0], None, location.size_bits))
