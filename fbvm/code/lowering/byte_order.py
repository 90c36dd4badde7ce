"""Big-endian forms: which bytes of a type change places, and the assignment that does it (IEC 61131-3 ed. 3, table 37).

Values lie in memory with the lowest byte first; in an array or a structure the bytes of each number are reversed by
themselves.  This is done in memory, never to a value: the bytes of a REAL in the other order may be those of a NaN, and
values do not keep NaNs apart."""

from __future__ import annotations

from fbvm.base.types import ArrayType, Elementary, EnumType, StringType, StructType, SubrangeType, Type, base
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.builder.places import is_aggregate
from fbvm.code.lowering.context import BodyContext
from fbvm.syntax import tree

Run = tuple[int, int, int, int]
"""Items of equal size, as the operation `reverse` has them: offset of the first, number, bytes from one to the next, size."""


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
    """A run in each of the `count` elements of an array, as few runs as possible."""
    offset, items, stride, size = inner
    if items * stride == width:
        return [(offset, items * count, stride, size)]
    if items <= count:
        return [(offset + n * stride, count, width, size) for n in range(items)]
    return [(offset + n * width, items, stride, size) for n in range(count)]


def assign(body: BodyContext, target: tree.Expr, called: StandardCall, site: int) -> None:
    """`target := TO_BIG_ENDIAN(x)` and its relatives: x is copied, then its bytes are reversed in the target."""
    value, kind = called.arguments[0]
    to = body.reusable(body.place(target))
    if is_aggregate(kind):
        body.copy(to, body.aggregate(value), site)
    elif isinstance(kind, Elementary) and isinstance(value, tree.NameRef | tree.Member | tree.Index | tree.Deref):
        body.copy(to, body.place(value), site)
    else:
        body.write(to, body.value(value, kind), site)
    reversed_runs = tuple(runs(to.type))
    if reversed_runs and called.key.endswith("BIG_ENDIAN"):
        body.emit(("reverse", to.address, to.type.size, reversed_runs))
        body.observe_write(to, site)
