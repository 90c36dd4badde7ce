"""Texts of others for a terminal: control and escape characters are shown, never sent."""

from __future__ import annotations

import re

_NOT_LINES = re.compile(r"[^\n\t -~]+")
"""Whatever may be more than plain ASCII in lines; looked at one character at a time."""


def printable(text: str) -> str:
    """A text of one or many lines in which every character that a terminal would obey or hide is written as an escape.

    Line feeds and tabs stay.

    >>> printable("pump\\x1b[31m.st")
    'pump\\\\x1b[31m.st'
    """
    return _NOT_LINES.sub(_escaped, text)


def one_line(text: str) -> str:
    """The same for a name or a value, in which line feeds and tabs are escapes, too.

    >>> one_line("a\\nb")
    'a\\\\nb'
    """
    return printable(text).replace("\n", "\\n").replace("\t", "\\t")


def _escaped(found: re.Match[str]) -> str:
    text = found[0]
    return text if text.isprintable() else "".join(_escape(character) for character in text)


def _escape(character: str) -> str:
    return character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
