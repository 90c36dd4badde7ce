"""The words of one ETN21 in one memory: views of them that are looked up once, not in each refresh."""

from __future__ import annotations

from typing import Any

from fbvm.units import etn21_map as at
from fbvm.units.unit import AreaMemory


class Words:
    """What a unit with this layout sees of a memory.  A copy of a unit shares it, as it shares the memory."""

    __slots__ = ("a", "cio", "d", "memory", "switches")

    def __init__(self, layout: at.Layout, memory: AreaMemory) -> None:
        self.memory = memory
        self.cio, self.d, self.a = memory.words("CIO"), memory.words("D"), memory.words("A")
        self.switches = self.cio[layout.n + at.SWITCHES : layout.n + at.FINS_TCP_STATUS]
        """n+19..n+22."""

    def __deepcopy__(self, known: dict[int, Any]) -> Words:
        return self
