"""Ladder as a drawing of characters: rungs with contacts, coils and boxes, and with thick lines where power was."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from fbvm.code.image import RungPicture
from fbvm.record.box_lines import Surface
from fbvm.record.rung_diagram import Box, Coil, Contact, Parallel, Point, Series, Undrawable, diagram

States = Mapping[int, Sequence[bool]]
"""What was seen at the steps of a rung in one execution: of a contact its state, of an output the power that reached
it, of a block the power into it and out of it."""
Places = Callable[[str], str]
"""The address behind a symbol, "" if it has none."""
Part = Contact | Box | Parallel
LINK = 5
"""Columns of the arrow with a number at the end of a line that goes on below."""
LEAST = 24
"""Columns that a rung needs for anything to be drawn."""


def ladder_text(picture: RungPicture, width: int = 80, states: States | None = None,
                places: Places = lambda symbol: "") -> list[str]:
    """The lines of a rung.  `states` of a rung that was executed draw the power; no `states` draw a rung at rest.

    Rungs that have no drawing, as one with an OR behind an output, are shown as their instructions."""
    head, surface = rung_surface(picture, width, states, places)
    return [head, *surface.rows()]


def rung_surface(picture: RungPicture, width: int = 80, states: States | None = None,
                 places: Places = lambda symbol: "") -> tuple[str, Surface]:
    """The headline of a rung and its drawing; see `ladder_text`."""
    head = " ".join(filter(None, (f"RUNG {picture.number}", picture.comment)))
    try:
        bar = diagram(picture)
    except (Undrawable, IndexError):
        surface = Surface()
        for row, (_, prefix, mnemonic, operands) in enumerate(picture.steps):
            surface.write(4, row, f"{prefix}{mnemonic} {' '.join(operands)}".rstrip())
        return head, surface
    return head, _Drawing(max(width, LEAST), states, places).drawn(bar)


class _Drawing:
    """Draws one rung.  Power is True, False, or None at rest."""

    def __init__(self, width: int, states: States | None, places: Places) -> None:
        self.surface = Surface()
        self.width, self.states, self.places = width, states, places
        self.bottom = 0
        self._links = 0

    def drawn(self, bar: Point) -> Surface:
        alive = self.states is not None
        self.width = max(LEAST, min(self.width, self._reach(bar)))
        height = self._outs(bar, 0, 0, alive, trunk=True)
        depth = max(height, self.bottom)
        for x, thick in ((0, alive), (self.width - 1, False)):
            self.surface.down(x, -1, depth, thick)
        self.surface.cut(depth)
        return self.surface

    def _reach(self, point: Point) -> int:
        """The columns that a rung takes on one line."""
        behind = [self._output_width(out) if not isinstance(out, Point) else self._reach(out) for out in point.outs]
        return self._series_width(point.path) + 2 + max(behind, default=4)

    def state(self, step: int, which: int = -1) -> bool | None:
        """What was seen at a step; None at rest or if it was not reached."""
        if self.states is None:
            return None
        seen = self.states.get(step)
        return bool(seen[which]) if seen else False

    # --- widths -----------------------------------------------------------------------------------------------------

    def _label(self, label: str) -> int:
        return max(len(label), len(self.places(label)))

    def _part_width(self, part: Part) -> int:
        if isinstance(part, Contact):
            return max(len(part.mark) + 6, self._label(part.label) + 2)
        if isinstance(part, Box):
            return _box_width(part) + 4
        return max(map(self._series_width, part.branches)) + 2

    def _series_width(self, path: Series) -> int:
        return sum(map(self._part_width, path.parts))

    def _output_width(self, out: Coil | Box) -> int:
        return _box_width(out) + 5 if isinstance(out, Box) else max(len(out.mark) + 6, self._label(out.label) + 6)

    # --- branch points and outputs ----------------------------------------------------------------------------------

    def _outs(self, point: Point, x: int, y: int, power: bool | None, trunk: bool = False) -> int:
        """What hangs on a point in column x whose line is in the row below y; the row behind it all."""
        first = last = y + 1
        for out in point.outs:
            last = y + 1
            if isinstance(out, Point):
                y = self._point(out, x, y, power)
            else:
                y = self._output(out, x, y, power)
        if not trunk:
            self.surface.down(x, first, last, bool(power))
        if not point.outs:
            self.surface.across(x, self.width - 1, y + 1, bool(power))
            y += 2
        return y

    def _point(self, point: Point, x: int, y: int, power: bool | None) -> int:
        """A path, and what hangs on its end; long ones go on below."""
        depth = y
        for at, part in enumerate(point.path.parts):
            if x + self._part_width(part) + self._needed(point, at) > self.width and x > LINK:
                x, y, depth = self._continued(x, y, max(depth, y + 2), bool(power))
            there = x + self._part_width(part)
            height, power = self._part(part, x, y, power)
            x, depth = there, max(depth, y + height)
        return max(depth, self._outs(point, x, y, power))

    def _needed(self, point: Point, at: int) -> int:
        """The columns that must be left behind a part of a path: for what ends the rung, or for an arrow."""
        if at + 1 < len(point.path.parts):
            return LINK
        return max((LINK if isinstance(out, Point) else self._output_width(out) for out in point.outs), default=2)

    def _continued(self, x: int, y: int, depth: int, power: bool) -> tuple[int, int, int]:
        """End a line with an arrow and a number, and begin another one with them."""
        self._links += 1
        mark = f"►{self._links}"
        self.surface.across(x, x + 2, y + 1, power)
        self.surface.write(x + 2, y + 1, mark)
        self.surface.write(2, depth + 1, mark)
        self.surface.across(2 + len(mark), 4 + len(mark), depth + 1, power)
        return 4 + len(mark), depth, depth + 2

    def _output(self, out: Coil | Box, x: int, y: int, power: bool | None) -> int:
        seen = self.state(out.step, 0)
        on = bool(power if seen is None else seen)
        end = self.width - 1
        if isinstance(out, Coil):
            mark = f"({out.mark})"
            at = end - 2 - max(len(mark), (self._label(out.label) + len(mark)) // 2)
            self.surface.across(x, at, y + 1, on)
            self.surface.across(at + len(mark) - 1, end, y + 1, on)
            self.surface.write(at, y + 1, mark)
            return y + 2 + self._labels(out.label, at + len(mark) // 2, y)
        wide = _box_width(out)
        at = end - wide - 2
        self.surface.across(x, at, y + 1, on)
        rows = self._more_inputs(out, y, at)
        height = self._box(out.lines, at, y, wide, max(rows, default=0))
        self.bottom = max(self.bottom, y + height)
        return y + height

    def _more_inputs(self, box: Box, y: int, until: int) -> list[int]:
        """The conditions below the first one, each from the bus bar to the box; the rows of their lines."""
        rows, row = [], y + 2
        for path in box.inputs:
            height, power = self._series(path, 0, row, self.states is not None or None)
            self.surface.across(self._series_width(path), until, row + 1, bool(power))
            rows.append(row + 1)
            row += height
        return rows

    def _box(self, lines: Sequence[str], x: int, y: int, wide: int, last_row: int) -> int:
        """A box whose first text is on the line; how many rows it takes."""
        deep = max(len(lines) + 1, last_row - y + 1)
        for row in (y, y + deep):
            self.surface.across(x, x + wide, row)
        self.surface.down(x, y, y + deep)
        self.surface.down(x + wide, y, y + deep)
        for row, text in enumerate(lines, y + 1):
            self.surface.write(x + 2, row, text)
        return deep + 1

    def _labels(self, label: str, middle: int, y: int) -> int:
        """A name above the line and its address below; how many rows that are more than two."""
        self.surface.write(middle - len(label) // 2, y, label)
        place = self.places(label)
        if place:
            self.surface.write(middle - len(place) // 2, y + 2, place)
        return bool(place)

    # --- conditions: each gives the rows that it takes and the power behind it --------------------------------------

    def _series(self, path: Series, x: int, y: int, power: bool | None) -> tuple[int, bool | None]:
        height = 2
        for part in path.parts:
            rows, power = self._part(part, x, y, power)
            x, height = x + self._part_width(part), max(height, rows)
        return height, power

    def _part(self, part: Part, x: int, y: int, power: bool | None) -> tuple[int, bool | None]:
        if isinstance(part, Contact):
            return self._contact(part, x, y, power)
        if isinstance(part, Parallel):
            return self._parallel(part, x, y, power)
        wide = _box_width(part)
        self.surface.across(x, x + 2, y + 1, bool(power))
        height = self._box(part.lines, x + 2, y, wide, 0)
        out = self.state(part.step) and (power or len(part.lines) == 1)
        self.surface.across(x + 2 + wide, x + 4 + wide, y + 1, bool(out))
        return height, out

    def _contact(self, contact: Contact, x: int, y: int, power: bool | None) -> tuple[int, bool | None]:
        wide, mark = self._part_width(contact), f"┤{contact.mark}├"
        state = self.state(contact.step)
        out = None if state is None else bool(power and state)
        at = x + (wide - len(mark)) // 2 + 1
        self.surface.across(x, at, y + 1, bool(power))
        self.surface.across(at + len(mark) - 1, x + wide, y + 1, bool(out))
        self.surface.write(at, y + 1, mark if not state else f"┫{contact.mark}┣")
        return 2 + self._labels(contact.label, at + len(mark) // 2, y), out

    def _parallel(self, parallel: Parallel, x: int, y: int, power: bool | None) -> tuple[int, bool | None]:
        wide = self._part_width(parallel)
        left, right, top = x + 1, x + wide - 1, y
        self.surface.across(x, left, y + 1, bool(power))
        powers, rows = [], []
        for branch in parallel.branches:
            height, out = self._series(branch, left, y, power)
            self.surface.across(left + self._series_width(branch), right, y + 1, bool(out))
            powers.append(out)
            rows.append(y + 1)
            y += height
        on = any(powers)
        self.surface.down(left, rows[0], rows[-1], bool(power))
        self.surface.down(right, rows[0], rows[-1], on)
        self.surface.across(right, x + wide, top + 1, on)
        return y - top, None if powers[0] is None else on


def _box_width(box: Box) -> int:
    return max(map(len, box.lines)) + 3
