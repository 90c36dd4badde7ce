"""Rungs as drawings of characters: contacts, coils and boxes, with thick lines where there was power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fbvm.syntax.ladder.drawing.box_lines import Surface
from fbvm.syntax.ladder.drawing.boxes import Shape
from fbvm.syntax.ladder.drawing.cells import cells
from fbvm.syntax.ladder.drawing.diagram import Box, Coil, Contact, Parallel, Part, Point, Series, StepText, Undrawable, diagram
from fbvm.syntax.ladder.drawing.widths import LEAD, LINK, SLACK, Annotations, Widths

ARROW = "►"
LEAST = 24
"""Least columns of a rung."""
STEP = 4
"""Columns by which a rung becomes wider if an element does not fit."""
AT_REST = Annotations()


def rung_text(steps: Sequence[StepText], width: int = 80, annotations: Annotations = AT_REST) -> list[str]:
    """The lines of a rung without its headline.

    Rungs that have no drawing, as one with an OR behind an output, are shown as their instructions."""
    return rung_surface(steps, width, annotations).rows()


def rung_surface(steps: Sequence[StepText], width: int = 80, annotations: Annotations = AT_REST, least: int = 0) -> Surface:
    """The drawing of a rung; see `ladder.text`."""
    filled = [(prefix, mnemonic, tuple(map(cells, operands))) for prefix, mnemonic, operands in steps]
    try:
        return drawn(diagram(filled), width, annotations.in_cells(), least)
    except Undrawable:
        surface = Surface()
        for row, (prefix, mnemonic, operands) in enumerate(filled):
            surface.write(4, row, f"{prefix}{mnemonic} {' '.join(operands)}".rstrip())
        return surface


def drawn(bar: Point, width: int = 80, annotations: Annotations = AT_REST, least: int = 0) -> Surface:
    """The drawing of a diagram whose texts are cells.

    It is wider than `width` only if a single element is, and never narrower than `least`."""
    widths = Widths(annotations)
    reach = max(LEAST, widths.reach(bar))
    width = max(LEAST, least, min(width, reach))
    while True:
        drawing = _Drawing(width, widths)
        surface = drawing.drawn(bar)
        if drawing.need <= width:
            return surface
        width = max(drawing.need, least, min(width + STEP, reach))


class _Rest(NamedTuple):
    """The rest of a line that goes on further down."""

    number: int
    point: Point
    power: bool | None


class _Branch(NamedTuple):
    """Where a point has been drawn: the column and row at which its paths begin, and its power."""

    x: int
    y: int
    power: bool | None


class _Drawing:
    """Draws one rung.  Power is True, False, or None at rest."""

    def __init__(self, width: int, widths: Widths) -> None:
        self.surface = Surface()
        self.width, self.widths, self.annotations = width, widths, widths.annotations
        self.need = 0
        """Width in columns that would have been enough for what did not fit."""
        self._start = 0
        """The column in which the line at work begins."""
        self._left: list[_Rest] = []
        self._links = 0

    def drawn(self, bar: Point) -> Surface:
        alive = self.annotations.states is not None
        depth = self._outs(bar, 0, 0, alive, trunk=True)
        while self._left:
            rest = self._left.pop(0)
            self._start = self._go_on(rest.number, 2, depth, bool(rest.power))
            depth = self._point(rest.point, self._start, depth, rest.power)
        for x, thick in ((0, alive), (self.width - 1, False)):
            self.surface.down(x, -1, depth, thick)
        self.surface.cut(depth)
        return self.surface

    def _state(self, step: int, which: int = -1) -> bool | None:
        """The state or power at a step; None at rest or if the step was not executed."""
        if self.annotations.states is None:
            return None
        seen = self.annotations.states.get(step)
        return bool(seen[which]) if seen else False

    # --- branch points and outputs ----------------------------------------------------------------------------------

    def _outs(self, point: Point, x: int, y: int, power: bool | None, is_open: bool = False, below: int = 0,
              trunk: bool = False, before: _Branch | None = None) -> int:
        """What hangs on a point in column x whose line is in the row below y; the row behind it all.

        `is_open`: a line passes below what is drawn here, so nothing may come from the left; else it may below `below`.
        `before` is the point before, from which lower inputs of boxes may come."""
        first = last = y + 1
        for position, out in enumerate(point.outs):
            last = y + 1
            passed = is_open or not trunk and position + 1 < len(point.outs)
            if isinstance(out, Point):
                y = self._point(out, x, y, power, passed, below, _Branch(x, first, power))
            elif isinstance(out, Box) and passed and any(not path.from_branch for path in out.inputs):
                y = self._leave(Point(Series(), [out]), x, y, power)
            else:
                y = self._output(out, x, y, power, below, before)
        if not trunk:
            self.surface.down(x, first, last, bool(power))
        if not point.outs:
            self.surface.across(x, self.width - 1, y + 1, bool(power))
            y += 2
        return y

    def _point(self, point: Point, x: int, y: int, power: bool | None, is_open: bool = False, below: int = 0,
               before: _Branch | None = None) -> int:
        """A path and the point at its end; what does not fit is left for another line, unless lower inputs join it."""
        depth, parts = y, point.path.parts
        for at, part in enumerate(parts):
            behind = LINK if at + 1 < len(parts) else self.widths.needed(point) + SLACK
            fits = x + self.widths.part(part) + behind <= self.width or point.is_joined
            if not fits and x > max(self._start, LINK):
                return max(depth, self._leave(Point(Series(parts[at:]), point.outs), x, y, power))
            wide = self._fitting(part, self.width - behind - x)
            height, power = self._part(part, x, y, power, wide)
            x, depth = x + wide, max(depth, y + height)
            self._take(x + behind - (SLACK if at + 1 == len(parts) else 0))
        return max(depth, self._outs(point, x, y, power, is_open, max(depth, below), before=before))

    def _leave(self, rest: Point, x: int, y: int, power: bool | None) -> int:
        """End a line with an arrow and a number; its rest begins with the same arrow, below all lines that were begun."""
        self._links += 1
        self._left.append(_Rest(self._links, rest, power))
        self._arrow(self._links, x, y, bool(power))
        return y + 2

    def _arrow(self, number: int, x: int, y: int, power: bool) -> None:
        self.surface.across(x, x + 2, y + 1, power)
        self.surface.write(x + 2, y + 1, f"{ARROW}{number}")
        self._take(x + 4 + len(str(number)))

    def _go_on(self, number: int, x: int, y: int, power: bool) -> int:
        """Begin a line with an arrow in column x; returns the column behind the arrow."""
        mark = f"{ARROW}{number}"
        self.surface.write(x, y + 1, mark)
        self.surface.across(x + len(mark) - 1, x + len(mark) + 2, y + 1, power)
        return x + len(mark) + 2

    def _take(self, columns: int) -> None:
        if columns > self.width:
            self.need = max(self.need, columns)

    def _output(self, out: Coil | Box, x: int, y: int, power: bool | None, below: int, before: _Branch | None) -> int:
        seen = None if isinstance(out, Box) and out.inputs else self._state(out.step, 0)  # of several inputs it is the last
        on = bool(power if seen is None else seen)
        end = self.width - 1
        self._take(x + self.widths.output(out))
        if isinstance(out, Coil):
            mark, label = f"({out.mark})", " ".join(out.operands)
            at = end - self.widths.mark_at(out)
            self.surface.across(x, at, y + 1, on)
            self.surface.across(at + len(mark) - 1, end, y + 1, on)
            self.surface.symbol(at, y + 1, mark)
            return y + 2 + self._labels(label, self.annotations.places(label), at, len(mark), y)
        made = self.widths.shape(out)
        at = end - made.right - made.wide - 2
        if out.entries or not out.instance:
            self.surface.across(x, at, y + 1, on)
        rows, bottom = self._more_inputs(out, y, at, below, before)
        return max(bottom, y + self._box(made, at, y, [1, *rows]))

    def _more_inputs(self, box: Box, y: int, until: int, below: int, before: _Branch | None) -> tuple[list[int], int]:
        """The conditions below the first one, each from the bus bar or from the point before to the box; the rows of their
        lines, counted from y, and the row behind them all."""
        rows, row = [], max(y + 2, below)
        for path in box.inputs:
            begins = _Branch(0, row + 1, self.annotations.states is not None or None)
            if path.from_branch:
                assert before is not None
                begins = before
                self.surface.down(before.x, before.y, row + 1, bool(before.power))
            height, power, line, x = self._series(path, begins.x, row, begins.power, until - 1)
            self.surface.across(x, until, line, bool(power))
            self._take(x + self.width - until + 1)
            rows.append(line - y)
            row += height
        return rows, row if rows else y

    def _box(self, made: Shape, x: int, y: int, conditions: Sequence[int]) -> int:
        """A box whose first condition is on the line; returns its number of rows."""
        rows = made.placed(conditions)
        deep = max([*rows, *conditions, 1]) + 1
        for edge in (y, y + deep):
            self.surface.across(x, x + made.wide, edge)
        for side in (x, x + made.wide):
            self.surface.down(side, y, y + deep)
        if made.title:
            self.surface.write(x + 2, y, made.title)
        for at, row in rows.items():
            self.surface.write(x + made.inset, y + at, row.left)
            self.surface.write(x + made.wide - len(row.right), y + at, row.right)
            if row.entering:
                self.surface.across(x - 2, x, y + at)
                self.surface.write(x - 1 - len(row.entering), y + at, row.entering)
            if row.leaving:
                self.surface.across(x + made.wide, x + made.wide + 2, y + at)
                self.surface.write(x + made.wide + 2, y + at, row.leaving)
        return deep + 1

    def _labels(self, label: str, below: str, x: int, wide: int, y: int) -> int:
        """A name above a mark, and an address or a value below; returns how many rows are needed beyond two."""
        self.surface.write(x + (wide - len(label)) // 2, y, label)
        if below:
            start = x + (wide - len(below)) // 2
            self.surface.write(start, y + 2, below)
            self.surface.faint |= {(column, y + 2) for column in range(start, start + len(below))}
        return bool(below)

    # --- conditions: each gives the rows that it takes and the power behind it --------------------------------------

    def _series(self, path: Series, x: int, y: int, power: bool | None, limit: int) -> tuple[int, bool | None, int, int]:
        """Parts one behind the other that end left of `limit`, in several lines if need be: also the row and the column
        in which the last line ends."""
        top, start, begin, height = y, x, x, 2
        for at, part in enumerate(path.parts):
            behind = LINK if at + 1 < len(path.parts) else 0
            if x + self.widths.part(part) + behind > limit and x > begin:
                self._links += 1
                self._arrow(self._links, x, y, bool(power))
                y, height = y + height, 2
                x = begin = self._go_on(self._links, start + 2, y, bool(power))
            wide = self._fitting(part, limit - behind - x)
            rows, power = self._part(part, x, y, power, wide)
            x, height = x + wide, max(height, rows)
            self._take(x + behind - limit + self.width)
        return y + height - top, power, y + 1, x

    def _fitting(self, part: Part, room: int) -> int:
        """The columns that a part takes if there is `room`: branches take less than they need, since they can go on below."""
        natural = self.widths.part(part)
        return max(room, LEAST // 2) if isinstance(part, Parallel) and room < natural else natural

    def _part(self, part: Part, x: int, y: int, power: bool | None, wide: int) -> tuple[int, bool | None]:
        if isinstance(part, Contact):
            return self._contact(part, x, y, power, wide)
        if isinstance(part, Parallel):
            return self._parallel(part, x, y, power, wide)
        made = self.widths.shape(part)
        at = x + max(LEAD, made.left + 1)
        self.surface.across(x, at, y + 1, bool(power))
        height = self._box(made, at, y, [1])
        out = self._state(part.step) and (power or not part.instance)
        self.surface.across(at + made.wide, x + wide, y + 1, bool(out))
        return height, out

    def _contact(self, contact: Contact, x: int, y: int, power: bool | None, wide: int) -> tuple[int, bool | None]:
        mark = f"┤{contact.mark}├"
        state = self._state(contact.step)
        out = None if state is None else bool(power and state)
        at = x + (wide - len(mark) + 1) // 2 + 1
        self.surface.across(x, at, y + 1, bool(power))
        self.surface.across(at + len(mark) - 1, x + wide, y + 1, bool(out))
        self.surface.symbol(at, y + 1, mark if not state else f"┫{contact.mark}┣")
        below = self.widths.below(contact)
        return 2 + self._labels(" ".join(contact.operands), below, at, len(mark), y), out

    def _parallel(self, parallel: Parallel, x: int, y: int, power: bool | None, wide: int) -> tuple[int, bool | None]:
        left, right, top = x + 1, x + wide - 1, y
        self.surface.across(x, left, y + 1, bool(power))
        powers = []
        for branch in parallel.branches:
            begun = y + 1
            height, out, ended, end = self._series(branch, left, y, power, right)
            self.surface.across(end, right, ended, bool(out))
            powers.append(out)
            y += height
        on = any(powers)
        self.surface.down(left, top + 1, begun, bool(power))
        self.surface.down(right, top + 1, ended, on)
        self.surface.across(right, x + wide, top + 1, on)
        return y - top, None if powers[0] is None else on
