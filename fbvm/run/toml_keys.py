"""Finds keys in the text of a TOML file, which Python's TOML reader does not tell, for messages that point at them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

from fbvm.base.diagnostics import Source

Path = tuple[str | int, ...]
"""The path to a value: names of keys, and numbers in arrays of tables (from 0)."""

_NAME = r"""(?:[\w-]+|"[^"]*"|'[^']*')"""
_DOTTED = rf"{_NAME}(?:\s*\.\s*{_NAME})*"
_HEAD = re.compile(rf"[ \t]*(\[\[?)\s*({_DOTTED})\s*\]")
_KEY = re.compile(rf"[ \t]*({_DOTTED})\s*=[ \t]*([^\n]*)")


def span(source: Source, path: Path) -> tuple[int, int]:
    """The offsets of start and end of a key with its value, or of the header of a table.

    If the path itself has no line of its own, as in an inline table, those of the nearest part of the path that has one.

    >>> source = Source("fbvm.toml", '[plc.pump]\\nsources = ["pump.st"]\\ncycle = "10ms"\\n')
    >>> start, end = span(source, ("plc", "pump", "cycle"))
    >>> source.text[start:end]
    'cycle = "10ms"'
    """
    places = _by_path(source)
    return next((places[path[:size]] for size in range(len(path), 0, -1) if path[:size] in places), (0, 0))


@lru_cache(maxsize=8)
def _by_path(source: Source) -> dict[Path, tuple[int, int]]:
    """The first place of each path and of all that stand in it: a table is where its first key is, if it has no header."""
    found: dict[Path, tuple[int, int]] = {}
    for path, start, end in _places(source):
        for size in range(1, len(path) + 1):
            found.setdefault(path[:size], (start, end))
    return found


def _places(source: Source) -> list[tuple[Path, int, int]]:
    """Every header and key that begins a line: path, start, end."""
    places: list[tuple[Path, int, int]] = []
    counts: dict[Path, int] = {}
    table: Path = ()
    for start, text in zip(source.line_starts, source.text.split("\n"), strict=True):
        if head := _HEAD.match(text):
            table = _numbered(_names(head[2]), counts, head[1] == "[[")
            places.append((table, start + head.start(1), start + head.end()))
        elif key := _KEY.match(text):
            places.append(((*table, *_names(key[1])), start + key.start(1), start + len(text.rstrip())))
    return places


def _names(dotted: str) -> list[str]:
    return [name.strip("\"'") for name in re.findall(_NAME, dotted)]


def _numbered(names: Sequence[str], counts: dict[Path, int], opens: bool) -> Path:
    """A header's path: arrays of tables that were opened before stand for their last table."""
    path: Path = ()
    for name in names[:-1]:
        path = (*path, name)
        if path in counts:
            path = (*path, counts[path])
    path = (*path, names[-1])
    if opens:
        counts[path] = counts.get(path, -1) + 1
        return (*path, counts[path])
    return path
