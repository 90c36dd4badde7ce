"""Pieces of the drawing of a chart: each has a size, the column of its entry, open ends, and functions that draw it.

Pieces are put side by side, or one below the other, by these alone; so no line crosses another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from textwrap import wrap

from fbvm.record.draw.sfc_graph import Node
from fbvm.syntax.ladder.drawing.box_lines import Surface

Paint = Callable[[Surface, int, int], None]
"""Draws something on a surface, from a column and a row on."""
GAP = 3
"""Columns between branches."""
NAMES = 30
"""Columns of a line of names behind an arrow."""
WING = 2
"""Columns that a double line goes on beyond its branches."""


@dataclass
class End:
    """An open end in the last row of a piece: its column, the node that it leads to, whether it is drawn with power."""

    x: int
    to: Node
    thick: bool


@dataclass
class Piece:
    """A part of a drawing; `entry` is the column of the line into its first row, and, of a single node, out of its last."""

    width: int
    height: int
    entry: int
    paint: list[Paint] = field(default_factory=list)
    parts: list[tuple[Piece, int, int]] = field(default_factory=list)
    """Other pieces in it, and where."""
    ends: list[End] = field(default_factory=list)
    thick: bool = False
    """True if the line into it is drawn with power."""

    def draw(self, surface: Surface, x: int, y: int) -> None:
        """Paint it, and all that is in it, however deep."""
        left = [(self, x, y)]
        while left:
            piece, x, y = left.pop()
            for paint in piece.paint:
                paint(surface, x, y)
            left += [(part, x + dx, y + dy) for part, dx, dy in piece.parts]

    def line_down(self, x: int, first: int, last: int, thick: bool = False) -> None:
        self.paint.append(lambda s, dx, dy: s.down(x + dx, first + dy, last + dy, thick))

    def line_across(self, first: int, last: int, y: int, thick: bool = False, double: bool = False) -> None:
        self.paint.append(lambda s, dx, dy: s.across(first + dx, last + dx, y + dy, thick, double))

    def text(self, x: int, y: int, text: str) -> None:
        self.paint.append(lambda s, dx, dy: s.write(x + dx, y + dy, text))
        self.width = max(self.width, x + len(text))

    def place(self, other: Piece, x: int, y: int) -> None:
        """Put another piece into this one."""
        self.parts.append((other, x, y))
        self.width = max(self.width, x + other.width)
        self.height = max(self.height, y + other.height)


# --- single elements ------------------------------------------------------------------------------------------------


def step(label: str, initial: bool, active: bool, actions: Sequence[tuple[str, str, str]]) -> Piece:
    """The box of a step, with its actions at the right."""
    wide = len(label) + 4
    piece = Piece(wide, 3, wide // 2)
    _box(piece, wide, active and not initial, initial)
    piece.text(2, 1, label)
    if actions:
        _actions(piece, actions, wide + 2)
        piece.line_across(wide - 1, wide + 2, 1)
        piece.line_down(piece.entry, 2, piece.height - 1)
    return piece


def _box(piece: Piece, wide: int, thick: bool, double: bool) -> None:
    def paint(surface: Surface, x: int, y: int) -> None:
        for row in (y, y + 2):
            surface.across(x, x + wide - 1, row, thick, double)
        for column in (x, x + wide - 1):
            surface.down(column, y, y + 2, thick, double)

    piece.paint.append(paint)


def _actions(piece: Piece, rows: Sequence[tuple[str, str, str]], at: int) -> None:
    """Qualifier, action and, where there are any, indicators; one row below the other."""
    columns = 3 if any(row[2] for row in rows) else 2
    widths = [max(len(row[column]) for row in rows) + 3 for column in range(columns)]
    edges = [at]
    for width in widths:
        edges.append(edges[-1] + width)
    depth = 2 * len(rows)
    for line in range(0, depth + 1, 2):
        piece.line_across(edges[0], edges[-1], line)
    for edge in edges:
        piece.line_down(edge, 0, depth)
    for number, row in enumerate(rows):
        for column in range(columns):
            piece.text(edges[column] + 2, 2 * number + 1, row[column])
    piece.width = edges[-1] + 1
    piece.height = max(3, depth + 1)


def transition(label: str, wrapped: int, fired: bool) -> Piece:
    """A bar across the line, its condition at the right in lines of `wrapped` columns."""
    piece = Piece(3, 3, 1, thick=fired)
    piece.line_across(0, 2, 1, fired)
    lines = wrap(label, wrapped) or [""]
    for row, line in enumerate(lines, 1):
        piece.text(4, row, line)
    piece.height = max(3, len(lines) + 1)
    piece.line_down(1, 0, piece.height - 1, fired)
    return piece


def arrow_target(piece: Piece, name: str) -> Piece:
    """A transition to which arrows lead from other branches; `name` is written beside it."""
    made = Piece(0, 0, piece.entry + WING - 1, thick=piece.thick)
    made.line_across(made.entry - WING, made.entry + WING, 0, double=True)
    made.text(made.entry + WING + 1, 0, f"◄ {name}")
    made.line_down(made.entry, 0, 1, piece.thick)
    made.place(piece, WING - 1, 1)
    return made


def jump(labels: Sequence[str], thick: bool) -> Piece:
    """An arrow with the names of steps."""
    piece = Piece(1, 1, 0, thick=thick)
    piece.line_across(0, 1, 0, thick)
    for row, line in enumerate(wrap(", ".join(labels), NAMES)):
        piece.text(1, row, f"{' ' if row else '►'} {line}")
        piece.height = row + 1
    return piece


def passing(to: Node, thick: bool) -> Piece:
    """A line that goes on."""
    return Piece(1, 0, 0, ends=[End(0, to, thick)], thick=thick)


# --- put together ---------------------------------------------------------------------------------------------------


def stack(own: Piece, children: Sequence[Piece], double: bool) -> Piece:
    """A node above what follows it: one below the other, or below a line across."""
    if not children:
        return own
    if len(children) == 1:
        shift = own.entry - children[0].entry
        piece = Piece(0, 0, max(0, -shift) + own.entry, thick=own.thick)
        piece.place(own, max(0, -shift), 0)
        _hang(piece, children[0], max(0, shift), own.height, own.height - 1)
        return piece
    places, x = [], WING if double else 0
    for child in children:
        places.append(x)
        x += child.width + GAP
    first, last = places[0] + children[0].entry, places[-1] + children[-1].entry
    middle = max(own.entry, (first + last) // 2)
    piece = Piece(0, 0, middle, thick=own.thick)
    piece.place(own, middle - own.entry, 0)
    row = own.height
    piece.line_down(middle, row - 1, row, any(child.thick for child in children))
    wing = WING if double else 0
    piece.line_across(min(first, middle) - wing, max(last, middle) + wing, row, double=double)
    piece.width = max(piece.width, max(last, middle) + wing + 1)
    for child, at in zip(children, places, strict=True):
        if child.thick and not double:
            piece.line_across(min(middle, at + child.entry), max(middle, at + child.entry), row, True)
        _hang(piece, child, at, row + 1, row)
    return piece


def _hang(piece: Piece, child: Piece, x: int, y: int, line: int) -> None:
    """Put a child below a line, and keep its ends; all ends reach the last row."""
    piece.line_down(x + child.entry, line, y, child.thick)
    bottoms = [*[(end, piece.height) for end in piece.ends], *[(End(end.x + x, end.to, end.thick), y + child.height)
                                                               for end in child.ends]]
    piece.place(child, x, y)
    piece.ends = [end for end, _ in bottoms]
    for end, bottom in bottoms:
        piece.line_down(end.x, bottom - 1, piece.height - 1, end.thick)


def join(piece: Piece, merged: Node, below: Piece, double: bool, name: str) -> Piece:
    """A piece with the node below it at which branches converge.

    `piece` is the drawing above, `below` that of the node `merged`, whose `name` is written at arrows.  Only ends without
    another end between them are joined; the others to `merged` end with an arrow.  `double` draws the line of a
    simultaneous convergence (6.7.4)."""
    joined, cut_off = _neighbours(piece.ends, merged)
    made = Piece(piece.width, piece.height, piece.entry, thick=piece.thick)
    made.place(piece, 0, 0)
    row = piece.height
    for end in cut_off:
        _close(made, end, row, f"► {name}")
    left, right = _beside(piece.ends, joined, cut_off)
    entry = max((joined[0].x + joined[-1].x) // 2, max((end.x + 2 for end in left), default=0) + below.entry)
    row, moved = _aside(made, right, entry - below.entry + below.width + 1, piece.height, row + bool(cut_off))
    for end in (*left, *joined, *(end for end in right if end not in moved)):
        made.line_down(end.x, piece.height - 1, row, end.thick)
    first, last = _converge(made, joined, entry, row, double)
    if double and cut_off:
        made.text(last + 2, row, f"◄ {name}")
    below.thick = any(end.thick for end in joined)
    made.ends = [End(end.x, end.to, end.thick) for end in (*left, *right)]
    made.height = row + 1
    made.width = max(made.width, last + 1)
    _hang(made, below, entry - below.entry, row + 1, row)
    made.ends.sort(key=lambda end: end.x)
    return _shifted(made, max(-first, below.entry - entry, 0))


def _beside(ends: Sequence[End], joined: Sequence[End], cut_off: Sequence[End]) -> tuple[list[End], list[End]]:
    """The ends that go on, at the left and at the right of those that are joined."""
    at = ends.index(joined[0])
    others = [(number, end) for number, end in enumerate(ends) if end not in joined and end not in cut_off]
    return [end for number, end in others if number < at], [end for number, end in others if number > at]


def _converge(piece: Piece, joined: Sequence[End], entry: int, row: int, double: bool) -> tuple[int, int]:
    """Draws the line across in which ends meet above column `entry`; returns its first and last column."""
    wing = WING if double else 0
    first, last = min(entry, joined[0].x) - wing, max(entry, joined[-1].x) + wing
    if len(joined) > 1 or entry != joined[0].x or double:
        piece.line_across(first, last, row, double=double)
        for end in joined if not double else ():
            if end.thick:
                piece.line_across(min(end.x, entry), max(end.x, entry), row, True)
    return first, last


def _neighbours(ends: Sequence[End], merged: Node) -> tuple[list[End], list[End]]:
    """The ends that meet, which no other end stands between, and those that are left over."""
    groups: list[list[End]] = [[]]
    for end in ends:
        if end.to == merged:
            groups[-1].append(end)
        elif groups[-1]:
            groups.append([])
    most = max(groups, key=len)
    return most, [end for group in groups if group is not most for end in group]


def _close(piece: Piece, end: End, row: int, text: str) -> None:
    """End a line with an arrow."""
    piece.line_down(end.x, row - 1, row, end.thick)
    piece.line_across(end.x, end.x + 1, row, end.thick)
    piece.text(end.x + 1, row, text)


def _aside(piece: Piece, ends: Sequence[End], least: int, begin: int, row: int) -> tuple[int, list[End]]:
    """Lead ends to the right until what is left of column `least` is free below them, the last one first, in
    rows from `row` on; their lines go on from row `begin`.  Gives the row behind that, and the ends that were moved."""
    moves = [(end, end.x, max(end.x, least + GAP * number)) for number, end in enumerate(ends)]
    moves = [move for move in reversed(moves) if move[1] != move[2]]
    for at, (end, x, until) in enumerate(moves, row):
        piece.line_down(x, begin - 1, at, end.thick)
        piece.line_across(x, until, at, end.thick)
        piece.line_down(until, at, row + len(moves), end.thick)
        piece.width = max(piece.width, until + 1)
        end.x = until
    return row + len(moves), [end for end, _, _ in moves]


def _shifted(piece: Piece, by: int) -> Piece:
    """The same piece some columns to the right."""
    if not by:
        return piece
    made = Piece(0, 0, piece.entry + by, thick=piece.thick)
    made.place(piece, by, 0)
    made.ends = [End(end.x + by, end.to, end.thick) for end in piece.ends]
    return made
