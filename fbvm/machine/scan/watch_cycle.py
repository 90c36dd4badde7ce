"""The watch cycle time of a CPU unit: a scan that takes longer is a fatal error (W394, PLC Setup; error 809F).

It is a matter of real time.  `run/watchdog.py` measures it and allows a scan no more steps, with which it ends; here that becomes
the trap R0112 and what the program's memory shows of it."""

from __future__ import annotations

from fbvm.base.areas import BUDGET
from fbvm.base.memory import Memory
from fbvm.engine.trap import Trap, too_long
from fbvm.machine.scan.clock_words import CYCLE_TIME, MAX_CYCLE_TIME, TENTH_MS_NS

SHORTEST_NS, LONGEST_NS, USUAL_NS = 10_000_000, 40_000_000_000, 1_000_000_000
"""The least and the greatest time that can be set, and the one that is set unless somebody sets another."""
WATCH = "R0112"
"""The code of the trap."""
ERROR_CODE, CYCLE_TIME_TOO_LONG = 400, 0x809F
"""A400: The code of the most serious error, here 16#809F."""
TOO_LONG_FLAG = (401, 8)
"""A401.08: ON if a cycle took longer than the watch cycle time."""


class WatchCycle:
    """The watch cycle time of one PLC, and what a scan that exceeds it leaves in the memory."""

    def __init__(self, memory: Memory) -> None:
        self._a, self._system = memory.words("A"), memory.views["i64"]
        self._time_ns = USUAL_NS

    @property
    def time_ns(self) -> int:
        """The watch cycle time.  Setting one that a CPU unit does not take raises ValueError."""
        return self._time_ns

    @time_ns.setter
    def time_ns(self, time_ns: int) -> None:
        if not SHORTEST_NS <= time_ns <= LONGEST_NS:
            raise ValueError(f"a watch cycle time is 10 ms to 40 s; {time_ns / 1e6:g} ms is not")
        self._time_ns = time_ns

    def ended(self, trap: Trap | None, budget: int) -> tuple[int, int] | None:
        """For a scan that has ended with R0112 the steps that it had charged of its budget, and the watch cycle time in ns."""
        return (budget - self._system[BUDGET // 8], self._time_ns) if trap and trap.code == WATCH else None

    def clear(self) -> None:
        """Clears flag and error code, as a start does."""
        a, (word, bit) = self._a, TOO_LONG_FLAG
        if a[word] & 1 << bit:
            a[word] &= ~(1 << bit)
            a[ERROR_CODE] = 0

    def judged(self, trap: Trap | None) -> Trap | None:
        """The trap of a scan: R0104 while steps are left of the budget is R0112, the watch cycle time.

        With that, flag and error code are set, and the cycle time words show the watch cycle time."""
        if trap is None or trap.code != "R0104" or self._system[BUDGET // 8] < 0:
            return trap
        a, (word, bit) = self._a, TOO_LONG_FLAG
        a[word] |= 1 << bit
        a[ERROR_CODE] = CYCLE_TIME_TOO_LONG
        tenths = self._time_ns // TENTH_MS_NS
        longest = max(tenths, a[MAX_CYCLE_TIME] | a[MAX_CYCLE_TIME + 1] << 16)
        a[CYCLE_TIME], a[CYCLE_TIME + 1] = tenths & 0xFFFF, tenths >> 16
        a[MAX_CYCLE_TIME], a[MAX_CYCLE_TIME + 1] = longest & 0xFFFF, longest >> 16
        return too_long(trap, self._time_ns)
