"""The width of the parts of a drawn rung, and the addresses and values that need width."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from fbvm.syntax.ladder.drawing.boxes import Shape, shape
from fbvm.syntax.ladder.drawing.cells import cells, text_of
from fbvm.syntax.ladder.drawing.diagram import Box, Coil, Contact, Part, Point, Series

LINK = 5
"""Columns of the arrow with a number at the end of a line that goes on below."""
SLACK = 4
"""Spare columns between the conditions and the outputs of a rung."""
LEAD = 2
"""Columns of line on either side of a box."""
States = Mapping[int, Sequence[bool]]
"""By the number of a step, its states in one execution of a rung: of a contact whether it conducted, of an output the power that
reached it, of a block the power into it and out of it."""


def _nothing(symbol: str) -> str:
    return ""


def _unseen(step: int, operand: str) -> str:
    return ""


class Annotations(NamedTuple):
    """The addresses, values and states that are drawn with a rung.  Without `states` the rung is drawn at rest."""

    states: States | None = None
    places: Callable[[str], str] = _nothing
    """The address behind a symbol, "" if it has none."""
    values: Callable[[int, str], str] = _unseen
    """The value that an operand of a step had; "" if it is not known."""
    others: Callable[[str], str] = _nothing
    """What is drawn in brackets behind an operand of a box, and below a comparison: the address of a symbol, or the symbol at an
    address; "" for nothing."""

    def in_cells(self) -> Annotations:
        """The same for operands that are cells, as cells."""
        return Annotations(
            self.states,
            lambda symbol: cells(self.places(text_of(symbol))),
            lambda step, operand: cells(self.values(step, text_of(operand))),
            lambda operand: cells(self.others(text_of(operand))),
        )

    def operand(self, step: int, operand: str) -> str:
        """An operand of a box as it is drawn."""
        other, value = self.others(operand), self.values(step, operand)
        return operand + (f" ({other})" if other else "") + (f" = {value}" if value else "")


class Widths:
    """The columns of parts of one rung."""

    def __init__(self, annotations: Annotations) -> None:
        self.annotations = annotations
        self._parts: dict[int, int] = {}

    def reach(self, point: Point) -> int:
        """Of a rung on one line."""
        behind = [self.reach(out) if isinstance(out, Point) else self.output(out) + SLACK for out in point.outs]
        lower = [self.series(path) + self.output(out) for out in point.outs if isinstance(out, Box) for path in out.inputs]
        return max(self.series(point.path) + max(behind, default=2 + SLACK), *lower, 0)

    def needed(self, point: Point) -> int:
        """The columns needed behind a path: for the outputs of the rung, or for an arrow."""
        return max((LINK if isinstance(out, Point) else self.output(out) for out in point.outs), default=2)

    def part(self, part: Part) -> int:
        """Of a contact, a box on the line, or branches."""
        known = self._parts.get(id(part))
        if known is None:
            known = self._parts[id(part)] = self._part(part)
        return known

    def _part(self, part: Part) -> int:
        if isinstance(part, Contact):
            return max(len(part.mark) + 6, self._label(part) + 2)
        if isinstance(part, Box):
            made = self.shape(part)
            return max(LEAD, made.left + 1) + made.wide + max(LEAD, made.right + 1)
        return max(map(self.series, part.branches)) + 3

    def series(self, path: Series) -> int:
        return sum(map(self.part, path.parts))

    def output(self, out: Coil | Box) -> int:
        """The columns of an output, up to the right rail."""
        if isinstance(out, Coil):
            return max(len(out.mark) + 6, self._label(out) + 6)
        made = self.shape(out)
        return max(1, made.left + 1) + made.wide + made.right + 3

    def mark_at(self, coil: Coil) -> int:
        """From the mark of a coil to the right rail."""
        mark = len(coil.mark) + 2
        return 2 + max(mark, (self._label(coil) + mark) // 2)

    def shape(self, box: Box) -> Shape:
        return shape(box, self.annotations.operand)

    def below(self, contact: Contact) -> str:
        """The text below a contact: its address, or the values that it compares, or the other names of what it compares."""
        if len(contact.operands) == 1:
            return self.annotations.places(contact.operands[0])
        seen = [value for operand in contact.operands if (value := self.annotations.values(contact.step, operand))]
        others = [other for operand in contact.operands if (other := self.annotations.others(operand))]
        return f"= {', '.join(seen)}" if seen else ", ".join(others)

    def _label(self, drawn: Contact | Coil) -> int:
        below = self.below(drawn) if isinstance(drawn, Contact) else self.annotations.places(" ".join(drawn.operands))
        return max(len(" ".join(drawn.operands)), len(below))
