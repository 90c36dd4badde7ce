"""Terms are simplified while they are made: each means what its operations say, and what is plain becomes plain."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from rows import each_of
from symbolic import term_value

from fbvm.prove.encoding.rewriting import substituted
from fbvm.prove.encoding.terms import Term, Terms, bounds, signed

VALUES = [{"a": 0, "b": 0, "p": 0, "q": 1}, {"a": 5, "b": 11, "p": 1, "q": 0}, {"a": 15, "b": 1, "p": 1, "q": 1},
          {"a": 8, "b": 7, "p": 0, "q": 0}, {"a": 8, "b": 15, "p": 1, "q": 0}, {"a": 3, "b": 3, "p": 0, "q": 1}]  # fmt: skip
WIDTHS = (1, 2, 4, 7)
Meant = tuple[Term, list[int]]
"""A term, and what it has to be for each row of VALUES."""


class Maker:
    """Makes random terms together with their values, which Python works out from those of the operands."""

    def __init__(self, seed: int) -> None:
        self.random, self.terms = random.Random(seed), Terms()

    def made(self, width: int, depth: int) -> Meant:
        terms = self.terms
        if depth == 0 or self.random.random() < 0.15:
            return self.leaf(width)
        if width == 0:
            return self.boolean(depth - 1)
        kind = self.random.choice(["add", "sub", "mul", "neg", "bits", "invert", "ite", "shift", "resized", "concat", "divide"])
        one, other = self.made(width, depth - 1), self.made(width, depth - 1)
        if kind in ("add", "sub", "mul"):
            row: dict[str, Callable[[int, int], int]] = {
                "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b}
            return self.both(getattr(terms, kind)(one[0], other[0]), row[kind], one, other)
        if kind == "neg":
            return self.both(terms.neg(one[0]), lambda a, _: -a, one, other)
        if kind == "invert":
            return self.both(terms.invert(one[0]), lambda a, _: ~a, one, other)
        if kind == "bits":
            name, made = self.random.choice([("bvand", int.__and__), ("bvor", int.__or__), ("bvxor", int.__xor__)])
            return self.both(terms.bitwise(name, one[0], other[0]), made, one, other)
        if kind == "shift":
            name = self.random.choice(["shl", "shr"])
            return self.both(terms.shift(name, one[0], other[0]), lambda a, n: a << n if name == "shl" else a >> n, one, other)
        if kind == "divide":
            return self.divided(one, other)
        if kind == "ite":
            choice = self.made(0, depth - 1)
            found = [a if c else b for c, a, b in zip(choice[1], one[1], other[1], strict=True)]
            return terms.ite(choice[0], one[0], other[0]), found
        narrow = self.made(self.random.choice([each for each in WIDTHS if each != width]), depth - 1)
        if kind == "concat":
            low = self.random.randrange(width + 1)
            term = terms.extract(terms.concat(one[0], other[0]), low, width)
            return self.both(term, lambda a, b: (a << width | b) >> low, one, other)
        is_signed = self.random.random() < 0.5
        term = terms.resized(narrow[0], width, is_signed)
        return self.both(term, lambda a, _: signed(a, narrow[0].width) if is_signed else a, narrow, narrow)

    def divided(self, one: Meant, other: Meant) -> Meant:
        op, width = self.random.choice(["udiv", "urem", "sdiv", "srem"]), one[0].width
        ones = self.terms.constant(width, self.random.randrange(1, 1 << width)) if self.random.random() < 0.5 else \
            self.terms.bitwise("bvor", other[0], self.terms.constant(width, 1))
        found = ones, [term_value(ones, self.values(row)) for row in VALUES]

        def quotient(a: int, b: int) -> int:
            if op[0] == "s":
                a, b = signed(a, width), signed(b, width)
            toward_zero = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
            return toward_zero if op.endswith("div") else a - b * toward_zero

        return self.both(self.terms.divide(op, one[0], ones), quotient, one, found)

    def both(self, term: Term, result: Callable[[int, int], int], one: Meant, other: Meant) -> Meant:
        return term, [result(a, b) & ((1 << term.width) - 1) for a, b in zip(one[1], other[1], strict=True)]

    def boolean(self, depth: int) -> Meant:
        terms, kind = self.terms, self.random.choice(["and_", "or_", "xor", "not_", "ite", "eq", "less", "less", "is_set"])
        width = self.random.choice(WIDTHS if kind in ("eq", "less", "is_set") else (0,))
        one, other, choice = self.made(width, depth), self.made(width, depth), self.made(0, depth)
        if kind == "not_":
            return terms.not_(one[0]), [not value for value in one[1]]
        if kind == "is_set":
            return terms.is_set(one[0]), [value != 0 for value in one[1]]
        if kind == "ite":
            return terms.ite(choice[0], one[0], other[0]), [
                a if c else b for c, a, b in zip(choice[1], one[1], other[1], strict=True)]
        if kind == "less":
            is_signed, equal = self.random.random() < 0.5, self.random.random() < 0.5
            lefts, rights = ([signed(each, width) if is_signed else each for each in side[1]] for side in (one, other))
            return terms.less(one[0], other[0], is_signed, equal), [
                a < b or (equal and a == b) for a, b in zip(lefts, rights, strict=True)]
        row: dict[str, Callable[[int, int], int]] = {
            "and_": lambda a, b: a and b, "or_": lambda a, b: a or b, "xor": lambda a, b: a != b, "eq": lambda a, b: a == b}
        return getattr(terms, kind)(one[0], other[0]), [row[kind](a, b) for a, b in zip(one[1], other[1], strict=True)]

    def leaf(self, width: int) -> Meant:
        if self.random.random() < 0.3:
            value = self.random.randrange(1 << max(width, 1))
            return self.terms.constant(width, value), [value] * len(VALUES)
        name = self.random.choice("ab" if width else "pq")
        variable = self.terms.variable(name, 4 if width else 0)
        if not width:
            return variable, [row[name] for row in VALUES]
        plain = variable, [row[name] for row in VALUES]
        return self.both(self.terms.resized(variable, width, False), lambda a, _: a, plain, plain)

    def values(self, row: dict[str, int]) -> dict[Term, int]:
        return {self.terms.variable(name, 4 if name in "ab" else 0): value for name, value in row.items()}


@pytest.mark.parametrize("seed", range(12))
def test_a_term_means_what_its_operations_say(seed: int) -> None:
    maker = Maker(seed)
    for _ in range(12):
        term, wanted = maker.made(maker.random.choice([0, 4]), 4)
        low, high = bounds(term, True) if term.width else (0, 1)
        for row, value in zip(VALUES, wanted, strict=True):
            assert term_value(term, maker.values(row)) == value, f"{term} for {row}"
            assert term.low <= value <= term.high, f"{term} for {row}"
            assert not term.width or low <= signed(value, term.width) <= high, f"{term} for {row}"
        constants = {leaf: maker.terms.constant(leaf.width, value) for leaf, value in maker.values(VALUES[1]).items()}
        assert substituted(maker.terms, [term], constants)[0] is maker.terms.constant(term.width, wanted[1]), f"{term}"


WIDE = 4
SOME = (0, 1, 2, 7, 8, 9, 14, 15)
"""Constants of so many bits at which something changes."""


def _divided(a: int, b: int) -> tuple[int, int]:
    quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    return quotient, a - b * quotient


def s(value: int) -> int:
    return signed(value, WIDE)


BINARY: dict[str, tuple[Callable[[Terms, Term, Term], Term], Callable[[int, int], int]]] = {
    "add": (Terms.add, lambda a, b: a + b), "sub": (Terms.sub, lambda a, b: a - b), "mul": (Terms.mul, lambda a, b: a * b),
    **{name: (lambda terms, a, b, name=name: terms.bitwise(name, a, b), made) for name, made in (
        ("bvand", int.__and__), ("bvor", int.__or__), ("bvxor", int.__xor__))},
    "shl": (lambda terms, a, b: terms.shift("shl", a, b), lambda a, n: a << n),
    "shr": (lambda terms, a, b: terms.shift("shr", a, b), lambda a, n: a >> n),
    "udiv": (lambda terms, a, b: terms.divide("udiv", a, b), lambda a, b: a // b),
    "urem": (lambda terms, a, b: terms.divide("urem", a, b), lambda a, b: a % b),
    "sdiv": (lambda terms, a, b: terms.divide("sdiv", a, b), lambda a, b: _divided(s(a), s(b))[0]),
    "srem": (lambda terms, a, b: terms.divide("srem", a, b), lambda a, b: _divided(s(a), s(b))[1]),
    "eq": (Terms.eq, lambda a, b: a == b),
    "ult": (lambda terms, a, b: terms.less(a, b, False), lambda a, b: a < b),
    "ule": (lambda terms, a, b: terms.less(a, b, False, True), lambda a, b: a <= b),
    "slt": (lambda terms, a, b: terms.less(a, b, True), lambda a, b: s(a) < s(b)),
    "sle": (lambda terms, a, b: terms.less(a, b, True, True), lambda a, b: s(a) <= s(b)),
    "concat": (Terms.concat, lambda a, b: a << WIDE | b),
}  # fmt: skip


@pytest.mark.slow
@each_of("name", BINARY)
def test_an_operation_with_a_constant_means_the_same_for_every_value(name: str) -> None:
    make, meaning = BINARY[name]
    terms = Terms()
    x, p = terms.variable("x", WIDE), terms.variable("p", 0)
    three = terms.ite(p, terms.constant(WIDE, 3), terms.ite(terms.eq(x, terms.constant(WIDE, 9)), terms.constant(WIDE, 8),
                                                            terms.constant(WIDE, 0)))  # fmt: skip
    low = terms.extend(terms.extract(x, 0, 2), WIDE, False)
    operands = (x, terms.neg(x), terms.invert(x), terms.add(x, terms.constant(WIDE, 5)), three, low, terms.of_boolean(p, WIDE),
                terms.concat(terms.constant(2, 0), terms.extract(x, 1, 2)), terms.extend(terms.extract(x, 1, 3), WIDE, True))
    pairs = [(one, constant) for one in operands for constant in SOME]
    for one, number in pairs:
        constant = terms.constant(WIDE, number)
        for left, right in ((one, constant), (constant, one)):
            if name[1:] in ("div", "rem") and (right is not constant or not number):
                continue
            term = make(terms, left, right)
            assert 0 <= term.low <= term.high < 1 << max(term.width, 1), f"{term}"
            for value in range(1 << WIDE):
                for choice in (0, 1) if one in (three, operands[6]) else (0,):
                    known = {x: value, p: choice}
                    a, b = term_value(left, known), term_value(right, known)
                    wanted = meaning(a, b) & ((1 << max(term.width, 1)) - 1)
                    assert term_value(term, known) == wanted, f"{left} {name} {right} = {term} for {known}"
                    assert term.low <= wanted <= term.high, f"{term} for {known}"


T = Terms()
A, B, C = (T.variable(name, 8) for name in "abc")
P, Q, R = (T.variable(name, 0) for name in "pqr")


def number(value: int, width: int = 8) -> Term:
    return T.constant(width, value)


FEW = T.ite(P, number(3), T.ite(Q, number(200), number(0)))
"""One of three constants."""
TO_16 = T.add(T.bitwise("bvand", A, number(15)), number(1))
"""A number from 1 to 16."""


@pytest.mark.parametrize(("made", "wanted"), [
    # Booleans
    (T.and_(P, P), P), (T.and_(T.true, P), P), (T.and_(P, T.true), P), (T.and_(P, T.false), T.false),
    (T.and_(P, T.not_(P)), T.false),
    (T.and_(Q, P), T.and_(P, Q)), (T.and_(T.and_(P, Q), Q), T.and_(P, Q)), (T.and_(T.and_(P, Q), T.not_(Q)), T.false),
    (T.and_(P, T.not_(T.and_(P, Q))), T.and_(P, T.not_(Q))), (T.and_(Q, T.not_(T.and_(P, Q))), T.and_(Q, T.not_(P))),
    (T.and_(T.not_(P), T.not_(T.and_(P, Q))), T.not_(P)), (T.and_(T.not_(Q), T.not_(T.and_(P, Q))), T.not_(Q)),
    (T.or_(T.and_(P, Q), T.and_(P, T.not_(Q))), P), (T.or_(T.and_(Q, P), T.and_(R, T.not_(P))).op, "not"),
    (T.xor(P, P), T.false), (T.xor(P, T.true), T.not_(P)), (T.xor(T.false, P), P), (T.xor(T.not_(P), Q), T.not_(T.xor(P, Q))),
    (T.xor(Q, P), T.xor(P, Q)), (T.xor(P, T.not_(Q)), T.not_(T.xor(P, Q))), (T.eq(P, P), T.true),
    (T.ite(P, Q, Q), Q), (T.ite(T.not_(P), A, B), T.ite(P, B, A)), (T.ite(P, T.ite(P, A, B), C), T.ite(P, A, C)),
    (T.ite(P, A, T.ite(P, B, C)), T.ite(P, A, C)), (T.ite(P, T.true, Q), T.or_(P, Q)),
    (T.ite(P, T.false, Q), T.and_(T.not_(P), Q)),
    (T.ite(P, Q, T.true), T.or_(T.not_(P), Q)), (T.ite(P, Q, T.false), T.and_(P, Q)), (T.ite(P, P, Q), T.or_(P, Q)),
    (T.ite(P, Q, P), T.and_(P, Q)), (T.ite(P, Q, T.not_(Q)), T.not_(T.xor(P, Q))),
    # comparisons
    (T.eq(A, A), T.true), (T.eq(number(3), number(4)), T.false), (T.eq(number(3), A), T.eq(A, number(3))),
    (T.eq(B, A), T.eq(A, B)),
    (T.eq(FEW, number(200)), T.and_(T.not_(P), Q)), (T.eq(FEW, number(7)), T.false),
    (T.eq(T.extend(A, 16, False), number(7, 16)), T.eq(A, number(7))), (T.eq(T.extend(A, 16, False), number(256, 16)), T.false),
    (T.eq(T.extend(A, 16, True), number(-1, 16)), T.eq(A, number(255))), (T.eq(T.extend(A, 16, True), number(128, 16)), T.false),
    (T.eq(T.add(A, number(3)), number(10)), T.eq(A, number(7))),
    (T.less(A, A, False), T.false), (T.less(A, A, True, True), T.true), (T.less(FEW, number(100), False).op, "not"),
    (T.less(number(3), FEW, False), T.and_(T.not_(P), Q)), (T.less(FEW, number(0), True), T.and_(T.not_(P), Q)),
    (T.less(A, number(0), False), T.false), (T.less(number(255), A, False), T.false),
    (T.less(A, number(255), False, True), T.true),
    (T.less(number(0), A, False, True), T.true), (T.less(T.extend(A, 16, False), number(256, 16), True), T.true),
    (T.less(T.extend(A, 16, True), number(-128, 16), True), T.false),
    # bit-vectors
    (T.add(A, number(0)), A), (T.add(number(1), A), T.add(A, number(1))),
    (T.add(T.add(A, number(3)), number(4)), T.add(A, number(7))),
    (T.add(FEW, number(60)), T.ite(P, number(63), T.ite(Q, number(4), number(60)))), (T.neg(T.neg(A)), A),
    (T.neg(number(1)), number(255)), (T.sub(A, A), number(0)), (T.sub(A, number(3)), T.add(A, number(253))),
    (T.sub(number(0), A), T.neg(A)), (T.mul(number(1), A), A), (T.mul(A, number(0)), number(0)),
    (T.mul(FEW, number(2)), T.ite(P, number(6), T.ite(Q, number(144), number(0)))), (T.mul(number(3), A), T.mul(A, number(3))),
    (T.divide("sdiv", A, number(1)), A), (T.divide("urem", A, number(1)), number(0)),
    (T.divide("udiv", FEW, number(3)), T.ite(P, number(1), T.ite(Q, number(66), number(0)))),
    (T.divide("sdiv", T.extend(A, 16, False), number(3, 16)), T.divide("udiv", T.extend(A, 16, False), number(3, 16))),
    (T.bitwise("bvand", A, number(255)), A), (T.bitwise("bvor", A, number(0)), A), (T.bitwise("bvxor", number(0), A), A),
    (T.bitwise("bvand", A, number(0)), number(0)), (T.bitwise("bvor", A, number(255)), number(255)),
    (T.bitwise("bvxor", A, number(255)), T.invert(A)), (T.bitwise("bvxor", A, A), number(0)), (T.bitwise("bvor", A, A), A),
    (T.bitwise("bvand", FEW, number(1)), T.ite(P, number(1), number(0))), (T.invert(T.invert(A)), A),
    (T.shift("shl", A, number(8)), number(0)), (T.shift("shr", A, number(0)), A),
    (T.shift("shr", A, number(4)), T.extend(T.extract(A, 4, 4), 8, False)),
    (T.shift("shl", A, number(4)), T.concat(T.extract(A, 0, 4), number(0, 4))),
    (T.extract(A, 0, 8), A), (T.extract(T.extract(A, 2, 6), 1, 3), T.extract(A, 3, 3)),
    (T.extract(T.concat(A, B), 8, 8), A), (T.extract(T.concat(A, B), 2, 4), T.extract(B, 2, 4)),
    (T.extract(T.concat(A, B), 4, 8), T.concat(T.extract(A, 0, 4), T.extract(B, 4, 4))),
    (T.extract(T.extend(A, 16, True), 3, 5), T.extract(A, 3, 5)), (T.extract(T.extend(A, 16, False), 8, 8), number(0)),
    (T.extract(T.extend(A, 32, True), 0, 16), T.extend(A, 16, True)),
    (T.extract(FEW, 7, 1), T.ite(P, number(0, 1), T.ite(Q, number(1, 1), number(0, 1)))),
    (T.extract(T.ite(P, A, number(5)), 0, 4), T.ite(P, T.extract(A, 0, 4), number(5, 4))),
    (T.extract(T.bitwise("bvand", A, B), 4, 4), T.bitwise("bvand", T.extract(A, 4, 4), T.extract(B, 4, 4))),
    (T.extract(T.invert(A), 4, 4), T.invert(T.extract(A, 4, 4))),
    (T.extract(T.add(A, B), 0, 4), T.add(T.extract(A, 0, 4), T.extract(B, 0, 4))),
    (T.concat(number(0), A), T.extend(A, 16, False)), (T.concat(T.extract(A, 4, 4), T.extract(A, 0, 4)), A),
    (T.concat(T.extract(A, 6, 2), T.concat(T.extract(A, 4, 2), B)), T.concat(T.extract(A, 4, 4), B)),
    (T.extend(A, 8, True), A), (T.extend(T.extend(A, 12, False), 16, False), T.extend(A, 16, False)),
    (T.extend(T.extend(A, 12, True), 16, True), T.extend(A, 16, True)),
    (T.extend(T.extend(A, 12, False), 16, True), T.extend(A, 16, False)), (T.extend(number(200), 16, True), number(-56, 16)),
    (T.extend(FEW, 16, False), T.ite(P, number(3, 16), T.ite(Q, number(200, 16), number(0, 16)))),
    (T.resized(A, 4, True), T.extract(A, 0, 4)), (T.is_set(P), P), (T.bit(number(4), 2), T.true),
])  # fmt: skip
def test_what_is_plain_becomes_plain(made: Term | str, wanted: Term | str) -> None:
    assert made is wanted or made == wanted == "not"


@each_of(("op", "most"), (("add", 16), ("eq", 64), ("ult", 64)))
def test_operations_are_carried_through_a_choice_of_up_to_so_many_constants(op: str, most: int) -> None:
    choice, made = number(0), []
    for way in range(1, most + 1):
        choice = T.ite(T.variable(f"c{way}", 0), number(2 * way), choice)
        made.append(BINARY[op][0](T, choice, number(1)).op)
    assert op not in made[:-1] and made[-1] == op


@pytest.mark.parametrize(("term", "low", "high"), [
    (T.extend(A, 16, False), 0, 255), (T.add(T.extend(A, 16, False), number(5, 16)), 5, 260), (T.add(A, number(5)), 0, 255),
    (T.mul(T.extend(A, 16, False), number(3, 16)), 0, 765), (T.mul(A, B), 0, 255), (FEW, 0, 200),
    (T.divide("udiv", A, number(10)), 0, 25), (T.divide("urem", A, number(10)), 0, 9), (T.divide("udiv", A, B), 0, 255),
    (T.bitwise("bvand", A, number(9)), 0, 9), (T.bitwise("bvor", T.extend(A, 16, False), number(256, 16)), 0, 511),
    (T.shift("shr", T.extend(A, 16, False), T.extend(B, 16, False)), 0, 255), (T.shift("shl", A, B), 0, 255),
    (T.extract(T.extend(T.add(A, B), 16, False), 0, 9), 0, 255),
    (T.extract(T.divide("udiv", A, number(10)), 0, 5), 0, 25), (T.extract(T.divide("udiv", A, number(10)), 1, 5), 0, 31),
    (T.concat(T.add(T.extend(A, 9, False), number(1, 9)), B), 256, 65791),
    # what may be a bit too long wraps
    (T.add(A, number(1)), 0, 255), (T.mul(T.add(T.extend(A, 9, False), number(5, 9)), number(3, 9)), 0, 511),
    (T.mul(TO_16, TO_16), 0, 255), (T.extract(T.ite(P, TO_16, T.add(TO_16, TO_16)), 0, 5), 0, 31),
])  # fmt: skip
def test_the_bounds_of_a_result_come_from_those_of_its_operands(term: Term, low: int, high: int) -> None:
    assert (term.low, term.high) == (low, high)
