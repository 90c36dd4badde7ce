"""Rungs of a project to the lines of a LADDER."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from fbvm.interchange.cx.read.elements import Definition, ElementError, instructions
from fbvm.interchange.cx.read.project import Reading, Rung, Section
from fbvm.interchange.cx.read.symbols import Symbol

_NOTE = re.compile(r"//\s*(\d{1,6})|A\s+F?(\d{1,6})")
"""`//  2`: the attached comment of that number belongs to the step before; `A  2`: to the rung."""
_WORD = re.compile(r"(?<![\w.#&+-])([@*]?)([^\W\d]\w*)")


def is_note(line: str) -> bool:
    """True for a line of a statement list that stands for an attached comment."""
    return _NOTE.fullmatch(line) is not None


class RungLines:
    """Makes the lines of rungs; `known` are the symbols that they see, by the names that rungs write."""

    def __init__(self, reading: Reading, known: Mapping[str, Symbol], definition: Definition) -> None:
        self.reading, self.known, self.definition = reading, known, definition
        self.number = 0

    def sections(self, sections: Iterable[Section]) -> Iterator[str]:
        """The lines of a program's sections, with the rungs numbered through."""
        where = self.reading.where
        for section in sections:
            self.reading.where = f"{where}, section {section.name}"
            yield f"SECTION {_one_line(section.name)}"
            if section.comment:
                yield from _notes(section.comment)
            yield from self.rungs(section.rungs)
        self.reading.where = where

    def rungs(self, rungs: Iterable[Rung]) -> Iterator[str]:
        """The lines of rungs; those that are empty are left out."""
        for position, rung in enumerate(rungs):
            if rung.is_empty:
                continue
            comment, *more = rung.comment.split("\n") if rung.comment else [""]
            yield f"RUNG {self.number} {_one_line(comment)}".rstrip()
            yield from _notes("\n".join(more))
            self.number += 1
            where = self.reading.where
            self.reading.where = f"{where}, rung {position}"
            yield from self._steps(rung)
            self.reading.where = where

    def _steps(self, rung: Rung) -> Iterator[str]:
        if rung.elements:
            try:
                yield from map(self._line, instructions(rung.elements, self.definition))
            except ElementError as error:
                self.reading.report("X0203", rung.value, f"the rung is not taken over: {error.args[0]}")
                yield f"' this rung is not taken over: {_one_line(error.args[0])}"
            return
        lines: list[str] = []
        for line in rung.lines:
            if note := _NOTE.fullmatch(line):
                text = _attached(rung, int(note[1] or note[2]))
                if text and note[1] and lines:
                    lines[-1] += f"  // {text}"
                elif text:
                    lines.append(f"' {text}")
            else:
                lines.append(line if line.startswith("'") else self._line(line))
        yield from lines

    def _line(self, line: str) -> str:
        """An instruction with symbols as they are spelt in the sources; an indirect address has no symbol."""
        mnemonic, space, operands = line.partition(" ")
        return mnemonic + space + _WORD.sub(self._operand, operands) if operands else line

    def _operand(self, word: re.Match[str]) -> str:
        symbol = self.known.get(word[2].casefold())
        if symbol is None:
            return word[0]
        return word[1] + (symbol.address if word[1] and symbol.address else symbol.own)


def _attached(rung: Rung, number: int) -> str:
    return _one_line(rung.attached[number]) if number < len(rung.attached) else ""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _notes(text: str) -> Iterator[str]:
    for line in text.splitlines():
        if line.strip():
            yield f"' {line.strip()}"
