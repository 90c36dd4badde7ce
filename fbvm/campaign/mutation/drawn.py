"""Changes of drawn rungs that leave everything around them in its column.

A drawing says by columns what belongs together.  So what gets shorter is filled up, and what gets longer takes blanks or wire
beside it, as far as there are enough; else the change is not made."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from fbvm.syntax.ladder.drawing.cells import columns

WIRE = "─-━═"
"""The characters of a wire that leads from left to right."""
STROKES = "┤┫┥┨|][("
"""The characters with which contacts and coils begin."""
_MARK = re.compile(r"([!@%]*)(/?[PN↑↓]?|[SR]|SET|RSET)")
"""What stands between the strokes of a contact or a coil: the signs of its variations, and its mark."""
_TITLE = re.compile(r" ?: ?[\w.]+ *")
"""What stands behind the instance in the upper side of a box."""

_OTHER_EDGE = {"P": "N", "N": "P", "↑": "↓", "↓": "↑"}
_COILS = {"": "/", "/": "", "S": "", "R": "S", "SET": "", "RSET": "SET"} | _OTHER_EDGE
"""Coils: another one that is taken for it by mistake (IEC 61131-3, table 76)."""


class Piece(NamedTuple):
    """The characters of a text from `start` to `end`, and what stands there instead."""

    start: int
    end: int
    text: str


def fitted(text: str, start: int, end: int, new: str, filler: str) -> Piece | None:
    """`new` in place of `text[start:end]`, with all columns beside it as they were: `filler` are the characters of which more or
    fewer may stand beside it, of which one stays at least.  None if there is no room for it."""
    wanted = columns(new) - columns(text[start:end])
    if not wanted:
        return Piece(start, end, new)
    if wanted < 0:
        beside = [character for character in (*text[end : end + 1], text[start - 1]) if character in filler]
        return Piece(start, end, new + (beside or [filler[0]])[0] * -wanted)
    until = next((at for at in range(end, len(text)) if text[at] in "\r\n"), len(text))
    if not text[end:until].strip():  # nothing stands behind it
        return Piece(start, min(until, end + wanted), new)
    behind, before = text[end : end + wanted + 1], text[max(start - wanted - 1, 0) : start]
    if len(behind) > wanted and set(behind) <= set(filler):
        return Piece(start, end + wanted, new)
    if len(before) > wanted and set(before) <= set(filler):
        return Piece(start - wanted, end, new)
    return None


def operand(text: str, places: Sequence[tuple[int, int]], number: int, element: tuple[int, int], new: str) -> Piece | None:
    """Another operand in place of that at `places[number]`, of the contact, coil or box that stands at `element`."""
    (first, last), (start, end) = element, places[number]
    if text[first] in STROKES:
        if first < start < last:
            return fitted(text, first, last, text[first:start] + new + text[end:last], WIRE)
        between = [text[this[1] : that[0]] for this, that in pairwise(places)]
        words = [new if at == number else text[slice(*place)] for at, place in enumerate(places)]
        return fitted(text, places[0][0], places[-1][1], "".join(map("".join, zip(words, [*between, ""], strict=True))), " ")
    if title := _TITLE.match(text, end):
        return fitted(text, start, title.end(), new + title[0], WIRE)
    if text[end : end + 1] in (*WIRE, *"┤┫┥┨") or text[end : end + 2] in [f" {wire}" for wire in WIRE]:  # to the left of a box
        return fitted(text, start, end, new.rjust(end - start), " ")
    return fitted(text, start, end, new, " ")


def mark(text: str, element: tuple[int, int], inside: str, new: str) -> Piece | None:
    """The contact or coil at `element` with another mark, "" for none; `inside` is the operand that stands in it, or ""."""
    start, end = element
    written = text[start:end]
    if inside:
        return fitted(text, start, end, f"{written[0]}{new}{'' if new == '/' else ' '}{inside} {written[-1]}", WIRE)
    return fitted(text, start, end, f"{written[0]}{new.center(len(written) - 2)}{written[-1]}", WIRE)


def marks(written: str, inside: str) -> Iterator[tuple[str, str]]:
    """The operators CONTACT, COIL and EDGE, and the marks that are taken for that of a contact or coil by mistake."""
    found = _MARK.fullmatch((written[1:-1].rpartition(inside)[0] if inside else written[1:-1]).strip())
    if not found:
        return
    signs, plain = found.groups()
    if written[0] == "(":
        if plain in _COILS:
            yield "COIL", signs + _COILS[plain]
        return
    edge = plain.removeprefix("/")
    if edge != plain:
        yield "CONTACT", signs + edge
    elif not plain:
        yield "CONTACT", f"{signs}/"
    if edge:
        yield "CONTACT", signs + plain.replace(edge, _OTHER_EDGE[edge])
        yield "EDGE", signs + plain.replace(edge, "")
