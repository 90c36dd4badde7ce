"""Where the lines of a source stand in the project of CX-Programmer of which it was made: symbols, sections, rungs, steps."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from fbvm.base.diagnostics import Source
from fbvm.interchange.cx.markup import CxText, Row
from fbvm.interchange.cx.read.project import Rung, Section
from fbvm.interchange.cx.read.rungs import is_note
from fbvm.interchange.imported import Place

_DECLARED = re.compile(r"\s*(?:([^\W\d]\w*)\s*(?:\bAT\b|:)|([^\W\d]\w*)?,([^,]*),)")
"""A variable, or the row of a timer or counter, or of the comment of an address."""
_WORD = re.compile(r"[^\W\d][\w.]*|\d[\d.]*")


@dataclass(frozen=True)
class Origin:
    """What a source was made of."""

    where: str
    """The POU, as messages name it."""
    rows: Mapping[str, Row]
    """Rows of symbols and variables by their names in the source, in small letters."""
    sections: tuple[Section, ...] = ()
    """Of a program."""
    rungs: tuple[Rung, ...] = ()
    """Of a function block."""
    start: int | None = None
    """Where the POU begins in the document."""


def places(text: str, origin: Origin, document: CxText) -> list[Place | None]:
    """The place of each line of a source; in a compressed document its beginning, and only the words tell more."""
    found = _Walk(origin, document.source).lines(text)
    return [place and replace(place, start=0, end=0) for place in found] if document.compressed else found


class _Walk:
    """Goes through the lines of a source and what they were made of at the same time: both have the same order."""

    def __init__(self, origin: Origin, document: Source) -> None:
        self.origin, self.document = origin, document
        self.where = origin.where
        self.sections = iter(origin.sections)
        self.rungs = self._filled(origin.rungs)
        self.rung: tuple[Rung, Place] | None = None
        self.steps: list[tuple[int, int]] = []
        self.step = 0

    def lines(self, text: str) -> list[Place | None]:
        """The places of all lines."""
        in_ladder, found = False, []
        for line in text.splitlines():
            bare = line.strip()
            in_ladder = bare != "END_LADDER" and (in_ladder or bare == "LADDER")
            found.append(self._in_ladder(bare) if in_ladder else self._declared(bare))
        return found

    def _filled(self, rungs: tuple[Rung, ...]) -> Iterator[tuple[int, Rung]]:
        return ((number, rung) for number, rung in enumerate(rungs) if not rung.is_empty)

    def _place(self, start: int, end: int, where: str) -> Place:
        return Place(self.document, start, end, where)

    def _line(self, start: int, where: str) -> Place:
        """The line of the document on which something begins."""
        end = self.document.text.find("\n", start)
        return self._place(start, start + len(self.document.text[start:end if end >= 0 else None].rstrip()), where)

    def _key(self, start: int, where: str) -> Place:
        """The key of a value that begins at `start`, behind its `:=`."""
        line = self.document.text.rfind("\n", 0, start) + 1
        before = self.document.text[line:start]
        return self._line(line + len(before) - len(before.lstrip()), where)

    def _declared(self, line: str) -> Place | None:
        found = _DECLARED.match(line)
        name = next((name for name in found.groups() if name), "") if found else ""
        row = self.origin.rows.get(name.casefold())
        if row is not None:
            return self._line(row.start, f"{self.origin.where}, symbol {name}")
        return self._key(self.origin.start, self.origin.where) if self.origin.start is not None else None

    def _in_ladder(self, line: str) -> Place | None:
        word = line.partition(" ")[0]
        if word == "SECTION" and (section := next(self.sections, None)) is not None:
            self.where, self.rungs, self.rung = f"{self.origin.where}, section {section.name}", self._filled(section.rungs), None
            return self._key(section.value.start, self.where)
        if word == "RUNG" and (found := next(self.rungs, None)) is not None:
            number, rung = found
            self.rung = rung, self._key(rung.value.start, f"{self.where}, rung {number}")
            self.steps, self.step = _steps(rung), 0
            return self.rung[1]
        if self.rung is None:
            return self._declared(line)
        rung, place = self.rung
        if not line or line.startswith("'"):
            return place
        self.step += 1
        where = f"{place.where}, step {self.step} ({' '.join(line.split('//')[0].split())})"
        if rung.elements is not None:
            start, end = _element(rung.elements.rows, line) or (place.start, place.end)
            return self._place(start, end, where)
        return self._place(*self.steps[self.step - 1], where) if self.step <= len(self.steps) else place


def _steps(rung: Rung) -> list[tuple[int, int]]:
    """Start and end of each instruction of a rung in the document."""
    value, found = rung.value.get("SL"), []
    at = value.inner if value is not None else 0
    for line in value.text.splitlines(keepends=True) if value is not None else ():
        bare = line.strip()
        if bare and not bare.startswith("'") and not is_note(bare):
            start = at + line.index(bare)
            found.append((start, start + len(bare)))
        at += len(line)
    return found


def _element(rows: tuple[tuple[str, int], ...], line: str) -> tuple[int, int] | None:
    """Start and end of the element of a rung of cells that has most words of an instruction; None if none has any."""
    wanted = {word.casefold() for word in _WORD.findall(line)}
    fits = {(at, at + len(row)): len(wanted & {word.casefold() for word in _WORD.findall(row)}) for row, at in rows}
    best = max(fits, key=lambda place: fits[place], default=None)
    return best if best is not None and fits[best] else None
