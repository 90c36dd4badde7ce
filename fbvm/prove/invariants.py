"""Invariants: guessed from states that runs were seen in, and kept if no scan can break them together.

The method is that of Houdini (Flanagan and Leino, 2001): all guesses are assumed of the state before a scan, those that some scan
then breaks are dropped, until none is.  What stays holds in every scan after the first."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

from fbvm.prove.encoding.clocks import Clock
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.encoding.terms import Term, Terms, signed
from fbvm.prove.solver import SAT, UNSAT, Solver
from fbvm.prove.unrolling import from_anywhere, from_power_on

MOST_LITERALS = 80
MOST_BITS = 32
"""The widest number whose bits are looked at."""
FEW_VALUES = 8
"""Different values of a number up to which each is looked at by itself."""

Values = dict[Term, int]
"""The state behind a scan: the values of its variables, as unsigned numbers."""


@dataclass(frozen=True)
class Sample:
    """A state that was seen behind a scan, and the time of that scan."""

    values: Values
    now_ns: int


class Guess(Protocol):
    """What may hold of the state behind every scan."""

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        """The guess about a state, behind the scan of a time."""

    def holds(self, sample: Sample) -> bool:
        """Whether the guess holds of a state that was seen."""


@dataclass(frozen=True)
class Literal:
    """A Boolean of the state, or that a number has a value; or the opposite."""

    variable: Term
    value: int
    is_equal: bool = True

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        at = state[self.variable]
        equal = terms.eq(at, terms.constant(at.width, self.value))
        return equal if self.is_equal else terms.not_(equal)

    def holds(self, sample: Sample) -> bool:
        return (sample.values[self.variable] == self.value) == self.is_equal


@dataclass(frozen=True)
class Clause:
    """One of two literals, or both."""

    left: Literal
    right: Literal

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        return terms.or_(self.left.term(terms, state, now), self.right.term(terms, state, now))

    def holds(self, sample: Sample) -> bool:
        return self.left.holds(sample) or self.right.holds(sample)


@dataclass(frozen=True)
class Bounds:
    """A number, read as a signed one, lies between two others."""

    variable: Term
    low: int
    high: int

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        at = state[self.variable]
        low, high = (terms.constant(at.width, limit) for limit in (self.low, self.high))
        return terms.and_(terms.less(low, at, True, True), terms.less(at, high, True, True))

    def holds(self, sample: Sample) -> bool:
        return self.low <= signed(sample.values[self.variable], self.variable.width) <= self.high


@dataclass(frozen=True)
class Bit:
    """A bit of a number has a value."""

    variable: Term
    number: int
    value: int

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        bit = terms.extract(state[self.variable], self.number, 1)
        return terms.eq(bit, terms.constant(1, self.value))

    def holds(self, sample: Sample) -> bool:
        return sample.values[self.variable] >> self.number & 1 == self.value


@dataclass(frozen=True)
class Ordered:
    """A number is not greater than another of its width, both signed; than the time of the scan, if there is no other."""

    lesser: Term
    greater: Term | None

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        return terms.less(state[self.lesser], state[self.greater] if self.greater else now, True, True)

    def holds(self, sample: Sample) -> bool:
        width = self.lesser.width
        high = signed(sample.values[self.greater], width) if self.greater else sample.now_ns
        return signed(sample.values[self.lesser], width) <= high




def guesses(variables: Sequence[Term], samples: Sequence[Sample], doubted: Collection[Guess] = ()) -> list[Guess]:
    """What holds of the variables in all samples; `doubted` holds in them, and is broken by some scan all the same."""
    literals: list[Literal] = []
    found: list[Guess] = []
    for variable in variables:
        seen = {sample.values[variable] for sample in samples}
        if variable.width == 0 or len(seen) <= FEW_VALUES:
            literals += [Literal(variable, value) for value in (sorted(seen) if variable.width else [1])]
        if variable.width:
            found += _about_number(variable, seen)
    wide = [variable for variable in variables if variable.width >= 16]
    found += [Ordered(a, b) for a in wide for b in wide if a is not b and a.width == b.width]
    both = [each for literal in literals[:MOST_LITERALS] for each in (literal, Literal(literal.variable, literal.value, False))]
    found += both
    found += [Clause(a, b) for a, b in combinations(both, 2) if a.variable is not b.variable]
    return _holding(found, samples, doubted)


def _about_number(variable: Term, seen: set[int]) -> list[Guess]:
    """Bounds of a number: those that were seen, and each of them alone; for one of 64 bits also the time of the scan."""
    numbers, top = [signed(value, variable.width) for value in seen], 1 << (variable.width - 1)
    low, high = min(numbers), max(numbers)
    found: list[Guess] = [Bounds(variable, low, high), Bounds(variable, min(low, 0), top - 1), Bounds(variable, -top, high)]
    return [*found, *_bits(variable, seen), *([Ordered(variable, None)] if variable.width == 64 else [])]


def _bits(variable: Term, seen: set[int]) -> list[Guess]:
    """The bits of a word that had one value only, if others had two: statements write single bits of words."""
    ones, zeros = ((1 << variable.width) - 1, 0)
    for value in seen:
        ones, zeros = ones & value, zeros | value
    fixed = [number for number in range(variable.width) if ones >> number & 1 == zeros >> number & 1]
    if variable.width > MOST_BITS or len(fixed) == variable.width or len(seen) > 1 << (variable.width - len(fixed)):
        return []
    return [Bit(variable, number, zeros >> number & 1) for number in fixed]


def _holding(found: list[Guess], samples: Sequence[Sample], doubted: Collection[Guess]) -> list[Guess]:
    """Those that hold in all samples; a clause of which one side always holds says nothing more."""
    kept: list[Guess] = []
    certain: set[Guess] = set()
    for guess in found:
        if isinstance(guess, Clause) and (guess.left in certain or guess.right in certain):
            continue
        if all(guess.holds(sample) for sample in samples):
            kept.append(guess)
            if isinstance(guess, Literal) and guess not in doubted:
                certain.add(guess)
    return kept


class Invariants:
    """What holds behind every scan, as far as guesses and the solver tell.

    `stop` and `given` are as in a goal: scans behind a trap, and those that break an assumption, do not count."""

    def __init__(self, summary: Summary, variables: Sequence[Term], stop: Term, given: Term, clock: Clock,
                 expired: Callable[[], bool]) -> None:  # fmt: skip
        self.summary, self.variables, self.clock = summary, list(variables), clock
        self.behind = [summary.next[variable] for variable in variables]
        self.context = [stop, given]
        self._expired = expired

    def kept(self, found: Sequence[Guess]) -> list[Guess] | None:
        """The guesses that hold behind every scan; None if the time is over."""
        summary, terms = self.summary, self.summary.terms
        wanted = [*self.context, *self.behind]
        begun = from_power_on(summary, wanted, self.clock)
        first = self._filtered(found, begun.scan(0), [], terms.constant(64, 0), None)
        if first is None:
            return None
        anywhere, later = from_anywhere(summary, wanted, self.clock)
        now = terms.add(later.before, self.clock.passed(0, later=True))
        return self._filtered(first, anywhere.scan(0), later.facts, now, later.before)

    def _filtered(self, found: Sequence[Guess], scan: list[Term], facts: Sequence[Term], now: Term,
                  before: Term | None) -> list[Guess] | None:  # fmt: skip
        """The guesses that hold behind a scan, if they hold `before` it; None there is power-on."""
        terms, solver = self.summary.terms, Solver(self._expired)
        stop, given, *behind = scan
        solver.assume(terms.not_(stop), given, *facts)
        state = dict(zip(self.variables, behind, strict=True))
        same = {variable: variable for variable in self.variables}
        assumed = {guess: guess.term(terms, same, before) for guess in found} if before else {}
        broken = {guess: terms.not_(guess.term(terms, state, now)) for guess in found}
        while True:
            open_ones = [broken[guess] for guess in found if broken[guess] is not terms.false]
            answer = solver.ask(*(assumed[guess] for guess in found if before), balanced(terms, open_ones))
            if answer != SAT:
                return [*found] if answer == UNSAT else None
            values = solver.values({*behind, now})
            sample = Sample(dict(zip(self.variables, (values[term] for term in behind), strict=True)), values[now])
            found = [guess for guess in found if guess.holds(sample)]


def balanced(terms: Terms, some: list[Term]) -> Term:
    """One of many, as a tree that is not deep."""
    while len(some) > 1:
        some = [terms.or_(*some[at:at + 2]) if at + 1 < len(some) else some[at] for at in range(0, len(some), 2)]
    return some[0] if some else terms.false


def facts_of(summary: Summary, found: Sequence[Guess], clock: Clock) -> list[Term]:
    """Invariants as terms over the state before the first scan of `from_anywhere`."""
    same = {variable: variable for variable in summary.next}
    before = clock.later().before
    return [guess.term(summary.terms, same, before) for guess in found]
