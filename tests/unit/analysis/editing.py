"""A program with a mark where the cursor stands."""

from __future__ import annotations

from fbvm.analysis.program import Program
from fbvm.analysis.references import declared_at, references

MARK = "‸"


def at_mark(text: str, dialect: str = "standard") -> tuple[Program, int]:
    """The checked program of one file, `pump.st`, and the place of the mark in it."""
    offset = text.index(MARK)
    program = Program(dialect=dialect)
    program.replace("pump.st", text.replace(MARK, ""))
    program.check_all()
    return program, offset


def at_word(text: str, before: str, word: str, dialect: str = "standard") -> tuple[Program, int]:
    """The checked program of a text, and the place of a word that stands in a piece of it."""
    at = text.index(before) + text[text.index(before):].index(word)
    return at_mark(text[:at] + MARK + text[at:], dialect)


def check_declaration(text: str, before: str, word: str, line: int, count: int, dialect: str = "standard") -> None:
    """Fails if the word does not lead to a declaration in `line`, or not to `count` places in all."""
    program, offset = at_word(text, before, word, dialect)
    declared = declared_at(program, "pump.st", offset)
    assert declared is not None
    placed = program.place(declared.source)
    assert placed is not None
    assert placed[0].source.place(placed[1] + declared.node.start)[0] == line
    assert len(references(program, declared.key)) == count
