"""A program that notes the power at each element of its rungs and charts: an Image made of another.

Machine code executes it, so that looking at power costs little.  The notes are beside the memory, which is that of the plain
program: a byte for each element of each instance, 0 or 1 as it was evaluated at the last time, else UNMARKED."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from weakref import finalize

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.image import Image
from fbvm.code.operations import Block, Node
from fbvm.code.shapes import statements
from fbvm.engine.bases import fixed_bases
from fbvm.engine.depths import with_recursion_room

Element = tuple[int, object]
"""A contact, an output or a transition: the site and the step that observations of it name."""


@dataclass(frozen=True)
class BodyMarks:
    """The marks of a body: that of its first element, the elements in the order of their marks, and its rows of them.

    A row is an instance.  With `size` instances begin at byte `low` or behind it, at least `size` bytes apart from one another,
    and there is room for `count` of them; else there is one instance."""

    first: int
    elements: tuple[Element, ...]
    low: int = 0
    size: int = 0
    count: int = 1

    def row(self, base: int) -> int:
        """The first mark of the instance that begins at byte `base`."""
        row = (base - self.low) // self.size if self.size else 0
        return self.first + len(self.elements) * (row if 0 <= row < self.count else 0)


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


def _made(image: Image) -> Powered:
    fixed, marks, bodies = fixed_bases(image), dict[int, BodyMarks](), list(image.bodies)
    end = 0
    for number, body in enumerate(image.bodies):
        elements = tuple(dict.fromkeys(_element(node) for node in statements(body.code) if _is_element(node)))
        if not elements:
            continue
        size = 0 if number in fixed else max(1, body.instance_size)
        count = image.layout.slots_size // size + 1 if size else 1
        made = marks[number] = BodyMarks(end, elements, SLOTS_OFFSET if size else 0, size, count)
        bodies[number] = replace(body, code=_block(body.code, made, {element: at for at, element in enumerate(elements)}))
        end += count * len(elements)
    return Powered(replace(image, bodies=tuple(bodies), marks=end), marks)


def _is_element(node: Node) -> bool:
    return node[:2] == ("observe", "contact")


def _element(node: Node) -> Element:
    return node[2], node[3][0]


def _block(block: Block, marks: BodyMarks, numbers: Mapping[Element, int]) -> Block:
    """A block in which the elements have marks."""
    out: list[Node] = []
    for node in block:
        if node[0] == "if":
            rows = tuple((condition, _block(inner, marks, numbers)) for condition, inner in node[1])
            out.append(("if", rows, _block(node[2], marks, numbers)))
        elif node[0] == "case":
            cases = tuple((labels, _block(inner, marks, numbers)) for labels, inner in node[3])
            out.append((*node[:3], cases, _block(node[4], marks, numbers)))
        elif node[0] == "loop":
            out.append(("loop", *(_block(inner, marks, numbers) for inner in node[1:])))
        else:
            out.append(node)
        if _is_element(node):
            where = (marks.low, marks.size, marks.count, len(marks.elements)) if marks.size else ()
            out.append(("mark", marks.first + numbers[_element(node)], where, node[3][1]))
    return tuple(out)
