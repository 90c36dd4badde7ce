"""The emitter: the block of code that is being written, and the temporaries in it."""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.base.dialects import Dialect
from fbvm.code.operations import Node

DEEPEST = 40
"""Operations nested deeper than this are cut by a temporary, so that no back end meets deep nesting."""


class Inner:
    """A block inside the present one, for a `with` statement: a class, since there is one for each branch and call."""

    def __init__(self, emitter: Emitter) -> None:
        self.emitter, self.outer = emitter, emitter.out

    def __enter__(self) -> list[Node]:
        inner: list[Node] = []
        self.emitter.out = inner
        return inner

    def __exit__(self, *_: object) -> None:
        self.emitter.out = self.outer


class Emitter:
    """Takes statements in the order in which they are executed; `out` is the block that is being written.

    An expression is only an operand until a statement holds it.  Whatever has to be evaluated now, since a statement follows
    that could change it, is put into a temporary."""

    def __init__(self, dialect: Dialect) -> None:
        self.dialect = dialect
        self.out: list[Node] = []
        self._temporaries = 0
        self._heights: dict[int, tuple[int, Node]] = {}
        """By identity of an expression how deep it is nested, and the expression, so that no other gets its identity."""

    def emit(self, *statements: Node) -> None:
        """Append statements to the present block."""
        self.out += statements

    def block(self) -> Inner:
        """Collects what is emitted inside the `with` statement in a block of its own, which is yielded."""
        return Inner(self)

    # --- temporaries ------------------------------------------------------------------------------------------------

    def new_temporary(self) -> int:
        """The number of a temporary that nothing else uses in this body."""
        self._temporaries += 1
        return self._temporaries

    def to_temporary(self, node: Node, always: bool = False) -> Node:
        """Evaluate an expression now.

        The result is the temporary that holds the value.  A constant or a temporary is its own result unless `always` is
        given, as it must be where the temporary is assigned again."""
        if node[0] in ("const", "tmp") and not always:
            return node
        number = self.new_temporary()
        self.out.append(("let", number, node[1], node))
        return ("tmp", node[1], number)

    def _to_temporary_at(self, position: int, node: Node) -> Node:
        """Evaluate an expression where the present block had only `position` statements; the result is its temporary."""
        if node[0] in ("const", "tmp"):
            return node
        number = self.new_temporary()
        self.out.insert(position, ("let", number, node[1], node))
        return ("tmp", node[1], number)

    def sequence(self, values: Iterable[Node]) -> list[Node]:
        """Operands that are evaluated from left to right.

        Each is lowered when `values` yields it.  If that emits statements, such as a call, the operands in front of it are
        evaluated into temporaries before those statements."""
        nodes: list[Node] = []
        mark = len(self.out)
        for node in values:
            if len(self.out) > mark:
                nodes, mark = self.evaluated_before(nodes, mark)
            nodes.append(node)
        return nodes

    def evaluated_before(self, nodes: list[Node], mark: int) -> tuple[list[Node], int]:
        """Temporaries with operands that are evaluated where the present block had only `mark` statements, and how many it has
        now."""
        made = [self._to_temporary_at(mark, earlier) for earlier in reversed(nodes)][::-1]
        return made, len(self.out)

    def cut_if_deep(self, node: Node) -> Node:
        """The same expression, or a temporary with its value if it is nested deeper than DEEPEST."""
        heights, height = self._heights, 1
        if id(node) in heights:
            return node
        for part in node[2:]:
            if type(part) is tuple:
                known = heights.get(id(part))
                above = 2 if known is None else known[0] + 1
                if above > height:
                    height = above
        if height > DEEPEST:
            return self.to_temporary(node)
        heights[id(node)] = height, node
        return node
