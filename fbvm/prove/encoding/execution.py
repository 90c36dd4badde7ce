"""The state of a symbolic execution: what cells, temporaries and conditions are on a path through the code.

Nothing here knows an operation; `expressions` and `statements` hold a row for each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from fbvm.code.image import Image
from fbvm.code.operations import Address, Node, caught
from fbvm.prove.encoding.cells import Cell, Contents
from fbvm.prove.encoding.terms import Term, Terms
from fbvm.prove.encoding.writes import Writes
from fbvm.watch.bits import Writer

MOST_STEPS = 400_000
"""Statements that one scan may execute symbolically, rounds of loops counted each."""
UNWOUND = "unwound"
"""In place of the code of a trap: a loop that goes on for longer than it was followed."""


class Refused(Exception):
    """The program, or a part of it that matters, cannot be followed; `site` is the number of the place, -1 for none."""

    def __init__(self, reason: str, site: int = -1) -> None:
        super().__init__(reason)
        self.reason, self.site = reason, site


class Trapped(Exception):
    """The execution ends in a trap on every path: no symbol is left in its condition."""

    def __init__(self, code: str, site: int) -> None:
        super().__init__(code, site)
        self.code, self.site = code, site


@dataclass(frozen=True)
class TrapCondition:
    """When the trap of a code at a site is reached, earlier traps left aside."""

    condition: Term
    code: str
    site: int


Held = tuple[Term, dict[int, Term], dict[Cell, Term]]
"""What a state holds at some moment: its path, temporaries, and the cells that were written."""


@dataclass
class State:
    """A path: its condition, counted from the start of the scan, and what memory and temporaries hold on it.

    `known` are bounds of terms (signed numbers) that checks on this path have made sure of; `used` is the step budget that
    it has used up, or more."""

    contents: Contents
    path: Term
    temporaries: dict[int, Term] = field(default_factory=dict)
    known: dict[Term, tuple[int, int]] = field(default_factory=dict)
    used: int = 0

    def child(self, path: Term) -> State:
        """The same state on a path of its own; this one is not written while the child is in use."""
        return State(self.contents.child(), path, dict(self.temporaries), dict(self.known), self.used)

    def held(self) -> Held:
        """What the state holds now, to be compared with what it holds later."""
        cells = {cell: self.contents.get(cell) for cell in self.contents.written_since(None)}
        return self.path, dict(self.temporaries), cells

    def is_again(self, held: Held) -> bool:
        """Whether the state holds what it held before."""
        path, temporaries, cells = held
        return (self.path is path and self.temporaries == temporaries
                and all(self.contents.get(cell) is term for cell, term in cells.items())
                and self.contents.written_since(None) == cells.keys())

    def join(self, others: list[State], conditions: list[Term]) -> None:
        """Takes over what children hold, each where its condition is TRUE; one of them is."""
        terms = self.contents.terms
        last, *rest = reversed(others)
        choices = list(reversed(conditions))[1:]
        merged = {}
        for cell in set().union(*(other.contents.written_since(self.contents) for other in others)):
            value = last.contents.get(cell)
            for condition, other in zip(choices, rest, strict=True):
                value = terms.ite(condition, other.contents.get(cell), value)
            merged[cell] = value
        self.contents.written.update(merged)
        for number in set.intersection(*(set(other.temporaries) for other in others)):
            temporary = last.temporaries[number]
            for condition, other in zip(choices, rest, strict=True):
                temporary = terms.ite(condition, other.temporaries[number], temporary)
            self.temporaries[number] = temporary
        self.used = max(other.used for other in others)


@dataclass
class Attempt:
    """An attempt whose body is executed: `ended` has a row for each place that may stop it, earlier ones first.

    A row is a condition, what the attempt gives then, what was written up to there, and the steps that were used."""

    traps: bool
    begun: Contents
    ended: list[tuple[Term, Term, dict[Cell, Term], int]] = field(default_factory=list)
    is_certain: bool = False
    """Whether the last of them stops it on every path."""

    def note(self, state: State, condition: Term, code: str, raised: Term | None) -> None:
        """Notes that a code stops the body here; `raised` is the number of a `raise`."""
        cells = {cell: state.contents.get(cell) for cell in state.contents.written_since(self.begun)}
        what = state.contents.terms.constant(32, caught(code, self.traps)) if raised is None else raised
        self.ended.append((condition, what, cells, state.used))

    def join(self, state: State, number: int, end: State | None) -> None:
        """Makes `state` that behind the attempt; `end` is the state behind its body, None if nothing gets there."""
        terms, ends, conditions = state.contents.terms, list[State](), list[Term]()
        for condition, what, cells, used in self.ended:
            made = state.child(state.path)
            made.contents.written.update(cells)
            made.temporaries[number], made.used = what, used
            ends.append(made)
            conditions.append(condition)
        if end is not None:
            end.temporaries[number] = terms.constant(32, 0)
            ends.append(end)
            conditions.append(terms.true)
        state.join(ends, conditions)


Row = Callable[..., Any]


class Execution:
    """One scan that is executed symbolically: what its code is, and what it has met.

    `now` is the term of the scan's time in nanoseconds, `budget` the steps that a scan may take.  `expressions` and `statements`
    are the rows by which operations are executed; `watched` are bits of which it is noted who writes them."""

    def __init__(self, image: Image, terms: Terms, now: Term, budget: int, expressions: dict[str, Row],
                 statements: dict[str, Row], watched: Sequence[range] = ()) -> None:  # fmt: skip
        self.image, self.terms, self.now, self.budget = image, terms, now, budget
        self.expressions, self.statements = expressions, statements
        self.traps: list[TrapCondition] = []
        self.attempts: list[Attempt] = []
        """Those whose bodies are executed now, the innermost last."""
        self.reached: dict[int, Term] = {}
        """When the statement at a site is executed."""
        self.unknowns: dict[str, int] = {}
        """Operations whose result is not known, with a site of each."""
        self.writes = Writes(terms, watched)
        self.stored: tuple[Address, list[Any]] | None = None
        """Where the last store went that an observation may follow, whose subscripts it may have changed."""
        self.base = 0
        """Where the instance begins that is executed."""
        self.site = -1
        self.callers: Writer = ()
        """The calls that have led here."""
        self.calls = 0
        """How many calls are nested now."""
        self.steps = 0
        self.rounds_most = 1

    def value(self, state: State, node: Node) -> Term:
        """The term of an expression."""
        term: Term = self.expressions[node[0]](self, state, *node[1:])
        return term

    def trap(self, state: State, condition: Term, code: str, site: int, raised: Term | None = None) -> None:
        """Notes that a trap is reached if `condition` holds here; `raised` is the number of a `raise`.

        Raises Trapped if that is certain."""
        reached = self.terms.and_(state.path, condition)
        attempt = next((each for each in reversed(self.attempts) if caught(code, each.traps)), None)
        if attempt is not None and reached is not self.terms.false:
            attempt.note(state, reached, code, raised)
            attempt.is_certain = reached is self.terms.true
            if attempt.is_certain:
                raise Trapped(code, site)
            state.path = self.terms.and_(state.path, self.terms.not_(condition))
            return
        if reached is self.terms.true:
            self.traps.append(TrapCondition(reached, code, site))
            raise Trapped(code, site)
        if reached is not self.terms.false:
            self.traps.append(TrapCondition(reached, code, site))

    def step(self) -> None:
        """Counts a statement.  Raises Refused for too many."""
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise Refused(f"a scan may execute more than {MOST_STEPS:,} statements, which is too long to be followed", self.site)
