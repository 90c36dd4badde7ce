"""How long scans took and how late they began, by the host's clock: whether anything made a PLC wait."""

from __future__ import annotations

from fbvm.base.areas import NEVER

DIGIT_BITS = 5
"""Bits that a time keeps when it is sorted in: a share is true to 3 %."""


class Times:
    """Many times, one a scan, of which only the longest and how many there were of each size are kept."""

    def __init__(self, limit_ns: int = NEVER) -> None:
        self._limit_ns = limit_ns
        self.count = 0
        self.beyond = 0
        """How many were longer than the limit."""
        self.longest_ns = 0
        self.longest_scan = 0
        """Number of the longest one."""
        self._total_ns = 0
        self._sorted: dict[int, int] = {}
        """How many there were, by a number that grows with the time: how many bits were dropped, and those left."""

    def note(self, scan: int, time_ns: int, times: int = 1) -> None:
        """Take one in, or so many that nobody measured one by one, from this scan on."""
        self.count += times
        self._total_ns += time_ns * times
        if time_ns > self.longest_ns:
            self.longest_ns, self.longest_scan = time_ns, scan
        if time_ns > self._limit_ns:
            self.beyond += times
        dropped = time_ns.bit_length() - DIGIT_BITS
        kind = dropped << DIGIT_BITS | time_ns >> dropped if dropped > 0 else time_ns
        self._sorted[kind] = self._sorted.get(kind, 0) + times

    @property
    def mean_ns(self) -> int:
        """The average."""
        return self._total_ns // self.count if self.count else 0

    def within_ns(self, share: float) -> int:
        """The time that this share of all (0.99: 99 of 100) did not exceed, to 3 %."""
        missing = share * self.count
        for kind, times in sorted(self._sorted.items()):
            missing -= times
            if missing <= 0:
                dropped, digits = kind >> DIGIT_BITS, kind & (1 << DIGIT_BITS) - 1
                return min((digits + 1 << dropped) - 1, self.longest_ns)
        return self.longest_ns

    def add(self, other: Times) -> None:
        """Take in all of another PLC's; the number of the longest scan is one of that PLC."""
        self.count += other.count
        self.beyond += other.beyond
        self._total_ns += other._total_ns
        if other.longest_ns > self.longest_ns:
            self.longest_ns, self.longest_scan = other.longest_ns, other.longest_scan
        for kind, times in other._sorted.items():
            self._sorted[kind] = self._sorted.get(kind, 0) + times

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

    def add(self, other: Times) -> None:
        super().add(other)
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
