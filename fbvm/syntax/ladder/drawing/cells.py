"""Texts as cells of a drawing: a character that terminals show two columns wide, as those of Chinese, Japanese and Korean, has
a filler behind it, so that the length of a text is its width and the rails of a drawing stand in one column."""

from __future__ import annotations

import unicodedata

FILLER = "\uffa0"
"""A letter of half a width that shows nothing (HALFWIDTH HANGUL FILLER), so that a name with fillers is still one word."""


class _Filled(dict[int, str]):
    """Each character with its filler, by its number; those that a drawing has are few."""

    def __missing__(self, number: int) -> str:
        character = chr(number)
        self[number] = filled = character + FILLER * (unicodedata.east_asian_width(character) in "WF")
        return filled


_FILLED = _Filled()


def cells(text: str) -> str:
    """A text with a filler behind each wide character.

    >>> len(cells("水 D0"))
    5
    """
    if text.isascii():
        return text
    return text.translate(_FILLED)


def text_of(filled: str) -> str:
    """The text of which these are the cells."""
    return filled.replace(FILLER, "")


def columns(text: str) -> int:
    """How many columns of a terminal a text takes."""
    return len(cells(text))


def place_in(filled: str, x: int) -> int:
    """The place in a text of the character in column `x` of its cells."""
    return x - filled.count(FILLER, 0, x)


def padded(text: str, width: int) -> str:
    """A text and spaces, up to a width in columns."""
    return text + " " * (width - columns(text))
