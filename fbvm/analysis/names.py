"""Names in a text: each place at which a name stands, and what it means there.

What a name means is a `Key`, which stays the same when texts change: what kind of thing it is, its library, and the folded
names under which it is found, such as ("variable", "", "PUMP", "LEVEL")."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from fbvm.analysis.parts import Part
from fbvm.base.diagnostics import Source
from fbvm.base.types import ArrayType, Elementary, EnumType, OpenArrayType, RefType, StructType, Type, fold
from fbvm.check.calls.standard import is_known
from fbvm.check.checker import Checker
from fbvm.check.expressions.qualified import dotted
from fbvm.check.symbols.facts import Pou, PouCall, Variable
from fbvm.check.symbols.namespaces import Namespaces, full_name
from fbvm.syntax import tree
from fbvm.syntax.tree import sfc
from fbvm.syntax.tree.node import names_of

Key = tuple[str, ...]
"""What a name means: "pou", "type", "global" or "standard" with library and name; "variable", "action", "method" (of a property,
too) or "member" with library, POU or type, and name.  The POU of a method's variable is `BLOCK.METHOD`."""


@dataclass(frozen=True)
class Use:
    """One place of a name in a part, in characters from its beginning; `role` is "declared", "read", "written" or "called"."""

    start: int
    end: int
    key: Key
    role: str = "read"


def uses(checker: Checker, part: Part) -> list[Use]:
    """All names in a part whose meaning is known, in the order of the text, each place once."""
    found: dict[tuple[int, int], Use] = {}
    for use in _Names(checker, part).all():
        if fold(part.source.text[use.start:use.end]) != use.key[-1].rpartition(".")[2]:
            continue
        kept = found.get((use.start, use.end))
        if kept is None or kept.role == "read":
            found[use.start, use.end] = use
    return sorted(found.values(), key=lambda use: use.start)


def key_of(variable: Variable) -> Key:
    """The key of a variable."""
    library = variable.source.library
    if variable.owner is not None and variable.owner.block is not None and _stands_for(variable, variable.owner):
        return key_of_pou(variable.owner)
    if variable.kind == "PROGRAM" and fold(variable.name) == fold(variable.type.name) or variable.kind == "RESULT":
        return "pou", library, fold(_plain(variable.owner.name if variable.owner else variable.type.name))
    if variable.owner is None:
        space = f"{fold(variable.space)}." if variable.qualified else ""
        return "global", library, space + fold(variable.name)
    method, _, name = fold(_plain(variable.name)).rpartition(".")  # a VAR_INST is one of the block, called `method.name`
    return "variable", library, fold(_plain(variable.owner.name)) + (f".{method}" if method else ""), name


def _stands_for(variable: Variable, method: Pou) -> bool:
    """True for the result of a method, and for the value that a property is set to: they have its name."""
    return variable.kind == "RESULT" or method.kind == "SET" and fold(variable.name) == fold(method.tree.name.text)


def key_of_pou(pou: Pou) -> Key:
    """The key of a POU, of an action, of a method, or of the property of an accessor."""
    if pou.block is not None:
        return "method", pou.source.library, fold(_plain(pou.block.name)), fold(pou.tree.name.text)
    if pou.home is not None:
        return "action", pou.source.library, fold(_plain(pou.home.name)), fold(pou.name.rpartition(".")[2])
    return "pou", pou.source.library, fold(_plain(pou.name))


def method_of(block: Pou, name: str) -> Pou | None:
    """The method of a block, its own or an inherited one, or an accessor of the property, with a folded name."""
    return next((found for key in accessors(name) if (found := block.method(key)) is not None), None)


def accessors(name: str) -> tuple[str, ...]:
    """The keys of `Pou.methods` under which a folded name is found."""
    return name, f"GET {name}", f"SET {name}"


def inherited(block: Pou | None, name: str) -> Variable | None:
    """The variable of a block or of one that it extends, by its folded name."""
    while block is not None:
        if name in block.variables:
            return block.variables[name]
        block = block.base
    return None


def _plain(name: str) -> str:
    """The name as it is written, of a variable, function or block that the compiler made of another one."""
    return name.partition(" ")[0].partition("<")[0]


def declared_name(pou: tree.Pou, name: str) -> tree.Name | None:
    """Where the sections of a POU declare a folded name: of a generic function, whose variables have no types of their own."""
    return next((each for section in pou.sections for declared in section.variables for each in declared.names
                 if fold(each.text) == name), None)


class _Names:
    """The names of one part."""

    def __init__(self, checker: Checker, part: Part) -> None:
        self.checker, self.part = checker, part
        self.project, self.facts, self.source = checker.project, checker.facts, part.source
        self.pou: Pou | None = None
        self.type = ""
        """The folded name of the type that is being declared."""
        self.targets: set[tree.Node] = set()
        """Expressions that are written."""
        self.callees: set[tree.Node] = set()

    def all(self) -> Iterator[Use]:
        last: Pou | None = None
        for declared, source in Namespaces.each(self.part.syntax.declarations, self.part.source):
            self.source = source
            if isinstance(declared, tree.Pou):
                last = self.pou = self.project.pous.get((self.source.library, fold(full_name(declared.name.text, self.source))))
                self.source = last.source if last is not None else self.source
            elif isinstance(declared, tree.Action | tree.Actions):
                self.pou = last if declared.owner is None else self.project.pou(declared.owner.text, self.source)
            else:
                self.pou = None
            yield from self.walk(declared)

    def walk(self, node: Any) -> Iterator[Use]:
        left = [node]
        while left:
            item = left.pop()
            if isinstance(item, tuple):
                left += reversed(item)
            elif isinstance(item, tree.Pou) and item is not node:
                yield from self.method(item)
            elif isinstance(item, tree.Node):
                rule = _RULES.get(type(item))
                if rule is not None:
                    yield from rule(self, item)
                left += [getattr(item, name) for name in reversed(names_of(item)) if name not in _LEAVES]

    def method(self, node: tree.Pou) -> Iterator[Use]:
        """The names in a method or accessor."""
        block, source = self.pou, self.source
        self.pou = next((each for each in block.methods.values() if (each.tree.start, each.tree.end) == (node.start, node.end)),
                        None) if block is not None else None  # fmt: skip
        self.source = self.pou.source if self.pou is not None else source
        yield from self.walk(node)
        self.pou, self.source = block, source

    # --- what expressions are -----------------------------------------------------------------------------------------

    def variable(self, name: tree.NameRef) -> Variable | None:
        """The variable that a name means, also where no fact says so: in texts with errors, and in paths."""
        known = self.facts.variables.get(name)
        if known is not None:
            return known
        own = self.pou.owner.variables.get(fold(name.text)) if self.pou is not None else None
        own = own or inherited(self.pou.own_block if self.pou is not None else None, fold(name.text))
        return own or next((self.project.globals[owner, fold(name.text)] for owner in self.project.owners(self.source)
                            if (owner, fold(name.text)) in self.project.globals), None)

    def kind(self, expr: tree.Expr) -> Type | None:
        """The type of an expression."""
        kind = self.facts.types.get(expr)
        if kind is None and isinstance(expr, tree.NameRef):
            found = self.variable(expr)
            pou = self.project.pous.get(("", fold(expr.text)))
            kind = found.type if found is not None else pou.type if pou is not None else None
        elif kind is None and isinstance(expr, tree.Member):
            whole = self.kind(expr.of)
            field = whole.member(expr.name.text) if isinstance(whole, StructType) else None
            kind = field.type if field is not None else None
        elif kind is None and isinstance(expr, tree.Index):
            whole = self.kind(expr.of)
            kind = whole.element if isinstance(whole, ArrayType | OpenArrayType) else None
        elif kind is None and isinstance(expr, tree.Deref):
            whole = self.kind(expr.of)
            kind = whole.target if isinstance(whole, RefType) else None
        if (block := self.facts.selves.get(expr)) is not None:
            return block.type
        return kind.target if isinstance(kind, RefType) and (kind.follows or kind.interface) else kind

    def member_key(self, whole: Type | None, name: str) -> Key | None:
        """The key of a member of a structure, of a variable of an instance, or of a member of an enumeration."""
        if isinstance(whole, EnumType) and fold(name) in whole.members:
            return self.in_type(whole.name, fold(name))
        if not isinstance(whole, StructType):
            return None
        field = whole.member(name)
        if field is not None and whole.block:
            block, folded = self.checker.block_of(whole), fold(field.name)
            variable = inherited(block, folded)
            unknown = "variable", block.source.library, fold(_plain(block.name)), folded
            return key_of(variable) if variable is not None else unknown
        if field is None and whole.block and (method := method_of(self.checker.block_of(whole), fold(name))) is not None:
            return key_of_pou(method)
        if field is None and whole.block and (action := self.checker.block_of(whole).action(fold(name))) is not None:
            return key_of_pou(action)
        return self.in_type(whole.name, fold(field.name)) if field is not None else None

    def in_type(self, name: str, member: str) -> Key | None:
        entry = self.project.type_entry(name, self.source)
        if entry is None:
            return None
        for base in entry.tree.spec.bases if isinstance(entry.tree.spec, tree.StructSpec) else ():
            known = self.project.type_entry(base.text, entry.source)
            if known is not None and known.resolved is not None and isinstance(whole := known.resolved[0], StructType) and \
                    whole.member(member) is not None:
                return self.in_type(base.text, member)
        return "member", entry.source.library, fold(entry.name), member

    def role(self, expr: tree.Node) -> str:
        return "written" if expr in self.targets else "called" if expr in self.callees else "read"

    # --- rules ----------------------------------------------------------------------------------------------------------

    def named(self, node: tree.NameRef) -> Iterator[Use]:
        variable = self.variable(node)
        if variable is not None and not (node in self.callees and variable.kind == "RESULT"):
            key: Key | None = self._key_of(variable, fold(node.text))
        else:
            key = self._without_variable(node, fold(node.text))
        if key is not None:
            yield Use(node.start, node.end, key, self.role(node))

    def _key_of(self, variable: Variable, name: str) -> Key:
        """The key of a variable that is named here."""
        if variable.kind == "PROGRAM" and name == fold(variable.type.name):  # the instance by the name of its program
            return "pou", variable.source.library, name
        key = key_of(variable)
        if key[0] == "global" and variable.kind not in _SHARED and self.pou is not None:  # a constant that was named early
            return "variable", self.source.library, fold(self.pou.owner.name), name
        return key

    def _without_variable(self, node: tree.NameRef, name: str) -> Key | None:
        """What a name means that is no variable's, or that of a generic function, whose variables are not resolved."""
        project, kind = self.project, self.facts.types.get(node)
        block = self.pou.own_block if self.pou is not None else None
        if self.pou is not None and not self.pou.resolved and declared_name(self.pou.tree, name) is not None:
            return "variable", self.source.library, fold(self.pou.name), name
        if isinstance(kind, EnumType) and name in kind.members:
            return self.in_type(kind.name, name)
        if block is not None and (method := method_of(block, name)) is not None:
            return key_of_pou(method)
        if self.pou is not None and (action := (block or self.pou.owner).action(name)) is not None:
            return key_of_pou(action)
        if (pou := project.pou(node.text, self.source)) is not None:
            return key_of_pou(pou)
        if (entry := project.type_entry(node.text, self.source)) is not None:
            return "type", entry.source.library, fold(entry.name)
        if members := project.enum_members.get(name):
            return self.in_type(members[0][0].name, name)
        return ("standard", "", name) if is_known(node.text) else None

    def member(self, node: tree.Member) -> Iterator[Use]:
        variable = self.facts.variables.get(node)
        key = key_of(variable) if variable is not None else self.member_key(self.kind(node.of), node.name.text)
        if key is None and isinstance(self.kind(node.of), Elementary):
            bit = self.variable(tree.NameRef(0, 0, node.name.text))
            key = key_of(bit) if bit is not None else None
        if key is None and isinstance(node.of, tree.NameRef):
            entry = self.project.type_entry(node.of.text, self.source)
            if entry is not None and entry.resolved is not None:
                key = self.member_key(entry.resolved[0], node.name.text)
            elif (pou := self.project.pous.get(("", fold(node.name.text)))) is not None and self.variable(node.of) is None:
                key = key_of_pou(pou)
        if key is None and (space := dotted(node.of)) and self.project.namespaces.space(space, self.source) is not None:
            key = self._key_of_name(f"{space}.{node.name.text}")
        if key is None and (name := dotted(node.of)) and (entry := self.project.type_entry(name, self.source)) is not None:
            key = self.member_key(entry.resolved[0], node.name.text) if entry.resolved is not None else None
        if key is not None:
            yield Use(node.name.start, node.name.end, key, self.role(node))

    def _key_of_name(self, name: str) -> Key | None:
        """The key of the type or POU that a name with its namespace means."""
        if (entry := self.project.type_entry(name, self.source)) is not None:
            return "type", entry.source.library, fold(entry.name)
        pou = self.project.pou(name, self.source)
        return key_of_pou(pou) if pou is not None else None

    def call(self, node: tree.Call) -> Iterator[Use]:
        self.callees.add(node.callee)
        made = self.facts.calls.get(node)
        pou = made.pou if isinstance(made, PouCall) else None
        if pou is None and made is None:
            kind = self.kind(node.callee) if not isinstance(node.callee, tree.NameRef) or self.variable(node.callee) else None
            pou = self.checker.block_of(kind) if isinstance(kind, StructType) and kind.block else None
            if pou is None and isinstance(node.callee, tree.NameRef):
                pou = self.project.pou(node.callee.text, self.source)
        for argument in node.arguments:
            if argument.kind == "=>" and argument.value is not None:
                self.targets.add(argument.value)
            if argument.name is None or pou is None:
                continue
            name = fold(argument.name.text)
            name = pou.owner.other_names.get(name, name)
            if name in pou.owner.variables:
                key = key_of(pou.owner.variables[name]) if pou.owner.nesting else \
                    ("variable", pou.source.library, fold(_plain(pou.owner.name)), name)
                yield Use(argument.name.start, argument.name.end, key, "written" if argument.kind == ":=" else "read")

    def assignment(self, node: tree.Assign) -> Iterator[Use]:
        self.targets.update(node.targets)
        return iter(())

    def counted(self, node: tree.For) -> Iterator[Use]:
        self.targets.add(node.variable)
        return iter(())

    def caught(self, node: tree.Try) -> Iterator[Use]:
        self.targets.update(() if node.code is None else (node.code,))
        return iter(())

    def enum_literal(self, node: tree.EnumLiteral) -> Iterator[Use]:
        entry = self.project.type_entry(node.type_name.text, self.source)
        if entry is not None:
            owner = fold(entry.name)
            yield Use(node.type_name.start, node.type_name.end, ("type", entry.source.library, owner))
            yield Use(node.member.start, node.member.end, ("member", entry.source.library, owner, fold(node.member.text)))

    def type_name(self, node: tree.NamedType) -> Iterator[Use]:
        name = node.text.rpartition(".")[2]
        if (key := self._key_of_name(node.text) or self._key_of_name(name)) is not None:
            end = node.start + len(node.text) if node.constants else node.end
            yield Use(end - len(name), end, key)

    def structure(self, node: tree.StructInit) -> Iterator[Use]:
        for name, _ in node.fields:
            if (key := self.member_key(self.facts.types.get(node), name.text)) is not None:
                yield Use(name.start, name.end, key, "written")

    def pou_head(self, node: tree.Pou) -> Iterator[Use]:
        if self.pou is not None and self.pou.block is not None:
            yield Use(node.name.start, node.name.end, key_of_pou(self.pou), "declared")
        elif self.pou is not None and node.kind != "ACTION":
            yield Use(node.name.start, node.name.end, ("pou", self.source.library, fold(self.pou.name)), "declared")

    def action(self, node: tree.Action) -> Iterator[Use]:
        if node.owner is not None and (pou := self.project.pou(node.owner.text, self.source)) is not None:
            yield Use(node.owner.start, node.owner.end, key_of_pou(pou))
        if self.pou is not None:
            yield Use(node.name.start, node.name.end,
                      ("action", self.source.library, fold(self.pou.name), fold(node.name.text)), "declared")

    def section(self, node: tree.VarSection) -> Iterator[Use]:
        for declared in node.variables if not node.hidden else ():
            for name in declared.names:
                if self.pou is None or node.kind in ("VAR_EXTERNAL", "VAR_GLOBAL"):
                    variable = self._global(name.text, node)
                    key: Key | None = key_of(variable) if variable is not None else None
                else:
                    key = "variable", self.source.library, fold(self.pou.name), fold(name.text)
                if key is not None:
                    yield Use(name.start, name.end, key, "read" if node.kind == "VAR_EXTERNAL" else "declared")

    def _global(self, name: str, section: tree.VarSection) -> Variable | None:
        found = self.checker.global_variable(name, self.source)
        if found is None and section in self.project.qualified_only:
            space = fold(self.source.name.replace("\\", "/").rpartition("/")[2].rpartition(".")[0])
            found = self.project.globals.get((self.source.library, f"{space}.{fold(name)}"))
        return found

    def type_head(self, node: tree.TypeDecl) -> Iterator[Use]:
        owner = fold(full_name(node.name.text, self.source))
        yield Use(node.name.start, node.name.end, ("type", self.source.library, owner), "declared")
        names: list[tree.Name] = []
        if isinstance(node.spec, tree.StructSpec | tree.UnionSpec):
            names = [name for declared in node.spec.members for name in declared.names]
        elif isinstance(node.spec, tree.EnumSpec):
            names = [name for name, _ in node.spec.members]
        for name in names:
            yield Use(name.start, name.end, ("member", self.source.library, owner, fold(name.text)), "declared")

    def program_instance(self, node: tree.ProgramInstance) -> Iterator[Use]:
        if (pou := self.project.pou(node.type_name.text, self.source)) is not None:
            yield Use(node.type_name.start, node.type_name.end, key_of_pou(pou))
        if (instance := self.project.globals.get(("", fold(node.name.text)))) is not None:
            yield Use(node.name.start, node.name.end, key_of(instance), "declared")

    def steps(self, node: sfc.Step | sfc.Transition | sfc.Association) -> Iterator[Use]:
        if self.pou is None:
            return
        owner = self.pou.owner
        names = [node.action] if isinstance(node, sfc.Association) else \
            [node.name] if isinstance(node, sfc.Step) else [*node.sources, *node.targets]
        for name in names:
            folded, role = fold(name.text), "declared" if isinstance(node, sfc.Step) else "read"
            if folded in owner.actions and isinstance(node, sfc.Association):
                yield Use(name.start, name.end, key_of_pou(owner.actions[folded]), "called")
            else:
                yield Use(name.start, name.end, ("variable", owner.source.library, fold(owner.name), folded), role)


_SHARED = ("VAR_GLOBAL", "PROGRAM")
_LEAVES = frozenset(("start", "end", "op_start", "text"))
_RULES: dict[type, Callable[[_Names, Any], Iterator[Use]]] = {
    tree.NameRef: _Names.named, tree.Member: _Names.member, tree.Call: _Names.call, tree.Assign: _Names.assignment,
    tree.For: _Names.counted, tree.Try: _Names.caught, tree.EnumLiteral: _Names.enum_literal, tree.NamedType: _Names.type_name,
    tree.StructInit: _Names.structure, tree.Pou: _Names.pou_head, tree.Action: _Names.action, tree.VarSection: _Names.section,
    tree.TypeDecl: _Names.type_head, tree.ProgramInstance: _Names.program_instance, sfc.Step: _Names.steps,
    sfc.Transition: _Names.steps, sfc.Association: _Names.steps,
}
"""By class of node the names that stand in it, beside those of the nodes inside."""


def text_has(source: Source, name: str) -> bool:
    """True if a text may have a name, which spares walking its tree."""
    return name in source.text.upper()  # `fold` would keep the text for ever
