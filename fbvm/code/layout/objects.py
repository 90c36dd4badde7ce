"""Objects: the numbers of what references are made to, and where in each instance a pointer finds those of its variables.

Only what something refers to is an object.  Variables with one place have a number each; of an instance the first is
written in its header, and its variables follow in a fixed order."""

from __future__ import annotations

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.types import ArrayType, StructType, Type
from fbvm.check.checker import Checker
from fbvm.check.containment import Inside
from fbvm.check.declarations.interfaces import OBJECTS_AT
from fbvm.code.operations import FIRST_OBJECT


class Numbering:
    """Numbers objects while it goes through everything that has a place; `extents` are theirs."""

    def __init__(self, checker: Checker) -> None:
        self.checker = checker
        self.extents: list[tuple[int, int]] = []
        self._has_objects = Inside(checker, lambda pou: bool(pou.referred))

    def single(self) -> None:
        """Number the variables that have one place."""
        for variable in self.checker.project.facts.referred:
            variable.object = self.add(variable.offset, variable.type.size)

    def add(self, start: int, size: int) -> int:
        """The number of one more object."""
        self.extents.append((start, start + size))
        return FIRST_OBJECT + len(self.extents) - 1

    def instances(self, content: bytearray, kind: Type, at: int, start: int = SLOTS_OFFSET) -> None:
        """Number what lies in the instances inside a value; `content` are initial bytes, the first of which is at `start`."""
        if not self._has_objects(kind):
            return
        if isinstance(kind, ArrayType):
            for index in range(kind.count):
                self.instances(content, kind.element, at + index * kind.element.size, start)
        elif isinstance(kind, StructType) and kind.block:
            pou = self.checker.block_of(kind)
            if pou.referred:
                header = at - start + OBJECTS_AT
                content[header:header + 4] = (FIRST_OBJECT + len(self.extents)).to_bytes(4, "little")
                for variable in pou.referred:
                    self.add(at + variable.offset, variable.type.size)
            for variable in pou.order:
                if variable.place == "self" and not variable.reference:
                    self.instances(content, variable.type, at + variable.offset, start)
        elif isinstance(kind, StructType):
            for member in kind.fields.values():
                self.instances(content, member.type, at + member.offset, start)
