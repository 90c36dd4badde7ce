"""Terms: Booleans and bit-vectors as a graph in which equal terms are one object, simplified while they are made.

A term has a width: 0 for a Boolean, the number of bits of a bit-vector, TEXT for the characters of a string.  Constants are
unsigned numbers.  An encoder that is fed with constants gets constants: so it is an interpreter, too.

`unknown` terms stand for what the solver is not told, such as a sum of REALs: they may have any value, the same one for the
same operands.  A proof that needs nothing of them holds; a counterexample in which they have a value may be none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fbvm.prove.encoding.term import FEW_LEAVES, TEXT, Term, bounds, is_choice, leaf_count, opposite, signed

__all__ = ["TEXT", "Term", "Terms", "TimeOver", "bounds", "signed"]

TERMS_A_LOOK = 4096
"""After how many terms a factory asks whether the time is over."""


class TimeOver(Exception):
    """The time that was given has passed while terms were made."""


def never() -> bool:
    """No limit of time."""
    return False


class Terms:
    """Makes terms.  Terms of two factories are never mixed.  Raises TimeOver once `expired` answers True."""

    def __init__(self, expired: Callable[[], bool] = never) -> None:
        self.expired = expired
        self._asked = 0
        self._known: dict[tuple[Any, ...], Term] = {}
        self.false = self._make("const", 0, (), 0, 0, 0)
        self.true = self._make("const", 0, (), 1, 1, 1)

    def _make(self, op: str, width: int, args: tuple[Term, ...], value: Any = None, low: int = 0,
              high: int | None = None) -> Term:  # fmt: skip
        self._asked += 1
        if not self._asked % TERMS_A_LOOK and self.expired():
            raise TimeOver
        key = (op, width, value, args) if op != "const" else (op, width, type(value), value)
        term = self._known.get(key)
        if term is None:
            most = (1 << max(width, 1)) - 1
            high = most if high is None else min(high, most)
            term = self._known[key] = Term(op, width, args, value, len(self._known), low, high)
        return term

    # --- leaves

    def boolean(self, value: object) -> Term:
        """TRUE or FALSE."""
        return self.true if value else self.false

    def constant(self, width: int, value: int) -> Term:
        """A bit-vector; of a number that is negative or too large its low bits."""
        if width == 0:
            return self.boolean(value)
        value &= (1 << width) - 1
        return self._make("const", width, (), value, value, value)

    def text(self, value: bytes | str) -> Term:
        """The characters of a STRING (bytes) or of a WSTRING (str)."""
        return self._make("const", TEXT, (), value)

    def variable(self, name: Any, width: int) -> Term:
        """The variable of a name, which is any value that can be a key of a dictionary."""
        return self._make("var", width, (), name)

    def unknown(self, name: Any, width: int, *args: Term) -> Term:
        """A value of which nothing is known but that it is the same for the same operands."""
        return self._make("unknown", width, args, name)

    # --- Booleans

    def not_(self, a: Term) -> Term:
        if a.op == "const":
            return self.boolean(not a.value)
        return a.args[0] if a.op == "not" else self._make("not", 0, (a,))

    def and_(self, a: Term, b: Term) -> Term:
        if a.op == "const":
            return b if a.value else a
        if b.op == "const":
            return a if b.value else b
        if a is b:
            return a
        if a.number > b.number:
            a, b = b, a
        if opposite(a, b):
            return self.false
        return self._simpler_and(a, b) or self._make("and", 0, (a, b))

    def _simpler_and(self, a: Term, b: Term) -> Term | None:
        """What a and b come to if one is, or negates, a conjunction with the other in it."""
        for one, other in ((a, b), (b, a)):
            if one.op == "and":
                if other in one.args:
                    return one
                if opposite(one.args[0], other) or opposite(one.args[1], other):
                    return self.false
            elif one.op == "not" and one.args[0].op == "and":
                left, right = one.args[0].args
                if other is left or other is right:  # a and not (a and c)
                    return self.and_(other, self.not_(right if other is left else left))
                if opposite(left, other) or opposite(right, other):
                    return other
        if a.op == b.op == "not" and a.args[0].op == b.args[0].op == "and":
            for shared in a.args[0].args:  # not (p and c), not (p and not c)
                if shared in b.args[0].args and opposite(_other(a.args[0], shared), _other(b.args[0], shared)):
                    return self.not_(shared)
        return None

    def or_(self, a: Term, b: Term) -> Term:
        return self.not_(self.and_(self.not_(a), self.not_(b)))

    def xor(self, a: Term, b: Term) -> Term:
        """Of Booleans."""
        for one, other in ((a, b), (b, a)):
            if one.op == "const":
                return self.not_(other) if one.value else other
        if a.op == "not":
            return self.not_(self.xor(a.args[0], b))
        if b.op == "not":
            return self.not_(self.xor(a, b.args[0]))
        if a is b:
            return self.false
        return self._make("xor", 0, (a, b) if a.number < b.number else (b, a))

    def all_of(self, *terms: Term) -> Term:
        found = self.true
        for term in terms:
            found = self.and_(found, term)
        return found

    def any_of(self, *terms: Term) -> Term:
        found = self.false
        for term in terms:
            found = self.or_(found, term)
        return found

    def ite(self, c: Term, a: Term, b: Term) -> Term:
        """a if c is TRUE, else b."""
        if c.op == "const":
            return a if c.value else b
        if a is b:
            return a
        if c.op == "not":
            return self.ite(c.args[0], b, a)
        if a.op == "ite" and a.args[0] is c:
            return self.ite(c, a.args[1], b)
        if b.op == "ite" and b.args[0] is c:
            return self.ite(c, a, b.args[2])
        if a.width == 0:
            if a.op == "const" or a is c:
                return self.or_(c, b) if a is c or a.value else self.and_(self.not_(c), b)
            if b.op == "const" or b is c:
                return self.and_(c, a) if b is c or not b.value else self.or_(self.not_(c), a)
            if opposite(a, b):
                return self.not_(self.xor(c, a))
        return self._make("ite", a.width, (c, a, b), None, min(a.low, b.low), max(a.high, b.high))

    # --- comparisons

    def eq(self, a: Term, b: Term) -> Term:
        if a is b:
            return self.true
        if a.width == 0:
            return self.not_(self.xor(a, b))
        if a.op == b.op == "const":
            return self.boolean(a.value == b.value)
        if a.width > 0 and (a.high < b.low or b.high < a.low):
            return self.false
        if a.op == "const":
            a, b = b, a
        if b.op == "const":
            if a.op == "ite" and leaf_count(a, FEW_LEAVES) is not None:
                return self.ite(a.args[0], self.eq(a.args[1], b), self.eq(a.args[2], b))
            if a.op in ("zext", "sext"):
                narrow = self.constant(a.args[0].width, b.value)
                fits = self.extend(narrow, a.width, a.op == "sext") is b
                return self.eq(a.args[0], narrow) if fits else self.false
            if a.op == "add" and a.args[1].op == "const":
                return self.eq(a.args[0], self.sub(b, a.args[1]))
        return self._make("eq", 0, (a, b) if a.number < b.number else (b, a))

    def less(self, a: Term, b: Term, is_signed: bool, or_equal: bool = False) -> Term:
        """a < b, or with `or_equal` a <= b."""
        if a is b:
            return self.boolean(or_equal)
        (al, ah), (bl, bh) = (bounds(a, is_signed), bounds(b, is_signed))
        if ah < bl or (or_equal and ah <= bl):
            return self.true
        if al > bh or (not or_equal and al >= bh):
            return self.false
        for one, other in ((a, b), (b, a)):
            if one.op == "const" and other.op == "ite" and leaf_count(other, FEW_LEAVES) is not None:
                ways = [self.less(x, b, is_signed, or_equal) if other is a else self.less(a, x, is_signed, or_equal)
                        for x in other.args[1:]]
                return self.ite(other.args[0], *ways)
        return self._make(f"{'s' if is_signed else 'u'}l{'e' if or_equal else 't'}", 0, (a, b))

    def _chosen(self, a: Term, make: Callable[[Term], Term]) -> Term:
        """An operation of one of a few constants as one of its results."""
        if a.op != "ite":
            return make(a)
        return self.ite(a.args[0], self._chosen(a.args[1], make), self._chosen(a.args[2], make))

    # --- bit-vectors

    def add(self, a: Term, b: Term) -> Term:
        if a.op == "const":
            a, b = b, a
        if b.op == "const":
            if a.op == "const":
                return self.constant(a.width, a.value + b.value)
            if b.value == 0:
                return a
            if a.op == "add" and a.args[1].op == "const":
                return self.add(a.args[0], self.constant(a.width, a.args[1].value + b.value))
            if is_choice(a):
                return self._chosen(a, lambda way: self.add(way, b))
        if a.high + b.high < 1 << a.width:
            return self._make("add", a.width, (a, b), None, a.low + b.low, a.high + b.high)
        return self._make("add", a.width, (a, b))

    def neg(self, a: Term) -> Term:
        if a.op == "const":
            return self.constant(a.width, -a.value)
        return a.args[0] if a.op == "neg" else self._make("neg", a.width, (a,))

    def sub(self, a: Term, b: Term) -> Term:
        if a is b:
            return self.constant(a.width, 0)
        if b.op == "const":
            return self.add(a, self.constant(a.width, -b.value))
        if a.op == "const" and a.value == 0:
            return self.neg(b)
        return self._make("sub", a.width, (a, b))

    def mul(self, a: Term, b: Term) -> Term:
        if a.op == "const":
            a, b = b, a
        if b.op == "const":
            if a.op == "const":
                return self.constant(a.width, a.value * b.value)
            if b.value in (0, 1):
                return a if b.value else b
            if is_choice(a):
                return self._chosen(a, lambda way: self.mul(way, b))
        high = a.high * b.high
        return self._make("mul", a.width, (a, b), None, *((a.low * b.low, high) if high < 1 << a.width else (0, None)))

    def divide(self, op: str, a: Term, b: Term) -> Term:
        """`udiv`, `urem`, `sdiv` (toward zero) or `srem` (with the sign of a); for b = 0 as SMT-LIB has it."""
        if a.op == b.op == "const" and b.value:
            x, y = (signed(t.value, t.width) if op[0] == "s" else t.value for t in (a, b))
            quotient = abs(x) // abs(y) * (1 if (x < 0) == (y < 0) else -1)
            return self.constant(a.width, quotient if op.endswith("div") else x - y * quotient)
        if b.op == "const" and b.value and is_choice(a):
            return self._chosen(a, lambda way: self.divide(op, way, b))
        if b.op == "const" and b.value == 1:
            return a if op.endswith("div") else self.constant(a.width, 0)
        if op[0] == "s" and max(a.high, b.high) >> (a.width - 1) == 0:
            return self.divide("u" + op[1:], a, b)
        high = None
        if op[0] == "u" and b.low > 0:
            high = a.high // b.low if op == "udiv" else min(a.high, b.high - 1)
        return self._make(op, a.width, (a, b), None, 0, high)

    def bitwise(self, op: str, a: Term, b: Term) -> Term:
        """`bvand`, `bvor` or `bvxor`."""
        if a.op == "const":
            a, b = b, a
        ones = (1 << a.width) - 1
        if b.op == "const":
            if a.op == "const":
                value = a.value & b.value if op == "bvand" else a.value | b.value if op == "bvor" else a.value ^ b.value
                return self.constant(a.width, value)
            if b.value == (ones if op == "bvand" else 0):
                return a
            if b.value == (0 if op == "bvand" else ones):
                return self.invert(a) if op == "bvxor" else b
            if is_choice(a):
                return self._chosen(a, lambda way: self.bitwise(op, way, b))
        if a is b:
            return self.constant(a.width, 0) if op == "bvxor" else a
        high = min(a.high, b.high) if op == "bvand" else (1 << max(a.high, b.high).bit_length()) - 1
        return self._make(op, a.width, (a, b), None, 0, high)

    def invert(self, a: Term) -> Term:
        if a.op == "const":
            return self.constant(a.width, ~a.value)
        return a.args[0] if a.op == "bvnot" else self._make("bvnot", a.width, (a,))

    def shift(self, op: str, a: Term, n: Term) -> Term:
        """`shl` or `shr` (zeros enter) by n, read as unsigned; all zeros from the width on."""
        if n.op == "const":
            if n.value >= a.width:
                return self.constant(a.width, 0)
            if n.value == 0:
                return a
            if is_choice(a):
                return self._chosen(a, lambda way: self.shift(op, way, n))
            zeros = self.constant(n.value, 0)
            if op == "shl":
                return self.concat(self.extract(a, 0, a.width - n.value), zeros)
            return self.extend(self.extract(a, n.value, a.width - n.value), a.width, False)
        return self._make(op, a.width, (a, n), None, 0, a.high if op == "shr" else None)

    def extract(self, a: Term, low: int, width: int) -> Term:
        """`width` bits from bit `low` on."""
        if width == a.width:
            return a
        if a.op == "const":
            return self.constant(width, a.value >> low)
        if a.op == "extract":
            return self.extract(a.args[0], a.value + low, width)
        if a.op == "concat":
            high, rest = a.args
            if low >= rest.width:
                return self.extract(high, low - rest.width, width)
            if low + width <= rest.width:
                return self.extract(rest, low, width)
            return self.concat(self.extract(high, 0, low + width - rest.width), self.extract(rest, low, rest.width - low))
        return self._extracted_inside(a, low, width) or self._make(
            "extract", width, (a,), low, *((a.low, a.high) if low == 0 and a.high < 1 << width else (0, None)))

    def _extracted_inside(self, a: Term, low: int, width: int) -> Term | None:
        """Some bits of a result as a result of some bits of its operands."""
        if a.op in ("zext", "sext"):
            inner = a.args[0]
            if low + width <= inner.width:
                return self.extract(inner, low, width)
            if a.op == "zext" and low >= inner.width:
                return self.constant(width, 0)
            if low == 0:
                return self.extend(inner, width, a.op == "sext")
        if a.op == "ite" and (a.args[1].op == "const" or a.args[2].op == "const" or is_choice(a)):
            return self.ite(a.args[0], self.extract(a.args[1], low, width), self.extract(a.args[2], low, width))
        if a.op in ("bvand", "bvor", "bvxor"):
            return self.bitwise(a.op, self.extract(a.args[0], low, width), self.extract(a.args[1], low, width))
        if a.op == "bvnot":
            return self.invert(self.extract(a.args[0], low, width))
        if low == 0 and a.op in ("add", "sub", "mul"):
            left, right = self.extract(a.args[0], 0, width), self.extract(a.args[1], 0, width)
            return {"add": self.add, "sub": self.sub, "mul": self.mul}[a.op](left, right)
        return None

    def concat(self, high: Term, low: Term) -> Term:
        """The bits of `high` in front of those of `low`."""
        width = high.width + low.width
        if high.op == low.op == "const":
            return self.constant(width, high.value << low.width | low.value)
        if high.op == "const" and high.value == 0:
            return self.extend(low, width, False)
        if high.op == low.op == "extract" and high.args == low.args and high.value == low.value + low.width:
            return self.extract(high.args[0], low.value, width)
        if low.op == "concat" and high.op == "extract" == low.args[0].op and high.args == low.args[0].args \
                and high.value == low.args[0].value + low.args[0].width:
            return self.concat(self.concat(high, low.args[0]), low.args[1])
        least, most = (high.low << low.width) + low.low, (high.high << low.width) + low.high
        return self._make("concat", width, (high, low), None, least, most)

    def extend(self, a: Term, width: int, is_signed: bool) -> Term:
        """The same number in a wider bit-vector."""
        if width == a.width:
            return a
        if is_signed and a.high >> (a.width - 1) == 0:
            is_signed = False
        if a.op == "const":
            return self.constant(width, signed(a.value, a.width) if is_signed else a.value)
        if a.op == "zext":
            return self.extend(a.args[0], width, False)
        if a.op == "sext" and is_signed:
            return self.extend(a.args[0], width, True)
        if is_choice(a):
            return self._chosen(a, lambda way: self.extend(way, width, is_signed))
        return self._make("sext", width, (a,)) if is_signed else self._make("zext", width, (a,), None, a.low, a.high)

    def resized(self, a: Term, width: int, is_signed: bool) -> Term:
        """A number in more bits, or its low bits."""
        return self.extract(a, 0, width) if width < a.width else self.extend(a, width, is_signed)

    def of_boolean(self, a: Term, width: int) -> Term:
        """1 or 0 in some bits."""
        return self.ite(a, self.constant(width, 1), self.constant(width, 0))

    def is_set(self, a: Term) -> Term:
        """a <> 0; a Boolean itself."""
        return a if a.width == 0 else self.not_(self.eq(a, self.constant(a.width, 0)))

    def bit(self, a: Term, number: int) -> Term:
        """A bit of a bit-vector as a Boolean."""
        return self.is_set(self.extract(a, number, 1))

    # --- again

    def again(self, term: Term, args: tuple[Term, ...]) -> Term:
        """The operation of `term` for other operands, simplified as when it was made."""
        op = term.op
        if op in _SIMPLE:
            made: Term = getattr(self, _SIMPLE[op])(*args)
            return made
        if op in _COMPARISONS:
            return self.less(args[0], args[1], *_COMPARISONS[op])
        if op in ("udiv", "urem", "sdiv", "srem"):
            return self.divide(op, *args)
        if op in ("bvand", "bvor", "bvxor"):
            return self.bitwise(op, *args)
        if op in ("shl", "shr"):
            return self.shift(op, *args)
        if op == "extract":
            return self.extract(args[0], term.value, term.width)
        if op in ("zext", "sext"):
            return self.extend(args[0], term.width, op == "sext")
        return self._make(op, term.width, args, term.value)


_SIMPLE = {"not": "not_", "and": "and_", "xor": "xor", "ite": "ite", "eq": "eq", "add": "add", "sub": "sub", "neg": "neg",
           "mul": "mul", "bvnot": "invert", "concat": "concat"}
_COMPARISONS = {"ult": (False, False), "ule": (False, True), "slt": (True, False), "sle": (True, True)}


def _other(pair: Term, one: Term) -> Term:
    return pair.args[1] if pair.args[0] is one else pair.args[0]
