"""Terms that are simplified while they are made mean what the solver takes them for."""

from __future__ import annotations

import operator
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fbvm.prove.encoding.rewriting import substituted
from fbvm.prove.encoding.terms import Term, Terms, bounds, signed
from fbvm.prove.solver import SAT, UNSAT, Solver

WIDTHS = (1, 4, 8, 16)


@st.composite
def expressions(draw: st.DrawFn, terms: Terms, width: int, depth: int = 3) -> Term:
    """A term over the variables a, b (bit-vectors of 8 bits) and p, q (Booleans)."""
    if depth == 0 or draw(st.integers(0, 5)) == 0:
        if width == 0:
            return draw(st.sampled_from([terms.true, terms.false, *(terms.variable(name, 0) for name in "pq")]))
        plain = terms.constant(width, draw(st.integers(0, (1 << width) - 1)))
        return draw(st.sampled_from([plain, *(terms.resized(terms.variable(name, 8), width, False) for name in "ab")]))
    inner = [draw(expressions(terms, width, depth - 1)) for _ in range(2)]
    condition = draw(expressions(terms, 0, depth - 1))
    if width == 0:
        numbers = [draw(expressions(terms, 8, depth - 1)) for _ in range(2)]
        return draw(st.sampled_from([
            lambda: terms.and_(*inner), lambda: terms.or_(*inner), lambda: terms.xor(*inner), lambda: terms.not_(inner[0]),
            lambda: terms.ite(condition, *inner), lambda: terms.eq(*numbers), lambda: terms.less(*numbers, False),
            lambda: terms.less(*numbers, True), lambda: terms.less(*numbers, True, True)]))()
    other = draw(st.sampled_from([each for each in WIDTHS if each != width]))
    resized = draw(expressions(terms, other, depth - 1))
    return draw(st.sampled_from([
        lambda: terms.add(*inner), lambda: terms.sub(*inner), lambda: terms.mul(*inner), lambda: terms.neg(inner[0]),
        lambda: terms.bitwise("bvand", *inner), lambda: terms.bitwise("bvor", *inner), lambda: terms.bitwise("bvxor", *inner),
        lambda: terms.invert(inner[0]), lambda: terms.ite(condition, *inner), lambda: terms.shift("shl", *inner),
        lambda: terms.shift("shr", *inner), lambda: terms.resized(resized, width, True),
        lambda: terms.resized(resized, width, False),
        lambda: terms.extract(terms.concat(inner[0], inner[1]), width // 2, width)]))()  # fmt: skip


@pytest.mark.slow
@given(st.data())
def test_a_term_of_constants_is_the_constant_that_the_solver_has(data: st.DataObject) -> None:
    terms = Terms()
    term = data.draw(expressions(terms, data.draw(st.sampled_from([0, 8]))))
    values = {name: data.draw(st.integers(0, 255 if name in "ab" else 1)) for name in "abpq"}
    variables = {terms.variable(name, 8 if name in "ab" else 0): value for name, value in values.items()}
    folded = substituted(terms, [term], {leaf: terms.constant(leaf.width, value) for leaf, value in variables.items()})[0]
    assert folded.is_constant
    assert term.low <= folded.value <= term.high
    solver = Solver()
    solver.assume(*(terms.eq(leaf, terms.constant(leaf.width, value)) for leaf, value in variables.items()))
    assert solver.ask() == SAT
    assert solver.values([term])[term] == folded.value


DIVISIONS: dict[str, Callable[[int, int], int]] = {
    "udiv": operator.floordiv, "urem": operator.mod,
    "sdiv": lambda a, b: int(a / b), "srem": lambda a, b: a - b * int(a / b)}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("op", DIVISIONS)
@given(a=st.integers(0, 255), b=st.integers(1, 255))
def test_divisions_of_constants_are_those_of_the_solver(op: str, a: int, b: int) -> None:
    terms = Terms()
    left, right = terms.variable("a", 8), terms.variable("b", 8)
    made = terms.divide(op, left, right)
    folded = terms.divide(op, terms.constant(8, a), terms.constant(8, b))
    numbers = (signed(a, 8), signed(b, 8)) if op[0] == "s" else (a, b)
    assert folded.value == DIVISIONS[op](*numbers) & 255
    solver = Solver()
    solver.assume(terms.eq(left, terms.constant(8, a)), terms.eq(right, terms.constant(8, b)))
    assert solver.ask(terms.eq(made, folded)) == SAT
    assert solver.ask(terms.not_(terms.eq(made, folded))) == UNSAT


def test_a_branch_and_its_opposite_come_together_as_the_path_before() -> None:
    terms = Terms()
    path, choice = terms.variable("path", 0), terms.variable("choice", 0)
    assert terms.or_(terms.and_(path, choice), terms.and_(path, terms.not_(choice))) is path


def test_bounds_of_signed_numbers_come_from_what_was_extended() -> None:
    terms = Terms()
    assert bounds(terms.extend(terms.variable("a", 8), 64, True), True) == (-128, 127)
    assert bounds(terms.extend(terms.variable("a", 8), 64, False), True) == (0, 255)
