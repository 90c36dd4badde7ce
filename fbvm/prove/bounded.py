"""Bounded search: whether a run of so many scans from power-on gets to a goal, asked in blocks of scans that grow.

A block without a run is asserted as a lemma for those behind it.  A run that is found is made the shortest, then one with few
changes of its inputs."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import accumulate

from fbvm.prove.encoding.cells import Cell
from fbvm.prove.encoding.clocks import Clock
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.encoding.terms import Term
from fbvm.prove.solver import SAT, UNKNOWN, UNSAT, Solver
from fbvm.prove.unrolling import Unrolling, from_power_on

FIRST_BLOCK = 16
MOST_IN_BLOCK = 512
MOST_SIMPLER = 120
"""Questions that may be asked to find a run with fewer changes."""


@dataclass(frozen=True)
class Inputs:
    """What a run is given: the inputs of each scan, as unsigned numbers, and the times at which the scans begin."""

    values: list[dict[Cell, int]]
    times_ns: list[int]

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True)
class Goal:
    """What is looked for behind a scan: `hit` is TRUE there, in no scan before it `stop` was (a trap), and in all of them and it
    `given` is (assumptions)."""

    hit: Term
    stop: Term
    given: Term

    @property
    def terms(self) -> list[Term]:
        return [self.hit, self.stop, self.given]


class BoundedSearch:
    """Looks for runs to a goal.  `cleared` is the number of scans after power-on in which it is known that none gets there;
    `is_shortest` tells of the run that was found whether it is known that no shorter one gets there."""

    def __init__(self, summary: Summary, goal: Goal, clock: Clock, expired: Callable[[], bool]) -> None:
        self.summary, self.terms, self.clock = summary, summary.terms, clock
        self.unrolling: Unrolling = from_power_on(summary, goal.terms, clock)
        self.solver = Solver(expired)
        self.cleared = 0
        self.is_shortest = False
        self._expired = expired
        self._alive: list[Term] = [self.terms.true]
        """Before each scan: no trap until then, and all assumptions kept."""
        self._block = FIRST_BLOCK

    def hit(self, number: int) -> Term:
        """The goal is met behind the scan of a number, from power-on on."""
        terms = self.terms
        while len(self._alive) <= number + 1:
            hit, stop, given = self.unrolling.scan(len(self._alive) - 1)
            self._alive.append(terms.all_of(self._alive[-1], given, terms.not_(stop)))
        hit, _, given = self.unrolling.scan(number)
        return terms.all_of(self._alive[number], given, hit)

    def until(self, scans: int) -> Inputs | None:
        """The inputs of a run of at most so many scans that gets to the goal, the shortest unless the time is over before that
        is known; None if there is none or the time is over before (then `cleared` is less than `scans`)."""
        while self.cleared < scans:
            end = min(scans, self.cleared + self._block)
            hits = []
            for number in range(self.cleared, end):
                if self._expired():
                    return None
                hits.append(self.hit(number))
            answer = self.solver.ask(self.terms.any_of(*hits))
            if answer == SAT:
                return self._shortest(hits)
            if answer == UNKNOWN:
                return None
            self.solver.assume(*(self.terms.not_(hit) for hit in hits))
            self.cleared = end
            self._block = min(2 * self._block, MOST_IN_BLOCK)
        return None

    def all_runs_end(self) -> bool:
        """True if no run is left to go on: each has trapped, or broken an assumption."""
        return self.solver.ask(self._alive[self.cleared]) == UNSAT

    def longest_run(self, scans: int) -> int | None:
        """The scans of the longest run, if all runs end within so many: by a trap, or an assumption that is broken; else None."""
        self.hit(scans - 1)
        if self.solver.ask(self._alive[scans]) != UNSAT:
            return None
        return bisect_left(range(1, scans), True, key=lambda end: self.solver.ask(self._alive[end]) == UNSAT)

    def _shortest(self, hits: list[Term]) -> Inputs | None:
        while True:
            values = self.solver.values(hits)
            last = next(number for number, hit in enumerate(hits) if values[hit])
            model = self._model(self.cleared + last)
            answer = self.solver.ask(self.terms.any_of(*hits[:last])) if last else UNSAT
            if answer != SAT:
                self.is_shortest = answer == UNSAT
                break
            hits = hits[:last]
        return self._simplest(model, self.cleared + last)

    def _model(self, last: int) -> dict[Term, int]:
        names = [self.unrolling.input(variable, number) for number in range(last + 1) for variable in self.unrolling.inputs]
        passed = (self.clock.passed(number) for number in range(1, last + 1))
        return self.solver.values([*names, *(term for term in passed if not term.is_constant)])

    def _simplest(self, model: dict[Term, int], last: int) -> Inputs:
        """A run to the goal in the scan `last` in which inputs keep their values where they can, beginning with 0."""
        terms, kept = self.terms, [self.hit(last)]
        wishes = [*self._even_times(last)]
        for number in range(last + 1):
            for variable in self.unrolling.inputs:
                here = self.unrolling.input(variable, number)
                before = self.unrolling.input(variable, number - 1) if number else terms.constant(here.width, 0)
                wishes.append(terms.eq(here, before))
        model = self._granted(kept, wishes, model, last)
        cells = self.summary.inputs
        values = [{cells[variable]: model[self.unrolling.input(variable, number)] for variable in self.unrolling.inputs}
                  for number in range(last + 1)]  # fmt: skip
        passed = (self.clock.passed(number) for number in range(last + 1))
        return Inputs(values, [*accumulate(term.value if term.is_constant else model[term] for term in passed)])

    def _even_times(self, last: int) -> Iterator[Term]:
        """That scans begin every so often, at one of the bounds."""
        if not self.clock.is_free:
            return
        terms = self.terms
        ends = [terms.constant(64, self.clock.cycle_ns), terms.constant(64, self.clock.longest_ns)]
        for number in range(1, last + 1):
            passed = self.clock.passed(number)
            yield terms.any_of(*(terms.eq(passed, end) for end in ends))
            if number > 1:
                yield terms.eq(passed, self.clock.passed(number - 1))

    def _granted(self, kept: list[Term], wishes: list[Term], model: dict[Term, int], last: int) -> dict[Term, int]:
        """The model of a run that grants as many wishes, the latest first, as can be found out by some questions."""
        waiting, asked = [wishes], 0
        while waiting and asked < MOST_SIMPLER and not self._expired():
            some = waiting.pop()
            asked += 1
            if self.solver.ask(*kept, *some) == SAT:
                kept += some
                model = self._model(last)
            elif len(some) > 1:
                half = len(some) // 2
                waiting += [some[:half], some[half:]]
        return model
