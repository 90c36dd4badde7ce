"""The words and bits in which a CPU unit tells the program about time: first cycle, clock pulses, cycle times.

Written at the start of a scan from the scan's time alone, so that a program and a chart see the same.
From W393/W394 (auxiliary area and condition flags), [K] where not noted.
"""

from __future__ import annotations

from fbvm.base.areas import AREAS
from fbvm.base.memory import Memory

FIRST_CYCLE = (200, 11)
"""A200.11: ON in the first cycle after a change to RUN."""
MAX_CYCLE_TIME = 262
"""A262 and A263, low word first: longest cycle time, 0.1 ms."""
CYCLE_TIME = 264
"""A264 and A265, low word first: cycle time of the cycle before, 0.1 ms."""
TENTH_MS_NS = 100_000
FREE_COUNTERS = ((0, 10_000_000), (1, 100_000_000))
"""A0 counts 10 ms, A1 100 ms, both modulo 65536 (newer CPU units; assumed for all)."""

ALWAYS_ON = 113
CLOCK_PULSES = ((100, 100_000_000), (101, 200_000_000), (102, 1_000_000_000), (103, 20_000_000), (104, 60_000_000_000))
"""CF number and period: half of it OFF, then half of it ON (which half comes first is assumed)."""

IOM_HOLD = (500, 12)
"""A500.12: CIO, W and timers keep their contents over a change of mode."""


def update(memory: Memory, now_ns: int, cycle_time_ns: int, first: bool) -> None:
    """Writes all of them for the scan at `now_ns`; `cycle_time_ns` is the length of the cycle before, 0 at first."""
    a = memory.words("A")
    word, bit = FIRST_CYCLE
    a[word] = a[word] & ~(1 << bit) | first << bit
    tenths = min(cycle_time_ns // TENTH_MS_NS, 0xFFFFFFFF)
    longest = 0 if first else a[MAX_CYCLE_TIME] | a[MAX_CYCLE_TIME + 1] << 16
    for at, value in ((CYCLE_TIME, tenths), (MAX_CYCLE_TIME, max(tenths, longest))):
        a[at], a[at + 1] = value & 0xFFFF, value >> 16
    for at, step_ns in FREE_COUNTERS:
        a[at] = now_ns // step_ns & 0xFFFF
    _set(memory, ALWAYS_ON, True)
    for number, period_ns in CLOCK_PULSES:
        _set(memory, number, now_ns % period_ns >= period_ns // 2)


def io_memory_held(memory: Memory) -> bool:
    """True if A500.12 is ON."""
    return bool(memory.words("A")[IOM_HOLD[0]] >> IOM_HOLD[1] & 1)


def _set(memory: Memory, number: int, on: bool) -> None:
    memory.write(AREAS["CF"].offset + number // 8, "b", on, number % 8)
