"""The words of one ETN21 in one memory: views of them that are looked up once, not in each refresh."""

from __future__ import annotations

from typing import Any

from fbvm.units import etn21_map as at
from fbvm.units.unit import AreaMemory


class Words:
    """What a unit with this layout sees of a memory.  A copy of a unit shares it, as it shares the memory."""

    __slots__ = ("a", "cio", "d", "memory", "status", "switches")

    def __init__(self, layout: at.Layout, memory: AreaMemory) -> None:
        self.memory = memory
        self.cio, self.d, self.a = memory.words("CIO"), memory.words("D"), memory.words("A")
        n = layout.n
        self.status = self.cio[n + at.SERVICE_STATUS : n + at.SWITCHES]
        """n+17 and n+18."""
        self.switches = self.cio[n + at.SWITCHES : n + at.FINS_TCP_STATUS].cast("B").cast("Q")
        """n+19..n+22 as one number."""

    def __deepcopy__(self, known: dict[int, Any]) -> Words:
        return self
