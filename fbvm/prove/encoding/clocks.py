"""When scans begin: every so often, or within bounds; and what the machine tells a scan of it.

A `Clock` gives the terms of `Signal`s scan by scan: from power-on on, and from any later state on, as proofs by induction need
them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

from fbvm.code.image import TaskRow
from fbvm.machine.scan.clock_words import FREE_COUNTERS, PERIODS_NS, TENTH_MS_NS
from fbvm.prove.encoding.scan import WIDTHS, Signal
from fbvm.prove.encoding.terms import Term, Terms

MOST_CYCLE_TENTHS = (1 << 32) - 1
MOST_NOW_NS = 1 << 60
"""Times before which proofs hold: 36 years after power-on."""
COUNTS = 1 << 16


@dataclass(frozen=True)
class Later:
    """Scans from any state on, the first scan after power-on left out.

    `signal` tells what the machine says in the scan of a number, from 0 on (None: nothing is known of it), `before` is the time
    of the scan before the first of them, `facts` are what is known of all that."""

    signal: Callable[[int, Signal], Term | None]
    before: Term
    facts: tuple[Term, ...]


class Clock(ABC):
    """Times of scans: from `cycle_ns` to `longest_ns` lie between two."""

    def __init__(self, terms: Terms, tasks: tuple[TaskRow, ...], cycle_ns: int, longest_ns: int) -> None:
        self.terms, self.tasks, self.cycle_ns, self.longest_ns = terms, tasks, cycle_ns, longest_ns

    @abstractmethod
    def passed(self, number: int, *, later: bool = False) -> Term:
        """The time between the scan of a number and the one before it; 0 for the first after power-on."""

    @abstractmethod
    def value(self, number: int, signal: Signal) -> Term | None:
        """A signal in the scan of a number, from 0 at power-on on; None for what depends on the scans before."""

    @property
    def is_free(self) -> bool:
        return self.longest_ns > self.cycle_ns

    def later(self) -> Later:
        """Scans at any later time."""
        before = self.terms.variable(("now", "before"), 64)
        phases = _Phases(self, before)
        zero, most = (self.terms.constant(64, limit) for limit in (0, MOST_NOW_NS))
        facts = (self.terms.less(zero, before, True, True), self.terms.less(before, most, True))
        return Later(phases.signal, before, (*facts, *phases.facts))

    def interval_ns(self, signal: Signal) -> int:
        """The interval of the task of a grid signal, 0 if it has none."""
        return self.tasks[signal[1]].interval_ns


def clock_of(terms: Terms, tasks: tuple[TaskRow, ...], cycle_ns: int, longest_ns: int) -> Clock:
    """The clock of scans between which these times lie."""
    return FreeCycle(terms, tasks, cycle_ns, longest_ns) if longest_ns > cycle_ns else FixedCycle(terms, tasks, cycle_ns)


class FixedCycle(Clock):
    """Scans that begin every `cycle_ns`."""

    def __init__(self, terms: Terms, tasks: tuple[TaskRow, ...], cycle_ns: int) -> None:
        super().__init__(terms, tasks, cycle_ns, cycle_ns)
        self._grids: list[list[bool]] = []
        self._next_ns = [0] * len(tasks)

    def passed(self, number: int, *, later: bool = False) -> Term:
        return self.terms.constant(64, self.cycle_ns if number or later else 0)

    def value(self, number: int, signal: Signal) -> Term | None:
        kind, which = signal
        now_ns = number * self.cycle_ns
        tenths = min(self.cycle_ns // TENTH_MS_NS, MOST_CYCLE_TENTHS) if number else 0
        if kind in ("level", "fresh"):
            return None
        if kind == "first":
            return self.terms.boolean(number == 0)
        if kind == "passed":
            return self.passed(number)
        if kind == "pulse":
            return self.terms.boolean(now_ns % PERIODS_NS[which] >= PERIODS_NS[which] // 2)
        if kind == "grid":
            return self.terms.boolean(self._passed(number)[which])
        value = {"now": now_ns, "counter": now_ns // dict(FREE_COUNTERS).get(which, 1), "cycle": tenths}[kind]
        return self.terms.constant(WIDTHS[kind], value)

    def _passed(self, number: int) -> list[bool]:
        while len(self._grids) <= number:
            now_ns, row = len(self._grids) * self.cycle_ns, []
            for task, planned in enumerate(self._next_ns):
                interval_ns = self.tasks[task].interval_ns
                row.append(bool(interval_ns) and now_ns >= planned)
                if row[-1]:
                    self._next_ns[task] += ((now_ns - planned) // interval_ns + 1) * interval_ns
            self._grids.append(row)
        return self._grids[number]


class FreeCycle(Clock):
    """Scans between which any time within bounds passes, to the nanosecond, another one each time.

    That time is `cycle_ns` and the value of a variable more, `longest_ns` at most: so no fact about the variable is needed."""

    def __init__(self, terms: Terms, tasks: tuple[TaskRow, ...], cycle_ns: int, longest_ns: int) -> None:
        super().__init__(terms, tasks, cycle_ns, longest_ns)
        self._from_power_on = _Phases(self, None)

    def passed(self, number: int, *, later: bool = False) -> Term:
        terms, spread = self.terms, self.longest_ns - self.cycle_ns
        if not number and not later:
            return terms.constant(64, 0)
        more = terms.variable(("time", number, later), spread.bit_length())
        most = terms.constant(more.width, spread)
        if spread & (spread + 1):
            more = terms.ite(terms.less(more, most, False), more, most)
        return terms.add(terms.extend(more, 64, False), terms.constant(64, self.cycle_ns))

    def value(self, number: int, signal: Signal) -> Term | None:
        return self._from_power_on.signal(number, signal)


@dataclass
class _Phases:
    """Signals from the times between scans: how far each period has gone is carried from scan to scan.

    `before` is the time of the scan before the first, None if the first is that of power-on."""

    clock: Clock
    before: Term | None
    facts: list[Term] = field(default_factory=list)
    _nows: list[Term] = field(default_factory=list)
    _gone: dict[int, list[tuple[Term, Term]]] = field(default_factory=dict)
    """For each period and scan: how much of it has gone, and whether one ended since the scan before."""
    _longest: list[Term] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.before is not None:
            for period in self._periods():
                start = self._start(period)
                self.facts.append(self.clock.terms.less(start, self.clock.terms.constant(start.width, period), False))

    def _periods(self) -> set[int]:
        tasks = {task.interval_ns for task in self.clock.tasks if task.interval_ns}
        return tasks | set(PERIODS_NS.values()) | {unit * COUNTS for _, unit in FREE_COUNTERS}

    def signal(self, number: int, signal: Signal) -> Term | None:
        """A signal in the scan of a number, None for one that the scans before say or of which nothing is known."""
        terms, (kind, which) = self.clock.terms, signal
        if kind in ("level", "fresh"):
            return None
        if kind == "first":
            return terms.boolean(self.before is None and number == 0)
        if kind == "passed":
            return self._passed(number)
        if kind == "now":
            return self._now(number)
        if kind == "pulse":
            gone, _ = self._phase(PERIODS_NS[which], number)
            return terms.less(terms.constant(gone.width, PERIODS_NS[which] // 2), gone, False, True)
        if kind == "grid":
            interval_ns = self.clock.interval_ns(signal)
            return self._phase(interval_ns, number)[1] if interval_ns else terms.false
        if kind == "counter":
            unit_ns = dict(FREE_COUNTERS)[which]
            gone, _ = self._phase(unit_ns * COUNTS, number)
            return terms.resized(terms.divide("udiv", gone, terms.constant(gone.width, unit_ns)), WIDTHS[kind], False)
        return self._tenths(number) if which == 0 else self._longest_tenths(number)

    def _passed(self, number: int) -> Term:
        return self.clock.passed(number, later=self.before is not None)

    def _now(self, number: int) -> Term:
        while len(self._nows) <= number:
            last = self._nows[-1] if self._nows else self.before or self.clock.terms.constant(64, 0)
            self._nows.append(self.clock.terms.add(last, self._passed(len(self._nows))))
        return self._nows[number]

    def _width(self, period: int) -> int:
        return (period + self.clock.longest_ns).bit_length()

    def _start(self, period: int) -> Term:
        terms, width = self.clock.terms, self._width(period)
        return terms.constant(width, 0) if self.before is None else terms.variable(("gone", period), width)

    def _phase(self, period: int, number: int) -> tuple[Term, Term]:
        terms, rows = self.clock.terms, self._gone.setdefault(period, [])
        whole = terms.constant(self._width(period), period)
        while len(rows) <= number:
            if not rows and self.before is None:
                rows.append((self._start(period), terms.true))
                continue
            last = rows[-1][0] if rows else self._start(period)
            gone = terms.add(last, terms.resized(self._passed(len(rows)), last.width, False))
            ended = terms.less(whole, gone, False, True)
            if self.clock.longest_ns <= period:
                rest = terms.ite(ended, terms.sub(gone, whole), gone)
            else:
                rest = terms.divide("urem", gone, whole)
            rows.append((rest, ended))
        return rows[number]

    def _tenths(self, number: int) -> Term:
        """The time since the scan before, in 0.1 ms; 0 in the first scan."""
        terms = self.clock.terms
        width = max(self.clock.longest_ns, TENTH_MS_NS).bit_length()
        tenths = terms.divide("udiv", terms.extract(self._passed(number), 0, width), terms.constant(width, TENTH_MS_NS))
        most = terms.constant(max(width, 32), MOST_CYCLE_TENTHS)
        wide = terms.resized(tenths, most.width, False)
        return terms.extract(terms.ite(terms.less(wide, most, False), wide, most), 0, WIDTHS["cycle"])

    def _longest_tenths(self, number: int) -> Term:
        terms = self.clock.terms
        while len(self._longest) <= number:
            before = self._longest[-1] if self._longest else \
                terms.constant(32, 0) if self.before is None else terms.variable(("longest", "before"), 32)  # fmt: skip
            now = self._tenths(len(self._longest))
            self._longest.append(terms.ite(terms.less(before, now, False), now, before))
        return self._longest[number]
