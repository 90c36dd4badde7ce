"""Chains of declarations that need one another: one that is too long for the stack is reported, and resolved no further."""

from __future__ import annotations

from types import TracebackType

from fbvm.base.diagnostics import Source
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree


class Chain:
    """What is being resolved, one declaration because another needs it.

    Where Python's limit of recursion is met, the outermost declaration is reported (S0106), and `too_long` is True from then on:
    what is not resolved by then stays so, without a diagnostic of its own."""

    def __init__(self, report: Report) -> None:
        self.too_long = False
        self.begun = False
        self._report = report

    def link(self, source: Source, node: tree.Node, name: str) -> Link:
        """A context inside of which the declaration called `name` at `node` is resolved."""
        return Link(self, source, node, name)

    def broke(self, link: Link) -> None:
        """Report the declaration at which a chain began that is too long."""
        self.too_long = True
        self._report.add("S0106", link.source, link.node,
                         f"{link.name} needs a declaration, which needs another one, and so on: this chain is too long",
                         "let fewer of them need one another, or declare first what others need")


class Link:
    """One declaration of a chain, while it is resolved."""

    def __init__(self, chain: Chain, source: Source, node: tree.Node, name: str) -> None:
        self.chain, self.source, self.node, self.name = chain, source, node, name
        self._is_first = False

    def __enter__(self) -> None:
        self._is_first, self.chain.begun = not self.chain.begun, True

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> bool:
        if not self._is_first:
            return False
        self.chain.begun = False
        if kind is None or not issubclass(kind, RecursionError):
            return False
        self.chain.broke(self)
        return True
