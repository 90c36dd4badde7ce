"""A checked body as the rules of warnings see it: its facts, its nodes, and where a warning goes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

from fbvm.base.areas import Address
from fbvm.base.diagnostics import Source
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc
from fbvm.syntax.tree.node import written

Nodes = tuple[tree.Node | None, ...]


class Body:
    """The body of one POU of the user's own, without errors."""

    def __init__(self, pou: Pou, context: Context) -> None:
        self.pou, self.context = pou, context
        self.facts, self.report = context.project.facts, context.report

    def warn(self, code: str, node: tree.Node, message: str, hint: str = "",
             related: tuple[Source, int, str] | None = None) -> None:
        self.report.add(code, self.pou.source, node, message, hint, related)

    def there(self, node: tree.Node, what: str) -> tuple[Source, int, str]:
        """A second place of a warning in the same source, with the words for it."""
        return self.pou.source, node.start, what

    def text(self, node: tree.Node) -> str:
        """A piece of the program as it is written, on one line."""
        return written(self.pou.source.text, node)

    def below(self, node: tree.Node) -> Nodes:
        """The nodes directly below one; of a call that means an operator, those of the operator."""
        kind = type(node)
        if kind in _MEANING_OTHERS and (meaning := self.facts.rewritten.get(node)) is not None:  # type: ignore[call-overload]
            return (meaning,)
        if kind is tree.StructInit and (assignment := self.facts.assignments.get(node)) is not None:  # type: ignore[call-overload]
            return *assignment.targets, assignment.value
        return _BELOW[kind](node)

    @cached_property
    def nodes(self) -> list[tree.Node]:
        """All statements and expressions, each once, in the order of the text."""
        found: list[tree.Node] = []
        todo: list[tree.Node | None] = [*self.pou.tree.body[::-1]]
        while todo:
            node = todo.pop()
            if node is not None:
                found.append(node)
                if type(node) not in _LEAVES:
                    todo += self.below(node)[::-1]
        return found

    def numbered(self) -> Iterator[tuple[tree.Call, Address]]:
        """Timers and counters of rungs that have a number, each with its completion flag.

        An interlock makes several calls of one instruction in the same place; they count as one."""
        seen: set[int] = set()
        for node in [each for each in self.nodes if isinstance(each, tree.Call)]:
            if isinstance(node.callee, tree.NameRef) and node.callee.text.startswith("$") and node.start not in seen:
                seen.add(node.start)
                for argument in node.arguments:
                    flag = self.facts.directs.get(argument.value) if argument.value is not None else None
                    if argument.name is None and flag is not None and flag.area in ("TF", "CNF"):
                        yield node, flag

    def constant(self, expr: tree.Expr) -> Any:
        """The value of a constant expression without names; None for others, since a named constant may be changed."""
        value = self.facts.constants.get(expr)
        if value is None:
            return None
        todo: list[tree.Node | None] = [expr]
        while todo:
            node = todo.pop()
            if isinstance(node, tree.NameRef):
                return None
            if node is not None:
                todo.extend(self.below(node))
        return value


def _branches(node: tree.If) -> Nodes:
    return *(part for condition, block in node.branches for part in (condition, *block)), *(node.otherwise or ())


def _labels(node: tree.Case) -> Nodes:
    return node.selector, *(part for branch in node.branches for part in branch.body), *(node.otherwise or ())


def _nothing(node: tree.Node) -> Nodes:
    return ()


_BELOW: dict[type, Callable[[Any], Nodes]] = {
    tree.Assign: lambda n: (*n.targets, n.value),
    tree.CallStatement: lambda n: (n.call,),
    tree.If: _branches,
    tree.Case: _labels,
    tree.For: lambda n: (n.variable, n.first, n.last, n.step, *n.body),
    tree.While: lambda n: (n.condition, *n.body),
    tree.Repeat: lambda n: (*n.body, n.until),
    tree.Try: lambda n: (*n.body, *(() if n.code is None else (n.code,)), *n.handler, *(n.final or ())),
    tree.Return: lambda n: (n.value,),
    tree.Exit: _nothing, tree.Continue: _nothing, tree.Empty: _nothing, tree.RefusedStatement: _nothing,
    tree.Binary: lambda n: (n.left, n.right),
    tree.Unary: lambda n: (n.operand,),
    tree.Call: lambda n: (n.callee, *(argument.value for argument in n.arguments)),
    tree.Member: lambda n: (n.of,),
    tree.Part: lambda n: (n.of,),
    tree.Index: lambda n: (n.of, *n.subscripts),
    tree.Deref: lambda n: (n.of,),
    tree.ArrayInit: lambda n: tuple(value for _, value in n.items),
    tree.StructInit: lambda n: tuple(value for _, value in n.fields),
    tree.Literal: _nothing, tree.EnumLiteral: _nothing, tree.NullLiteral: _nothing, tree.TypeOperand: _nothing,
    tree.NameRef: _nothing,
    tree.Direct: _nothing,
    il.InstructionList: lambda n: n.body, il.CallsInRow: lambda n: (n.before, *n.calls),
    ladder.Ladder: lambda n: n.body, ladder.Rung: lambda n: n.body, sfc.Sfc: lambda n: n.body,
    ladder.Edge: lambda n: (n.of, n.memory), ladder.Element: lambda n: (n.value,),
    ladder.Memory: lambda n: (n.address,), ladder.Words: lambda n: (n.of,),
    ladder.Contents: lambda n: (n.of,),
}
"""For each kind of node of a body the nodes directly below it, in the order of the text."""
_LEAVES = frozenset(kind for kind, below in _BELOW.items() if below is _nothing)
_MEANING_OTHERS = frozenset((tree.Call, ladder.Contents))
