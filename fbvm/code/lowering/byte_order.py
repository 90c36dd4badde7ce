"""Big-endian forms: which bytes of a type change places, and the assignment that does it (IEC 61131-3 ed. 3, table 37).

Values lie in memory with the lowest byte first; each number in an array or a structure is turned by itself.  A REAL is
turned in memory, never as a value: its bytes in the other order may be those of a NaN, which values do not keep apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.types import ArrayType, Elementary, EnumType, StringType, StructType, SubrangeType, Type, base
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.lowering.values import is_aggregate
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering

Run = tuple[int, int, int, int]
"""Items of equal size: offset of the first, how many, bytes from one to the next, size."""


def runs(kind: Type) -> list[Run]:
    """All items of a type that have more than one byte."""
    if isinstance(kind, ArrayType):
        return [run for inner in runs(kind.element) for run in _repeated(inner, kind.count, kind.element.size)]
    if isinstance(kind, StructType):
        return [(field.offset + offset, count, stride, size) for field in kind.fields.values()
                for offset, count, stride, size in runs(field.type)]
    if isinstance(kind, StringType):
        return [(0, kind.capacity, 2, 2)] if kind.wide else []
    plain = base(kind)
    assert isinstance(plain, Elementary | EnumType | SubrangeType)
    return [(0, 1, plain.size, plain.size)] if plain.size > 1 else []


def _repeated(inner: Run, count: int, width: int) -> list[Run]:
    """A run in each element of an array, as few runs as it takes."""
    offset, items, stride, size = inner
    if items * stride == width:
        return [(offset, items * count, stride, size)]
    if items <= count:
        return [(offset + n * stride, count, width, size) for n in range(items)]
    return [(offset + n * width, items, stride, size) for n in range(count)]


def assign(body: BodyLowering, target: tree.Expr, called: StandardCall, site: int) -> None:
    """`target := TO_BIG_ENDIAN(x)` and its relatives, where the value is turned in memory."""
    value, kind = called.arguments[0]
    to = body.places.fixed(body.places.of(target))
    if is_aggregate(kind):
        body.copy(to, body.aggregate(value), site)
    elif isinstance(kind, Elementary) and isinstance(value, tree.NameRef | tree.Member | tree.Index | tree.Deref):
        body.copy(to, body.places.of(value), site)
    else:
        body.write(to, body.value(value, kind), site)
    turned = tuple(runs(to.type))
    if turned and called.key.endswith("BIG_ENDIAN"):
        body.out.append(("reverse", to.address, to.type.size, turned))
        body.observe_write(to, site)
