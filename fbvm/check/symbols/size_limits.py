"""Size limits of what a program declares, checked before any bytes are made of it."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree

MAX_SIZE = 128 << 20
"""Largest variable, structure or instance in bytes."""
MAX_TOGETHER = 1 << 30
"""Bytes that all declarations of a program may take; those of an array in a block are counted with both."""


class SizeLimits:
    """Counts the bytes that the declarations of one program take."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._reserved = 0

    def allows(self, size: int, what: str, source: Source, node: tree.Node) -> bool:
        """True if one object may have `size` bytes; else a diagnostic that begins with `what`, such as "the array takes"."""
        if size > MAX_SIZE:
            self._report.add("S0603", source, node, f"{what} more than {MAX_SIZE >> 20} MiB")
        return size <= MAX_SIZE

    def reserve(self, size: int, what: str, source: Source, node: tree.Node) -> bool:
        """Count `size` bytes more; False if one object or all together become too large.

        That all together are too large is reported once."""
        if not self.allows(size, what, source, node):
            return False
        full = self._reserved > MAX_TOGETHER
        self._reserved += size
        if self._reserved > MAX_TOGETHER and not full:
            self._report.add("S0603", source, node, "there is no room for all variables together")
        return self._reserved <= MAX_TOGETHER
