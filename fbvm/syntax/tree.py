"""The tree of a source text, named as the productions of IEC 61131-3 Annex A.

A tree is a value: it never changes after parsing and holds no facts about names or types.  Nodes compare by identity,
so that facts can be kept about each in side tables.  `start` and `end` are character offsets in the source.
Names are kept as written; comparing them without case is the checker's work.
"""

from __future__ import annotations

from fbvm.syntax.node import Node as Node
from fbvm.syntax.node import node as _node


@_node
class Name(Node):
    """An identifier as written."""

    text: str


# --- expressions (Annex: 7.3.2) ------------------------------------------------------------------------------------


@_node
class Expr(Node):
    pass


@_node
class Literal(Expr):
    """A literal of an elementary type.

    `kind` is "int", "real", "bool", "string", "wstring", "time", "date", "tod" or "dt"; `value` an int, float, bool,
    str (one character per STRING byte or WSTRING unit) or whole nanoseconds; `type_name` the type written before `#`,
    in capitals and in its long form (T -> TIME, D -> DATE, LTOD -> LTIME_OF_DAY), or None.  `text` is as written."""

    kind: str
    value: int | float | bool | str
    type_name: str | None
    text: str


@_node
class EnumLiteral(Expr):
    """`Color#Red`."""

    type_name: Name
    member: Name


@_node
class NullLiteral(Expr):
    """`NULL`."""


@_node
class NameRef(Expr):
    """A plain identifier: variable, enumeration member, POU, type."""

    text: str


@_node
class Direct(Expr):
    """A directly represented variable such as `%MW10`, `%IX0.3`, `%D200`, `%CIO1519.03`; `text` as written."""

    text: str


@_node
class Member(Expr):
    """`of.name`."""

    of: Expr
    name: Name


@_node
class Part(Expr):
    """Partial access `of.%X3`, `of.3`, `of.%B1`; `size` is X, B, W, D or L, `index` the number written."""

    of: Expr
    size: str
    index: int


@_node
class Index(Expr):
    """`of[subscripts]`."""

    of: Expr
    subscripts: tuple[Expr, ...]


@_node
class Deref(Expr):
    """`of^`."""

    of: Expr


@_node
class Unary(Expr):
    """`op` is "-", "+" or "NOT"."""

    op: str
    operand: Expr


@_node
class Binary(Expr):
    """`op` is one of OR XOR AND OR_ELSE AND_THEN = <> < > <= >= + - * / MOD ** (`&` is AND)."""

    op: str
    left: Expr
    right: Expr
    op_start: int


@_node
class Argument(Node):
    """One argument of a call: `value`, `name := value` or `name => value`; `kind` is "", ":=" or "=>".

    `value` is None for `name =>` and `name :=` with nothing behind; `negated` for `NOT name => value`."""

    kind: str
    name: Name | None
    value: Expr | None
    negated: bool = False


@_node
class Call(Expr):
    """A call of a function, or of an instance when it stands as a statement."""

    callee: Expr
    arguments: tuple[Argument, ...]


# --- initial values (6.4.4, 6.5.1.4) -------------------------------------------------------------------------------


@_node
class ArrayInit(Node):
    """`[1, 2, 3(0)]`: pairs of repetition (None = once) and value; a value None in `3()` takes the default."""

    items: tuple[tuple[Expr | None, Initial | None], ...]


@_node
class StructInit(Node):
    """`(a := 1, b := [..])`."""

    fields: tuple[tuple[Name, Initial], ...]


Initial = Expr | ArrayInit | StructInit


# --- type specifications (6.4.4) -----------------------------------------------------------------------------------


@_node
class TypeSpec(Node):
    pass


@_node
class NamedType(TypeSpec):
    """An elementary, generic, derived or block type by name (dotted names keep their dots)."""

    text: str


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
    members: tuple[VarDecl, ...]
    overlap: bool = False


@_node
class UnionSpec(TypeSpec):
    members: tuple[VarDecl, ...]


@_node
class EnumSpec(TypeSpec):
    """`(A, B := 2)`, `INT (A := 1)`: names with values (None = not written)."""

    base: NamedType | None
    members: tuple[tuple[Name, Expr | None], ...]


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
    """One VAR.. END_VAR: `kind` is VAR, VAR_INPUT, VAR_OUTPUT, VAR_IN_OUT, VAR_TEMP, VAR_EXTERNAL, VAR_GLOBAL,
    VAR_STAT or VAR_INST; `qualifiers` the words behind it in capitals; `hidden` ones hold what rungs need, unwritten."""

    kind: str
    qualifiers: tuple[Name, ...]
    variables: tuple[VarDecl, ...]
    hidden: bool = False


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
class RefusedStatement(Statement):
    """Understood but never executed (JMP, a label, SUPER() ...): `what` names it, `code` is S0901 or S0902."""

    what: str
    code: str = "S0901"


# --- declarations (6.6, 6.8) ---------------------------------------------------------------------------------------


@_node
class Declaration(Node):
    pass


@_node
class Refused(Declaration):
    """Understood but not executed: CLASS, INTERFACE, NAMESPACE, SFC text, VAR_CONFIG ...; code S0901 or S0902."""

    what: str
    code: str


@_node
class TypeDecl(Declaration):
    name: Name
    spec: TypeSpec
    initial: Initial | None


@_node
class Pou(Declaration):
    """FUNCTION, FUNCTION_BLOCK or PROGRAM.  `refused` are METHODs, ACTIONs, EXTENDS ... found in it."""

    kind: str
    name: Name
    result: TypeSpec | None
    sections: tuple[VarSection, ...]
    body: Block
    refused: tuple[Refused, ...] = ()


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
class ProgramInstance(Node):
    """`PROGRAM name RETAIN WITH task : type (connections)`; connections with `fb WITH task` are `refused`."""

    name: Name
    qualifiers: tuple[Name, ...]
    task: Name | None
    type_name: Name
    connections: tuple[Argument, ...]
    refused: tuple[Refused, ...] = ()


@_node
class Resource(Node):
    """`RESOURCE name ON processor`; the one resource that a CONFIGURATION has without the word has name None."""

    name: Name | None
    processor: Name | None
    sections: tuple[VarSection, ...]
    tasks: tuple[Task, ...]
    programs: tuple[ProgramInstance, ...]
    refused: tuple[Refused, ...] = ()


@_node
class Configuration(Declaration):
    name: Name
    sections: tuple[VarSection, ...]
    resources: tuple[Resource, ...]
    refused: tuple[Refused, ...] = ()


@_node
class Pragma(Node):
    """`{...}` with its contents; kept for those who know it."""

    text: str


@_node
class SourceText(Node):
    """All declarations of one source text in the order of writing."""

    declarations: tuple[Declaration, ...]
    pragmas: tuple[Pragma, ...] = ()
