"""Limits of what a program declares, checked before any bytes are made of it: how large, and how deep in one another."""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.base.diagnostics import Source
from fbvm.base.types import DEEPEST_TYPE, Type
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree

MAX_SIZE, LARGE_SIZE = 64 << 20, 128 << 20
"""Largest variable, structure or instance in bytes; where the dialect has `large_memory`."""
MAX_TOGETHER, LARGE_TOGETHER = 256 << 20, 1 << 30
"""Bytes that all declarations of a program may take; those of an array in a block are counted with both."""


class SizeLimits:
    """Counts the bytes that the declarations of one program take, and how deep their types are."""

    def __init__(self, report: Report, large: bool) -> None:
        self._report = report
        self._size, self._together = (LARGE_SIZE, LARGE_TOGETHER) if large else (MAX_SIZE, MAX_TOGETHER)
        self._reserved = 0
        self._depths: dict[int, tuple[Type, int]] = {}
        """By the identity of a type that holds others how many are in one another; the type is kept, so that no other gets it."""

    def allows(self, size: int, what: str, source: Source, node: tree.Node) -> bool:
        """True if one object may have `size` bytes; else a diagnostic that begins with `what`, such as "the array takes"."""
        if size > self._size:
            self._report.add("S0603", source, node, f"{what} more than {self._size >> 20} MiB")
        return size <= self._size

    def reserve(self, size: int, what: str, source: Source, node: tree.Node) -> bool:
        """Count `size` bytes more; False if one object or all together become too large.

        That all together are too large is reported once."""
        if not self.allows(size, what, source, node):
            return False
        full = self._reserved > self._together
        self._reserved += size
        if self._reserved > self._together and not full:
            self._report.add("S0603", source, node, "there is no room for all variables together")
        return self._reserved <= self._together

    def nests(self, kind: Type, parts: Iterable[Type], what: str, source: Source, node: tree.Node) -> bool:
        """True if a new type with these parts is not too deep, which is noted; else a diagnostic that begins with `what`."""
        depth = 1 + max((self._depths[id(part)][1] for part in parts if id(part) in self._depths), default=0)
        if depth > DEEPEST_TYPE:
            self._report.add("S0106", source, node,
                             f"{what} instances, structures, arrays or references in one another more than {DEEPEST_TYPE} deep",
                             "let a reference lead to the inner ones, or declare them beside")
            return False
        self._depths[id(kind)] = kind, depth
        return True
