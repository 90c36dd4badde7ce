"""TOML texts to tables; every text that cannot be used gives the same error, with its place."""

from __future__ import annotations

import re
import tomllib
from typing import Any

MOST_DEPTH = 50
"""Deepest nesting of tables and lists; files of projects and libraries have less than 6."""
_LIMIT = 1 << 63
"""Numbers of TOML have 64 bits."""
_DIGITS = re.compile(r"[0-9A-Fa-f_]{16,}")
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?m)(?:^|[\[{{,])[ \t]*+(?:{_PART}[ \t]*+\.[ \t]*+){{{MOST_DEPTH}}}")
"""The beginning of a key of so many parts; how long Python reads it grows with the square of their number."""
_PLACE = re.compile(r"(.*) \(at line (\d+), column (\d+)\)", re.S)


class TomlError(ValueError):
    """The text is no TOML, or is beyond what a file of ours holds; `line` and `column` count from 1."""

    def __init__(self, message: str, line: int, column: int) -> None:
        super().__init__(message)
        self.line, self.column = line, column


def load_toml(text: str) -> dict[str, Any]:
    """The table that a text says.  Raises TomlError for a text that is no TOML, for values that are nested more than MOST_DEPTH
    deep, and for numbers of more than 64 bits.

    >>> load_toml('a = [1, 2]')
    {'a': [1, 2]}
    """
    if deep := _DEEP_KEY.search(text):
        raise TomlError("values are nested too deeply", *_place(text, deep.start()))
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        placed = _PLACE.fullmatch(str(error))
        if placed:
            raise TomlError(placed[1], int(placed[2]), int(placed[3])) from None
        raise TomlError(str(error).removesuffix(" (at end of document)"), *_place(text, len(text))) from None
    except RecursionError:
        raise TomlError("values are nested too deeply", *_place(text, 0)) from None
    except ValueError:  # Python's limit for the digits of a number
        raise _too_large(text) from None
    todo: list[tuple[object, int]] = [(table, 0)]
    while todo:
        value, depth = todo.pop()
        if depth > MOST_DEPTH:
            raise TomlError("values are nested too deeply", *_place(text, 0))
        if isinstance(value, dict | list):
            todo += [(inner, depth + 1) for inner in (value.values() if isinstance(value, dict) else value)]
        elif isinstance(value, int) and not -_LIMIT <= value < _LIMIT:
            raise _too_large(text)
    return table


def _too_large(text: str) -> TomlError:
    longest = max(_DIGITS.finditer(text), key=lambda found: len(found[0]), default=None)
    return TomlError("a number does not fit 64 bits", *_place(text, longest.start() if longest else 0))


def _place(text: str, at: int) -> tuple[int, int]:
    return text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)
