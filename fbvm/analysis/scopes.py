"""What can be named at a place, and the type of a path that is being written there, such as `Line.Pumps[3].`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fbvm.analysis.names import Key, inherited, key_of_pou, method_of
from fbvm.analysis.parts import Part
from fbvm.analysis.program import Program
from fbvm.base.diagnostics import Source
from fbvm.base.types import ArrayType, EnumType, OpenArrayType, RefType, StructType, Type, fold, pointer
from fbvm.check.checker import Checker
from fbvm.check.expressions.members import READABLE
from fbvm.check.expressions.objects import WORDS
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.check.symbols.namespaces import Namespaces, full_name
from fbvm.syntax import tree

PATH = re.compile(r"([A-Za-z_]\w*(?:\s*\[[^\[\]]*\]|\^|\s*\.\s*[A-Za-z_]\w*)*)\s*\Z")
"""The path at the end of a text."""
_STEP = re.compile(r"\s*(\[[^\[\]]*\]|\^|\.?\s*[A-Za-z_]\w*)")


@dataclass(frozen=True)
class Member:
    """Something behind a point: `kind` is "field", "pin", "action", "method", "property" or "enumerator", behind a NAMESPACE
    "function", "block", "type", "enumeration" or "namespace"."""

    name: str
    kind: str
    type: str
    key: Key | None = None


@dataclass(frozen=True)
class Scope:
    """A place in a part: the checker that knows the program, and the POU around the place, in a method that."""

    checker: Checker
    part: Part
    pou: Pou | None

    @property
    def source(self) -> Source:
        """The source in which names are looked up here."""
        return self.pou.source if self.pou is not None else self.part.source

    @property
    def block(self) -> Pou | None:
        """The POU whose instance the place is about: of a method its block."""
        return self.pou.own_block if self.pou is not None else None

    def variable(self, name: str) -> Variable | None:
        """The variable that a name means here."""
        own = self.pou.owner.variables.get(fold(name)) if self.pou is not None else None
        own = own or inherited(self.block, fold(name))
        return own or self.checker.global_variable(name, self.source)

    def variables(self) -> list[Variable]:
        """The variables that can be named here without a point."""
        known: dict[str, Variable] = {}
        for pou in (self.pou, *_and_bases(self.block)):
            known = {**(pou.owner.variables if pou is not None else {}), **known}
        own = [each for name, each in known.items() if "." not in name]
        shared = [each for each in self.checker.project.globals.values() if not each.source.library and not each.qualified]
        return [each for each in [*own, *shared] if not each.role and each.kind != "PROGRAM"]

    def kind(self, path: str) -> Type | None:
        """The type of what a path names; of the name of an enumeration or a program, that type."""
        kind: Type | None = None
        for number, step in enumerate(found[1].strip() for found in _STEP.finditer(path)):
            if number == 0:
                kind = self._first(step)
            elif step.startswith("["):
                kind = kind.element if isinstance(kind, ArrayType | OpenArrayType) else None
            elif step == "^":
                kind = kind.target if isinstance(kind, RefType) else None
            else:
                kind = self._part(kind, step.lstrip(". \t"))
            if isinstance(kind, RefType) and (kind.follows or kind.interface):
                kind = kind.target
        return kind

    def _part(self, whole: Type | None, name: str) -> Type | None:
        """The type of what stands behind a point: of a field, of a property."""
        field = whole.member(name) if isinstance(whole, StructType) else None
        if field is None and isinstance(whole, StructType) and whole.block:
            found = method_of(self.checker.block_of(whole), fold(name))
            return found.result.type if found is not None and found.result is not None else None
        return field.type if field is not None else None

    def _first(self, name: str) -> Type | None:
        if fold(name) in WORDS and self.block is not None:
            block = self.block.base if fold(name) == "SUPER" else self.block
            return pointer(block.type) if block is not None and block.type is not None else None
        variable = self.variable(name)
        if variable is not None:
            return variable.type
        own = method_of(self.block, fold(name)) if self.block is not None else None
        if own is not None and own.result is not None:
            return own.result.type
        project = self.checker.project
        entry = project.type_entry(name, self.source)
        if entry is not None and entry.resolved is not None and isinstance(entry.resolved[0], EnumType):
            return entry.resolved[0]
        pou = project.pous.get(("", fold(name)))
        return pou.type if pou is not None and pou.kind == "PROGRAM" else None

    def method(self, path: str) -> Pou | None:
        """The method, or an accessor of the property, that a path names: of the block around the place, or of an instance."""
        whole, _, name = path.strip().rpartition(".")
        kind = self.kind(whole) if whole else None
        if isinstance(kind, RefType) and fold(whole.strip()) in WORDS:  # THIS.m() without ^
            kind = kind.target
        block = self.checker.block_of(kind) if isinstance(kind, StructType) and kind.block else self.block if not whole else None
        return method_of(block, fold(name.strip())) if block is not None else None

    def callee(self, path: str) -> Pou | None:
        """The POU that is called by `path(`: a function, a method, the block of an instance, an action."""
        if (method := self.method(path)) is not None:
            return method
        kind = self.kind(path)
        if isinstance(kind, StructType) and kind.block:
            return self.checker.block_of(kind)
        pou = self.checker.project.pou(path.strip(), self.source) if path.strip().isidentifier() else None
        if pou is not None and not pou.resolved:
            self.checker.interface(pou, self.source, pou.tree.name)
        return pou

    def members(self, path: str) -> list[Member]:
        """What can stand behind a point behind a path."""
        kind = self.kind(path)
        if isinstance(kind, RefType) and fold(path.strip()) in WORDS:
            kind = kind.target
        if isinstance(kind, EnumType):
            return [Member(name, "enumerator", kind.name) for name in kind.shown.values()]
        if isinstance(kind, StructType) and kind.block:
            block = self.checker.block_of(kind)
            readable = (*READABLE, "VAR") if block.kind == "PROGRAM" or self.checker.project.dialect.locals_are_read else READABLE
            pins = [Member(field.name, "pin", str(field.type)) for field in kind.fields.values()
                    if field.kind in readable and " " not in field.name]
            return pins + self.actions(block) + self.methods(block)
        if isinstance(kind, StructType):
            return [Member(field.name, "field", str(field.type)) for field in kind.fields.values()]
        return [*self._listed_in(path.strip()), *self._declared_in(path)] if kind is None else []

    def _listed_in(self, space: str) -> list[Member]:
        """The global variables behind the name of their list, or of what else may qualify them; [] for another name."""
        project = self.checker.project
        if not space.isidentifier() or not project.is_space(space, self.source):
            return []
        return [Member(name, "field", str(found.type)) for name in project.names_in(space)
                if (found := self.checker.listed(fold(space), fold(name), self.source)) is not None]

    def _declared_in(self, path: str) -> list[Member]:
        """What a NAMESPACE declares that may be named here, and the namespaces in it; [] for another name."""
        project, space = self.checker.project, self.checker.project.namespaces.space(path, self.source)
        if space is None:
            return []
        inner = [Member(full.rpartition(".")[2], "namespace", "NAMESPACE")
                 for folded, full in project.namespaces.declared.items() if folded.rpartition(".")[0] == space]
        pous = [Member(pou.name.rpartition(".")[2], "function" if pou.is_function else "block", pou.kind)
                for _, folded in project.pous if folded.rpartition(".")[0] == space
                if (pou := project.pou(folded, self.source)) is not None]
        types = [Member(entry.tree.name.text, "enumeration" if isinstance(entry.tree.spec, tree.EnumSpec) else "type", "TYPE")
                 for _, folded in project.types if folded.rpartition(".")[0] == space
                 if (entry := project.type_entry(folded, self.source)) is not None]
        return [*pous, *types, *inner]

    def actions(self, block: Pou | None = None) -> list[Member]:
        """The actions of a block and of those that it extends; by default of the one around the place."""
        found = {name: action for each in reversed(_and_bases(block or self.block)) for name, action in each.actions.items()}
        return [Member(action.tree.name.text, "action", "", key_of_pou(action)) for name, action in found.items()
                if not is_of_rungs(name)]

    def methods(self, block: Pou | None = None) -> list[Member]:
        """The methods and properties of a block that may be named here, each once; by default of the one around the place."""
        block = block or self.block
        hidden = {"PRIVATE"} if block in _and_bases(self.block) else {"PRIVATE", "PROTECTED"}
        found: dict[str, Member] = {}
        for each in reversed(_and_bases(block)):
            for method in each.methods.values():
                if each is self.block or not method.modifiers & hidden:
                    kind, name = method.result.type if method.result is not None else "", method.tree.name.text
                    if fold(name) not in found or kind:
                        shown = "method" if method.kind == "METHOD" else "property"
                        found[fold(name)] = Member(name, shown, str(kind), key_of_pou(method))
        return list(found.values())


def _and_bases(block: Pou | None) -> list[Pou]:
    """A block and all that it extends and implements, itself first."""
    if block is None:
        return []
    return list(dict.fromkeys([block, *(each for parent in ([block.base] if block.base is not None else []) + block.interfaces
                                        for each in _and_bases(parent))]))  # fmt: skip


def is_of_rungs(action: str) -> bool:
    """True for the name of an action that is a subroutine of a LADDER: only SBS and MCRO call it."""
    return action.startswith("$")


def scope_at(program: Program, name: str, offset: int) -> Scope | None:
    """The scope of a place in a file; None before the first check."""
    checked = program.checked
    if checked is None:
        return None
    part = program.files[name].part_at(offset)
    at = offset - part.base
    named = [(each, full_name(each.name.text, source)) for each, source in Namespaces.each(part.syntax.declarations, part.source)
             if isinstance(each, tree.Pou) and each.start <= at]
    pous = [each for each, _ in named]
    pou = checked.project.pous.get(("", fold(named[-1][1]))) if named else None
    inside = [each for each in pous[-1].methods if each.start <= at <= each.end] if pous else []
    if pou is not None and inside:
        method = min(inside, key=lambda each: each.end - each.start)
        key = fold(method.name.text) if method.kind == "METHOD" else f"{method.kind} {fold(method.name.text)}"
        pou = pou.methods.get(key, pou)
    return Scope(checked.checker, part, pou)
