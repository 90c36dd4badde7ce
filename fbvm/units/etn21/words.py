"""The words of one ETN21 in one memory: views of them that are looked up once, not in each refresh."""

from __future__ import annotations

from fbvm.units.contract import AreaMemory
from fbvm.units.etn21 import map as at


def numbers(n: memoryview) -> tuple[memoryview, memoryview]:
    """Two views of 64 bits into `n`, the unit's CIO words: the request switches n+19..n+22, and n+17..n+20, which begin with
    the unit's service status and error status."""
    switches, status = n[at.SWITCHES : at.SWITCHES + 4], n[at.SERVICE_STATUS : at.SERVICE_STATUS + 4]
    return switches.cast("B").cast("Q"), status.cast("B").cast("Q")


class Words:
    """Views of the words that a unit with this layout exchanges with a memory: `n` and `m` from n and from m on, `initializing`
    and `restart` in A, `switches` and `status` as `numbers` has them."""

    __slots__ = ("initializing", "m", "memory", "n", "restart", "status", "switches")

    def __init__(self, layout: at.Layout, memory: AreaMemory) -> None:
        self.memory = memory
        cio, a, n = memory.words("CIO"), memory.words("A"), layout.n
        self.n = cio[n : n + at.CIO_WORDS]
        self.m = memory.words("D")[layout.m : layout.m + at.D_WORDS]
        self.initializing, self.restart = a[at.INITIALIZING : at.INITIALIZING + 1], a[at.RESTART : at.RESTART + 1]
        self.switches, self.status = numbers(self.n)

    @property
    def are_blank(self) -> bool:
        """True if nobody has used the unit: its own words, switches among them, are 0."""
        return not any(self.n) and not any(self.m[1 : at.PARAMETERS])
