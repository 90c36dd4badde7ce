"""References in initial values: `r : REF_TO INT := REF(x)`, evaluated once everything has its place.

Each instance of a block refers to variables of its own (IEC 61131-3 ed. 3, table 12).  Until then the initial bytes hold marks
(`reference_marks`)."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.memory import STRUCTS
from fbvm.check.checker import Checker
from fbvm.check.symbols.facts import Start
from fbvm.code.builder.evaluation import value_of
from fbvm.code.layout.layout import Placement
from fbvm.code.layout.reference_marks import REFERENCE_BYTES, Instances, references_in
from fbvm.code.lowering.bodies import lower_reference
from fbvm.code.lowering.program import Program
from fbvm.code.operations import BUFFER_OBJECT, OBJECT_SHIFT, OFFSET_SHIFT, Address, Node
from fbvm.code.shapes import is_expression


class InitialReferences:
    """The references of one program; `placement` has what the buffer holds at power-on without them."""

    def __init__(self, program: Program, checker: Checker, placement: Placement) -> None:
        self.program, self.checker = program, checker
        self._any = bool(checker.project.facts.starts)
        frames = [(pou.frame_offset, pou.frame_initial) for pou in checker.bodies] if self._any else []
        self._initial, self._config_initials = [*placement.initial, *frames], placement.config_initials

    def in_slots(self) -> Iterator[tuple[int, bytes]]:
        """The references that live as long as the program: the offset of each in the buffer, and its bytes."""
        for variable in self.checker.global_order if self._any else ():
            if variable.place == "abs" and not variable.reference:
                for at, start, around in references_in(self.checker, variable.type, variable.initial, variable.offset):
                    yield variable.offset + at, self._made(start, around)
        for offset, kind, content in self._config_initials if self._any else ():
            for at, start, around in references_in(self.checker, kind, content, offset):
                yield offset + at, self._made(start, around)

    def in_frames(self) -> None:
        """Replace the marks in the initial bytes of frames.

        A reference that is the same at each start of the body is put there; one to a variable of the frame itself is left
        to the body (`Program.entry_references`)."""
        for pou in self.checker.bodies if self._any else ():
            content = bytearray(pou.frame_initial)
            for variable in pou.order:
                if variable.place != "frame" or variable.reference:
                    continue
                value = bytearray(variable.initial)
                begin = variable.offset + (0 if pou.stack_bytes else pou.frame_offset)
                for at, start, around in references_in(self.checker, variable.type, variable.initial, begin):
                    made = bytes(REFERENCE_BYTES)
                    if start.late and start.pou is pou:
                        self.program.entry_references.setdefault(pou, []).append((begin + at, start))
                    else:
                        made = self._made(start, around)
                    value[at:at + REFERENCE_BYTES] = made
                    content[variable.offset + at:variable.offset + at + REFERENCE_BYTES] = made
                variable.initial = bytes(value)
            pou.frame_initial = bytes(content)

    def _made(self, start: Start, around: Instances) -> bytes:
        """The bytes of a reference that lies in certain instances."""
        pou = start.pou if start.pou is not None and start.pou.number >= 0 else self.checker.bodies[0]
        node = lower_reference(self.program, self.checker, pou, start)
        return STRUCTS["ref"].pack(value_of(self._at_power_on(node, around.get(pou, 0))))

    def _at_power_on(self, node: Node, instance: int) -> Node:
        """The same expression with constants for references and for what the instance at an offset holds at power-on."""
        name, form, *operands = node
        if name == "reference":
            offset = _offset(operands[0], instance)
            return ("const", form, BUFFER_OBJECT << OBJECT_SHIFT | offset << OFFSET_SHIFT | operands[1])
        if name in ("load", "load_raw"):
            return ("const", form, self._read(form, _offset(operands[0], instance)))
        return (name, form, *(self._at_power_on(part, instance) if is_expression(part) else part for part in operands))

    def _read(self, form: str, offset: int) -> int:
        """What lies in the buffer at power-on: a field behind the beginning of an instance."""
        start, data = next((start, data) for start, data in reversed(self._initial) if start < offset < start + len(data))
        value: int = STRUCTS[form].unpack_from(data, offset - start)[0]
        return value


def _offset(address: Address, instance: int) -> int:
    """The offset in the buffer of an address without subscripts."""
    start, offset, terms = address
    assert not terms and isinstance(start, str)
    return offset + (instance if start == "self" else 0)
