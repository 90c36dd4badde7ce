"""Drawings of rungs to their instructions: the second notation of a LADDER, beside mnemonics."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fbvm.syntax.ladder.drawing.box_lines import LEFT
from fbvm.syntax.ladder.drawing.cells import cells, place_in, text_of
from fbvm.syntax.ladder.drawing.diagram import Box, Point
from fbvm.syntax.ladder.drawing.grid import DrawingError, DrawnBox, Grid
from fbvm.syntax.ladder.drawing.network import Network
from fbvm.syntax.ladder.drawing.steps import Coded, steps

_BEGINS = re.compile(r"[ \t]*(?:[│┃├┣┝┠║╟|]|\+-)")
_BARE = re.compile(r"[ \t]*[-─]+[\[\]|┤].*[-─]\(")
"""A row of contacts and a coil whose rail is missing."""
_REMARK = re.compile(r"(?<=[│┃┤┫┥┨|\s])(//.*)$")


@dataclass(frozen=True)
class Picture:
    """What a drawing has besides its instructions: its width, whether lines go on below, and the texts below symbols."""

    bar: Point
    width: int
    is_broken: bool
    places: dict[str, str]


@dataclass(frozen=True)
class Placed:
    """An instruction and where it was drawn: offsets of the text, also those of its operands."""

    coded: Coded
    start: int
    end: int
    operands: list[tuple[int, int]]


def is_drawn(lines: Sequence[str]) -> bool:
    """Whether lines are a drawing: one of them begins with a rail, or should."""
    return any(_BEGINS.match(line) or _BARE.match(line) for line in lines)


def remark_of(line: str) -> str:
    """The comment behind a line of a drawing."""
    found = _REMARK.search(line)
    return found[1] if found else ""


def read_drawing(lines: Sequence[str], offsets: Sequence[int]) -> tuple[list[Placed], Picture]:
    """The instructions of a drawing; `offsets` are the places of its lines in the text.  Raises DrawingError."""
    bare = next((row for row, line in enumerate(lines) if _BARE.match(line)), None)
    if bare is not None:
        raise DrawingError(len(lines[bare]) - len(lines[bare].lstrip()), bare, 1, "the left rail is missing",
                           "each row of a drawing begins with │ or |")
    filled = [cells(_REMARK.sub("", line).rstrip()) for line in lines]
    try:
        return _read(Grid(filled), offsets)
    except DrawingError as error:
        x, y, width, message, hint = error.args
        x = place_in(filled[y], x) if 0 <= y < len(filled) else x
        raise DrawingError(x, y, width, text_of(message), text_of(hint)) from None


def _read(grid: Grid, offsets: Sequence[int]) -> tuple[list[Placed], Picture]:
    network = Network(grid)
    bar = network.diagram()
    if not bar.outs:
        raise DrawingError(grid.left, 0, 1, "nothing hangs on the bus bar", "draw a wire from it, with contacts and a coil")
    width = max(map(len, grid.lines)) - grid.left
    places = _Places(grid.lines, offsets)
    return _placed(steps(bar), network, places), Picture(bar, width, bool(grid.links), grid.places)


class _Places:
    """Places in the text of the cells of a drawing."""

    def __init__(self, lines: Sequence[str], offsets: Sequence[int]) -> None:
        self._lines, self._offsets = lines, offsets

    def at(self, x: int, y: int) -> int:
        return self._offsets[y] + place_in(self._lines[y], x)

    def span(self, x: int, until: int, y: int) -> tuple[int, int]:
        return self.at(x, y), self.at(until, y)


def _placed(coded: Sequence[Coded], network: Network, places: _Places) -> list[Placed]:
    """The instructions with their places; an instruction that is not drawn, such as AND LD, has the place of the one before."""
    made: list[Placed] = []
    end = places.at(0, 0)
    for one in coded:
        written = one._replace(mnemonic=text_of(one.mnemonic), operands=tuple(map(text_of, one.operands)))
        if one.drawn is None:
            made.append(Placed(written, end, end, [(end, end)] * len(one.operands)))
            continue
        drawn = network.sources[id(one.drawn)]
        if isinstance(drawn, DrawnBox):
            start, end = places.span(drawn.x + 1, drawn.until, drawn.y + 1)
            operands = _operands(one, drawn, network.grid, places)
        else:
            start, end = places.span(drawn.x, drawn.until + 1, drawn.y)
            row = drawn.y if drawn.inside else drawn.y - 1
            operands = [places.span(x, until, row) for x, until in drawn.operand_at]
        made.append(Placed(written, start, end, operands))
    return made


def _operands(one: Coded, drawn: DrawnBox, grid: Grid, places: _Places) -> list[tuple[int, int]]:
    """The places of the operands of a box.  That of a pin is moved so that the operand behind its sign is in its place."""
    assert isinstance(one.drawn, Box)
    if drawn.title is None:
        words = [places.span(drawn.x + 1 + found.start(), drawn.x + 1 + found.end(), y)
                 for y, text in drawn.rows.items() for found in re.finditer(r"\S+", text.split(" = ")[0])]  # fmt: skip
        return words[1:]
    named, typed = drawn.heads
    title = grid.lines[named].index(drawn.title[0], drawn.x)
    at = grid.lines[typed].rindex(drawn.title[1], drawn.x, drawn.until)
    found = [places.span(at, at + len(drawn.title[1]), typed), places.span(title, title + len(drawn.title[0]), named)]
    found += [found[1]] * (len(one.operands) - len(found) - len(one.drawn.pins))  # pins that the wire enters and leaves
    for pin, ((side, y), operand) in zip(one.drawn.pins, _stubs(drawn), strict=True):
        line = grid.lines[y]
        x = line.rindex(operand, 0, drawn.x) if side == LEFT else line.index(operand, drawn.until)
        start, end = places.span(x, x + len(operand), y)
        found.append((start - len(text_of(pin.name)) - 2, end))
    return found


def _stubs(drawn: DrawnBox) -> list[tuple[tuple[int, int], str]]:
    """The operands at pins, in the order of the rows, left before right."""
    return sorted(drawn.stubs.items(), key=lambda stub: (stub[0][1], stub[0][0] != LEFT))


