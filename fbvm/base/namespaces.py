"""Where a text stands among namespaces: what it may name without writing the namespace in front (IEC 61131-3 ed. 3, 6.9)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Surroundings:
    """One NAMESPACE, or the whole of a text, or a POU with a USING of its own, and what is around it."""

    space: str = ""
    """The full name of the namespace as it is written, such as `Plant.Pumps`; "" for what stands in none."""
    usings: tuple[str, ...] = ()
    """The names behind USING, as they are written."""
    outer: Surroundings | None = None

    def levels(self) -> Iterator[Surroundings]:
        """This one and those around it, the innermost first; the last one has no namespace."""
        level: Surroundings | None = self
        while level is not None:
            yield level
            level = level.outer

    def within(self, name: str, usings: tuple[str, ...]) -> Surroundings:
        """Those inside a NAMESPACE of this name; of `A.B` also those of A are seen."""
        level = self
        for part in name.split("."):
            level = Surroundings(f"{level.space}.{part}".lstrip("."), (), level)
        return Surroundings(level.space, usings, level.outer)
