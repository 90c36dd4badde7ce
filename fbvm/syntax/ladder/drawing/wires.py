"""Wires of a drawing to nets: which elements are joined, and which wires end at nothing."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple

from fbvm.syntax.ladder.drawing.box_lines import LEFT, RIGHT, UP
from fbvm.syntax.ladder.drawing.grid import RAIL, WAYS, Cell, DrawingError, Grid

BUS, SINK = "bus", "sink"
"""The nets of the left and of the right rail."""
Border = tuple[str, int, int]
"""Between two cells: "h" or "v", and the cell to the left of it or above."""
Order = tuple[int, ...]
"""The position of an element on a net, from above: the rows of the arrows that lead to its line, then its own row."""


class Net(NamedTuple):
    """The net that a port is joined to, and the position of the port on it."""

    name: Hashable
    order: Order


class Wires:
    """The nets of a drawing."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._above: dict[Hashable, Hashable] = {}
        self._users: dict[Border, list[Cell]] = {}
        self._pieces: dict[Hashable, Hashable] = {}
        """Nets that are joined without arrows."""
        self._prefixes: dict[Hashable, Order] = {}
        self._join_wires()
        self._join_rails()
        self._look_for_ends()
        self._pieces = {name: self._root(name) for name in list(self._above)}
        self._join_arrows()

    def net(self, border: Border) -> Net:
        """The net at a border of a cell."""
        piece = self._pieces.get(border, border)
        return Net(self._root(border), (*self._prefixes.get(piece, ()), border[2]))

    def is_used(self, border: Border) -> bool:
        """Whether a wire crosses a border."""
        return border in self._users

    # --- joining ----------------------------------------------------------------------------------------------------

    def _root(self, name: Hashable) -> Hashable:
        while (above := self._above.get(name, name)) != name:
            self._above[name] = name = self._above[above]  # half as long a way for those who ask next
        return name

    def _join(self, one: Hashable, other: Hashable) -> None:
        first, second = self._root(one), self._root(other)
        self._above.setdefault(first, first)
        if first in (BUS, SINK):
            first, second = second, first
        self._above[first] = second
        self._above.setdefault(second, second)

    def _use(self, border: Border, cell: Cell) -> None:
        self._users.setdefault(border, []).append(cell)

    def _join_wires(self) -> None:
        grid = self.grid
        for y, line in enumerate(grid.lines):
            for x, character in enumerate(line):
                if character == " " or x in (grid.left, grid.right) and (x, y) not in grid.taken:
                    continue
                borders = [border(x, y, way) for way in sorted(grid.ways(x, y))]
                for one in borders:
                    self._use(one, (x, y))
                    self._join(borders[0], one)
        for element in grid.elements:
            for way, x in ((LEFT, element.x), (RIGHT, element.until)):
                if way == LEFT or not element.is_coil or border(x, element.y, way) in self._users:
                    self._use(border(x, element.y, way), (x, element.y))
        for box in grid.boxes:
            for y in range(box.y + 1, box.bottom):
                for way, x, side in ((LEFT, box.x, LEFT), (RIGHT, box.until, RIGHT)):
                    if (side, y) not in box.stubs and border(x, y, way) in self._users:
                        self._use(border(x, y, way), (x, y))

    def _join_rails(self) -> None:
        grid = self.grid
        for y in range(len(grid.lines)):
            for x, way, net in ((grid.left, RIGHT, BUS), (grid.right, LEFT, SINK)):
                if grid.at(x, y) == " " or (x, y) in grid.taken or x == 0 and net == SINK:
                    continue
                side = border(x, y, way)
                if net == SINK and side in self._users and self._root(side) == BUS:
                    raise DrawingError(grid.left, y, grid.right - grid.left + 1,
                                       "this wire leads from rail to rail with nothing on it",
                                       "draw contacts and a coil, or take the wire away")
                if side in self._users or way in grid.ways(x, y) and grid.at(x, y) not in "|+":
                    self._use(side, (x, y))
                    self._join(side, net)

    def _look_for_ends(self) -> None:
        """Refuse wires that end at nothing: a border that a wire reaches from one side only."""
        arrows = {border(x, y, LEFT) for x, y, _, _ in self.grid.links} | \
                 {border(x + wide - 1, y, RIGHT) for x, y, wide, _ in self.grid.links}
        ends = sorted((y, x, end) for end, users in self._users.items() if len(users) < 2 and end not in arrows
                      for x, y in users)
        for y, x, end in ends:
            if not self.grid.right and end == border(len(self.grid.lines[y].rstrip()) - 1, y, RIGHT):
                continue  # a drawing without a right rail
            raise DrawingError(x, y, 1, *self._said(x, y, end))

    def _said(self, x: int, y: int, end: Border) -> tuple[str, str]:
        """The message and the hint for a wire that ends at nothing."""
        grid = self.grid
        way = next(way for way in WAYS if border(x, y, way) == end)
        beside = grid.at(x + WAYS[way][0], y + WAYS[way][1])
        where = f"column {x + WAYS[way][0] + 1}" if way in (LEFT, RIGHT) else f"the row {'above' if way == UP else 'below'}"
        if (x, y) in grid.taken and way == LEFT:
            return "no wire leads here from the left", f"draw ─ up to column {x}, from the bus bar or from what is in front"
        if x == grid.left:
            return "nothing hangs on the bus bar here", f"draw ─ from {where} on, or │ for a row without a wire"
        if x == grid.right:
            return "no wire leads to the right rail here", f"draw ─ up to {where}, or │ for a row without a wire"
        if grid.at(x, y) in RAIL and x + 1 == len(grid.lines[y]) != grid.right + 1:
            return "here is no rail", f"the right rail stands in column {grid.right + 1}: let the line end there"
        if beside == " ":
            return "this wire ends in the air", f"go on in {where}, where there is a gap, or take it away up to the last ┬ or ┴"
        return (f"this wire ends at `{beside}`, which does not join it",
                f"in {where} write a character that has a line to this side, such as ┤ ├ ┬ ┴ ┼ ─")

    def _join_arrows(self) -> None:
        """Join the arrows with the same number: the line of the first, in the order of rows, goes on at the other."""
        ends: dict[int, tuple[int, int, int]] = {}
        begun: dict[int, tuple[int, int, int]] = {}
        for x, y, wide, number in sorted(self.grid.links, key=lambda link: link[1]):
            known = ends if border(x, y, LEFT) in self._users else begun
            if number in known:
                raise DrawingError(x, y, wide, f"there is another arrow with the number {number}",
                                   "give each pair of arrows its number")
            known[number] = x, y, wide
        for number in sorted({*ends} ^ {*begun}):
            x, y, wide = ends.get(number) or begun[number]
            raise DrawingError(x, y, wide, f"there is one arrow with the number {number}",
                               f"►{number} stands at the end of a line, and at the beginning of the one that goes on")
        for number, (x, y, _) in sorted(ends.items(), key=lambda item: item[1][1]):
            at, row, wide = begun[number]
            leaving, going = border(x, y, LEFT), border(at + wide - 1, row, RIGHT)
            piece = self._pieces.get(leaving, leaving)
            self._prefixes[self._pieces.get(going, going)] = (*self._prefixes.get(piece, ()), y)
            self._join(leaving, going)


def border(x: int, y: int, way: int) -> Border:
    """The border of a cell in one direction."""
    if way in (LEFT, RIGHT):
        return "h", x - (way == LEFT), y
    return "v", x, y - (way == UP)
