"""How much memory the variables of a program may take: said before bytes are made of them."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.check.symbols.facts import Report
from fbvm.syntax import tree

MAX_SIZE = 64 << 20
"""Largest variable, structure or instance in bytes."""
MAX_TOGETHER = 256 << 20
"""Bytes that are laid out of all declarations; those of an array in a block are counted with both."""


class Room:
    """Counts what the declarations of one program take."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._together = 0

    def fits(self, size: int, what: str, source: Source, node: tree.Node) -> bool:
        """Whether anything may be that large; else a diagnostic."""
        if size > MAX_SIZE:
            self._report.add("S0603", source, node, f"{what} more than {MAX_SIZE >> 20} MiB")
        return size <= MAX_SIZE

    def has(self, size: int, what: str, source: Source, node: tree.Node) -> bool:
        """Whether there is room for so many bytes more, which it then takes; else a diagnostic, the last one once."""
        if not self.fits(size, what, source, node):
            return False
        full = self._together > MAX_TOGETHER
        self._together += size
        if self._together > MAX_TOGETHER and not full:
            self._report.add("S0603", source, node, "there is no room for all variables together")
        return self._together <= MAX_TOGETHER
