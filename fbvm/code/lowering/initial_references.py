"""References that are made before anything runs: `r : REF_TO INT := REF(x)`, worked out once everything has its place.

Each instance of a block refers to variables of its own (IEC 61131-3 ed. 3, table 12).  Until then initial bytes hold a
mark with the number of what is to be referred to, so that such values stand wherever others do: in structures and
arrays, in values of a type, in initial values of an instance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from fbvm.base.memory import STRUCTS
from fbvm.base.types import ArrayType, RefType, StructType, Type
from fbvm.check.checker import Checker
from fbvm.check.expressions.references import MARK
from fbvm.check.symbols.facts import Pou, Start
from fbvm.code.lowering.bodies import BodyLowering
from fbvm.code.lowering.evaluation import value_of
from fbvm.code.lowering.layout import Placed
from fbvm.code.operations import BUFFER_OBJECT, OBJECT_SHIFT, OFFSET_SHIFT, Address, Node
from fbvm.code.shapes import is_expression

if TYPE_CHECKING:
    from fbvm.code.lowering.program import Program

Instances = Mapping[Pou, int]
"""Where the instances around a value begin."""
Marked = tuple[int, Start, Instances]


class InitialReferences:
    """The references of one program; `placed` has what the buffer holds at power-on without them."""

    def __init__(self, program: Program, checker: Checker, placed: Placed) -> None:
        self.program, self.checker = program, checker
        self.starts = checker.project.facts.starts
        frames = [(pou.frame_offset, pou.frame_initial) for pou in checker.bodies] if self.starts else []
        self.initial, self.completed = [*placed.initial, *frames], placed.completed

    def in_slots(self) -> Iterator[tuple[int, bytes]]:
        """Where each of those lies that live as long as the program, and its bytes."""
        for variable in self.checker.global_order if self.starts else ():
            if variable.place == "abs" and not variable.reference:
                for at, start, around in self._marked(variable.type, variable.initial, 0, variable.offset, {}):
                    yield variable.offset + at, self._made(start, around)

        for offset, kind, content in self.completed if self.starts else ():
            for at, start, around in self._marked(kind, content, 0, offset, {}):
                yield offset + at, self._made(start, around)

    def within(self, kind: Type, content: bytes) -> Iterator[tuple[int, Start]]:
        """Those in a value that a body makes, which are to global variables."""
        for at, start, _ in self._marked(kind, content, 0, 0, {}) if self.starts else ():
            yield at, start

    def in_frames(self) -> None:
        """Put those into the values at the start of functions that are known now; the others are made when a body starts."""
        for pou in self.checker.bodies if self.starts else ():
            content = bytearray(pou.frame_initial)
            for variable in pou.order:
                if variable.place != "frame" or variable.reference:
                    continue
                value = bytearray(variable.initial)
                begin = pou.frame_offset + variable.offset
                for at, start, around in self._marked(variable.type, variable.initial, 0, begin, {}):
                    if start.late and start.pou is pou:
                        value[at:at + 8] = bytes(8)
                        self.program.late_starts.setdefault(pou, []).append((begin + at, start))
                    else:
                        value[at:at + 8] = self._made(start, around)
                    content[variable.offset + at:variable.offset + at + 8] = value[at:at + 8]
                variable.initial = bytes(value)
            pou.frame_initial = bytes(content)

    def _marked(self, kind: Type, content: bytes, at: int, begin: int, around: Instances) -> Iterator[Marked]:
        """The marks in a value of `kind`, which lies `at` bytes into `content`; that begins at `begin` of the buffer."""
        if not any(content[at + 5:at + kind.size]):
            return
        if isinstance(kind, RefType):
            number = int.from_bytes(content[at:at + 8], "little") - MARK
            if 0 <= number < len(self.starts):
                yield at, self.starts[number], around
        elif isinstance(kind, ArrayType) and isinstance(kind.element, ArrayType | StructType | RefType):
            for index in range(kind.count):
                yield from self._marked(kind.element, content, at + index * kind.element.size, begin, around)
        elif isinstance(kind, StructType) and kind.block:
            pou = self.checker.block_of(kind)
            inside = {**around, pou: begin + at}
            for variable in pou.order:
                if variable.place == "self" and not variable.reference:
                    yield from self._marked(variable.type, content, at + variable.offset, begin, inside)
        elif isinstance(kind, StructType):
            for member in kind.fields.values():
                if member.bit is None:
                    yield from self._marked(member.type, content, at + member.offset, begin, around)

    def _made(self, start: Start, around: Instances) -> bytes:
        pou = start.pou if start.pou is not None and start.pou.number >= 0 else self.checker.bodies[0]
        node = BodyLowering(self.program, self.checker, pou).pointers.to(start.place)
        return STRUCTS["ref"].pack(value_of(self._placed(node, around.get(pou, 0))))

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
