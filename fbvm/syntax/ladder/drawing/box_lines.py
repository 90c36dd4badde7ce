"""A surface of characters on which lines meet: each cell knows the directions in which lines leave it, thin or thick."""

from __future__ import annotations

import unicodedata
from functools import cache

from fbvm.syntax.ladder.drawing.cells import text_of

LEFT, RIGHT, UP, DOWN = range(4)
WAY_WORDS = {"LEFT": (LEFT,), "RIGHT": (RIGHT,), "UP": (UP,), "DOWN": (DOWN,), "HORIZONTAL": (LEFT, RIGHT),
             "VERTICAL": (UP, DOWN)}
"""Words in the names of box drawing characters -> the directions in which lines leave the character."""
THIN, THICK, DOUBLE = 1, 2, 3
_WEIGHTS = {"LIGHT": THIN, "SINGLE": THIN, "HEAVY": THICK, "DOUBLE": DOUBLE}


@cache
def _characters() -> dict[tuple[int, int, int, int], str]:
    """Box drawing characters by the weight of the lines that leave to the left, right, up and down.

    Their names say it: DOWN LIGHT AND RIGHT HEAVY, VERTICAL HEAVY AND RIGHT LIGHT, LIGHT HORIZONTAL."""
    found = {(0, 0, 0, 0): " "}
    for code in range(0x2500, 0x2580):
        words = unicodedata.name(chr(code)).removeprefix("BOX DRAWINGS ").split()
        if not set(words) <= {*WAY_WORDS, *_WEIGHTS, "AND"}:
            continue
        weights = [0, 0, 0, 0]
        for ways, weight in _parts(words):
            for way in ways:
                weights[way] = weight
        found.setdefault((weights[LEFT], weights[RIGHT], weights[UP], weights[DOWN]), chr(code))
    return found


def _parts(words: list[str]) -> list[tuple[tuple[int, ...], int]]:
    """The directions and weights that a name says: a weight stands in front of its directions, or behind them."""
    if words[0] not in _WEIGHTS:
        return [(ways, weight) for ways, weight in _parts(words[::-1])]
    parts: list[tuple[tuple[int, ...], int]] = []
    weight = 0
    for word in words:
        if word in _WEIGHTS:
            weight = _WEIGHTS[word]
        elif word != "AND":
            parts.append((WAY_WORDS[word], weight))
    return parts


class Surface:
    """Characters by column and row, and lines between them."""

    def __init__(self) -> None:
        self.lines: dict[tuple[int, int], list[int]] = {}
        self.texts: dict[tuple[int, int], str] = {}
        self.strokes: set[tuple[int, int]] = set()
        """Characters that are the strokes of a contact or the brackets of a coil."""
        self.faint: set[tuple[int, int]] = set()
        """Cells of less important text, such as addresses below symbols."""

    def _leave(self, x: int, y: int, way: int, weight: int) -> None:
        cell = self.lines.setdefault((x, y), [0, 0, 0, 0])
        cell[way] = max(cell[way], weight)

    def across(self, x: int, until: int, y: int, thick: bool = False, double: bool = False) -> None:
        """A line from the middle of one cell to that of another in its row."""
        weight = DOUBLE if double else THICK if thick else THIN
        for at in range(x, until):
            self._leave(at, y, RIGHT, weight)
            self._leave(at + 1, y, LEFT, weight)

    def down(self, x: int, y: int, until: int, thick: bool = False, double: bool = False) -> None:
        """A line from the middle of one cell to that of another in its column."""
        weight = DOUBLE if double else THICK if thick else THIN
        for at in range(y, until):
            self._leave(x, at, DOWN, weight)
            self._leave(x, at + 1, UP, weight)

    def write(self, x: int, y: int, text: str) -> None:
        """Write text, in which wide characters have their fillers, over the cells there."""
        for at, character in enumerate(text):
            self.texts[x + at, y] = character

    def symbol(self, x: int, y: int, text: str) -> None:
        """A contact or a coil: its first and its last character are strokes."""
        self.write(x, y, text)
        self.strokes |= {(x, y), (x + len(text) - 1, y)}

    def cut(self, depth: int) -> None:
        """Leave out what lies above the first row, or in row `depth` and below."""
        self.lines = {(x, y): ways for (x, y), ways in self.lines.items() if 0 <= y < depth}

    def rows(self) -> list[str]:
        """What was drawn, spaces at the ends left out."""
        cells = {place: _character(ways) for place, ways in self.lines.items()} | self.texts
        if not cells:
            return []
        depth = max(y for _, y in cells) + 1
        width = max(x for x, _ in cells) + 1
        return [text_of("".join(cells.get((x, y), " ") for x in range(width))).rstrip() for y in range(depth)]


def _character(ways: list[int]) -> str:
    """The character of a cell.  Where a double line meets a thick one there is none, and the thick one is drawn thin; nor
    is there one for the end of a double line."""
    a, b, c, d = (THIN if way == THICK and DOUBLE in ways else way for way in ways)
    return _characters().get((a, b, c, d), "═")
