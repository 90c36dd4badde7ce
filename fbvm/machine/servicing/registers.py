"""What a CPU unit keeps for peripheral servicing, in words of its system page: clock, access right, cycle times.

They lie in the memory of the PLC, so that snapshots, recordings and journals have them."""

from __future__ import annotations

from fbvm.base.areas import ACCESS_RIGHT, CLOCK, CYCLE_TIMES, OPERATING
from fbvm.base.memory import Memory
from fbvm.wire.fins.frames import Address

LAST_CYCLES = 8
"""As many cycle times make the average, W342 5-3 p195."""
_HELD = 1 << 24
_FIRST, _BEHIND = CLOCK, CYCLE_TIMES + 8 * (3 + LAST_CYCLES)


class Registers:
    """The registers of one memory."""

    def __init__(self, memory: Memory) -> None:
        self._memory, self._words = memory, memory.views["i64"]

    def kept(self) -> tuple[int, bytes]:
        """Offset and bytes of what a restart does not clear: clock, mode and access right."""
        return _FIRST, bytes(self._memory.u8[_FIRST:CYCLE_TIMES])

    @property
    def clock_ns(self) -> int:
        """The date at power-on, in ns since 2000-01-01 00:00."""
        return int(self._words[CLOCK // 8])

    @clock_ns.setter
    def clock_ns(self, date_ns: int) -> None:
        self._words[CLOCK // 8] = date_ns

    @property
    def is_monitor(self) -> bool:
        """True in MONITOR mode, False in RUN mode; of no meaning in PROGRAM mode."""
        return not self._words[OPERATING // 8]

    @is_monitor.setter
    def is_monitor(self, monitor: bool) -> None:
        self._words[OPERATING // 8] = not monitor

    @property
    def right(self) -> Address | None:
        """Who has the access right."""
        held = int(self._words[ACCESS_RIGHT // 8])
        return Address(held & 0xFF, held >> 8 & 0xFF, held >> 16 & 0xFF) if held & _HELD else None

    @right.setter
    def right(self, holder: Address | None) -> None:
        self._words[ACCESS_RIGHT // 8] = (
            _HELD | holder.unit << 16 | holder.node << 8 | holder.network if holder else 0)

    def measure(self, cycle_time_ns: int) -> None:
        """Adds the time of a cycle."""
        words, first = self._words, CYCLE_TIMES // 8
        count = words[first]
        words[first + 1] = min(words[first + 1], cycle_time_ns) if count else cycle_time_ns
        words[first + 2] = max(words[first + 2], cycle_time_ns)
        words[first + 3 + count % LAST_CYCLES] = cycle_time_ns
        words[first] = count + 1

    def forget_cycle_times(self) -> None:
        """Begins to measure anew."""
        self._memory.u8[CYCLE_TIMES:_BEHIND] = bytes(_BEHIND - CYCLE_TIMES)

    @property
    def cycle_times_ns(self) -> tuple[int, int, int]:
        """Average of the last eight, longest and least cycle time; 0 if none was measured."""
        first = CYCLE_TIMES // 8
        count = min(self._words[first], LAST_CYCLES)
        last = self._words[first + 3 : first + 3 + count]
        return (sum(last) // count if count else 0), int(self._words[first + 2]), int(self._words[first + 1])
