"""Which bits of the memory a place has, to tell whether two writes meet: bit 0 of byte 0 is 0, of byte 1 it is 8."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import ArrayType
from fbvm.watch.paths import Place

Writer = tuple[tuple[int, int], ...]
"""Who writes: the calls that lead there, each the site of the statement that calls and the byte at which the instance begins;
last the site of the statement that writes, with 0.  The rounds of a loop are one writer, the instances of a block several."""
Written = tuple[Writer, range]
"""A write: who writes, and the bits."""


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
    """The pairs of writes by different writers that write the same bit, one that is watched."""
    watched = tuple(watched)
    for one, other in combinations(writes, 2):
        if one[0] != other[0] and any(meet(one[1], other[1], bits) for bits in watched):
            yield one, other
