"""The report of a check: its diagnostics as they are found."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax import tree


def with_article(kind: str) -> str:
    """The kind of a POU as messages say it: `a PROGRAM`, `an INTERFACE`."""
    return f"{'an' if kind == 'INTERFACE' else 'a'} {kind}"


class Report:
    """Collects diagnostics; one code is reported once for one place."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._seen: set[tuple[str, Source, int]] = set()

    def add(self, code: str, source: Source, node: tree.Node, message: str, hint: str = "",
            related: tuple[Source, int, str] | None = None) -> None:
        source = source.whole
        related = related and (related[0].whole, *related[1:])
        key = (code, source, node.start)
        if key not in self._seen:
            self._seen.add(key)
            self.diagnostics.append(Diagnostic(code, source, node.start, node.end, message, hint, related))

    def refuse(self, source: Source, node: tree.Refused | tree.RefusedStatement) -> None:
        """Report why something that was read is not executed."""
        self.add("S0901", source, node, f"{node.what} is understood but not executed by this version")
