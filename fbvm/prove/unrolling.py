"""Scans one behind the other: the summary instantiated for each scan, as far as what is asked depends on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fbvm.prove.encoding.clocks import Clock, Later
from fbvm.prove.encoding.rewriting import cone, leaves, substituted
from fbvm.prove.encoding.scan import Signal
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.encoding.terms import Term


class Unrolling:
    """The terms `wanted` behind each scan of a run.

    `signal(number, signal)` is what the machine says in the scan of a number, None for a value of which nothing is known.
    `state` are the terms of the state before the first of them: that of power-on, unless given."""

    def __init__(self, summary: Summary, wanted: Sequence[Term], signal: Callable[[int, Signal], Term | None],
                 state: dict[Term, Term] | None = None) -> None:  # fmt: skip
        self.summary, self.wanted, self._signal = summary, list(wanted), signal
        self.cone = sorted(cone(summary.next, wanted), key=lambda term: term.number)
        """The variables of the state that matter."""
        needed = [*self.wanted, *(summary.next[variable] for variable in self.cone)]
        found = leaves(needed)
        self.inputs = sorted((leaf for leaf in found if leaf in summary.inputs), key=lambda term: term.number)
        """The inputs that matter."""
        self._signals = [leaf for leaf in found if leaf in summary.signals]
        self.state = [state or {variable: summary.initial[variable] for variable in self.cone}]
        """The terms of the state before each scan."""
        self.behind: list[list[Term]] = []
        """The wanted terms behind each scan, in their order."""

    def input(self, variable: Term, number: int) -> Term:
        """The variable of an input in the scan of a number."""
        return self.summary.terms.variable(("input", number, variable.value), variable.width)

    def scan(self, number: int) -> list[Term]:
        """The wanted terms behind the scan of a number, from 0 on."""
        while len(self.behind) <= number:
            self._next()
        return self.behind[number]

    def _next(self) -> None:
        number, terms = len(self.behind), self.summary.terms
        known = dict(self.state[-1])
        known.update((variable, self.input(variable, number)) for variable in self.inputs)
        for variable in self._signals:
            term = self._signal(number, self.summary.signals[variable])
            known[variable] = terms.variable(("signal", number, variable.value), variable.width) if term is None else term
        found = substituted(terms, [*self.wanted, *(self.summary.next[variable] for variable in self.cone)], known)
        self.behind.append(found[: len(self.wanted)])
        self.state.append(dict(zip(self.cone, found[len(self.wanted):], strict=True)))


def from_power_on(summary: Summary, wanted: Sequence[Term], clock: Clock) -> Unrolling:
    """A run from power-on on."""
    return Unrolling(summary, wanted, clock.value)


def from_anywhere(summary: Summary, wanted: Sequence[Term], clock: Clock) -> tuple[Unrolling, Later]:
    """Scans from any state on, the first scan after power-on left out; and what is known of their times."""
    later = clock.later()
    return Unrolling(summary, wanted, later.signal, {variable: variable for variable in cone(summary.next, wanted)}), later
