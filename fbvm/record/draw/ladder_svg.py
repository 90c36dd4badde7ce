"""Rungs and charts as SVG: the same drawing as the one of characters, with lines and colours."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fbvm.record.draw.sfc_text import TOKEN
from fbvm.syntax.ladder.drawing.box_lines import DOUBLE, DOWN, LEFT, RIGHT, THICK, UP, Surface
from fbvm.syntax.ladder.drawing.cells import cells, text_of

CELL_WIDTH, CELL_HEIGHT = 9, 18
"""Pixels of a character."""
APART = 2.0
"""Pixels from the middle of a double line to its halves."""
_STYLE = """
    text { font: 14px ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; fill: #1f2430; white-space: pre; }
    text.head { font-weight: bold; } text.faint { fill: #6b7280; font-size: 12px; }
    text.power { fill: #0a8f3c; }
    path { fill: none; stroke: #6b7280; stroke-width: 1.2; stroke-linecap: square; }
    path.mark { stroke: #1f2430; stroke-width: 1.8; stroke-linecap: butt; }
    path.power { stroke: #0a8f3c; stroke-width: 3.2; }
    rect { fill: #ffffff; }
    @media (prefers-color-scheme: dark) {
        text { fill: #e5e7eb; } text.faint { fill: #9ca3af; } text.power { fill: #34d26b; }
        path { stroke: #9ca3af; } path.mark { stroke: #e5e7eb; }
        path.power { stroke: #34d26b; } rect { fill: #16181d; }
    }
"""
_ENDS = {LEFT: (-0.5, 0.0), RIGHT: (0.5, 0.0), DOWN: (0.0, 0.5), UP: (0.0, -0.5)}
_TURNS = {**dict.fromkeys((LEFT, RIGHT), ((UP, -1), (DOWN, 1))), **dict.fromkeys((UP, DOWN), ((LEFT, -1), (RIGHT, 1)))}
"""The directions across a direction, and their sides."""
_OPPOSITE = {LEFT: RIGHT, RIGHT: LEFT, UP: DOWN, DOWN: UP}
SINGLE = ((0.0, 0.0),)
Drawn = tuple[str, Surface]
"""The headline of a rung and its drawing."""


def ladder_svg(rungs: Sequence[Drawn]) -> str:
    """A picture of rungs, one below the other.  The colours follow the reader's choice of light or dark."""
    parts: list[str] = []
    row = columns = 0
    for head, surface in rungs:
        places = [*surface.lines, *surface.texts]
        parts.append(_text(0, row, cells(head), "head"))
        parts += _parts(surface, row + 1)
        columns = max(columns, len(cells(head)), *(x + 1 for x, _ in places))
        row += max((y for _, y in places), default=-1) + 3
    width, height = (columns + 2) * CELL_WIDTH, row * CELL_HEIGHT - CELL_HEIGHT // 2
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            f'viewBox="{-CELL_WIDTH} 0 {width} {height}">\n<style>{_STYLE}</style>\n'
            f'<rect x="{-CELL_WIDTH}" width="{width}" height="{height}"/>\n' + "\n".join(parts) + "\n</svg>\n")


def rung_svg(surface: Surface) -> str:
    """A drawing of a rung or a chart as an SVG element of a page, whose style sheet has `svg.rung` with `text`, `path`, `mark`,
    `power` and `faint`."""
    places = [*surface.lines, *surface.texts]
    width = (max(x for x, _ in places) + 2) * CELL_WIDTH
    height = (max(y for _, y in places) + 1) * CELL_HEIGHT
    return (f'<svg xmlns="http://www.w3.org/2000/svg" class="rung" width="{width}" height="{height}" '
            f'viewBox="{-CELL_WIDTH // 2} 0 {width} {height}">{"".join(_parts(surface, 0))}</svg>')


def _parts(surface: Surface, row: int) -> list[str]:
    return [*_lines(surface, row), *_strokes(surface, row), *_texts(surface, row)]


def _strokes(surface: Surface, row: int) -> list[str]:
    """Contacts as two strokes, coils as two arcs; those that conduct are of the colour of power."""
    found: dict[bool, list[str]] = {False: [], True: []}
    for x, y in sorted(surface.strokes):
        mark, middle, top = surface.texts[x, y], (x + 0.5) * CELL_WIDTH, (y + row + 0.06) * CELL_HEIGHT
        high, bend = CELL_HEIGHT * 0.88, {"(": -CELL_WIDTH * 0.55, ")": CELL_WIDTH * 0.55}.get(mark, 0)
        lit = mark in "┫┣" or mark in "()" and THICK in surface.lines.get((x, y), ())
        found[lit].append(f"M{middle - bend / 2:g} {top:g}q{bend * 1.6:g} {high / 2:g} 0 {high:g}")
    return [f'<path class="{"power" if lit else "mark"}" d="{"".join(pieces)}"/>' for lit, pieces in found.items() if pieces]


def _lines(surface: Surface, row: int) -> list[str]:
    """One path for all lines without power and one for those with it; each way out of a cell is half a cell long."""
    found: dict[bool, list[str]] = {False: [], True: []}
    for (x, y), weights in surface.lines.items():
        if (x, y) in surface.texts and (x, y) not in surface.strokes:
            continue
        for way, weight in enumerate(weights):
            if weight:
                halves = _halves(way, weights) if weight == DOUBLE else SINGLE
                found[weight == THICK] += (_line(x, y + row, way, *half) for half in halves)
    return [f'<path{" class=" + chr(34) + "power" + chr(34) if power else ""} d="{"".join(pieces)}"/>'
            for power, pieces in found.items() if pieces]


def _halves(way: int, weights: Sequence[int]) -> tuple[tuple[float, float], ...]:
    """The two lines of a double one: how far each lies beside the middle, and how far from it it begins.  At a corner the
    inner one begins later and the outer one earlier."""
    across = [(other, sign) for other, sign in _TURNS[way] if weights[other] == DOUBLE]
    if len(across) != 1 or weights[_OPPOSITE[way]]:
        return (-APART, 0.0), (APART, 0.0)
    turn = across[0][1]
    return (turn * APART, APART), (-turn * APART, -APART)


def _line(x: int, y: int, way: int, beside: float, start: float) -> str:
    dx, dy = _ENDS[way]
    right, down = (0.0, beside) if dx else (beside, 0.0)
    begin_x, begin_y = 2 * dx * start, 2 * dy * start
    first = f"M{_pixels(x, CELL_WIDTH, right + begin_x)} {_pixels(y, CELL_HEIGHT, down + begin_y)}"
    return f"{first}L{_pixels(x + dx, CELL_WIDTH, right)} {_pixels(y + dy, CELL_HEIGHT, down)}"


def _texts(surface: Surface, row: int) -> list[str]:
    """Runs of characters, each as one text at its place."""
    parts: list[str] = []
    run, start, kind = "", (0, 0), ""
    texts = {place: character for place, character in surface.texts.items() if place not in surface.strokes}
    for (x, y), character in sorted(texts.items(), key=lambda item: (item[0][1], item[0][0])):
        here = "power" if character == TOKEN else "faint" if (x, y) in surface.faint else ""
        if run and ((x, y) != (start[0] + len(run), start[1]) or here != kind and "power" in (here, kind)):
            parts.append(_text(start[0], start[1] + row, run, kind))
            run = ""
        start, kind = (start, kind) if run else ((x, y), here)
        run += character
    return [*parts, _text(start[0], start[1] + row, run, kind)] if run else parts


def _text(x: int, y: int, text: str, kind: str = "") -> str:
    """A text, in cells, stretched to them, whatever the reader's font."""
    named = f' class="{kind}"' if kind else ""
    return (f'<text{named} x="{_across(x - 0.5)}" y="{_down(y + 0.28)}" textLength="{len(text) * CELL_WIDTH}" '
            f'lengthAdjust="spacingAndGlyphs">{escape(text_of(text), quote=False)}</text>') if text.strip() else ""


def _across(x: float) -> str:
    return _pixels(x, CELL_WIDTH)


def _down(y: float) -> str:
    return _pixels(y, CELL_HEIGHT)


def _pixels(place: float, size: int, more: float = 0.0) -> str:
    """Where the middle of a cell lies."""
    return f"{(place + 0.5) * size + more:g}"
