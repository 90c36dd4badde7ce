"""A program with a mark where the cursor stands."""

from __future__ import annotations

from fbvm.analysis.program import Program

MARK = "‸"


def at_mark(text: str, dialect: str = "standard") -> tuple[Program, int]:
    """The checked program of one file, `pump.st`, and the place of the mark in it."""
    offset = text.index(MARK)
    program = Program(dialect=dialect)
    program.replace("pump.st", text.replace(MARK, ""))
    program.check_all()
    return program, offset
