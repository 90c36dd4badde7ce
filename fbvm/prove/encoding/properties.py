"""Conditions of users as terms: the same expressions as `--until` takes, over what memory holds behind a scan.

Integers are exact as in `watch.conditions`: they are computed in as many bits as the result needs.  REALs are compared, and not
computed with."""

from __future__ import annotations

import struct
from collections.abc import Callable

from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import REAL, base, machine
from fbvm.code.operations import BIT_MASK, OFFSET_MASK, OFFSET_SHIFT
from fbvm.prove.encoding import reals
from fbvm.prove.encoding.addresses import cases
from fbvm.prove.encoding.cells import Contents
from fbvm.prove.encoding.execution import Refused, State
from fbvm.prove.encoding.expressions import is_signed
from fbvm.prove.encoding.terms import Term, Terms
from fbvm.watch import terms as watched
from fbvm.watch.paths import Place

_REALS = ("f32", "f64")


def condition_term(contents: Contents, condition: watched.Term) -> Term:
    """A condition as a Boolean over what memory holds.  Raises Refused for texts and arithmetic of REAL."""
    return _Property(contents).boolean(condition)


def place_term(contents: Contents, place: Place) -> Term:
    """What lies at a place, as a term.  Raises Refused for texts."""
    return _Property(contents).place(place)


class _Property:
    def __init__(self, contents: Contents) -> None:
        self.contents, self.terms = contents, contents.terms

    def boolean(self, term: watched.Term) -> Term:
        if term.constant is not None:
            return self.terms.boolean(term.constant)
        if term.place:
            return self.place(term.place)
        if term.sign == "NOT":
            return self.terms.not_(self.boolean(term.parts[0]))
        left, right = term.parts
        if term.sign in _LOGIC:
            return _LOGIC[term.sign](self.terms, self.boolean(left), self.boolean(right))
        if left.sort == "BOOL":
            return self._ordered(term.sign, *(self.terms.of_boolean(self.boolean(each), 2) for each in term.parts))
        if _is_real(left) or _is_real(right):
            return self._compared_reals(term)
        return self._ordered(term.sign, *self._alike(*(self.number(each) for each in term.parts)))

    def _compared_reals(self, term: watched.Term) -> Term:
        """A comparison of REALs and LREALs, as numbers of 64 bits; whole numbers are compared with constants only."""
        widest = max(_real_bits(part) for part in term.parts)
        if not widest:
            raise Refused(f"{term.text} cannot be followed: compare whole numbers with a whole number")
        left, right = (self._real(part, widest) for part in term.parts)
        if term.sign in ("=", "<>"):
            equal = reals.equal(self.terms, left, right)
            return equal if term.sign == "=" else self.terms.not_(equal)
        if term.sign[0] == ">":
            left, right = right, left
        return reals.less(self.terms, left, right, term.sign.endswith("="))

    def _real(self, term: watched.Term, bits: int) -> Term:
        if isinstance(term.constant, int | float):
            data = struct.pack("<f" if bits == 32 else "<d", term.constant)
            return self.terms.constant(bits, int.from_bytes(data, "little"))
        if term.place is None or _real_bits(term) != bits:
            raise Refused(f"{term.text} cannot be followed: compare a REAL with one of its type, or with a number")
        return self.place(term.place)

    def _ordered(self, sign: str, left: Term, right: Term) -> Term:
        terms = self.terms
        if sign in ("=", "<>"):
            equal = terms.eq(left, right)
            return equal if sign == "=" else terms.not_(equal)
        if sign[0] == ">":
            left, right = right, left
        return terms.less(left, right, True, sign.endswith("="))

    def number(self, term: watched.Term) -> Term:
        """An integer, a time or a member of an enumeration as a signed bit-vector that is wide enough."""
        if term.constant is not None:
            if not isinstance(term.constant, int):
                raise Refused(f"{term.text} is no whole number, and only whole numbers can be followed")
            return self.terms.constant(term.constant.bit_length() + 1, term.constant)
        if term.place:
            value = self.place(term.place)
            kind = machine(base(term.place.type))
            if kind in _REALS or value.width <= 0:
                raise Refused(f"{term.text} is {term.place.type.name}, which cannot be followed")
            return self.terms.extend(value, value.width + 1, is_signed(kind))
        if term.type is not None and base(term.type) is REAL:
            raise Refused(f"{term.text} is arithmetic of REAL, of which nothing is known")
        if len(term.parts) == 1:
            inner = self.number(term.parts[0])
            return self.terms.neg(self.terms.extend(inner, inner.width + 1, True))
        return self._computed(term)

    def _computed(self, term: watched.Term) -> Term:
        terms = self.terms
        left, right = self._alike(*(self.number(part) for part in term.parts))
        width = 2 * left.width if term.sign == "*" else left.width + 1
        left, right = (terms.extend(each, width, True) for each in (left, right))
        if term.sign in ("/", "MOD"):
            if term.parts[1].constant is None:
                raise Refused(f"{term.text} divides by a variable: a property that is not defined everywhere cannot be proved")
            return terms.divide("sdiv" if term.sign == "/" else "srem", left, right)
        return {"+": terms.add, "-": terms.sub, "*": terms.mul}[term.sign](left, right)

    def _alike(self, left: Term, right: Term) -> tuple[Term, Term]:
        width = max(left.width, right.width)
        return self.terms.extend(left, width, True), self.terms.extend(right, width, True)

    def place(self, place: Place) -> Term:
        """What lies at a place behind the scan."""
        kind = machine(base(place.type))
        if kind != "b" and kind not in _BYTES:
            raise Refused(f"{place.name} is {place.type.name}, and texts cannot be followed")
        found: list[tuple[Term, int, int | None]] = [(self.terms.true, place.offset, place.bit)]
        for distance in place.hops:
            found = [hop for condition, offset, _ in found for hop in self._hop(place, condition, offset, distance)]
        value = self._at(kind, *found[-1][1:])
        for condition, offset, bit in reversed(found[:-1]):
            value = self.terms.ite(condition, self._at(kind, offset, bit), value)
        return value

    def _hop(self, place: Place, condition: Term, offset: int, distance: int) -> list[tuple[Term, int, int | None]]:
        reference = self.contents.number(offset, 8)
        state = State(self.contents, self.terms.true)
        choices = cases(self.terms, state, reference)
        if choices is None or any(not value for _, value in choices):
            raise Refused(f"{place.name} lies behind a reference that may be null or point anywhere")
        return [(self.terms.and_(condition, chosen), (value >> OFFSET_SHIFT & OFFSET_MASK) + distance,
                 place.bit if value & BIT_MASK == WHOLE_BYTES else value & BIT_MASK) for chosen, value in choices]

    def _at(self, kind: str, offset: int, bit: int | None) -> Term:
        if kind == "b":
            return self.contents.boolean(offset) if bit is None else self.contents.bit(offset, bit)
        return self.contents.number(offset, _BYTES[kind])


def _real_bits(term: watched.Term) -> int:
    """The bits of a REAL or LREAL variable; 0 for anything else."""
    kind = machine(base(term.place.type)) if term.place else ""
    return {"f32": 32, "f64": 64}.get(kind, 0)


def _is_real(term: watched.Term) -> bool:
    return term.type is not None and machine(base(term.type)) in _REALS or isinstance(term.constant, float)


_BYTES = {"i8": 1, "u8": 1, "i16": 2, "u16": 2, "i32": 4, "u32": 4, "i64": 8, "u64": 8, "f32": 4, "f64": 8, "ref": 8}
_LOGIC: dict[str, Callable[[Terms, Term, Term], Term]] = {
    "AND": Terms.and_, "&": Terms.and_, "OR": Terms.or_, "XOR": Terms.xor}
