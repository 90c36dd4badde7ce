"""A drawing of a rung as cells: finds contacts, coils, boxes and texts; all other cells are wire.

Box characters and typed characters (`|--| |--( )--|`) mean the same; whether a line is thick or thin has no meaning.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise

from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.drawing.box_lines import DOWN, LEFT, RIGHT, UP, WAY_WORDS
from fbvm.syntax.ladder.instructions.instruction_set import instruction_set, spelling

Cell = tuple[int, int]
WAYS = {LEFT: (-1, 0), RIGHT: (1, 0), UP: (0, -1), DOWN: (0, 1)}
BACK = {LEFT: RIGHT, RIGHT: LEFT, UP: DOWN, DOWN: UP}
_MARK = r"!?/?[↑↓PN]?|[!@%]{0,2}(?:TSTN?|[<>=]{1,2}[A-Z]*\$?)"
_CONTACT = re.compile(r"[┤┫┥┨|\]]([^─━|┤┫\[\]├┣-]{0,8}?)[├┣┝┠|\[]")
_COIL = re.compile(r"\(([^()]{0,8})\)")
_KNOWN = re.compile(rf" ?(?:{_MARK}) ?")
_COIL_KNOWN = re.compile(r" ?[!@%]{0,2}(?:[/↑↓PN]|S|R|SET|RSET|)(?: ?)")
_OPERAND = r"(?:[^\W\d]|%)[\w.]*(?:\[\d+\][\w.]*)*|\d+\.\d+"
_NAMED = {False: re.compile(rf"[\[\]|┤┫](?: ?(/)| ?([PN↑↓])(?= )|) ?({_OPERAND}) ?[\]\[|├┣]"),
          True: re.compile(rf"\((?: ?(/)| ?([PNSR↑↓]|SET|RSET)(?= )|) ?({_OPERAND}) ?\)")}
"""Contacts and coils with their operand inside: `[ a ]`, `[/a]`, `( b )`, `(S b)`."""
_BRACKETS = re.compile(r"\[[^\[\]|]*\w[^\[\]|]*\]")
_BEGIN = re.compile(r"[┤┫┥┨|\[\](]")
"""The characters with which each of these begins."""
_LINK = re.compile(r"[►▶>](\d+)")
_TITLE = re.compile(r"([^\W\d]\w*) ?: ?([^\W\d]\w*(?:\.[^\W\d]\w*)*)")
_NAME = re.compile(r" *([^\W\d]\w*) *")
_HEAD = re.compile(r" *(?:([^\W\d]\w*) +([^\W\d]\w*) +(\w+)|([^\W\d]\w*)) *")
"""The first row of a block: its type, alone or between two pins."""
_UPPER_SIDE = re.compile(r"[─━═-]*( ?[^\W\d][\w .:\[\]]*)?[─━═-]*[┐┓╗╮┒┑+]")
"""The upper side of a box behind its left corner, perhaps with a title."""
_STUB = frozenset("─━-╶╴╺╸")
_BOX_TEXT = re.compile(r" ?[A-Za-z0-9@%!&#+]")
_TEXT = re.compile(r"= [^\s─-╿|]+(?:, [^\s─-╿|]+)*|[^\s─-╿|]+")
"""A text of a row: one word, or the values that stand below a comparison."""


class DrawingError(Exception):
    """The drawing cannot be read; the arguments are column, row, width, message and hint."""


@dataclass(eq=False)
class DrawnElement:
    """A contact or a coil: the columns of its strokes or brackets."""

    x: int
    until: int
    y: int
    mark: str
    is_coil: bool
    operands: tuple[str, ...] = ()
    operand_at: list[tuple[int, int]] = field(default_factory=list)
    """For each operand its first column and the one behind its last, in the row above or, if `inside`, in its own row."""
    inside: bool = False


@dataclass(eq=False)
class DrawnBox:
    """A box: its sides, and the text of each of its rows."""

    x: int
    y: int
    until: int
    bottom: int
    title: tuple[str, str] | None
    """Instance and type of a block."""
    heads: tuple[int, int]
    """The rows in which instance and type stand."""
    rows: dict[int, str] = field(default_factory=dict)
    stubs: dict[tuple[int, int], str] = field(default_factory=dict)
    """Operands beside a side, by side (LEFT, RIGHT) and row."""


@cache
def ways(character: str) -> frozenset[int]:
    """The directions in which lines leave a box character; those of `|`, `-` and `+` depend on their neighbours."""
    words = unicodedata.name(character, "").split()
    if words[:2] != ["BOX", "DRAWINGS"] or "DIAGONAL" in words:
        return frozenset()
    return frozenset(way for word in words for way in WAY_WORDS.get(word, ()))


class Grid:
    """The cells of a drawing.  `taken` are those of elements and texts; the rest is wire."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = lines
        self.taken: set[Cell] = set()
        self._rows: dict[int, list[tuple[int, int]]] = {}
        self.boxes: list[DrawnBox] = []
        self.elements: list[DrawnElement] = []
        self.links: list[tuple[int, int, int, int]] = []
        """Arrows: column, row, width, number."""
        self.places: dict[str, str] = {}
        """By operands of an element, the text in the row below the element: the addresses of its symbols."""
        self.problems: list[DrawingError] = []
        """Errors of texts.  They are raised after those of wires: a misplaced text often comes of a wrong wire."""
        for y, line in enumerate(lines):
            if "\t" in line.rstrip():
                raise DrawingError(line.index("\t"), y, 1, "there is a tab in the drawing",
                                   "columns are only known of spaces: write spaces")
        self.left = min((x for line in lines if (x := _first(line)) is not None and line[x] in RAIL), default=0)
        self.right = self._right_rail()
        self._find_boxes()
        self._find_elements()
        self._find_stubs()
        self._find_labels()

    def at(self, x: int, y: int) -> str:
        """The character of a cell."""
        return self.lines[y][x] if 0 <= y < len(self.lines) and 0 <= x < len(self.lines[y]) else " "

    def _line(self, x: int, y: int) -> str:
        """The character of a cell; a blank for the sign of a number, which is no line."""
        character = self.at(x, y)
        return " " if character in "+-" and self.at(x + 1, y).isdecimal() else character

    def ways(self, x: int, y: int) -> frozenset[int]:
        """The directions in which wires leave a cell; none for the cells of elements and texts."""
        character = self._line(x, y)
        if (x, y) in self.taken:
            return frozenset()
        if character == "-":
            return frozenset((LEFT, RIGHT))
        if character in "|+":
            sides = {way for way in (LEFT, RIGHT) if BACK[way] in _plain(self._line(x + WAYS[way][0], y), way)}
            depths = {way for way in (UP, DOWN) if BACK[way] in _plain(self._line(x, y + WAYS[way][1]), way)}
            return frozenset(sides | ({UP, DOWN} if character == "|" else depths))
        return ways(character)

    def _right_rail(self) -> int:
        """The column of the right rail: where the longest line ends that does not end with a text; 0 if there is none."""
        longest = max((line for line in self.lines if line[-1:] in (*RAIL, *"-─━)") and line), key=len, default="")
        return len(longest) - 1 if len(longest) - 1 > self.left and longest[-1] in RAIL else 0

    # --- boxes ---

    def _find_boxes(self) -> None:
        for y, line in enumerate(self.lines):
            for x, character in enumerate(line):
                if character in "┌┏╔╭┍┎+" and (x, y) not in self.taken and (box := self._box(x, y)):
                    self.boxes.append(box)
                    self.taken |= {(column, row) for column in range(x, box.until + 1) for row in range(y, box.bottom + 1)}

    def _box(self, x: int, y: int) -> DrawnBox | None:
        """The box with this upper left corner, if it is one.  Raises DrawingError."""
        upper = _UPPER_SIDE.match(self.lines[y], x + 1)
        if not upper or (until := upper.end() - 1) - x < 2:
            return None
        bottom = y + 1
        while self._is_side(x, bottom) and self._is_side(until, bottom) and not self._is_bottom(x, until, bottom):
            bottom += 1
        rows = {row: self.lines[row][x + 1:until] for row in range(y + 1, bottom)}
        if not self._is_bottom(x, until, bottom) or not any(text.strip() for text in rows.values()):
            self._check_open(x, y, until, bottom)
            return None
        if any(any(ways(c) or c == "|" for c in text) for text in rows.values()):
            return None
        title = self._title(x, y, upper[1])
        box = DrawnBox(x, y, until, bottom, title, (y, y), rows)
        return box if title else self._headed(box)

    def _check_open(self, x: int, y: int, until: int, bottom: int) -> None:
        """Refuse what begins as a box and has no lower side."""
        if bottom > y + 1 or self._is_side(x, y + 1) and _BOX_TEXT.match(self.lines[y + 1], x + 1):
            raise DrawingError(x, bottom, until - x + 1, f"the box that begins in column {x + 1} is open in this row",
                               f"its sides stand in the columns {x + 1} and {until + 1} down to its lower corners")

    def _title(self, x: int, y: int, text: str | None) -> tuple[str, str] | None:
        """Instance and type from the text in the upper side of a box; None if there is no text."""
        if not text:
            return None
        found, bare = _TITLE.search(text), text.strip()
        if not found:
            raise DrawingError(x + 2, y, len(bare), f"`{bare}` is no title of a block", "write instance : type")
        return found[1], found[2]

    def _headed(self, box: DrawnBox) -> DrawnBox:
        """The box with instance and type from its first row or from the row above, where other tools draw them; the same box if
        it is that of an instruction."""
        row, first = next((row, text) for row, text in box.rows.items() if text.strip())
        if named := _TITLE.fullmatch(first.strip()):
            box.title, box.heads = (named[1], named[2]), (row, row)
            del box.rows[row]
        elif len(box.rows) > 1 and (typed := _HEAD.fullmatch(first)) and spelling(first.split()[0]) not in instruction_set().rows:
            above = _NAME.fullmatch(self.lines[box.y - 1][box.x:box.until + 1]) if box.y else None
            if not above:
                raise DrawingError(box.x, box.y, box.until + 1 - box.x,
                                   f"`{first.split()[0]}` is no instruction, and as a block this box has no instance",
                                   "write the name of the instance above the box, or instance : type in its upper side")
            box.title, box.heads = (above[1], typed[2] or typed[4]), (box.y - 1, row)
            self._take(box.x + above.start(1), box.x + above.end(1), box.y - 1)
            box.rows[row] = f"{typed[1]} {typed[3]}"
            if typed[4]:
                del box.rows[row]
        return box

    def _is_side(self, x: int, y: int) -> bool:
        character = self.at(x, y)
        return character in "|+" or {UP, DOWN} <= ways(character)

    def _is_bottom(self, x: int, until: int, y: int) -> bool:
        if not 0 <= y < len(self.lines) or self.at(x, y) not in "└┗╚╰┕┖+" or self.at(until, y) not in "┘┛╝╯┙┚+":
            return False
        return all(c in "─━═-" for c in self.lines[y][x + 1:until])

    def _find_stubs(self) -> None:
        """Find the operands at pins of blocks: a text that a line connects with the side of the box."""
        for box in self.boxes:
            for y in box.rows if box.title else ():
                for side, start, step in ((LEFT, box.x - 1, -1), (RIGHT, box.until + 1, 1)):
                    at = start
                    while self._line(at, y) in _STUB:
                        at += step
                    at += step * (self.at(at, y) == " ")
                    if self.at(start, y) not in _STUB or not self._is_operand(at, y):
                        continue
                    begin = at
                    while self._continues(at, y, step):
                        at += step
                    text = self.lines[y][min(at - step, begin):max(at - step, begin) + 1]
                    box.stubs[side, y] = text.split(" = ")[0].strip()
                    self.taken |= {(column, y) for column in range(min(at - step, start), max(at - step, start) + 1)}

    def _is_operand(self, x: int, y: int) -> bool:
        """Whether an operand begins or ends in a cell; behind a sign stands a digit."""
        character = self.at(x, y)
        if (x, y) in self.taken:
            return False
        if character in "+-":
            return self.at(x + 1, y).isdecimal()
        arrow = any(link.start() <= x < link.end() for link in _LINK.finditer(self.lines[y]))
        return character not in " |[()►▶>" and not ways(character) and not arrow

    def _continues(self, x: int, y: int, step: int) -> bool:
        """Whether the text at a pin goes on in a cell: it ends at a line or a space, but for the spaces of ` = value`."""
        character, line = self.at(x, y), self.lines[y]
        if character == " ":
            return line[max(x - 2, 0):x + 3].find(" = ") in (0, 2) if 0 <= x < len(line) else False
        return not ways(character) and character != "|"

    # --- contacts and coils ---

    def _find_elements(self) -> None:
        for y, line in enumerate(self.lines):
            for found in _LINK.finditer(line):
                if not self._is_taken(found.start(), found.end(), y) and self._has_wire_beside(found, y):
                    self.links.append((found.start(), y, len(found[0]), whole_number(found[1])))
                    self._take(found.start(), found.end(), y)
            at = 0
            while found_next := self._next_element(line, at, y):
                at = found_next.until + found_next.is_coil
                self.elements.append(found_next)
        self.elements.sort(key=lambda element: (element.y, element.x))

    def _next_element(self, line: str, at: int, y: int) -> DrawnElement | None:
        for begin in _BEGIN.finditer(line, at):
            x = begin.start()
            if named := self._named(line, x, y):
                return named
            for is_coil, shape, known in ((False, _CONTACT, _KNOWN), (True, _COIL, _COIL_KNOWN)):
                found = shape.match(line, x)
                if not found or self._is_taken(x, found.end(), y) or not self._is_on_wire(x, found.end() - 1, y, is_coil):
                    continue
                if not is_coil and any(self._is_crossed(column, y) for column in (x, found.end() - 1)):
                    continue
                if not known.fullmatch(found[1]):
                    what, hint = _UNKNOWN[is_coil]
                    raise DrawingError(x, y, found.end() - x, f"`{found[0]}` is no {what}", hint)
                self._take(x, found.end(), y)
                return DrawnElement(x, found.end() - 1, y, found[1].strip() or " ", is_coil)
        return None

    def _named(self, line: str, x: int, y: int) -> DrawnElement | None:
        """The contact or coil with its operand inside that begins in a column, if there is one.  Raises DrawingError."""
        for is_coil, shape in _NAMED.items():
            found = shape.match(line, x)
            if not found or self._is_taken(x, found.end(), y) or not self._is_on_wire(x, found.end() - 1, y, is_coil):
                continue
            known = (_COIL_KNOWN if is_coil else _KNOWN).fullmatch(line[x + 1:found.end() - 1])
            if known or self._has_text(x, found.end(), y - 1):
                continue  # its operand stands above
            if not is_coil and any(self._is_crossed(column, y) for column in (x, found.end() - 1)):
                continue
            self._take(x, found.end(), y)
            return DrawnElement(x, found.end() - 1, y, found[1] or found[2] or " ", is_coil, (found[3],), [found.span(3)], True)
        other = _BRACKETS.match(line, x)
        if other and not self._is_taken(x, other.end(), y) and self._is_on_wire(x, other.end() - 1, y, False):
            raise DrawingError(x, y, other.end() - x, f"`{other[0]}` is no contact",
                               "a comparison is ┤>├ with its two operands above; "
                               "an instruction or a block is a box of several rows")
        return None

    def _is_on_wire(self, x: int, until: int, y: int, is_coil: bool) -> bool:
        """Whether wires lead to an element: at both sides, or to a coil from the left."""
        before = RIGHT in _plain(self._line(x - 1, y), LEFT) or x - 1 == self.left
        behind = LEFT in _plain(self._line(until + 1, y), RIGHT)
        return before and (behind or is_coil or until == self.right - 1)

    def _is_crossed(self, x: int, y: int) -> bool:
        """Whether a wire comes from above or below, so that what looks like the stroke of a contact is none."""
        return DOWN in _plain(self._line(x, y - 1), UP) or UP in _plain(self._line(x, y + 1), DOWN)

    def _has_wire_beside(self, found: re.Match[str], y: int) -> bool:
        return RIGHT in _plain(self._line(found.start() - 1, y), LEFT) or LEFT in _plain(self._line(found.end(), y), RIGHT)

    def _is_taken(self, x: int, until: int, y: int) -> bool:
        return any((column, y) in self.taken for column in range(x, until))

    def _take(self, x: int, until: int, y: int) -> None:
        self.taken |= {(column, y) for column in range(x, until)}

    # --- texts ---

    def _find_labels(self) -> None:
        """Find the operands above contacts and coils, then the texts below them."""
        for element in (each for each in self.elements if not each.inside):
            row = None if element.is_coil else instruction_set().rows.get("LD" + element.mark.lstrip("!@%").strip())
            wanted = len(row.operands) if row else 1
            texts = self._label(element, wanted)
            element.operands = tuple(self.lines[element.y - 1][start:end] for start, end in texts)
            element.operand_at = texts
        in_rows: dict[int, list[DrawnElement]] = {}
        for element in sorted(self.elements, key=lambda each: each.x):
            in_rows.setdefault(element.y, []).append(element)
        for y in range(len(self.lines)):
            row_above = in_rows.get(y - 1, [])
            for start, end in self._row(y):
                if self._is_taken(start, end, y):
                    continue
                above = row_above[bisect_left(row_above, start - 2, key=lambda e: e.until):
                                  bisect_right(row_above, end + 1, key=lambda e: e.x)]
                if not above:
                    text = self.lines[y][start:end]
                    self._take(start, end, y)
                    self.problems.append(DrawingError(start, y, end - start, f"`{text}` belongs to no contact, coil or box",
                                                      "operands stand above contacts and coils, in the row next to theirs"))
                    continue
                near = min(above, key=lambda e: abs(e.x + e.until - start - end))
                self.places[" ".join(near.operands)] = self.lines[y][start:end]
                self._take(start, end, y)

    def _label(self, element: DrawnElement, wanted: int) -> list[tuple[int, int]]:
        """The columns of the operands of a contact or coil: the `wanted` texts of the row above that are nearest to it."""
        texts, y = self._row(element.y - 1), element.y - 1
        first = bisect_left(texts, element.x - 1, key=lambda text: text[1]) - wanted + 1
        last = bisect_right(texts, element.until + 2, key=lambda text: text[0])
        choices = [texts[at:at + wanted] for at in range(max(first, 0), min(last, len(texts) - wanted + 1))]
        near = [c for c in choices if all(b[0] - a[1] == 1 for a, b in pairwise(c))
                and not any(self._is_taken(*text, y) or self.lines[y].startswith("= ", text[0]) for text in c)]
        if not near:
            what = "coil" if element.is_coil else "contact"
            self.problems.append(DrawingError(
                element.x, element.y, element.until + 1 - element.x, f"above this {what} stands no operand",
                f"write {f'{wanted} operands with one space between them' if wanted > 1 else 'it'} in the row above, "
                f"over column {(element.x + element.until) // 2 + 1}"))
            return []
        chosen = min(near, key=lambda c: abs(c[0][0] + c[-1][1] - 1 - element.x - element.until))
        for start, end in chosen:
            self._take(start, end, element.y - 1)
        return chosen

    def _has_text(self, x: int, until: int, y: int) -> bool:
        """Whether a text that nothing has taken stands in some columns of a row."""
        texts = self._row(y)
        first = bisect_right(texts, x, key=lambda text: text[1])
        last = bisect_left(texts, until, key=lambda text: text[0])
        return not all(self._is_taken(*text, y) for text in texts[first:last])

    def _row(self, y: int) -> list[tuple[int, int]]:
        """The places of the texts of a row, from left to right, that are more than a wire."""
        if y not in self._rows:
            found = _TEXT.finditer(self.lines[y]) if 0 <= y < len(self.lines) else ()
            self._rows[y] = [each.span() for each in found if not set(each[0]) <= set("-+")]
        return self._rows[y]


RAIL = "│┃├┣┝┠┤┫┥┨|║╟╢┌└┐┘+"
"""Characters of rails."""
_UNKNOWN = {False: ("contact", "contacts are ┤ ├, ┤/├, ┤↑├, ┤↓├, and comparisons such as ┤=├ with two operands above"),
            True: ("coil", "coils are ( ), (/), (S), (R), (↑), (↓); other instructions are boxes")}


def _first(line: str) -> int | None:
    """The column of the first character."""
    stripped = line.lstrip(" ")
    return len(line) - len(stripped) if stripped else None


def _plain(character: str, way: int) -> frozenset[int]:
    """The directions in which lines leave a neighbour in direction `way`, judged by its character alone."""
    if character == "-":
        return frozenset((LEFT, RIGHT))
    if character == "|":
        return frozenset((UP, DOWN)) if way in (UP, DOWN) else frozenset()
    if character == "+":
        return frozenset((LEFT, RIGHT, UP, DOWN))
    return ways(character)
