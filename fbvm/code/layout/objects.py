"""Objects: what pointers may be moved in, by number.

Only a variable that something refers to is an object.  One with a single place has a number of its own.  Variables of instances
are numbered instance by instance, in a fixed order: the header of each instance holds the number of its first, so that code which
all instances share finds the others by adding."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.types import ArrayType, StructType, Type
from fbvm.check.checker import Checker
from fbvm.check.declarations.interfaces import OBJECTS_AT
from fbvm.check.symbols.containment import Containment
from fbvm.check.symbols.facts import holds_block
from fbvm.code.operations import FIRST_OBJECT

HEADER_BYTES = 8
"""Bytes with which an instance begins: the number of its type, and that of its first object."""


def runs(kind: Type) -> Iterator[tuple[int, int]]:
    """Offset and number of the bytes that a copy of a value takes along: all but those with which instances in it begin."""
    at = 0
    for header in headers(kind, 0):
        if header > at:
            yield at, header - at
        at = header + HEADER_BYTES
    if kind.size > at:
        yield at, kind.size - at


def headers(kind: Type, at: int) -> Iterator[int]:
    """Where the instances in a value at an offset begin, from low to high."""
    if not holds_block(kind):
        return
    if isinstance(kind, ArrayType):
        for index in range(kind.count):
            yield from headers(kind.element, at + index * kind.element.size)
    elif isinstance(kind, StructType):
        if kind.block:
            yield at
        for member in sorted(kind.fields.values(), key=lambda each: each.offset):
            if not (member.reference or member.absolute):
                yield from headers(member.type, at + member.offset)


class Numbering:
    """Gives numbers to objects; `extents` has the first byte of each, and the first behind it, as offsets in the buffer."""

    def __init__(self, checker: Checker) -> None:
        self.checker = checker
        self.extents: list[tuple[int, int]] = []
        self._has_objects = Containment(checker, lambda pou: bool(pou.all_referred()))
        for pou in checker.blocks():
            for number, variable in enumerate(pou.all_referred()):
                variable.object = number

    def add_single(self) -> None:
        """Number the variables that have one place."""
        for variable in self.checker.project.facts.referred:
            variable.object = self._add(variable.offset, variable.offset + variable.type.size)

    def _add(self, start: int, end: int) -> int:
        """The number of one more object."""
        self.extents.append((start, end))
        return FIRST_OBJECT + len(self.extents) - 1

    def add_instances(self, content: bytearray, kind: Type, at: int, start: int = SLOTS_OFFSET,
                      extent: tuple[int, int] | None = None) -> None:
        """Number the variables of all instances inside a value, and write the headers of those.

        content: initial bytes of the part of the buffer that begins at the offset `start`.
        kind: the type of the value.
        at: the offset of the value in the buffer.
        extent: what the variables lie in, if the value has no fixed place."""
        if not self._has_objects(kind):
            return
        if isinstance(kind, ArrayType):
            for index in range(kind.count):
                self.add_instances(content, kind.element, at + index * kind.element.size, start, extent)
        elif isinstance(kind, StructType) and kind.block:
            pou = self.checker.block_of(kind)
            if referred := pou.all_referred():
                header = at - start + OBJECTS_AT
                content[header:header + 4] = (FIRST_OBJECT + len(self.extents)).to_bytes(4, "little")
                for variable in referred:
                    size = kind.size if variable.name == "THIS" else variable.type.size
                    self._add(*(extent or (at + variable.offset, at + variable.offset + size)))
            for variable in pou.order:
                if variable.place == "self" and not variable.reference:
                    self.add_instances(content, variable.type, at + variable.offset, start, extent)
        elif isinstance(kind, StructType):
            for member in kind.fields.values():
                self.add_instances(content, member.type, at + member.offset, start, extent)
