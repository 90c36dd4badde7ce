"""Drawings of rungs to their instructions: the second notation of a LADDER, beside mnemonics."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fbvm.syntax.ladder.drawing.box_lines import LEFT
from fbvm.syntax.ladder.drawing.diagram import Box, Point
from fbvm.syntax.ladder.drawing.grid import DrawingError, DrawnBox, Grid
from fbvm.syntax.ladder.drawing.network import Network
from fbvm.syntax.ladder.drawing.steps import Coded, steps

_BEGINS = re.compile(r"[ \t]*(?:[│┃├┣┝┠║╟|]|\+-)")
_BARE = re.compile(r"[ \t]*[-─]+[\[\]|┤].*[-─]\(")
"""A row of contacts and a coil whose rail is missing."""
_REMARK = re.compile(r"(?<=[│┃┤┫┥┨|\s])\s*(//.*)$")


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
    grid = Grid([_REMARK.sub("", line).rstrip() for line in lines])
    network = Network(grid)
    bar = network.diagram()
    if not bar.outs:
        raise DrawingError(grid.left, 0, 1, "nothing hangs on the bus bar", "draw a wire from it, with contacts and a coil")
    width = max(map(len, grid.lines)) - grid.left
    return _placed(steps(bar), network, offsets), Picture(bar, width, bool(grid.links), grid.places)


def _placed(coded: Sequence[Coded], network: Network, offsets: Sequence[int]) -> list[Placed]:
    """The instructions with their places; an instruction that is not drawn, such as AND LD, has the place of the one before."""
    made: list[Placed] = []
    end = offsets[0]
    for one in coded:
        if one.drawn is None:
            made.append(Placed(one, end, end, [(end, end)] * len(one.operands)))
            continue
        drawn = network.sources[id(one.drawn)]
        if isinstance(drawn, DrawnBox):
            start = offsets[drawn.y + 1] + drawn.x + 1
            end = start + drawn.until - drawn.x - 1
            operands = _operands(one, drawn, network.grid, offsets)
        else:
            start, end = offsets[drawn.y] + drawn.x, offsets[drawn.y] + drawn.until + 1
            row = offsets[drawn.y if drawn.inside else drawn.y - 1]
            operands = [(row + x, row + until) for x, until in drawn.operand_at]
        made.append(Placed(one, start, end, operands))
    return made


def _operands(one: Coded, drawn: DrawnBox, grid: Grid, offsets: Sequence[int]) -> list[tuple[int, int]]:
    """The places of the operands of a box.  That of a pin is moved so that the operand behind its sign is in its place."""
    assert isinstance(one.drawn, Box)
    if drawn.title is None:
        words = [(offsets[y] + drawn.x + 1 + found.start(), offsets[y] + drawn.x + 1 + found.end())
                 for y, text in drawn.rows.items() for found in re.finditer(r"\S+", text.split(" = ")[0])]  # fmt: skip
        return words[1:]
    named, typed = drawn.heads
    title = offsets[named] + grid.lines[named].index(drawn.title[0], drawn.x)
    at = offsets[typed] + grid.lines[typed].rindex(drawn.title[1], drawn.x, drawn.until)
    places = [(at, at + len(drawn.title[1])), (title, title + len(drawn.title[0]))]
    places += [places[1]] * (len(one.operands) - len(places) - len(one.drawn.pins))  # pins that the wire enters and leaves
    for pin, ((side, y), operand) in zip(one.drawn.pins, _stubs(drawn), strict=True):
        line, length = grid.lines[y], len(operand)
        x = line.rindex(operand, 0, drawn.x) if side == LEFT else line.index(operand, drawn.until)
        places.append((offsets[y] + x - len(pin.name) - 2, offsets[y] + x + length))
    return places


def _stubs(drawn: DrawnBox) -> list[tuple[tuple[int, int], str]]:
    """The operands at pins, in the order of the rows, left before right."""
    return sorted(drawn.stubs.items(), key=lambda stub: (stub[0][1], stub[0][0] != LEFT))


