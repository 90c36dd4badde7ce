"""Statistics of how long scans took and how late they began, by the host's clock."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from operator import sub

from fbvm.base.areas import NEVER

SIZES_NS: tuple[int, ...] = (*range(32), *(digits << zeros for zeros in range(1, 60) for digits in range(16, 32)))
"""Lower bounds of the bins of the histogram, in ns: a time is sorted in by its five highest bits, so a percentile is true to
3 %."""
RECENT = 1024
"""So many scans of bursts wait to be sorted into the histogram together, which takes a fifth of the time."""


class Times:
    """A histogram of times in ns, one a scan, and the longest of them.

    `limit_ns` is what `beyond` counts.

    >>> times = Times(limit_ns=1000)
    >>> for scan, time_ns in enumerate((500, 700, 900, 4000)):
    ...     times.note(scan, time_ns)
    >>> times.count, times.beyond, times.longest_ns, times.longest_scan, times.mean_ns
    (4, 1, 4000, 3, 1525)
    >>> times.within_ns(0.75)
    927
    """

    def __init__(self, limit_ns: int = NEVER) -> None:
        self._limit_ns = limit_ns
        self._count = self._beyond = self._total_ns = 0
        self._longest_ns = self._longest_scan = 0
        self._sorted: dict[int, int] = {}
        """How many there were of each size."""
        self._recent_ns: list[int] = []
        """Of scans that followed one upon the other, not sorted in yet."""
        self._recent_scan = 0
        """Number of the first of them."""

    @property
    def count(self) -> int:
        """How many there are."""
        self._settle()
        return self._count

    @property
    def beyond(self) -> int:
        """How many were longer than the limit."""
        self._settle()
        return self._beyond

    @property
    def longest_ns(self) -> int:
        """The longest one."""
        self._settle()
        return self._longest_ns

    @property
    def longest_scan(self) -> int:
        """Number of the longest one."""
        self._settle()
        return self._longest_scan

    @property
    def mean_ns(self) -> int:
        """The average."""
        return self._total_ns // self._count if self.count else 0

    def note(self, scan: int, time_ns: int, times: int = 1) -> None:
        """Adds the time of a scan; or of `times` scans from this one on, which took `time_ns` each on average."""
        self._settle()
        self._count += times
        self._total_ns += time_ns * times
        if time_ns > self._longest_ns:
            self._longest_ns, self._longest_scan = time_ns, scan
        if time_ns > self._limit_ns:
            self._beyond += times
        size = bisect_right(SIZES_NS, time_ns)
        self._sorted[size] = self._sorted.get(size, 0) + times

    def note_burst(self, scan: int, began_ns: list[int], together_ns: int) -> None:
        """Adds the times of a burst that began with scan number `scan`: when each scan began, and what all took together."""
        if scan != self._recent_scan + len(self._recent_ns) or len(self._recent_ns) >= RECENT:
            self._settle()
            self._recent_scan = scan
        self._recent_ns += map(sub, [*began_ns[1:], began_ns[0] + together_ns], began_ns)

    def _settle(self) -> None:
        """Sorts the scans of bursts that wait into the histogram."""
        recent_ns = self._recent_ns
        if not recent_ns:
            return
        self._count += len(recent_ns)
        self._total_ns += sum(recent_ns)
        longest_ns = max(recent_ns)
        if longest_ns > self._longest_ns:
            self._longest_ns, self._longest_scan = longest_ns, self._recent_scan + recent_ns.index(longest_ns)
        if longest_ns > self._limit_ns:
            self._beyond += sum(time_ns > self._limit_ns for time_ns in recent_ns)
        recent_ns.sort()
        begin = 0
        while begin < len(recent_ns):
            size = bisect_right(SIZES_NS, recent_ns[begin])
            end = bisect_left(recent_ns, SIZES_NS[size], begin)
            self._sorted[size] = self._sorted.get(size, 0) + end - begin
            begin = end
        recent_ns.clear()

    @property
    def bins(self) -> list[tuple[int, int]]:
        """The histogram: lower bounds in ns, and how many there were from there up to the next bound of `SIZES_NS`."""
        self._settle()
        return [(SIZES_NS[size - 1] if size else 0, times) for size, times in sorted(self._sorted.items())]

    def within_ns(self, share: float) -> int:
        """The time in ns that this share of all scans (0.99: 99 of 100) did not exceed, to 3 %."""
        missing = share * self.count
        for size, times in sorted(self._sorted.items()):
            missing -= times
            if missing <= 0:
                return min(SIZES_NS[size] - 1, self._longest_ns)
        return self._longest_ns

    def add(self, other: Times, first_scan: int = 0) -> None:
        """Adds all of others; the number of the longest scan may then be one of theirs, which count from `first_scan`."""
        if other.longest_ns > self.longest_ns:
            self._longest_ns, self._longest_scan = other._longest_ns, other._longest_scan + first_scan
        self._count += other._count
        self._beyond += other._beyond
        self._total_ns += other._total_ns
        for size, times in other._sorted.items():
            self._sorted[size] = self._sorted.get(size, 0) + times

    def as_dict(self) -> dict[str, int]:
        """For scripts, in nanoseconds."""
        return {"mean_ns": self.mean_ns, "within_99_percent_ns": self.within_ns(0.99), "longest_ns": self.longest_ns,
                "longest_scan": self.longest_scan}  # fmt: skip


class ScanTimes(Times):
    """Durations of scans as `fbvm.run` measured them; empty for a PLC that was only told the time."""

    def __init__(self, cycle_ns: int) -> None:
        super().__init__(cycle_ns)

    @property
    def overruns(self) -> int:
        """Scans that took longer than the cycle."""
        return self.beyond

    def __str__(self) -> str:
        if not self.count:
            return "no scan was measured"
        text = (f"scan time: {_ms(self.mean_ns)} on average, 99 % within {_ms(self.within_ns(0.99))}, "
                f"longest {_ms(self.longest_ns)} (scan {self.longest_scan})")  # fmt: skip
        return text + (f"; {self.overruns} longer than the cycle" if self.overruns else "")

    def as_dict(self) -> dict[str, int]:
        return super().as_dict() | {"overruns": self.overruns}


class Lateness(Times):
    """How long after the moment that its period planned each scan began; empty in virtual time and in event pace."""

    def __init__(self) -> None:
        super().__init__()
        self.missed = 0
        """Periods in which no scan began, because the one before took too long or the host was busy."""

    def add(self, other: Times, first_scan: int = 0) -> None:
        super().add(other, first_scan)
        if isinstance(other, Lateness):
            self.missed += other.missed

    def __str__(self) -> str:
        if not self.count:
            return "no period was measured"
        text = (f"scans began late by {_ms(self.mean_ns)} on average, 99 % within {_ms(self.within_ns(0.99))}, "
                f"at most {_ms(self.longest_ns)} (scan {self.longest_scan})")  # fmt: skip
        return text + (f"; {self.missed} periods missed" if self.missed else "")

    def as_dict(self) -> dict[str, int]:
        return super().as_dict() | {"missed_periods": self.missed}


def _ms(time_ns: int) -> str:
    return f"{time_ns / 1e6:.3g} ms"
