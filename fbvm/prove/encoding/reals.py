"""REAL and LREAL as the bits of IEEE 754: what can be said of them exactly without arithmetic.

Read as numbers of sign and magnitude the bits are in the order of the values; NaN is in no order, and the zeros are equal.  A NaN
that is computed is canonical, so that the same bits are the same value."""

from __future__ import annotations

from fbvm.prove.encoding.terms import Term, Terms

MANTISSA_BITS = {32: 23, 64: 52}


def is_nan(terms: Terms, a: Term) -> Term:
    """The value is no number: all bits of the exponent are set, and some of the mantissa."""
    infinity = ((1 << a.width - 1) - 1) >> MANTISSA_BITS[a.width] << MANTISSA_BITS[a.width]
    magnitude = terms.extract(a, 0, a.width - 1)
    return terms.less(terms.constant(a.width - 1, infinity), magnitude, False)


def equal(terms: Terms, a: Term, b: Term) -> Term:
    """a = b: the same bits, or both zeros; never with NaN."""
    both_zero = terms.and_(*(terms.not_(_is_set(terms, each)) for each in (a, b)))
    return terms.all_of(terms.or_(terms.eq(a, b), both_zero), *(terms.not_(is_nan(terms, each)) for each in (a, b)))


def less(terms: Terms, a: Term, b: Term, or_equal: bool) -> Term:
    """a < b, or with `or_equal` a <= b; FALSE with NaN."""
    numbers = terms.and_(terms.not_(is_nan(terms, a)), terms.not_(is_nan(terms, b)))
    return terms.and_(numbers, terms.less(_ordered(terms, a), _ordered(terms, b), True, or_equal))


def _ordered(terms: Terms, a: Term) -> Term:
    """A signed number in the order of the values: minus the magnitude for a negative one, so both zeros are 0."""
    magnitude = terms.extend(terms.extract(a, 0, a.width - 1), a.width, False)
    return terms.ite(terms.bit(a, a.width - 1), terms.neg(magnitude), magnitude)


def _is_set(terms: Terms, a: Term) -> Term:
    return terms.is_set(terms.extract(a, 0, a.width - 1))


def negated(terms: Terms, a: Term) -> Term:
    """-a."""
    return terms.ite(is_nan(terms, a), _nan(terms, a.width), terms.bitwise("bvxor", a, terms.constant(a.width, 1 << a.width - 1)))


def _nan(terms: Terms, width: int) -> Term:
    """The canonical NaN."""
    return terms.constant(width, ((1 << width - 1) - 1) >> MANTISSA_BITS[width] - 1 << MANTISSA_BITS[width] - 1)


def magnitude(terms: Terms, a: Term) -> Term:
    """The value without its sign."""
    return terms.ite(is_nan(terms, a), _nan(terms, a.width), terms.extend(terms.extract(a, 0, a.width - 1), a.width, False))


def extreme(terms: Terms, a: Term, b: Term, least: bool) -> Term:
    """The lesser or the greater of two, a if they are equal, NaN if one is NaN."""
    wrong = terms.or_(is_nan(terms, a), is_nan(terms, b))
    first = less(terms, a, b, True) if least else less(terms, b, a, True)
    return terms.ite(wrong, _nan(terms, a.width), terms.ite(first, a, b))
