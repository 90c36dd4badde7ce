"""Where an address can point to: the places that it may mean, each with the condition under which it does."""

from __future__ import annotations

from typing import NamedTuple

from fbvm.code.image import Objects
from fbvm.code.operations import (
    BIT_MASK,
    BUFFER_OBJECT,
    FIRST_OBJECT,
    OBJECT_SHIFT,
    OFFSET_MASK,
    OFFSET_SHIFT,
    Address,
)
from fbvm.prove.encoding.execution import Execution, Refused, State
from fbvm.prove.encoding.terms import Term, Terms, bounds, signed

MOST_CASES = 4096
"""Places that one access may choose from."""

Cases = list[tuple[Term, int]]
"""The values of a term, as unsigned numbers, each with its condition."""
_STRUCTURAL = frozenset(("add", "sub", "mul", "neg", "zext", "sext", "extract", "concat", "bvand", "bvor", "shl", "shr"))


class Target(NamedTuple):
    """A place that an address may mean: its condition, offset, the bit that a reference names, and the reference's object."""

    condition: Term
    offset: int
    bit: int
    owner: int


def targets(x: Execution, state: State, address: Address, count: int) -> list[Target]:
    """The places of `count` bytes that an address may mean.  Notes the trap of references that point elsewhere (R0110)."""
    base, offset, strides = address
    places: Cases = [(x.terms.true, offset)]
    if isinstance(base, tuple):
        reference = x.value(state, base[1])
    elif base == "self":
        places = [(x.terms.true, offset + x.base)]
    for stride, expression in strides:
        term = x.value(state, expression)
        if (steps := cases(x.terms, state, term)) is None:
            raise Refused("an index has no bounds that could be followed", x.site)
        steps = [(condition, stride * signed(value, term.width)) for condition, value in steps]
        places = _combined(x, places, steps)
    if not isinstance(base, tuple):
        return [Target(condition, place, BIT_MASK, BUFFER_OBJECT) for condition, place in places]
    return _behind(x, state, reference, places, count, base[2])


def _combined(x: Execution, left: Cases, right: Cases) -> Cases:
    if len(left) * len(right) > MOST_CASES:
        raise Refused(f"an index chooses from more than {MOST_CASES} places", x.site)
    if len(left) == 1 and left[0][0] is x.terms.true:
        return [(condition, left[0][1] + value) for condition, value in right]
    both = ((x.terms.and_(c, d), a + b) for c, a in left for d, b in right)
    return [(condition, value) for condition, value in both if condition is not x.terms.false]


def _behind(x: Execution, state: State, reference: Term, places: Cases, count: int, site: int) -> list[Target]:
    """The places that lie some way behind where a reference points."""
    found = cases(x.terms, state, reference)
    if found is None:
        raise Refused("a pointer may point to too many places", x.site)
    targets = []
    for condition, value in found:
        start, end = extent(x.image.objects, x.image.layout.size, value >> OBJECT_SHIFT, x.site)
        for where, delta in places:
            both = x.terms.and_(condition, where)
            offset = (value >> OFFSET_SHIFT & OFFSET_MASK) + delta
            if value and start <= offset <= end - count:
                targets.append(Target(both, offset, value & BIT_MASK, value >> OBJECT_SHIFT))
            else:
                x.trap(state, both, "R0110", site)
    return targets


def extent(objects: Objects, size: int, number: int, site: int) -> tuple[int, int]:
    """The first byte of an object and the byte behind its last.  Raises Refused for what ends while pointers to it are kept."""
    if number == BUFFER_OBJECT:
        return 0, size
    row = number - FIRST_OBJECT
    if 0 <= row < len(objects.extents):
        return objects.extents[row]
    if number == 0:
        return 0, 0
    if objects.is_made(number):
        raise Refused("what __NEW has made cannot be followed", site)
    raise Refused("a pointer to a variable that ends with its call cannot be followed", site)


def cases(terms: Terms, state: State, term: Term, most: int = MOST_CASES) -> Cases | None:
    """The values that a term may have, each with its condition; None if there are too many.

    What checks of the path have ruled out is left out: where it is the value all the same, the scan has trapped."""
    return _Values(terms, state, most).of(term)


class _Values:
    """The values of terms at one place of a scan; those of parts that terms share are worked out once."""

    def __init__(self, terms: Terms, state: State, most: int) -> None:
        self.terms, self.state, self.most = terms, state, most
        self._found: dict[Term, Cases | None] = {}

    def of(self, term: Term) -> Cases | None:
        if term.is_constant:
            return [(self.terms.true, term.value)]
        if term not in self._found:
            found = self._worked_out(term)
            if found is not None and term in self.state.known:
                low, high = self.state.known[term]
                found = [(condition, value) for condition, value in found if low <= signed(value, term.width) <= high]
            self._found[term] = found
        return self._found[term]

    def _worked_out(self, term: Term) -> Cases | None:
        if term.op == "ite":
            return self._of_choice(*term.args)
        if term.op in _STRUCTURAL:
            return self._of_operands(term)
        return self._enumerated(term)

    def _of_choice(self, choice: Term, then: Term, otherwise: Term) -> Cases | None:
        ways = self.of(then), self.of(otherwise)
        if ways[0] is None or ways[1] is None or len(ways[0]) + len(ways[1]) > self.most:
            return None
        chosen = [(choice, found) for found in ways[0]] + [(self.terms.not_(choice), found) for found in ways[1]]
        return _merged(self.terms, [(self.terms.and_(c, condition), value) for c, (condition, value) in chosen])

    def _of_operands(self, term: Term) -> Cases | None:
        """What the operation gives for each combination of its operands' values."""
        terms = self.terms
        made: list[tuple[Term, list[Term]]] = [(terms.true, [])]
        for arg in term.args:
            each = self.of(arg)
            if each is None or len(made) * len(each) > self.most:
                return self._enumerated(term)
            made = [(terms.and_(c, condition), [*values, terms.constant(arg.width, value)])
                    for c, values in made for condition, value in each]  # fmt: skip
        results = ((condition, terms.again(term, tuple(values))) for condition, values in made)
        return _merged(terms, [(condition, int(result.value)) for condition, result in results])

    def _enumerated(self, term: Term) -> Cases | None:
        """All values within the bounds of a term."""
        low, high = self.state.known.get(term) or bounds(term, True)
        if high - low >= self.most:
            return None
        numbers = (self.terms.constant(term.width, number) for number in range(low, high + 1))
        return [(self.terms.eq(term, number), number.value) for number in numbers]


def _merged(terms: Terms, found: Cases) -> Cases:
    """The same with each value once, and none that is impossible."""
    by_value: dict[int, Term] = {}
    for condition, value in found:
        if condition is not terms.false:
            by_value[value] = terms.or_(by_value.get(value, terms.false), condition)
    return [(condition, value) for value, condition in by_value.items()]
