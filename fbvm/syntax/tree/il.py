"""The tree of an instruction list (IEC 61131-3 ed. 2 Annex B.2, ed. 3 tables 67 to 70)."""

from __future__ import annotations

from fbvm.syntax.tree.expressions import Call, Expr
from fbvm.syntax.tree.node import node as _node
from fbvm.syntax.tree.nodes import Block, Statement, TypeSpec, VarDecl


@_node
class TypeOf(TypeSpec):
    """The type of the value of an expression: a current result that is needed again has the type of what was computed."""

    of: Expr


@_node
class CallsInRow(Expr):
    """Calls with all their arguments in brackets, one behind the other: its value is the result of the last that has one.

    If none has a result, its value is `before`, the current result in front of the first; None if there is none, or if the
    first replaces one that nobody has used."""

    calls: tuple[Call, ...]
    before: Expr | None


@_node
class InstructionList(Statement):
    """A body in the instruction list: `body` are the statements that its instructions stand for.

    `temporaries` keep current results that are used more than once; no program can write their names.  `result` is the
    current result at the end, None if there is none: a transition takes it as its condition.  `ends_with_result` if the last
    statement is there only to work it out."""

    body: Block
    temporaries: tuple[VarDecl, ...]
    result: Expr | None
    ends_with_result: bool = False
