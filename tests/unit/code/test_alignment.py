"""Which values lie on a multiple of their size: machine code may only be told so of these."""

from __future__ import annotations

from rows import each_of

from fbvm.base.types import INT
from fbvm.code.builder.places import Place
from fbvm.code.operations import Address

N = ("load", "i16", ("self", 8, ()))
REFERENCE = ("ref", ("load", "ref", ("self", 16, ())), 0)


@each_of("address, sizes", [
    (("abs", 184320, ()), {1, 2, 4, 8}), (("abs", 184322, ()), {1, 2}), (("abs", 184321, ()), {1}), (("self", 12, ()), {1, 2, 4}),
    (("self", 0, ((2, N),)), {1, 2}), (("self", 8, ((8, N),)), {1, 2, 4, 8}), (("self", 8, ((8, N), (4, N))), {1, 2, 4}),
    (("self", 8, ((8, N), (3, N))), {1}), (("self", 2, ((8, N),)), {1, 2}), ((REFERENCE, 0, ()), {1}),
    ((REFERENCE, 8, ((8, N),)), {1}),
])
def test_what_is_aligned(address: Address, sizes: set[int]) -> None:
    place = Place(address, INT)
    assert {size for size in (1, 2, 4, 8) if place.is_aligned(size)} == sizes
