"""The nodes of sequential function charts (IEC 61131-3, 6.7): steps and transitions as they were written, and what they do
written as statements.

A chart is a statement whose body is made of ordinary ones.  So lowering and execution need to know nothing of steps; checking,
drawing and printing find them here.
"""

from __future__ import annotations

from fbvm.syntax.tree import Block, Expr, Name, Statement, VarSection
from fbvm.syntax.tree.node import Node
from fbvm.syntax.tree.node import node as _node

QUALIFIERS = {"N": False, "R": False, "S": False, "P": False, "P0": False, "P1": False,
              "L": True, "D": True, "SD": True, "DS": True, "SL": True}
"""Qualifier -> whether a time belongs to it (table 59)."""


@_node
class Association(Node):
    """`Fill(L, T#5s, full);` in a step: `qualifier` in capitals, N where none is written.  The action is an ACTION of the
    POU, or a BOOL variable."""

    action: Name
    qualifier: str
    time: Expr | None
    indicators: tuple[Expr, ...]


@_node
class Step(Node):
    """STEP or INITIAL_STEP .. END_STEP."""

    name: Name
    initial: bool
    associations: tuple[Association, ...]


@_node
class Transition(Node):
    """`TRANSITION name (PRIORITY := n) FROM .. TO .. := condition; END_TRANSITION`.  With a `body`, that assigns the
    condition to the transition's name, and `condition` is this name; or `body` is an instruction list that does nothing but
    compute the condition."""

    name: Name | None
    priority: int | None
    sources: tuple[Name, ...]
    targets: tuple[Name, ...]
    condition: Expr
    body: Block | None


@_node
class Sfc(Statement):
    """All steps and transitions of a POU, in the order of writing; `body` is what one call does.  `sections` declare what
    it needs: the flags of steps and actions, which programs may read, and variables whose names cannot be written."""

    steps: tuple[Step, ...]
    transitions: tuple[Transition, ...]
    body: Block
    sections: tuple[VarSection, ...]
