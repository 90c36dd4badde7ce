"""Which bits of the memory a place has, to tell whether two writes meet: bit 0 of byte 0 is 0, of byte 1 it is 8."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import ArrayType
from fbvm.watch.paths import Place

Written = tuple[int, range]
"""A write: the site of its statement, and the bits that it writes."""


def bits_of(place: Place) -> range:
    """The bits of a place to which no reference leads."""
    if place.bit is None:
        return written_bits(place.offset, place.type.size)
    first = 8 * place.offset + place.bit
    return range(first, first + (place.type.count if isinstance(place.type, ArrayType) else 1))


def written_bits(offset: int, size: int, bit: int = WHOLE_BYTES) -> range:
    """The bits of so many bytes, or a single one of them."""
    return range(8 * offset, 8 * (offset + size)) if bit == WHOLE_BYTES else range(8 * offset + bit, 8 * offset + bit + 1)


def meet(*bits: range) -> bool:
    """True if some bit is in all of these."""
    return max(each.start for each in bits) < min(each.stop for each in bits)


def written_twice(writes: Iterable[Written], watched: Iterable[range]) -> Iterable[tuple[Written, Written]]:
    """The pairs of writes by different statements that write the same bit, one that is watched."""
    watched = tuple(watched)
    for one, other in combinations(writes, 2):
        if one[0] != other[0] and any(meet(one[1], other[1], bits) for bits in watched):
            yield one, other
