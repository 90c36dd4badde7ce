"""A program that notes the power at each element of its rungs and charts: an Image made of another.

Machine code executes it, so that looking at power costs little.  The notes are beside the memory, which is that of the plain
program: some bytes for each instance, UNMARKED where nothing was evaluated yet.  Contacts at bits of one byte of the memory share
a byte of notes, and what follows from other elements, such as a coil behind its contacts, has none (`Reading`)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any
from weakref import finalize

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.image import Image
from fbvm.code.operations import Address, Block, Node
from fbvm.code.shapes import statements
from fbvm.engine.bases import fixed_bases
from fbvm.engine.depths import with_recursion_room
from fbvm.engine.ranges import may_trap

Element = tuple[int, object]
"""A contact, an output or a transition: the site and the step that observations of it name."""


Reading = tuple[Any, ...]
"""How the state of an element follows from the marks of its row.  ("mark", number, mask, inverted) is TRUE if the byte has a bit
of the mask, or, inverted, if it has none; ("and", a, b), ("or", a, b) and ("not", a) are of other readings."""


@dataclass(frozen=True)
class BodyMarks:
    """The marks of a body: the first one, how many an instance has, and how the states of its elements are read from these.

    A row is an instance.  With `size` instances begin at byte `low` or behind it, at least `size` bytes apart from one another,
    and there is room for `count` of them; else there is one instance."""

    first: int
    marks: int
    elements: Mapping[Element, Reading]
    low: int = 0
    size: int = 0
    count: int = 1

    def row(self, base: int) -> int:
        """The first mark of the instance that begins at byte `base`."""
        row = (base - self.low) // self.size if self.size else 0
        return self.first + self.marks * (row if 0 <= row < self.count else 0)


@dataclass(frozen=True)
class Powered:
    """An image with marks, and those of each body that has rungs or charts, by its number."""

    image: Image
    bodies: Mapping[int, BodyMarks]


UNMARKED = b"\xff"
FRAMES_A_LEVEL = 4
"""Python frames that are taken at most for each level of nested code."""
_powered: dict[int, Powered] = {}
"""Those of images that are still in use."""


def powered(image: Image) -> Powered:
    """The same program, in which each element of a rung or a chart has a mark.

    The same object as long as the image is in use."""
    known = _powered.get(id(image))
    if known is None:
        known = _powered[id(image)] = with_recursion_room(image, FRAMES_A_LEVEL, partial(_made, image))
        finalize(image, _powered.pop, id(image))
    return known


def state(reading: Reading, marks: bytes) -> bool | None:
    """The state of an element as the marks of its row say it; None if it was not evaluated."""
    if reading[0] == "mark":
        _, number, mask, inverted = reading
        return None if marks[number] == UNMARKED[0] else bool(marks[number] & mask) != inverted
    states = [state(operand, marks) for operand in reading[1:]]
    if None in states:
        return None
    return not states[0] if reading[0] == "not" else (all if reading[0] == "and" else any)(states)


def _made(image: Image) -> Powered:
    fixed, marks, bodies = fixed_bases(image), dict[int, BodyMarks](), list(image.bodies)
    end = 0
    for number, body in enumerate(image.bodies):
        elements = Counter(_element(node) for node in statements(body.code) if _is_element(node))
        if not elements:
            continue
        several = frozenset(element for element, count in elements.items() if count > 1)
        size = 0 if number in fixed else max(1, body.instance_size)
        count = image.layout.slots_size // size + 1 if size else 1
        planned = _Marking(end, several)
        planned.block(body.code)
        made = _Marking(end, several, (SLOTS_OFFSET, size, count, planned.marks) if size else ())
        bodies[number] = replace(body, code=made.block(body.code))
        marks[number] = BodyMarks(end, made.marks, made.readings, SLOTS_OFFSET if size else 0, size, count)
        end += count * made.marks
    return Powered(replace(image, bodies=tuple(bodies), marks=end), marks)


def _is_element(node: Node) -> bool:
    return node[:2] == ("observe", "contact")


def _element(node: Node) -> Element:
    return node[2], node[3][0]


ALL_BITS = 0xFF
MOST_PARTS = 32
"""Marks that a reading looks at; an element with more has one of its own."""


@dataclass
class _Shared:
    """Contacts at bits of one byte that share a mark."""

    number: int
    address: Address
    mask: int = 0


class _Marking:
    """Puts marks into the code of a body.

    What is evaluated in a row, with nothing between that writes or can trap, is evaluated together: there contacts can share a
    mark, and states follow from others.  Elements of `several` places in the code have one mark each."""

    def __init__(self, first: int, several: frozenset[Element], rows: tuple[int, ...] = ()) -> None:
        self.readings: dict[Element, Reading] = {}
        self.marks = 0
        self._first, self._several, self._rows = first, several, rows
        self._shared: list[_Shared] = []
        self._bits: dict[Node, tuple[Address, int, bool]] = {}
        """Of temporaries that are bits of the memory: the byte, the bit, and whether it is inverted."""
        self._known: dict[Node, Reading] = {}
        """What temporaries follow from; like `_shared` and `_bits` of this row."""

    def block(self, block: Block) -> Block:
        """A block in which the elements have marks."""
        out: list[Node] = []
        for node in block:
            if node[0] not in ("let", "observe") or (node[0] == "let" and may_trap(node[3])):
                out += self._end_row()
            out.append(self._inside(node))
            if node[0] == "let":
                self._know(("tmp", node[2], node[1]), node[3])
            elif _is_element(node):
                out += self._mark(_element(node), node[3][1])
        return (*out, *self._end_row())

    def _inside(self, node: Node) -> Node:
        """A statement whose blocks have marks."""
        if node[0] == "if":
            return ("if", tuple((condition, self.block(inner)) for condition, inner in node[1]), self.block(node[2]))
        if node[0] == "case":
            return (*node[:3], tuple((labels, self.block(inner)) for labels, inner in node[3]), self.block(node[4]))
        return ("loop", *map(self.block, node[1:])) if node[0] == "loop" else node

    def _end_row(self) -> list[Node]:
        """The marks that contacts share."""
        made = [self._note(each.number, ("and", "u8", ("load_raw", "u8", each.address), ("const", "u8", each.mask)))
                for each in self._shared]  # fmt: skip
        self._shared, self._bits, self._known = [], {}, {}
        return made

    def _note(self, number: int, value: Node) -> Node:
        return ("mark", self._first + number, self._rows, value)

    def _new(self) -> int:
        self.marks += 1
        return self.marks - 1

    def _know(self, temporary: Node, value: Node) -> None:
        """Keeps what a temporary is."""
        bit = _bit(value)
        if bit is not None:
            self._bits[temporary] = bit
        elif (reading := self._reading(value)) is not None:
            self._known[temporary] = reading

    def _reading(self, value: Node) -> Reading | None:
        """How a value follows from marks; None if it does not, or from too many."""
        if value[0] == "tmp":
            return self._known.get(value)
        if value[0] not in ("and", "or", "not") or value[1] != "b":
            return None
        operands = [self._reading(operand) for operand in value[2:]]
        made = (value[0], *operands)
        return None if None in operands or _parts(made) > MOST_PARTS else made

    def _mark(self, element: Element, value: Node) -> list[Node]:
        """The mark behind an element; none if its state follows from other marks, or if it shares one."""
        if element in self._several:
            known = self.readings.setdefault(element, ("mark", self.marks, 1, False))
            if known[1] == self.marks:
                self._new()
            return [self._note(known[1], value)]
        bit, reading = self._bits.get(value) or _bit(value), self._reading(value)
        made: list[Node] = []
        if bit is not None:
            address, number, inverted = bit
            reading = ("mark", self._share(address, 1 << number), 1 << number, inverted)
        elif reading is None:
            reading = ("mark", self._new(), 1, False)
            made = [self._note(reading[1], value)]
        self.readings[element] = self._known[value] = reading
        return made

    def _share(self, address: Address, mask: int) -> int:
        """The number of the mark of some bits of a byte; one that has not all bits, which would be UNMARKED."""
        for each in self._shared:
            if each.address == address and each.mask | mask != ALL_BITS:
                each.mask |= mask
                return each.number
        self._shared.append(_Shared(self._new(), address, mask))
        return self._shared[-1].number


def _bit(value: Node) -> tuple[Address, int, bool] | None:
    """Byte, bit and whether it is inverted, of an expression that is a bit of the memory."""
    inverted = value[0] == "not"
    inner = value[2] if inverted else value
    return (inner[2], inner[3], inverted) if inner[0] == "load_bit" and not may_trap(inner) else None


def _parts(reading: Reading) -> int:
    return 1 if reading[0] == "mark" else sum(map(_parts, reading[1:]))
