"""What comments and texts look like, and where comments in brackets end."""

from __future__ import annotations

import re
from functools import lru_cache

LINE = r"//[^\n]*"
BRACKETED = r"\(\*.*?\*\)|/\*.*?\*/"
TEXT = r"'(?:\$.|[^'$\n])*'|\"(?:\$.|[^\"$\n])*\""
"""Patterns for a comment up to the end of its line, for one in brackets that holds no other, and for a text; with DOTALL."""
SILENT = f"{TEXT}|{BRACKETED}|{LINE}"
"""A pattern for all in which no name means anything."""
CLOSERS = {"(": "*)", "/": "*/"}
_MARKS = {"(": re.compile(r"\(\*|\*\)"), "/": re.compile(r"/\*|\*/")}


def comment_end(text: str, start: int) -> tuple[int, int]:
    """Where the bracket comment ends that begins at `start`, and where the first one inside it begins: -1 if it has no end, 0 if
    there is none inside.

    Each kind nests in itself.  A comment that is not closed as often as it is opened ends at the first sign of an end."""
    closer = CLOSERS[text[start]]
    first = text.find(closer, start + 2)
    inner = text.find(text[start:start + 2], start + 2, first) if first >= 0 else -1
    if inner < 0:
        return (first + 2 if first >= 0 else -1), 0
    return _nested_ends(text, text[start]).get(start, first + 2), inner


@lru_cache(maxsize=2)
def _nested_ends(text: str, kind: str) -> dict[int, int]:
    """For each bracket comment of a kind that is closed as often as it is opened, where it begins and ends."""
    open_: list[int] = []
    ends: dict[int, int] = {}
    for found in _MARKS[kind].finditer(text):
        if found[0] != CLOSERS[kind]:
            open_.append(found.start())
        elif open_:
            ends[open_.pop()] = found.end()
    return ends
