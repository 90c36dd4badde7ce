"""Under which conditions statements write places that are watched: what `observe write` tells, in terms."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.prove.encoding.terms import Term, Terms
from fbvm.watch.bits import Writer, Written, meet, written_bits, written_twice


class Writes:
    """The writes of one scan to the bits `watched`, each with its condition."""

    def __init__(self, terms: Terms, watched: Sequence[range]) -> None:
        self.terms, self.watched = terms, watched
        self.conditions: dict[Written, Term] = {}

    def note(self, writer: Writer, offset: int, size: int, bit: int, condition: Term) -> None:
        """Somebody writes so many bytes, or a bit of one, if a condition of the whole path holds."""
        bits = written_bits(offset, size, bit)
        if condition is not self.terms.false and any(meet(bits, watched) for watched in self.watched):
            written = writer, bits
            self.conditions[written] = self.terms.or_(self.conditions.get(written, self.terms.false), condition)

    def twice(self) -> Term:
        """The condition that two writers write the same bit in this scan."""
        pairs = written_twice(self.conditions, self.watched)
        return self.terms.any_of(*(self.terms.and_(self.conditions[one], self.conditions[other]) for one, other in pairs))
