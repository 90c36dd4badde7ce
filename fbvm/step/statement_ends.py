"""Where statements end in their sources, which an image does not say: found by reading the source once."""

from __future__ import annotations

from collections.abc import Mapping

from fbvm.base.diagnostics import Source
from fbvm.code.image import Site
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.node import Node, names_of
from fbvm.syntax.tree.nodes import Statement

Place = tuple[int, int]


class StatementEnds:
    """The ends of the statements of some sources, whose texts are given by name."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        self._texts = texts
        self._ends: dict[str, dict[Place, Place]] = {}

    def end(self, site: Site) -> Place | None:
        """Line and column behind the statement that begins at a site; None if that is not known."""
        if site.file not in self._ends:
            self._ends[site.file] = self._read(site.file)
        return self._ends[site.file].get((site.line, site.column))

    def _read(self, name: str) -> dict[Place, Place]:
        if name not in self._texts:
            return {}
        source = Source(name, self._texts[name])
        found: dict[Place, Place] = {}
        waiting: list[object] = [parse(source)[0]]
        while waiting:
            part = waiting.pop()
            if isinstance(part, tuple | list):
                waiting.extend(part)
            elif isinstance(part, Node):
                if isinstance(part, Statement):
                    found[source.place(part.start)] = source.place(part.end)
                waiting.extend(getattr(part, name) for name in names_of(part) if name not in ("start", "end"))
        return found
