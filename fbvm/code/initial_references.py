"""References that variables hold from the start: `r : REF_TO INT := REF(x)`, worked out once everything has its place.

Each instance of a block refers to variables of its own (IEC 61131-3 ed. 3, table 12)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from fbvm.base.memory import STRUCTS
from fbvm.base.types import ArrayType, StructType, Type
from fbvm.check.checker import Checker
from fbvm.check.facts import Pou, Variable
from fbvm.code.evaluation import value_of
from fbvm.code.lower import BodyLowering
from fbvm.code.operations import BUFFER_OBJECT, OBJECT_SHIFT, OFFSET_SHIFT, Address, Node
from fbvm.code.shapes import is_expression

if TYPE_CHECKING:
    from fbvm.code.compiler import Program


class InitialReferences:
    """The references of one program; `initial` is what the buffer holds at power-on without them."""

    def __init__(self, program: Program, checker: Checker, initial: Sequence[tuple[int, bytes]]) -> None:
        self.program, self.checker, self.initial = program, checker, initial
        self.blocks = any(v.refers is not None for pou in checker.bodies for v in pou.order)

    def all(self) -> Iterator[tuple[int, bytes]]:
        """Where each of them lies, and its bytes."""
        for variable in self.checker.global_order:
            if variable.place != "abs" or variable.reference:
                continue
            if variable.refers is not None:
                yield variable.offset, self._made(variable, self.checker.bodies[0], 0)
            if self.blocks:
                yield from self._inside(variable.type, variable.offset)

    def _inside(self, kind: Type, at: int) -> Iterator[tuple[int, bytes]]:
        """Those of the instances in a value."""
        if isinstance(kind, ArrayType) and isinstance(kind.element, ArrayType | StructType):
            for index in range(kind.count):
                yield from self._inside(kind.element, at + index * kind.element.size)
        elif isinstance(kind, StructType) and kind.block:
            pou = self.checker.block_of(kind)
            for variable in pou.order:
                if variable.place != "self" or variable.reference:
                    continue
                if variable.refers is not None:
                    yield at + variable.offset, self._made(variable, pou, at)
                yield from self._inside(variable.type, at + variable.offset)
        elif isinstance(kind, StructType):
            for member in kind.fields.values():
                yield from self._inside(member.type, at + member.offset)

    def _made(self, variable: Variable, pou: Pou, instance: int) -> bytes:
        assert variable.refers is not None
        node = BodyLowering(self.program, self.checker, pou).value(variable.refers)
        return STRUCTS["ref"].pack(value_of(self._placed(node, instance)))

    def _placed(self, node: Node, instance: int) -> Node:
        """The same expression with constants for references and for what instances hold at power-on."""
        name, form, *operands = node
        if name == "reference":
            offset = self._offset(operands[0], instance)
            return ("const", form, BUFFER_OBJECT << OBJECT_SHIFT | offset << OFFSET_SHIFT | operands[1])
        if name in ("load", "load_raw"):
            return ("const", form, self._read(form, self._offset(operands[0], instance)))
        return (name, form, *(self._placed(part, instance) if is_expression(part) else part for part in operands))

    def _read(self, form: str, offset: int) -> int:
        """What lies in the buffer at power-on."""
        for start, data in reversed(self.initial):
            if start <= offset and offset + STRUCTS[form].size <= start + len(data):
                value: int = STRUCTS[form].unpack_from(data, offset - start)[0]
                return value
        return 0

    @staticmethod
    def _offset(address: Address, instance: int) -> int:
        start, offset, terms = address
        assert not terms and isinstance(start, str)
        return offset + (instance if start == "self" else 0)
