"""What can be named at a place, and the type of a path that is being written there, such as `Line.Pumps[3].`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fbvm.analysis.names import Key, key_of_pou
from fbvm.analysis.parts import Part
from fbvm.analysis.program import Program
from fbvm.base.types import ArrayType, EnumType, OpenArrayType, RefType, StructType, Type, fold
from fbvm.check.checker import Checker
from fbvm.check.expressions.members import READABLE
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.syntax import tree

PATH = re.compile(r"([A-Za-z_]\w*(?:\s*\[[^\[\]]*\]|\^|\s*\.\s*[A-Za-z_]\w*)*)\s*\Z")
"""The path at the end of a text."""
_STEP = re.compile(r"\s*(\[[^\[\]]*\]|\^|\.?\s*[A-Za-z_]\w*)")


@dataclass(frozen=True)
class Member:
    """Something behind a point: `kind` is "field", "pin", "action" or "enumerator"."""

    name: str
    kind: str
    type: str
    key: Key | None = None


@dataclass(frozen=True)
class Scope:
    """A place in a part: the checker that knows the program, and the POU around the place."""

    checker: Checker
    part: Part
    pou: Pou | None

    def variable(self, name: str) -> Variable | None:
        """The variable that a name means here."""
        own = self.pou.owner.variables.get(fold(name)) if self.pou is not None else None
        return own or self.checker.global_variable(name, self.part.source)

    def variables(self) -> list[Variable]:
        """The variables that can be named here without a point."""
        own = list(self.pou.owner.variables.values()) if self.pou is not None else []
        shared = [each for each in self.checker.project.globals.values() if not each.source.library and not each.qualified]
        return [each for each in [*own, *shared] if not each.role and each.kind != "PROGRAM"]

    def kind(self, path: str) -> Type | None:
        """The type of what a path names; of the name of a type or a program, that type."""
        kind: Type | None = None
        for number, step in enumerate(found[1].strip() for found in _STEP.finditer(path)):
            if number == 0:
                kind = self._first(step)
            elif step.startswith("["):
                kind = kind.element if isinstance(kind, ArrayType | OpenArrayType) else None
            elif step == "^":
                kind = kind.target if isinstance(kind, RefType) else None
            else:
                field = kind.member(step.lstrip(". \t")) if isinstance(kind, StructType) else None
                kind = field.type if field is not None else None
            if isinstance(kind, RefType) and kind.follows:
                kind = kind.target
        return kind

    def _first(self, name: str) -> Type | None:
        variable = self.variable(name)
        if variable is not None:
            return variable.type
        project = self.checker.project
        entry = project.type_entry(name, self.part.source)
        if entry is not None and entry.resolved is not None:
            return entry.resolved[0]
        pou = project.pous.get(("", fold(name)))
        return pou.type if pou is not None and pou.kind == "PROGRAM" else None

    def callee(self, path: str) -> Pou | None:
        """The POU that is called by `path(`: a function, the block of an instance, an action."""
        kind = self.kind(path)
        if isinstance(kind, StructType) and kind.block:
            return self.checker.block_of(kind)
        pou = self.checker.project.pou(path.strip(), self.part.source) if path.strip().isidentifier() else None
        if pou is not None and not pou.resolved:
            self.checker.interface(pou, self.part.source, pou.tree.name)
        return pou

    def members(self, path: str) -> list[Member]:
        """What can stand behind a point behind a path."""
        kind = self.kind(path)
        if isinstance(kind, EnumType):
            return [Member(name, "enumerator", kind.name) for name in kind.shown.values()]
        if isinstance(kind, StructType) and kind.block:
            block = self.checker.block_of(kind)
            readable = (*READABLE, "VAR") if block.kind == "PROGRAM" or self.checker.project.dialect.locals_are_read else READABLE
            pins = [Member(field.name, "pin", str(field.type)) for field in kind.fields.values()
                    if field.kind in readable and " " not in field.name]
            return pins + [Member(action.tree.name.text, "action", "", key_of_pou(action)) for action in block.actions.values()]
        if isinstance(kind, StructType):
            return [Member(field.name, "field", str(field.type)) for field in kind.fields.values()]
        if kind is None and path.strip().isidentifier() and self.checker.project.is_space(path.strip()):
            project = self.checker.project
            return [Member(name, "field", str(found.type)) for name in project.names_in(path.strip())
                    if (found := self.checker.listed(fold(path.strip()), fold(name), self.part.source)) is not None]
        return []


def scope_at(program: Program, name: str, offset: int) -> Scope | None:
    """The scope of a place in a file; None before the first check."""
    checked = program.checked
    if checked is None:
        return None
    part = program.files[name].part_at(offset)
    at = offset - part.base
    pous = [each for each in part.syntax.declarations if isinstance(each, tree.Pou) and each.start <= at]
    pou = checked.project.pous.get(("", fold(pous[-1].name.text))) if pous else None
    return Scope(checked.checker, part, pou)
