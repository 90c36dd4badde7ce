"""The words and bits in which a CPU unit tells its program about time: first cycle, clock pulses, cycle times.

They are written at the start of a scan from the scan's time alone, so that a program and a chart see the same.  Addresses and
units are from W393 and W394 (auxiliary area, condition flags); what is assumed says so."""

from __future__ import annotations

from array import array
from datetime import datetime, timedelta
from functools import lru_cache

from fbvm.base.areas import AREAS, CLOCK, DATE_SECOND
from fbvm.base.memory import Memory
from fbvm.engine.native.scans.code import MOST_CYCLE, ClockWordTable

FIRST_CYCLE = (200, 11)
"""A200.11: ON in the first cycle after a change to RUN."""
FIRST_TASK_CYCLE = (200, 15)
"""A200.15: ON while a task is executed for the first time after a change to RUN."""
MAX_CYCLE_TIME = 262
"""A262 and A263, low word first: longest cycle time, 0.1 ms."""
CYCLE_TIME = 264
"""A264 and A265, low word first: cycle time of the cycle before, 0.1 ms."""
TENTH_MS_NS = 100_000
FREE_COUNTERS = ((0, 10_000_000), (1, 100_000_000))
"""A0 counts 10 ms, A1 100 ms, both modulo 65536 (newer CPU units; assumed for all)."""

DATE = 351
"""A351 to A354, in BCD: minute and second, day and hour, year and month, day of the week with Sunday as 0 (CP1H operation
6-8 p385).  They are written when a second has passed."""
EPOCH = datetime(2000, 1, 1)
"""From when on the PLC's clock counts."""
SECOND_NS = 1_000_000_000

ALWAYS_ON = 113
PERIODS_NS = {100: 100_000_000, 101: 200_000_000, 102: 1_000_000_000, 103: 20_000_000, 104: 60_000_000_000, ALWAYS_ON: 1}
"""CF number and period: half of it OFF, then half of it ON (which half comes first is assumed)."""

IOM_HOLD = (500, 12)
"""A500.12: CIO, W and timers keep their contents over a change of mode."""

Periods = list[tuple[int, int, int]]
"""Clock pulses of one byte: the bit as a mask, its period in ns, and half of that."""
SLOT_NS = 10_000_000
"""Within so many nanoseconds, from a multiple of them on, no clock pulse and no free counter changes."""


class ClockWords:
    """Writes these words and bits of one memory."""

    def __init__(self, memory: Memory) -> None:
        self._a = memory.words("A")
        self._system = memory.views["i64"]
        self._bytes = memory.u8
        self._slot = -1
        self._counters: list[tuple[int, int]] = []
        self._pulses: list[tuple[int, int, int]] = []

    def update(self, now_ns: int, cycle_time_ns: int, first: bool) -> None:
        """Writes all of them for the scan at `now_ns`.

        `cycle_time_ns` is the length of the cycle before, 0 if there was none; `first` is True for the first scan in RUN."""
        a, on = self._a, self._bytes
        word, bit = FIRST_CYCLE
        a[word] = a[word] & ~(1 << bit | 1 << FIRST_TASK_CYCLE[1]) | first << bit
        tenths = min(cycle_time_ns // TENTH_MS_NS, MOST_CYCLE)
        longest = 0 if first else a[MAX_CYCLE_TIME] | a[MAX_CYCLE_TIME + 1] << 16
        a[CYCLE_TIME], a[CYCLE_TIME + 1] = tenths & 0xFFFF, tenths >> 16
        longest = max(tenths, longest)
        a[MAX_CYCLE_TIME], a[MAX_CYCLE_TIME + 1] = longest & 0xFFFF, longest >> 16
        if now_ns // SLOT_NS != self._slot:
            self._enter(now_ns)
        second = max(self._system[CLOCK // 8] + now_ns, 0) // SECOND_NS + 1
        if second != self._system[DATE_SECOND // 8]:
            self._system[DATE_SECOND // 8] = second
            a[DATE:DATE + 4] = _date_words(second - 1)
        for at, count in self._counters:
            a[at] = count
        for at, keep, pulses in self._pulses:
            on[at] = on[at] & keep | pulses

    def _enter(self, now_ns: int) -> None:
        """Works out what counters and pulses are in the whole slot of 10 ms to which `now_ns` belongs."""
        self._slot = now_ns // SLOT_NS
        self._counters = [(at, now_ns // step_ns & 0xFFFF) for at, step_ns in FREE_COUNTERS]
        self._pulses = []
        for at, keep, periods in _ROWS:
            pulses = 0
            for bit, period_ns, half_ns in periods:
                if now_ns % period_ns >= half_ns:
                    pulses |= bit
            self._pulses.append((at, keep, pulses))

    def begin_task(self, first: bool) -> None:
        """Writes A200.15 at the start of a task: ON if the task is executed for the first time."""
        word, bit = FIRST_TASK_CYCLE
        self._a[word] = self._a[word] & ~(1 << bit) | first << bit

    @property
    def io_memory_held(self) -> bool:
        """True if A500.12 is ON."""
        word, bit = IOM_HOLD
        return bool(self._a[word] >> bit & 1)


@lru_cache(maxsize=16)
def _date_words(second: int) -> array[int]:
    """The four words of a second since 2000-01-01 00:00:00.  Many PLCs have the same time."""
    now = EPOCH + timedelta(seconds=second)
    pairs = (now.minute, now.second), (now.day, now.hour), (now.year % 100, now.month), (0, now.isoweekday() % 7)
    return array("H", (bcd(high) << 8 | bcd(low) for high, low in pairs))


def bcd(value: int) -> int:
    """Two decimal digits in BCD."""
    return value // 10 << 4 | value % 10


def _clock_words() -> ClockWordTable:
    """What `ClockWords.update` writes in a scan that is not the first, as data for machine code."""
    a = AREAS["A"].offset
    word, bit = FIRST_CYCLE
    assert FIRST_TASK_CYCLE[0] == word
    return ClockWordTable(
        cleared=((a + 2 * word, 0xFFFF & ~(1 << bit | 1 << FIRST_TASK_CYCLE[1])),),
        cycle_time=(a + 2 * CYCLE_TIME, a + 2 * MAX_CYCLE_TIME, TENTH_MS_NS),
        counters=tuple((a + 2 * at, unit_ns) for at, unit_ns in FREE_COUNTERS),
        pulses=tuple((at, keep, tuple(periods)) for at, keep, periods in _ROWS),
        date=a + 2 * DATE,
    )  # fmt: skip


def _masks(byte: int) -> tuple[int, Periods]:
    """For a byte of CF the mask of the bits that are no clock pulses, and the clock pulses."""
    here = {1 << number % 8: period_ns for number, period_ns in PERIODS_NS.items() if number // 8 == byte}
    return 0xFF & ~sum(here), [(bit, period_ns, period_ns // 2) for bit, period_ns in here.items()]


_ROWS = [(AREAS["CF"].offset + byte, *_masks(byte)) for byte in sorted({number // 8 for number in PERIODS_NS})]
CLOCK_WORDS = _clock_words()
