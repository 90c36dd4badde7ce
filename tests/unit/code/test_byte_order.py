"""Which bytes of a type change places in the other byte order: those of each number by themselves."""

from __future__ import annotations

from collections.abc import Iterator

from rows import each_of

from fbvm.base.types import (
    BOOL,
    BYTE,
    DINT,
    INT,
    LREAL,
    WORD,
    ArrayType,
    EnumType,
    Field,
    StringType,
    StructType,
    SubrangeType,
    Type,
    array,
    string,
)
from fbvm.code.lowering.byte_order import runs

MODE = EnumType("Mode", 2, 2, INT, {}, {})
SMALL = SubrangeType("Small", 4, 4, DINT, 0, 9)
PART = StructType("Part", 16, 8, {"A": Field("a", INT, 0), "B": Field("b", BYTE, 2), "C": Field("c", SMALL, 4),
                                  "D": Field("d", LREAL, 8)})
PAIR = StructType("Pair", 4, 2, {"A": Field("a", INT, 0), "B": Field("b", MODE, 2)})
DEEP = StructType("Deep", 80, 8, {"P": Field("p", array(((0, 2),), PART), 0), "T": Field("t", string(3, True), 48),
                                  "W": Field("w", array(((0, 1), (0, 2)), WORD), 56)})


def numbers(kind: Type, at: int = 0) -> Iterator[tuple[int, int]]:
    """Offset and size of each number of more than one byte."""
    if isinstance(kind, ArrayType):
        for item in range(kind.count):
            yield from numbers(kind.element, at + item * kind.element.size)
    elif isinstance(kind, StructType):
        for field in kind.fields.values():
            yield from numbers(field.type, at + field.offset)
    elif isinstance(kind, StringType):
        yield from ((at + 2 * item, 2) for item in range(kind.capacity) if kind.wide)
    elif kind.size > 1:
        yield at, kind.size


@each_of("kind, most", [
    (BOOL, 0), (INT, 1), (LREAL, 1), (MODE, 1), (SMALL, 1), (string(9), 0), (string(9, True), 1), (array(((0, 9),), BYTE), 0),
    (array(((0, 9),), INT), 1), (array(((0, 1), (0, 4)), DINT), 1), (PART, 3), (PAIR, 2), (array(((1, 50),), PART), 3),
    (array(((1, 50),), array(((0, 3),), INT)), 1), (array(((0, 1),), array(((0, 2),), PART)), 9), (DEEP, 5),
    (array(((0, 4),), string(2, True)), 2), (array(((0, 1),), string(5, True)), 2), (array(((0, 3),), DEEP), 24),
])
def test_each_number_is_reversed_once(kind: Type, most: int) -> None:
    """And a loop over equal ones is one run, of which there are `most`."""
    made = runs(kind)
    found = [(offset + item * stride, size) for offset, count, stride, size in made for item in range(count)]
    assert sorted(found) == sorted(numbers(kind)) and len(made) <= most
