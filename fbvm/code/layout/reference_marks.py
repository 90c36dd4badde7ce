"""References in initial values, as they stand until everything has its place: marks in the initial bytes.

`r : REF_TO INT := REF(x)` cannot be evaluated before x has its place.  Until then its 8 bytes hold a mark, MARK plus the number
of the reference among `Facts.starts`, and so are copied like any value: into structures and arrays, into the initial
values of a type, into those of an instance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fbvm.base.types import ArrayType, RefType, StructType, Type
from fbvm.check.checker import Checker
from fbvm.check.expressions.references import MARK
from fbvm.check.symbols.facts import Pou, Start

REFERENCE_BYTES = 8
Instances = Mapping[Pou, int]
"""The instances that a value lies in, by POU: the offset in the buffer at which each begins."""
Marked = tuple[int, Start, Instances]
"""The offset of a mark in the bytes, what the reference is to, and the instances around it."""


def references_in(checker: Checker, kind: Type, content: bytes, begin: int = 0) -> Iterator[Marked]:
    """The marks in the initial bytes of a value of `kind`, whose first byte lies at `begin` of the buffer."""
    if checker.project.facts.starts:
        yield from _marked(checker, kind, content, 0, begin, {})


def _marked(checker: Checker, kind: Type, content: bytes, at: int, begin: int, around: Instances) -> Iterator[Marked]:
    """The marks in the part of `content` from `at` on, which is a value of `kind`."""
    if not any(content[at + 5:at + kind.size]):  # marks are large numbers, most values are not
        return
    if isinstance(kind, RefType):
        starts = checker.project.facts.starts
        number = int.from_bytes(content[at:at + REFERENCE_BYTES], "little") - MARK
        if 0 <= number < len(starts):
            yield at, starts[number], around
    elif isinstance(kind, ArrayType) and isinstance(kind.element, ArrayType | StructType | RefType):
        for index in range(kind.count):
            yield from _marked(checker, kind.element, content, at + index * kind.element.size, begin, around)
    elif isinstance(kind, StructType):
        yield from _marked_in_members(checker, kind, content, at, begin, around)


def _marked_in_members(checker: Checker, kind: StructType, content: bytes, at: int, begin: int,
                       around: Instances) -> Iterator[Marked]:
    if not kind.block:
        for member in kind.fields.values():
            if member.bit is None:
                yield from _marked(checker, member.type, content, at + member.offset, begin, around)
        return
    pou = checker.block_of(kind)
    inside = {**around, **dict.fromkeys(pou.lineage(), begin + at)}
    for variable in pou.order:
        if variable.place == "self" and not variable.reference:
            yield from _marked(checker, variable.type, content, at + variable.offset, begin, inside)
