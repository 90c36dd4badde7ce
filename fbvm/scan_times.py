"""How long scans took by the host's clock: the measure of whether anything made a PLC wait."""

from __future__ import annotations

DIGIT_BITS = 5
"""Bits that a time keeps when it is sorted in: a share is true to 3 %."""


class ScanTimes:
    """Durations of scans as `fbvm.run` measured them; empty for a PLC that was only told the time."""

    def __init__(self) -> None:
        self.count = 0
        self.overruns = 0
        """Scans that took longer than the cycle."""
        self.longest_ns = 0
        self.longest_scan = 0
        """Number of the longest one."""
        self._total_ns = 0
        self._sorted: dict[int, int] = {}
        """How many there were, by a number that grows with the duration: how many bits were dropped, and those left."""

    def note(self, scan: int, duration_ns: int, cycle_ns: int) -> None:
        """Take one scan in."""
        self.count += 1
        self._total_ns += duration_ns
        self.overruns += duration_ns > cycle_ns
        if duration_ns > self.longest_ns:
            self.longest_ns, self.longest_scan = duration_ns, scan
        dropped = max(duration_ns.bit_length() - DIGIT_BITS, 0)
        kind = dropped << DIGIT_BITS | duration_ns >> dropped
        self._sorted[kind] = self._sorted.get(kind, 0) + 1

    @property
    def mean_ns(self) -> int:
        """The average."""
        return self._total_ns // self.count if self.count else 0

    def within_ns(self, share: float) -> int:
        """The time that this share of all scans (0.99: 99 of 100) did not exceed, to 3 %."""
        missing = share * self.count
        for kind, times in sorted(self._sorted.items()):
            missing -= times
            if missing <= 0:
                dropped, digits = kind >> DIGIT_BITS, kind & (1 << DIGIT_BITS) - 1
                return min((digits + 1 << dropped) - 1, self.longest_ns)
        return self.longest_ns

    def __str__(self) -> str:
        if not self.count:
            return "no scan was measured"
        text = (f"scan time: {_ms(self.mean_ns)} on average, 99 % within {_ms(self.within_ns(0.99))}, "
                f"longest {_ms(self.longest_ns)} (scan {self.longest_scan})")  # fmt: skip
        return text + (f"; {self.overruns} longer than the cycle" if self.overruns else "")

    def as_dict(self) -> dict[str, int]:
        """For scripts, in nanoseconds."""
        return {
            "mean_ns": self.mean_ns, "within_99_percent_ns": self.within_ns(0.99), "longest_ns": self.longest_ns,
            "longest_scan": self.longest_scan, "overruns": self.overruns,
        }  # fmt: skip


def _ms(time_ns: int) -> str:
    return f"{time_ns / 1e6:.3g} ms"
