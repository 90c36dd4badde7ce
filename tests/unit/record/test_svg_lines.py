"""Pictures of rungs: lines that belong together meet at the edges of their cells, and each text lies in its cells."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from fbvm.record.draw.ladder_svg import rung_svg
from fbvm.syntax.ladder.drawing.box_lines import Surface

SEGMENT = re.compile(r"M([-\d.]+) ([-\d.]+)L([-\d.]+) ([-\d.]+)")
Segment = tuple[float, float, float, float]


def drawn(surface: Surface) -> tuple[dict[str, list[Segment]], list[ElementTree.Element]]:
    """The segments of the lines of a picture by their class, and its texts."""
    root = ElementTree.fromstring(rung_svg(surface))
    lines = {path.get("class") or "": [tuple(map(float, found)) for found in SEGMENT.findall(path.get("d") or "")]
             for path in root if path.tag.endswith("}path")}  # fmt: skip
    return lines, [part for part in root if part.tag.endswith("}text")]  # type: ignore[return-value]


def covered(segments: list[Segment], axis: int) -> list[tuple[float, float, float]]:
    """The stretches that horizontal (0) or vertical (1) segments cover together: where they lie, from, to."""
    across = sorted((one[1 - axis], min(one[axis], one[axis + 2]), max(one[axis], one[axis + 2])) for one in segments
                    if one[1 - axis] == one[3 - axis])  # fmt: skip
    found: list[tuple[float, float, float]] = []
    for where, start, end in across:
        if found and found[-1][0] == where and start <= found[-1][2]:
            found[-1] = where, found[-1][1], max(end, found[-1][2])
        else:
            found.append((where, start, end))
    return found


def middles(surface: Surface) -> tuple[float, float]:
    """The distance of two columns and of two rows, by a text in each."""
    surface.write(20, 9, "x")
    surface.write(21, 10, "y")
    texts = [part for part in drawn(surface)[1] if part.text in ("x", "y")]
    (one, two) = [(float(part.get("x") or 0), float(part.get("y") or 0)) for part in texts]
    return two[0] - one[0], two[1] - one[1]


def test_lines_go_from_the_middle_of_a_cell_to_that_of_another() -> None:
    surface = Surface()
    surface.across(1, 6, 2)
    surface.down(4, 2, 5, True)
    wide, high = middles(surface)
    lines, _ = drawn(surface)
    [(y, first, last)] = covered(lines[""], 0)
    assert (y, first, last) == (2.5 * high, 1.5 * wide, 6.5 * wide)
    [(x, top, bottom)] = [found for found in covered(lines["power"], 1) if found[1] != found[2]]
    assert (x, top, bottom) == (4.5 * wide, 2.5 * high, 5.5 * high)


def test_double_lines_are_two_beside_the_middle_that_meet_at_corners() -> None:
    surface = Surface()
    for row in (0, 2):
        surface.across(0, 4, row, double=True)
    for column in (0, 4):
        surface.down(column, 0, 2, double=True)
    wide, high = middles(surface)
    lines, _ = drawn(surface)
    rows, columns = covered(lines[""], 0), covered(lines[""], 1)
    assert len(rows) == len(columns) == 4
    for (where, start, end), (outer, first, last) in ((rows[0], columns[0]), (rows[3], columns[3])):
        assert start == columns[0][0] and end == columns[3][0], "the outer frame is closed"
        assert first == rows[0][0] and last == rows[3][0]
        apart = min(abs(where - middle * high) for middle in (0.5, 2.5))
        assert apart == min(abs(outer - middle * wide) for middle in (0.5, 4.5)) > 0
    for where, start, end in rows[1:3]:
        assert (start, end) == (columns[1][0], columns[2][0]) and 0.5 * high < where < 2.5 * high, "the inner one too"


def test_a_text_is_as_wide_as_its_cells() -> None:
    surface = Surface()
    surface.write(3, 1, "abc")
    surface.write(7, 1, "d")
    wide, _ = middles(surface)
    texts = {part.text: part for part in drawn(surface)[1]}
    assert float(texts["abc"].get("textLength") or 0) == 3 * wide and float(texts["d"].get("x") or 0) == 7 * wide
    assert float(texts["d"].get("x") or 0) - float(texts["abc"].get("x") or 0) == 4 * wide
    root = ElementTree.fromstring(rung_svg(surface))
    assert float(root.get("width") or 0) >= 22 * wide
