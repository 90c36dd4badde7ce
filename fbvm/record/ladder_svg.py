"""Ladder as SVG: the same drawing as the one of characters, its lines drawn as lines, power in colour."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from fbvm.syntax.box_lines import DOWN, LEFT, RIGHT, THICK, Surface

CELL_WIDTH, CELL_HEIGHT = 9, 18
"""Pixels of a character."""
_STYLE = """
    text { font: 14px ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; fill: #1f2430; white-space: pre; }
    text.head { font-weight: bold; }
    path { fill: none; stroke: #6b7280; stroke-width: 1.2; stroke-linecap: square; }
    path.power { stroke: #0a8f3c; stroke-width: 3.2; }
    rect { fill: #ffffff; }
    @media (prefers-color-scheme: dark) {
        text { fill: #e5e7eb; } path { stroke: #9ca3af; } path.power { stroke: #34d26b; } rect { fill: #16181d; }
    }
"""
_ENDS = {LEFT: (-0.5, 0.0), RIGHT: (0.5, 0.0), DOWN: (0.0, 0.5)}
Drawn = tuple[str, Surface]
"""The headline of a rung and its drawing."""


def ladder_svg(rungs: Sequence[Drawn]) -> str:
    """A picture of rungs, one below the other.  It follows the reader's choice of light or dark."""
    parts: list[str] = []
    row = columns = 0
    for head, surface in rungs:
        places = [*surface.lines, *surface.texts]
        parts.append(_text(0, row, head, "head"))
        parts += [*_lines(surface, row + 1), *_texts(surface, row + 1)]
        columns = max(columns, len(head), *(x + 1 for x, _ in places))
        row += max(y for _, y in places) + 3
    width, height = (columns + 2) * CELL_WIDTH, row * CELL_HEIGHT
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            f'viewBox="{-CELL_WIDTH} 0 {width} {height}">\n<style>{_STYLE}</style>\n'
            f'<rect x="{-CELL_WIDTH}" width="{width}" height="{height}"/>\n' + "\n".join(parts) + "\n</svg>\n")


def _lines(surface: Surface, row: int) -> list[str]:
    """One path for all lines without power and one for those with it; each way out of a cell is half a cell long."""
    found: dict[bool, list[str]] = {False: [], True: []}
    for (x, y), weights in surface.lines.items():
        covered = (x, y) in surface.texts
        for way, weight in enumerate(weights):
            if weight and not covered:
                dx, dy = _ENDS.get(way, (0.0, -0.5))
                found[weight == THICK].append(f"M{_across(x)} {_down(y + row)}L{_across(x + dx)} {_down(y + row + dy)}")
    return [f'<path{" class=" + chr(34) + "power" + chr(34) if power else ""} d="{"".join(pieces)}"/>'
            for power, pieces in found.items() if pieces]


def _texts(surface: Surface, row: int) -> list[str]:
    """Runs of characters, each as one text at its place."""
    parts: list[str] = []
    run, start = "", (0, 0)
    for (x, y), character in sorted(surface.texts.items(), key=lambda item: (item[0][1], item[0][0])):
        if run and (x, y) != (start[0] + len(run), start[1]):
            parts.append(_text(start[0], start[1] + row, run))
            run = ""
        start = start if run else (x, y)
        run += character
    return [*parts, _text(start[0], start[1] + row, run)] if run else parts


def _text(x: int, y: int, text: str, kind: str = "") -> str:
    """A text stretched to its cells, whatever the reader's font."""
    named = f' class="{kind}"' if kind else ""
    return (f'<text{named} x="{_across(x - 0.5)}" y="{_down(y + 0.28)}" textLength="{len(text) * CELL_WIDTH}" '
            f'lengthAdjust="spacingAndGlyphs">{escape(text)}</text>') if text.strip() else ""


def _across(x: float) -> str:
    return f"{(x + 0.5) * CELL_WIDTH:g}"


def _down(y: float) -> str:
    return f"{(y + 0.5) * CELL_HEIGHT:g}"
