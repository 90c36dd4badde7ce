"""The layout of boxes: the texts of each row, and the width."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from fbvm.syntax.ladder.drawing.diagram import Box, Pin

Operand = Callable[[int, str], str]
"""What is drawn of an operand, by its step."""


class Row(NamedTuple):
    """A row of a box: the texts inside at the left and at the right, and the operands outside at the left and at the right."""

    left: str
    right: str = ""
    entering: str = ""
    leaving: str = ""


class Shape(NamedTuple):
    """A box: `left`, `wide` and `right` are the columns of the operands at the left, of the box, and of those at the right."""

    title: str
    heads: tuple[Row, ...]
    """Rows on the lines of conditions."""
    rows: tuple[Row, ...]
    left: int
    wide: int
    right: int
    inset: int
    """Columns from the left side to the text of a row."""

    def placed(self, conditions: Sequence[int]) -> dict[int, Row]:
        """Its rows by their distance from the upper side; conditions enter in some of them."""
        made = dict(zip(conditions, self.heads, strict=False))
        free = max(made, default=0) + 1
        return made | dict(enumerate(self.rows, free))


def shape(box: Box, operand: Operand) -> Shape:
    """The layout of a box; `operand` says how each of its operands is drawn."""
    if box.instance:
        return _block(box, operand)
    texts = [operand(box.step, text) for text in box.operands]
    wide = max(map(len, (box.name, *texts))) + 3
    return Shape("", (Row(box.name),), tuple(map(Row, texts)), 0, wide, 0, 2)


def _block(box: Box, operand: Operand) -> Shape:
    """A function block: its instance and type in its upper side, operands beside its pins."""
    heads = tuple(Row(name, box.leaves if box.through else "") for name in box.entries)
    rows = tuple(_rows(box, operand))
    everything = (*heads, *rows)
    title = f" {box.instance} : {box.name} "
    inside = max((len(row.left) + len(row.right) + 2 * bool(row.right) for row in everything), default=0)
    return Shape(title, heads, rows, _widest(row.entering for row in rows), max(len(title) + 3, inside + 2),
                 _widest(row.leaving for row in rows), 1)


def _widest(texts: Iterator[str]) -> int:
    """Columns of the longest text and the line to it."""
    longest = max(map(len, texts), default=0)
    return longest + 1 if longest else 0


def _rows(box: Box, operand: Operand) -> Iterator[Row]:
    """The pins in rows: an output stands beside the input in front of it."""
    before: Pin | None = None
    for pin in box.pins:
        if before is not None and pin.output:
            yield _row(box, before, pin, operand)
            before = None
            continue
        if before is not None:
            yield _row(box, before, None, operand)
        before = None if pin.output else pin
        if pin.output:
            yield _row(box, None, pin, operand)
    if before is not None:
        yield _row(box, before, None, operand)


def _row(box: Box, taking: Pin | None, giving: Pin | None, operand: Operand) -> Row:
    return Row(taking.name if taking else "", giving.name if giving else "",
               operand(box.step, taking.operand) if taking else "",
               operand(box.step, giving.operand) if giving else "")

