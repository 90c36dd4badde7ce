"""Pieces of text that know where they may be broken, and the printer that fits them into lines.

The printer never recurses, so a text may nest as deep as the parser allows.  It is after Oppen, "Prettyprinting" (1980):
a group stands on one line if it fits, else every break of the group itself begins a new one.
"""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.syntax.formatter.comments import Comment, Comments

WIDTH = 100
"""Columns of a line, if the text can be broken so."""
STEP = 4
"""Columns of one level of indentation."""
HANG_LIMIT = 40
"""Column up to which broken text hangs below its beginning in any case."""
HANG_STEP = 2 * STEP
REMARK_SPREAD = 30
"""Largest difference of line lengths behind which comments are aligned."""
NO_SPACE_BEFORE = tuple(" ,;)]")
NO_SPACE_BEHIND = (" ", "(", "[")


@dataclass(frozen=True, slots=True)
class Leaf:
    """A token of the source as it is to be written, with the comments that stand at it."""

    text: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Verbatim:
    """Text that is kept as it is, shifted as a whole; in the source it began at `column`."""

    text: str
    column: int


@dataclass(frozen=True, slots=True)
class Break:
    """A place for a line end; `flat` is written there if the line goes on."""

    flat: str


@dataclass(frozen=True, slots=True)
class End:
    """A line end; with `blank`, an empty line behind it."""

    blank: bool


@dataclass(frozen=True, slots=True)
class Group:
    """On one line if that fits, else all its own breaks are line ends."""

    doc: Doc


@dataclass(frozen=True, slots=True)
class Fill:
    """Parts that fill line after line, a space between them; from part `at` on."""

    parts: tuple[Doc, ...]
    at: int = 0


@dataclass(frozen=True, slots=True)
class Indent:
    """One level further in."""

    doc: Doc


@dataclass(frozen=True, slots=True)
class Hang:
    """A piece whose further lines begin below its first character."""

    doc: Doc


Doc = str | Leaf | Verbatim | Break | End | Group | Fill | Indent | Hang | tuple["Doc", ...]
SPACE, NOTHING, HARD, BLANK = Break(" "), Break(""), End(False), End(True)
Work = tuple[int, bool, Doc]
"""Indentation, whether on one line, and what is to be written."""


def flat_width(doc: Doc, comments: Comments) -> int | None:
    """Columns of a piece on one line; None if it needs several lines."""
    width, todo = 0, [doc]
    while todo:
        part = todo.pop()
        if isinstance(part, tuple):
            todo.extend(part)
        elif isinstance(part, str):
            width += len(part)
        elif isinstance(part, Leaf):
            more = _leaf_width(part, comments)
            if more is None:
                return None
            width += more
        elif isinstance(part, Break):
            width += len(part.flat)
        elif isinstance(part, Fill):
            todo.extend(part.parts)
            width += max(0, len(part.parts) - 1)
        elif isinstance(part, (Group, Indent, Hang)):
            todo.append(part.doc)
        else:
            return None
    return width


def _leaf_width(leaf: Leaf, comments: Comments) -> int | None:
    if leaf.end in comments.behind:
        return None
    width = len(leaf.text)
    for comment in comments.ahead.get(leaf.start, ()):
        if comment.own or "\n" in comment.text:
            return None
        width += len(comment.text) + 1
    return width


def _widest(doc: Doc, comments: Comments) -> int:
    """Columns of the widest part between the breaks of a piece."""
    while isinstance(doc, Group):
        doc = doc.doc
    parts: list[list[Doc]] = [[]]
    for part in doc.parts if isinstance(doc, Fill) else doc if isinstance(doc, tuple) else (doc,):
        if isinstance(part, Break) or isinstance(doc, Fill):
            parts.append([])
        if not isinstance(part, Break):
            parts[-1].append(part)
    return max(flat_width(tuple(part), comments) or 0 for part in parts)


class _Line:
    """A line that is written: its text, and the comments behind it; `more` if it goes on with what began above it."""

    __slots__ = ("more", "remarks", "text")

    def __init__(self, text: str, more: bool) -> None:
        self.text, self.more = text, more
        self.remarks: list[Comment] = []


class Printer:
    """Writes one document into lines."""

    def __init__(self, comments: Comments) -> None:
        self.comments = comments
        self.lines: list[_Line] = []
        self.line = _Line("", False)
        self.fresh = True
        """Whether nothing but indentation stands on the line."""
        self.full = False
        """Whether nothing more may stand on the line."""
        self.apart = False
        """Whether a comment ends here, which keeps a space to what follows."""

    def print(self, doc: Doc) -> str:
        """The text of a whole document, its lines ended by a line feed."""
        todo: list[Work] = [(0, False, doc)]
        while todo:
            indent, flat, part = todo.pop()
            if isinstance(part, str):
                self.write(part, indent)
            elif isinstance(part, tuple):
                todo.extend((indent, flat, p) for p in reversed(part))
            elif isinstance(part, Leaf):
                self.leaf(part, indent)
            elif isinstance(part, Break):
                if flat:
                    self.write(part.flat, indent)
                else:
                    self.end_line(indent)
            elif isinstance(part, Group):
                todo.append((indent, flat or self.fits(part.doc, todo), part.doc))
            elif isinstance(part, Hang):
                todo.append((self.hang(part.doc, indent, flat, todo), flat, part.doc))
            elif isinstance(part, Indent):
                todo.append((indent + STEP, flat, part.doc))
            elif isinstance(part, Fill):
                self.fill(part, indent, flat, todo)
            elif isinstance(part, End):
                self.end_line(indent, more=False)
                if part.blank:
                    self.end_line(indent, more=False)
            else:
                self.begin(part.text, indent)
                self.verbatim(part.text, part.column)
        self.end_line(0)
        return _text(self.lines)

    # --- lines ---

    def begin(self, text: str, indent: int) -> None:
        """Separate a text from a comment before it: by a line end if the comment reaches to the line's end, else by a space."""
        if self.full and text.strip(" "):
            self.end_line(indent)
        if self.apart and text:
            self.apart = False
            if not text.startswith(NO_SPACE_BEFORE):
                self.line.text += " "

    def write(self, text: str, indent: int) -> None:
        self.begin(text, indent)
        if self.fresh:
            text = text.lstrip(" ")
            self.fresh = not text
        if not self.full:
            self.line.text += text

    def end_line(self, indent: int, more: bool = True) -> None:
        self.line.text = self.line.text.rstrip(" ")
        self.lines.append(self.line)
        self.line = _Line(" " * indent, more)
        self.fresh, self.full, self.apart = True, False, False

    def verbatim(self, text: str, column: int) -> None:
        """Write lines that keep their places to one another."""
        first, *more = shifted(text, len(self.line.text) - column)
        self.line.text += first
        for line in more:
            self.lines.append(self.line)
            self.line = _Line(line, True)
        self.fresh = False

    def leaf(self, leaf: Leaf, indent: int) -> None:
        """A token with its comments."""
        for comment in self.comments.ahead.get(leaf.start, ()):
            if self.full or (comment.own and not self.fresh):
                self.end_line(indent)
            elif not self.fresh and not self.line.text.endswith(NO_SPACE_BEHIND):
                self.line.text += " "
            self.verbatim(comment.text, comment.column)
            self.full, self.apart = comment.own, True
        self.write(leaf.text, indent)
        if behind := self.comments.behind.get(leaf.end):
            self.line.remarks += behind
            self.full = True

    def fill(self, part: Fill, indent: int, flat: bool, todo: list[Work]) -> None:
        """The next part of a fill, and the rest of it later."""
        here, last = part.parts[part.at], part.at + 1 == len(part.parts)
        if part.at:
            if flat or self.fits((" ", here), todo if last else []):
                self.write(" ", indent)
            else:
                self.end_line(indent)
        if not last:
            todo.append((indent, flat, Fill(part.parts, part.at + 1)))
        todo.append((indent, flat, Group(here)))

    def hang(self, doc: Doc, indent: int, flat: bool, behind: list[Work]) -> int:
        """Where the lines of a hanging piece begin: below its first character, or on a line of its own if there is not
        room enough for each of its parts."""
        column, aside = len(self.line.text), indent + HANG_STEP
        if flat or self.full or column <= max(HANG_LIMIT, aside) or self.fits(doc, behind):
            return indent if self.full else column
        if column + _widest(doc, self.comments) <= WIDTH:
            return column
        self.end_line(aside)
        return aside

    def fits(self, doc: Doc, behind: list[Work]) -> bool:
        """Whether a piece fits on this line with all that must follow on the same line."""
        left = WIDTH - len(self.line.text)
        if self.full:
            return False
        todo, rest, own = [doc], len(behind), True
        broken = False
        while left >= 0:
            if not todo:
                if not rest:
                    return True
                rest -= 1
                own, broken = False, not behind[rest][1]
                todo.append(behind[rest][2])
            part = todo.pop()
            if isinstance(part, str):
                left -= len(part)
            elif isinstance(part, tuple):
                todo.extend(reversed(part))
            elif isinstance(part, Leaf):
                width = _leaf_width(part, self.comments)
                if width is None:
                    return not own and left >= len(part.text)
                left -= width
            elif isinstance(part, Break):
                if broken:
                    return True
                left -= len(part.flat)
            elif isinstance(part, Fill):
                if broken:
                    todo += (SPACE,) if part.at else (SPACE, part.parts[0])
                else:
                    todo.extend(reversed(part.parts[part.at:]))
                    left -= len(part.parts) - max(part.at, 1)
            elif isinstance(part, (Group, Indent, Hang)):
                todo.append(part.doc)
            else:
                return not own
        return False


def shifted(text: str, by: int) -> list[str]:
    """The lines of a text; from the second on `by` columns further right, or as far left as there is room."""
    first, *more = text.split("\n")
    lines = [first.rstrip()]
    for line in more:
        bare = line.strip()
        indent = len(line[:len(line) - len(line.lstrip())].expandtabs(STEP))
        lines.append(" " * max(0, indent + by) + bare if bare else "")
    return lines


def _text(lines: list[_Line]) -> str:
    """All lines, the comments behind them aligned."""
    columns = _columns(lines)
    written = [_with_remarks(line, column) if line.remarks else line.text for line, column in zip(lines, columns, strict=True)]
    return "\n".join(written).strip("\n") + "\n" if any(written) else ""


def _with_remarks(line: _Line, column: int) -> str:
    """A line with the comments behind it, which begin at a column."""
    pieces = [line.text.ljust(column)]
    width = len(pieces[0])
    for comment in line.remarks:
        if not pieces[-1].endswith(" "):
            pieces.append(" ")
            width += 1
        first, *more = shifted(comment.text, width - comment.column)
        pieces += [first, *(f"\n{shown}" for shown in more)]
        width = len(more[-1]) if more else width + len(first)
    return "".join(pieces)


def _columns(lines: list[_Line]) -> list[int]:
    """For each line where its comments begin: in one column as long as neither the indentation changes nor a line is
    empty, and the lines are not too different."""
    columns: list[int] = []
    indent = shortest = longest = first = 0
    for at, line in enumerate(lines):
        width, own = len(line.text), len(line.text) - len(line.text.lstrip(" "))
        differ = shortest and line.remarks and max(longest, width) - min(shortest, width) > REMARK_SPREAD
        if differ or (not line.more and (own != indent or not width)):
            columns += [longest + 2] * (at - first)
            indent, first, shortest, longest = own, at, 0, 0
        if line.remarks:
            shortest, longest = min(shortest or width, width), max(longest, width)
    return columns + [longest + 2] * (len(lines) - first)
