"""The tree of a source text, named as the productions of IEC 61131-3 Annex A.

A tree is a value: it never changes after parsing and holds no facts about names or types.  Nodes compare by identity, so that
facts can be kept about each in side tables.  `start` and `end` are character offsets in the source.  Names are kept as written;
comparing them without case is the checker's work.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from fbvm.syntax.tree.expressions import Argument, ArrayInit, Expr, Name
from fbvm.syntax.tree.node import Node
from fbvm.syntax.tree.node import node as _node

# --- initial values (6.4.4, 6.5.1.4) -------------------------------------------------------------------------------


Initial = Expr
"""What may stand behind `:=` in a declaration."""


# --- type specifications (6.4.4) -----------------------------------------------------------------------------------


@_node
class TypeSpec(Node):
    pass


@_node
class NamedType(TypeSpec):
    """An elementary, generic, derived or block type by name (dotted names keep their dots), with `constants` in Buffer<100>."""

    text: str
    constants: tuple[Expr, ...] = ()


@_node
class StringSpec(TypeSpec):
    """`STRING`, `STRING[n]`, `STRING(n)`, `WSTRING[n]`."""

    wide: bool
    length: Expr | None


@_node
class SubrangeSpec(TypeSpec):
    base: NamedType
    low: Expr
    high: Expr


@_node
class ArraySpec(TypeSpec):
    """`ARRAY [l..h, ...] OF T`; a dimension None is `*`."""

    dimensions: tuple[tuple[Expr, Expr] | None, ...]
    element: TypeSpec


@_node
class StructSpec(TypeSpec):
    """`STRUCT .. END_STRUCT`, of a type that EXTENDS `bases` behind the members of these."""

    members: tuple[VarDecl, ...]
    overlap: bool = False
    bases: tuple[NamedType, ...] = ()


@_node
class UnionSpec(TypeSpec):
    members: tuple[VarDecl, ...]


@_node
class EnumSpec(TypeSpec):
    """`(A, B := 2)`, `INT (A := 1)`: names with values (None = not written)."""

    base: NamedType | None
    members: tuple[tuple[Name, Expr | None], ...]


@_node
class ConstructedSpec(TypeSpec):
    """`FB (25)`, `FB [(n := 1), 3((n := 2))]`: a block with initial values for its inputs, for each element of an array its
    own, or with `arguments` of FB_init; `values` None but for elements of an array."""

    base: NamedType
    values: ArrayInit | None
    arguments: tuple[Argument, ...] = ()


@_node
class RefSpec(TypeSpec):
    """`kind` is "REF_TO", "POINTER TO" or "REFERENCE TO"."""

    kind: str
    target: TypeSpec


# --- variables (6.5) -----------------------------------------------------------------------------------------------


@_node
class Location(Node):
    """What stands behind AT: `D32500`, `CIO 1519.03`, `%MW10`, `%IX0.3`, `%I*`, `%D30018`; `text` as written."""

    text: str


@_node
class VarDecl(Node):
    """`a, b AT D100 : INT := 5;`; `edge` is "", "R_EDGE" or "F_EDGE"."""

    names: tuple[Name, ...]
    location: Location | None
    spec: TypeSpec
    initial: Initial | None
    edge: str = ""


@_node
class VarSection(Node):
    """One VAR.. END_VAR: `kind` is VAR, VAR_INPUT, VAR_TEMP ...; `qualifiers` the words behind it in capitals; `hidden` ones hold
    what rungs and charts need, unwritten; their `role` is "step" or "action" where they are the flags of these."""

    kind: str
    qualifiers: tuple[Name, ...]
    variables: tuple[VarDecl, ...]
    hidden: bool = False
    role: str = ""


# --- statements (7.3.3) --------------------------------------------------------------------------------------------


@_node
class Statement(Node):
    pass


Block = tuple[Statement, ...]


@_node
class Assign(Statement):
    """`a := e`, `a := b := e` (several targets), `S=`, `R=`, `REF=`, `?=`; `op` as written."""

    targets: tuple[Expr, ...]
    op: str
    value: Expr


@_node
class CallStatement(Statement):
    """A call as a statement; an expression that is no call is kept too, for the checker to refuse."""

    call: Expr


@_node
class If(Statement):
    branches: tuple[tuple[Expr, Block], ...]
    otherwise: Block | None


@_node
class CaseBranch(Node):
    """`labels` are (low, high); high None for a single value."""

    labels: tuple[tuple[Expr, Expr | None], ...]
    body: Block


@_node
class Case(Statement):
    selector: Expr
    branches: tuple[CaseBranch, ...]
    otherwise: Block | None


@_node
class For(Statement):
    variable: Expr
    first: Expr
    last: Expr
    step: Expr | None
    body: Block


@_node
class While(Statement):
    condition: Expr
    body: Block


@_node
class Repeat(Statement):
    body: Block
    until: Expr


@_node
class Exit(Statement):
    pass


@_node
class Continue(Statement):
    pass


@_node
class Return(Statement):
    value: Expr | None = None


@_node
class Empty(Statement):
    pass


@_node
class Try(Statement):
    """`__TRY body __CATCH(code) handler __FINALLY final __ENDTRY`: `final` is None without __FINALLY, `code` without (code)."""
    body: Block
    code: Expr | None
    handler: Block
    final: Block | None


@_node
class RefusedStatement(Statement):
    """Understood but never executed (a JMP into a block ...): `what` names it."""

    what: str


# --- declarations (6.6, 6.8) ---------------------------------------------------------------------------------------


@_node
class Declaration(Node):
    pass


@_node
class Refused(Declaration):
    """Understood but not executed, such as VAR_ACCESS of a block: `what` names it."""

    what: str


@_node
class Using(Declaration):
    """`USING A.B, C;` in front of what may then name the declarations of these namespaces without them."""

    names: tuple[NamedType, ...]


@_node
class Namespace(Declaration):
    """`NAMESPACE A.B .. END_NAMESPACE`: `modifiers` may be INTERNAL; of POUs it has no PROGRAM."""

    name: NamedType
    modifiers: tuple[Name, ...]
    usings: tuple[Using, ...]
    declarations: tuple[Declaration, ...]


@_node
class TypeDecl(Declaration):
    name: Name
    spec: TypeSpec
    initial: Initial | None
    internal: bool = False


@_node
class Pou(Declaration):
    """FUNCTION, FUNCTION_BLOCK, PROGRAM, CLASS or INTERFACE, and a METHOD of one of these.

    `modifiers` are the words of its head (ABSTRACT, FINAL, OVERRIDE, PUBLIC ...) in capitals, `bases` and `interfaces` what
    stands behind EXTENDS and IMPLEMENTS.  A PROPERTY is up to two of its `methods`, of the kinds GET and SET; SET has an input
    with the name of the property.  `refused` are parts that are not executed."""

    kind: str
    name: Name
    result: TypeSpec | None
    sections: tuple[VarSection, ...]
    body: Block
    refused: tuple[Refused, ...] = ()
    actions: tuple[Action, ...] = ()
    accesses: tuple[AccessVars, ...] = ()
    modifiers: tuple[Name, ...] = ()
    bases: tuple[NamedType, ...] = ()
    interfaces: tuple[NamedType, ...] = ()
    methods: tuple[Pou, ...] = ()
    usings: tuple[Using, ...] = ()


@_node
class Action(Declaration):
    """`ACTION name: .. END_ACTION` in a POU, or behind it, perhaps with the POU's name in front."""

    owner: Name | None
    name: Name
    body: Block


@_node
class Actions(Declaration):
    """`ACTIONS pou .. END_ACTIONS` around the actions of a POU; without its name, of the one in front."""

    owner: Name | None
    actions: tuple[Action, ...]


@_node
class GlobalVars(Declaration):
    """A VAR_GLOBAL section that stands by itself."""

    section: VarSection


@_node
class Task(Node):
    """`TASK name (SINGLE := e, INTERVAL := e, PRIORITY := e)`; missing parts None."""

    name: Name
    single: Expr | None
    interval: Expr | None
    priority: Expr | None


@_node
class BlockTask(Node):
    """`valve WITH slow` among the connections of a program: an instance of its own that another task runs."""

    instance: Expr
    task: Name


@_node
class ProgramInstance(Node):
    """`PROGRAM name RETAIN WITH task : type (connections)`."""

    name: Name
    qualifiers: tuple[Name, ...]
    task: Name | None
    type_name: Name
    connections: tuple[Argument, ...]
    blocks: tuple[BlockTask, ...] = ()


@_node
class Access(Node):
    """`name : path : type READ_WRITE;` of VAR_ACCESS; a direct address is the last Member or the whole `path`."""

    name: Name
    path: Expr
    spec: TypeSpec
    writable: bool


@_node
class AccessVars(Node):
    variables: tuple[Access, ...]


@_node
class ConfigVar(Node):
    """`resource.program.instance.variable AT %IX0.0 : BOOL := TRUE;` of VAR_CONFIG."""

    path: Expr
    location: Location | None
    spec: TypeSpec
    initial: Initial | None


@_node
class ConfigVars(Declaration):
    """A VAR_CONFIG section."""

    variables: tuple[ConfigVar, ...]


@_node
class Resource(Node):
    """`RESOURCE name ON processor`; the one resource that a CONFIGURATION has without the word has name None."""

    name: Name | None
    processor: Name | None
    sections: tuple[VarSection, ...]
    tasks: tuple[Task, ...]
    programs: tuple[ProgramInstance, ...]
    settings: tuple[AccessVars | ConfigVars, ...] = ()


@_node
class Configuration(Declaration):
    name: Name
    sections: tuple[VarSection, ...]
    resources: tuple[Resource, ...]
    settings: tuple[AccessVars | ConfigVars, ...] = ()


@_node
class Pragma(Node):
    """`{...}` with its contents."""

    text: str


class Form(NamedTuple):
    """Text that only some dialects take: those that have `switch` set, or that do not if `taken` is False.

    The parser reads it for all of them.  `refused` is the code, message and hint for the others, None if they take it without a
    word; `accepted` is the warning, if there is one, for who takes it."""

    switch: str
    start: int
    end: int
    refused: tuple[str, str, str] | None
    accepted: tuple[str, str, str] | None = None
    taken: bool = True


@_node
class SourceText(Node):
    """All declarations of one source text in the order of writing."""

    declarations: tuple[Declaration, ...]
    pragmas: tuple[Pragma, ...] = ()
    forms: tuple[Form, ...] = ()

    def everything(self) -> Iterator[Declaration]:
        """All declarations, those in namespaces too, but no NAMESPACE and no USING."""
        waiting = list(reversed(self.declarations))
        while waiting:
            each = waiting.pop()
            if isinstance(each, Namespace):
                waiting += reversed(each.declarations)
            elif not isinstance(each, Using):
                yield each
