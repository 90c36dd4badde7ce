"""Diagnostics of a program: each has a code, a position, a message, and a hint where one helps."""

from __future__ import annotations

import bisect
import re
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from fbvm.base.codes import CODES
from fbvm.base.namespaces import Surroundings
from fbvm.base.printable import one_line, printable


def whole_lines(text: str) -> str:
    """A text whose lines end with LF or CR LF: a CR alone, as very old machines write it, becomes LF."""
    return _LONE_CR.sub("\n", text) if text.count("\r") != text.count("\r\n") else text


_LONE_CR = re.compile(r"\r(?!\n)")


@dataclass(eq=False)
class Source:
    """One source text.  A place in it is an offset in characters from 0."""

    name: str
    """The name that messages show, such as a path relative to its library or project."""
    text: str = field(repr=False)
    """The whole text; a line ends with LF or CR LF."""
    library: str = ""
    """Name of the library that the text belongs to, "" for the user's own."""
    first_line: int = 1
    """The number of the first line, for a text that is a part of a longer one."""
    surroundings: Surroundings | None = field(default=None, repr=False)
    """The namespaces in which names of the text are looked up; None where there are none."""
    whole: Source = field(init=False, repr=False)
    """The source itself; of one that stands for what is inside a NAMESPACE, the source of the whole text."""

    def __post_init__(self) -> None:
        self.text = whole_lines(self.text)
        self.whole = self

    def inside(self, surroundings: Surroundings) -> Source:
        """The same text with other namespaces around it: places in it are those of the whole text."""
        made = copy(self)
        made.surroundings = surroundings
        return made

    @cached_property
    def line_starts(self) -> list[int]:
        """The offset of the first character of each line."""
        starts, at = [0], self.text.find("\n")
        while at >= 0:
            starts.append(at + 1)
            at = self.text.find("\n", at + 1)
        return starts

    def place(self, offset: int) -> tuple[int, int]:
        """Line (from `first_line`) and column (from 1) of a character offset; behind the text those of its end."""
        if not 0 <= offset <= len(self.text):
            offset = 0 if offset < 0 else len(self.text)
        starts = self.line_starts
        row = bisect.bisect_right(starts, offset) - 1
        return row + self.first_line, offset - starts[row] + 1

    def line(self, number: int) -> str:
        """The text of line `number` (from `first_line`) without its end.  Raises IndexError behind the last line."""
        row = number - self.first_line
        start = self.line_starts[row]
        end = self.line_starts[row + 1] if row + 1 < len(self.line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")


@dataclass(frozen=True)
class Diagnostic:
    """One error or warning about a place in a source.  Two diagnostics are equal if code, place and words are."""

    code: str
    """The letter of its kind and four digits, such as "S0301"; `fbvm explain S0301` shows its page."""
    source: Source = field(compare=False)
    """The source that it is about."""
    start: int
    """Offset in `source.text`, in characters from 0, of the first character that it is about."""
    end: int
    """Offset behind the last character that it is about; `start` if it is about a place between two characters."""
    message: str
    """What is wrong, in one line."""
    hint: str = ""
    """What to write instead, in one line; "" if nothing is known."""
    related: tuple[Source, int, str] | None = field(default=None, compare=False)
    """A second place, such as an earlier declaration: its source, its offset in characters, and what is said about it."""
    raised: bool = False
    """True for a warning that counts as an error because of an option."""
    lossless: bool = field(default=False, compare=False)
    """True for a syntax error after which the whole text could still be parsed."""

    @property
    def severity(self) -> str:
        """"error" or "warning", as the table of codes has it."""
        return "error" if self.raised else CODES[self.code].severity

    @property
    def line(self) -> int:
        """The line of `start`, counted from 1."""
        return self.source.place(self.start)[0]

    @property
    def column(self) -> int:
        """The column of `start`, in characters counted from 1; a tab is one character."""
        return self.source.place(self.start)[1]

    def order(self) -> tuple[str, int, str]:
        """The key by which diagnostics are sorted: the name of the source, `start`, the code."""
        return self.source.name, self.start, self.code

    def as_dict(self) -> dict[str, Any]:
        """The diagnostic as plain data, which `fbvm check --json` prints.

        The keys are code, severity, file, line, column, end_line, end_column, message and hint, with lines and columns from 1;
        where there is a second place, also related with file, line, column and message."""
        line, column = self.source.place(self.start)
        end_line, end_column = self.source.place(max(self.end, self.start))
        data: dict[str, Any] = {
            "code": self.code, "severity": self.severity, "file": self.source.name, "line": line, "column": column,
            "end_line": end_line, "end_column": end_column, "message": self.message, "hint": self.hint,
        }
        if self.related:
            source, at, text = self.related
            data["related"] = {"file": source.name, "line": source.place(at)[0], "column": source.place(at)[1],
                               "message": text}
        return data

    def render(self) -> str:
        """The message as text: place, code, what is wrong, the line with a caret, the hint."""
        line, column = self.source.place(self.start)
        lines = [f"{one_line(self.source.name)}:{line}:{column}: {self.severity} {self.code}: {one_line(self.message)}"]
        lines += caret_lines(self.source, self.start, self.end)
        if self.related:
            other, at, text = self.related
            other_line, other_column = other.place(at)
            lines.append(f"  {one_line(other.name)}:{other_line}:{other_column}: {one_line(text)}")
            lines += caret_lines(other, at, at + 1)
        if self.hint:
            lines.append(f"  help: {printable(self.hint)}")
        return "\n".join(lines)


WIDTH = 160
"""Longest piece of a source line that a message shows, in characters."""


def caret_lines(source: Source, start: int, end: int) -> list[str]:
    """The source line of `start` and a line of carets below the span; nothing for a text that could not be read."""
    if not source.text:
        return []
    number, column = source.place(start)
    text = source.line(number)
    first = max(0, column - 1 - WIDTH // 2) if len(text) > WIDTH else 0
    shown = "".join(c if c.isprintable() or c == "\t" else "\N{REPLACEMENT CHARACTER}" for c in text[first:first + WIDTH])
    lead = "".join("\t" if c == "\t" else " " for c in shown[:column - 1 - first])
    width = max(1, min(end - start, len(shown) - len(lead)))
    return [f"    {shown}", f"    {lead}{'^' * width}"]


def errors(diagnostics: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The errors among diagnostics; a program with one is not run."""
    return [d for d in diagnostics if d.severity == "error"]
