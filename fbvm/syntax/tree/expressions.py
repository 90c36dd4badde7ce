"""The expressions of a tree, and names (Annex A: 7.3.2); `tree` has them with all other nodes."""

from __future__ import annotations

from fbvm.syntax.tree.node import Node
from fbvm.syntax.tree.node import node as _node


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

    `kind` is "int", "real", "bool", "string", "wstring", "time", "date", "tod", "dt" or "wrong"; `value` an int, float, bool,
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
class ArrayInit(Expr):
    """`[1, 2, 3(0)]`: pairs of repetition (None = once) and value; a value None in `3()` takes the default."""

    items: tuple[tuple[Expr | None, Expr | None], ...]


@_node
class StructInit(Expr):
    """`(a := 1, b := [..])`."""

    fields: tuple[tuple[Name, Expr], ...]


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
class TypeOperand(Expr):
    """A type that is written out where a value stands, as in `SIZEOF(POINTER TO INT)`."""

    spec: Node


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
