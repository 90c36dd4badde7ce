"""The report of a check: its diagnostics as they are found."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax import tree


class Report:
    """Collects diagnostics; one code is reported once for one place."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._seen: set[tuple[str, Source, int]] = set()

    def add(self, code: str, source: Source, node: tree.Node, message: str, hint: str = "",
            related: tuple[Source, int, str] | None = None) -> None:
        key = (code, source, node.start)
        if key not in self._seen:
            self._seen.add(key)
            self.diagnostics.append(Diagnostic(code, source, node.start, node.end, message, hint, related))

    def refuse(self, source: Source, node: tree.Refused | tree.RefusedStatement) -> None:
        """Report why something that was read is not executed."""
        why = "is object-oriented text, which fbvm does not execute" if node.code == "S0902" else \
            "is understood but not executed by this version"
        self.add(node.code, source, node, f"{node.what} {why}")
