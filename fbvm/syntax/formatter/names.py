"""How names are spelt: as they are declared first, wherever they are used.

Only what a text itself, and `Outside` it, declares is known.  A name that nobody declares stays as it is, so nothing here
needs to be complete; the checker is who decides what a name means.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

from fbvm.base.types import ELEMENTARY, GENERIC, SHORT_NAMES, fold
from fbvm.syntax.formatter.scopes import Entry, Scope, declared_in, element, global_scope, members, of_method, with_inherited
from fbvm.syntax.tree import (
    Argument,
    ArrayInit,
    Call,
    Declaration,
    Deref,
    EnumLiteral,
    EnumSpec,
    Expr,
    Index,
    Member,
    Name,
    NamedType,
    NameRef,
    Node,
    Part,
    Pou,
    ProgramInstance,
    SourceText,
    StructInit,
    TypeDecl,
    TypeSpec,
    VarDecl,
    VarSection,
)
from fbvm.syntax.tree.ladder import Ladder
from fbvm.syntax.tree.node import names_of
from fbvm.syntax.tree.sfc import Association, Sfc, Transition

TYPE_WORDS = frozenset(ELEMENTARY) | GENERIC | set(SHORT_NAMES) | {"STRING", "WSTRING"}
_WITH_METHODS = ("FUNCTION_BLOCK", "CLASS", "PROGRAM", "INTERFACE")
Shape = TypeSpec | Pou | None
"""What is known of a value's type."""


class Outside(NamedTuple):
    """Names from outside that a text may use."""

    declaration: Callable[[str], Declaration | None]
    """The declaration of a block, function or type of a library."""
    standard: Callable[[str], bool]
    """Whether a name is that of a standard function; those are written in capitals."""


NOTHING = Outside(lambda name: None, lambda name: False)


class Spelling:
    """Called with the place of a name and its text: the name as it is to be written."""

    def __init__(self, tree: SourceText, outside: Outside = NOTHING) -> None:
        self.outside = outside
        self.globals = global_scope(tree)
        self.at: dict[int, str] = {}
        self.shapes: dict[Expr, Shape] = {}
        self.members: dict[Shape, Scope] = {}
        self._walk(tree)

    def __call__(self, start: int, text: str) -> str:
        known = self.at.get(start, text)
        return known if fold(known) == fold(text) else text

    # --- the walk ---

    def _walk(self, tree: SourceText) -> None:
        """Visit every node, those of a POU in the scope of the POU."""
        todo: list[tuple[Node, Scope]] = [(tree, {})]
        declared: list[int] = []
        while todo:
            node, scope = todo.pop()
            if isinstance(node, Pou):
                scope = self._names_in(node, scope)
            self._visit(node, scope)
            if isinstance(node, Transition) and node.name is not None:
                declared.append(node.name.start)
            todo.extend((child, scope) for child in _children(node) if not _is_ladder(child))
        for start in declared:  # what an instruction list computes is assigned there
            self.at.pop(start, None)

    def _names_in(self, pou: Pou, around: Scope) -> Scope:
        """The names in a POU; `around` are those of the block that a METHOD stands in."""
        if "THIS" in around:
            return of_method(pou, around, self.globals)
        scope = declared_in(pou, self.globals)
        if pou.kind not in _WITH_METHODS:
            return scope
        base = self._named(pou.bases[0].text) if pou.bases else None
        return self._members(pou) | scope | {"THIS": Entry("THIS", pou), "SUPER": Entry("SUPER", base)}

    def _visit(self, node: Node, scope: Scope) -> None:
        if isinstance(node, NameRef):
            self._name(node, scope)
        elif isinstance(node, NamedType):
            self._type_name(node)
        elif isinstance(node, Member):
            self._field(node.name, self._shape(node.of, scope))
        elif isinstance(node, EnumLiteral):
            self._enum_literal(node)
        elif isinstance(node, Call):
            self._arguments(node.arguments, self._called(node.callee, scope))
            self._function_name(node.callee, scope)
        elif isinstance(node, ProgramInstance):
            self._program(node)
        elif isinstance(node, Transition):
            for name in (*node.sources, *node.targets):
                self._name(name, scope)
        elif isinstance(node, Association):
            self._name(node.action, scope)
        elif isinstance(node, VarSection) and node.kind == "VAR_EXTERNAL":
            for name in (name for variable in node.variables for name in variable.names):
                if entry := self.globals.get(fold(name.text)):
                    self.at[name.start] = entry.text
        elif isinstance(node, (VarDecl, TypeDecl)) and isinstance(node.initial, (StructInit, ArrayInit)):
            self._initial(node.initial, node.spec)

    def _program(self, node: ProgramInstance) -> None:
        if node.task:
            self._name(node.task, {})
        self._type_name(node.type_name)
        self._arguments(node.connections, self._named(node.type_name.text))

    # --- names ---

    def _name(self, name: Name | NamedType | NameRef, scope: Scope) -> bool:
        """Note the spelling of a name that the text declares; whether it does."""
        entry = scope.get(fold(name.text)) or self.globals.get(fold(name.text))
        if entry and not entry.text.startswith("$"):  # that is what jumps remember, where the text has something else
            self.at[name.start] = entry.text
        return entry is not None

    def _type_name(self, name: Name | NamedType) -> None:
        """The name of a type or block, also of one outside."""
        if not self._name(name, {}):
            key = fold(name.text)
            outside = None if key in TYPE_WORDS else self.outside.declaration(key)
            if key in TYPE_WORDS:
                self.at[name.start] = key
            elif isinstance(outside, (Pou, TypeDecl)):
                self.at[name.start] = outside.name.text

    def _function_name(self, callee: Expr, scope: Scope) -> None:
        """The name of a function, also of one outside."""
        if isinstance(callee, NameRef) and not self._name(callee, scope):
            if self.outside.standard(fold(callee.text)):
                self.at[callee.start] = fold(callee.text)
            elif isinstance(outside := self.outside.declaration(callee.text), Pou):
                self.at[callee.start] = outside.name.text

    def _field(self, name: Name, shape: Shape) -> None:
        entry = self._members(shape).get(fold(name.text))
        if entry:
            self.at[name.start] = entry.text

    def _enum_literal(self, node: EnumLiteral) -> None:
        self._type_name(node.type_name)
        spec = self._resolved(self._named(node.type_name.text))
        names = [name.text for name, _ in spec.members] if isinstance(spec, EnumSpec) else []
        for text in names:
            if fold(text) == fold(node.member.text):
                self.at[node.member.start] = text

    def _arguments(self, arguments: Iterable[Argument], shape: Shape) -> None:
        for argument in arguments:
            if argument.name:
                self._field(argument.name, shape)

    def _initial(self, initial: Any, spec: Shape) -> None:
        """The names of fields in an initial value."""
        todo = [(initial, spec)]
        while todo:
            value, shape = todo.pop()
            if isinstance(value, StructInit):
                known = self._members(shape)
                for name, inner in value.fields:
                    if entry := known.get(fold(name.text)):
                        self.at[name.start] = entry.text
                    todo.append((inner, entry.shape if entry else None))
            elif isinstance(value, ArrayInit):
                todo += [(inner, element(self._resolved(shape))) for _, inner in value.items]

    # --- types ---

    def _named(self, text: str) -> Shape:
        """The type that a name stands for."""
        entry = self.globals.get(fold(text))
        if entry:
            return entry.shape
        found = self.outside.declaration(text)
        return found if isinstance(found, Pou) else found.spec if isinstance(found, TypeDecl) else None

    def _resolved(self, shape: Shape) -> Shape:
        """The type behind names of types."""
        for _ in range(100):
            if not isinstance(shape, NamedType):
                return shape
            shape = self._named(shape.text)
        return None

    def _members(self, shape: Shape) -> Scope:
        shape = self._resolved(shape)
        if shape not in self.members:
            self.members[shape] = with_inherited(shape, self._named) if isinstance(shape, Pou) else members(shape)
        return self.members[shape]

    def _called(self, callee: Expr, scope: Scope) -> Shape:
        """The parameters of the function or block that is called."""
        shape = self._resolved(self._shape(callee, scope))
        if isinstance(shape, Pou) or not isinstance(callee, NameRef):
            return shape
        return self._named(callee.text)

    def _shape(self, value: Expr, scope: Scope) -> Shape:
        """What is known of the type of a variable, found from its first name on."""
        chain: list[Expr] = []
        while value not in self.shapes and isinstance(value, (Member, Index, Deref, Part, Call)):
            chain.append(value)
            value = value.callee if isinstance(value, Call) else value.of
        if value not in self.shapes:
            key = fold(value.text) if isinstance(value, NameRef) else ""
            entry = scope.get(key) or self.globals.get(key)
            self.shapes[value] = entry.shape if entry else None
        shape = self.shapes[value]
        for link in reversed(chain):
            shape = self.shapes[link] = self._behind(link, self._resolved(shape))
        return shape

    def _behind(self, link: Expr, shape: Shape) -> Shape:
        """The type that a member, an index, `^` or a call leads to."""
        if isinstance(link, Member):
            entry = self._members(shape).get(fold(link.name.text))
            return entry.shape if entry else None
        if isinstance(link, Call):
            return shape.result if isinstance(shape, Pou) else None
        if isinstance(link, Deref) and isinstance(shape, Pou):
            return shape  # THIS^ and SUPER^
        return element(shape) if isinstance(link, (Index, Deref)) else None


def _is_ladder(node: Node) -> bool:
    """Whether a node belongs to a LADDER, whose names stay as they are written."""
    return isinstance(node, Ladder) or isinstance(node, VarSection) and node.hidden


def _children(node: Node) -> Iterator[Node]:
    """The nodes directly below a node; of a chart what was written."""
    written = names_of(node)
    if isinstance(node, Sfc):
        written = ("steps", "transitions")
    elif isinstance(node, Transition) and node.body is not None:
        written = ("body",)  # the condition stands for the name, which is a declaration
    todo: list[Any] = [getattr(node, name) for name in written]
    while todo:
        value = todo.pop()
        if isinstance(value, Node):
            yield value
        elif isinstance(value, tuple):
            todo.extend(value)
