"""Proof for all scans: what no scan breaks, if the scans before it did not.

k-induction (Sheeran, Singh and Stalmarck, 2000): from any state on, k scans without the goal are never followed by one with it.
Together with a bounded search over the first scans that is a proof for all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fbvm.prove.bounded import Goal
from fbvm.prove.encoding.clocks import Clock
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.encoding.terms import Term
from fbvm.prove.solver import UNKNOWN, UNSAT, Solver
from fbvm.prove.unrolling import from_anywhere


class Induction:
    """Whether scans from any state on get to a goal.  `facts` are invariants over the state before them."""

    def __init__(self, summary: Summary, goal: Goal, clock: Clock, expired: Callable[[], bool],
                 facts: Sequence[Term] = ()) -> None:  # fmt: skip
        self.terms = summary.terms
        self.unrolling, later = from_anywhere(summary, goal.terms, clock)
        self.solver = Solver(expired)
        self.solver.assume(*later.facts, *facts)
        self.depth = 0
        """So many scans without the goal are assumed before one with it."""

    def step(self) -> str:
        """UNSAT if the goal is never met in the next depth, which is a proof; SAT or UNKNOWN if that cannot be told from it."""
        terms = self.terms
        hit, stop, given = self.unrolling.scan(self.depth)
        self.solver.assume(given)
        answer = self.solver.ask(hit)
        if answer not in (UNSAT, UNKNOWN):
            self.solver.assume(terms.not_(hit), terms.not_(stop))
            self.depth += 1
        return answer
