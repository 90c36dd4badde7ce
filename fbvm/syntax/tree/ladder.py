"""The nodes of ladder (IEC 61131-3, 8.2): rungs as they were written, and what they do written as statements.

A rung is a statement whose body is made of ordinary ones, and of the expressions of this module.  So checking, lowering and
execution need to know only these expressions; drawing and printing need the steps.
"""

from __future__ import annotations

from fbvm.syntax.tree import Action, Block, Expr, NameRef, Statement, VarDecl
from fbvm.syntax.tree.node import Node
from fbvm.syntax.tree.node import node as _node


@_node
class Edge(Expr):
    """TRUE in the one evaluation in which `of` rises, or falls.  `memory` is the variable with the value of `of` at its last
    evaluation."""

    of: Expr
    memory: NameRef
    falling: bool


@_node
class Element(Expr):
    """A value that can be observed at a step of a rung: the state of a contact, or the power that reaches an output.  `step` is
    the number of the step in the rung."""

    step: int
    value: Expr


@_node
class Memory(Expr):
    """What lies at a PLC memory address, where index registers and indirect addresses point: a place of the type `kind`,
    or with "" the words from there to the end of their area.  The address of a BOOL counts bits."""

    address: Expr
    kind: str


@_node
class Words(Expr):
    """The words that begin with a variable: up to the end of its area if it lies in one, else up to its own end."""

    of: Expr


@_node
class Contents(Expr):
    """What an instruction reads at a variable as a number of its own width, of the type `kind`: instructions of ladder know
    addresses, not types.  `converted` is the value where the variable itself has that width, or less without an address.
    With `kind` "" it is what stands at a pin of a function block, of the pin's type; `converted` is None then."""

    of: Expr
    kind: str
    converted: Expr | None


@_node
class Step(Node):
    """One instruction as a programming tool writes it: `prefix` is made of `!`, `@` and `%`, `operands` are as written."""

    prefix: str
    mnemonic: str
    operands: tuple[str, ...]


@_node
class Rung(Statement):
    """`steps` are the instructions as written, `body` the statements that execute them.  `notes` are comments as written, each
    with the number of the step behind it, `section` the name of the section that begins with it, "" if none does."""

    number: int
    comment: str
    section: str
    steps: tuple[Step, ...]
    notes: tuple[tuple[int, str], ...]
    body: Block


@_node
class Ladder(Statement):
    """LADDER .. END_LADDER: `rungs` in the order of writing; in `body` some may stand inside loops.  `variables` are what
    steps remember, `temporaries` what lives for one execution: neither has a name that can be written."""

    rungs: tuple[Rung, ...]
    body: Block
    variables: tuple[VarDecl, ...]
    temporaries: tuple[VarDecl, ...]
    instances: tuple[VarDecl, ...]
    """Instances that FBCALL names."""
    subroutines: tuple[Action, ...]
    """The subroutines, from SBN to RET."""
