"""The two notations of a LADDER: rungs that are drawn become instructions, and instructions become drawings.

A rung changes its notation only if it is read back as it was; one that cannot, such as one that has no drawing, stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from fbvm.syntax.ladder.drawing.cells import cells, text_of
from fbvm.syntax.ladder.drawing.diagram import StepText, Undrawable, diagram
from fbvm.syntax.ladder.drawing.reading import Picture
from fbvm.syntax.ladder.drawing.steps import steps
from fbvm.syntax.ladder.mnemonics import RungText, read_rungs
from fbvm.syntax.ladder.text import rung_lines

WIDTH = 92
"""Columns of a drawing; lines that need more go on below."""


class Form(Enum):
    """How the rungs of a LADDER are written."""

    MNEMONICS = "instructions"
    DRAWING = "a drawing"


@dataclass
class Notation:
    """The form that rungs are to have, for the formatter, which adds the lines of rungs that have to stay as they are."""

    form: Form
    kept: list[int] = field(default_factory=list)
    """Numbers of the lines at which rungs begin that have no other form, from 1."""

    def rewritten(self, rungs: list[RungText], text: str, at: int) -> list[RungText]:
        """The rungs in this form.  `at` is the place in `text` from which the rungs count their own places."""
        places = {symbol.name: symbol.address for rung in rungs for symbol in rung.symbols if symbol.name and symbol.address}
        made = []
        for rung in rungs:
            other = _in_form(rung, self.form, places)
            if other is None:
                self.kept.append(text.count("\n", 0, at + rung.start) + 1)
            made.append(other or rung)
        if any(bool(new.picture) != bool(old.picture) for new, old in zip(made, rungs, strict=True)):
            # an empty line alone does not part every two rungs; a section without rungs has none to be parted
            made = [replace(rung, declared=True) if rung.lines or rung.notes else rung for rung in made]
        return made


def _in_form(rung: RungText, form: Form, places: Mapping[str, str]) -> RungText | None:
    """The rung in this form; None if it would not be read back as the same."""
    if not rung.lines or (rung.picture is not None) == (form is Form.DRAWING):
        return rung
    made = replace(rung, picture=None, declared=True)
    wanted = _texts(rung)
    if form is Form.DRAWING:
        try:
            bar = diagram([(prefix, mnemonic, tuple(map(cells, operands))) for prefix, mnemonic, operands in wanted])
        except Undrawable:
            return None
        named = {operand for _, _, operands in wanted for operand in operands}
        made.picture = Picture(bar, WIDTH, True, {cells(name): cells(place) for name, place in places.items() if name in named})
        made.notes = _comments(rung)
        wanted = [(step.prefix, step.mnemonic, tuple(map(text_of, step.operands))) for step in steps(bar)]
    return made if _read_back(made) == (wanted, [note for _, note in made.notes], rung.comment) else None


def _texts(rung: RungText) -> list[StepText]:
    return [(line.step.prefix, line.step.mnemonic, line.step.operands) for line in rung.lines]


def _comments(rung: RungText) -> list[tuple[int, str]]:
    """The notes and remarks of a rung in their order, all in front of it: a drawing has no other place for them."""
    placed = [*((at, 0, note) for at, note in rung.notes),
              *((at, 1, line.remark) for at, line in enumerate(rung.lines) if line.remark)]
    return [(0, text) for _, _, text in sorted(placed, key=lambda one: one[:2])]


def _read_back(rung: RungText) -> tuple[list[StepText], list[str], str] | None:
    """The instructions, comments and headline of a rung as its text says them; None if the text is not one rung."""
    wrong: list[object] = []
    text = "\n".join(rung_lines([replace(rung, section="", symbols=[])])) + "\n"
    read = read_rungs(text, 0, len(text), lambda *message: wrong.append(message))
    if wrong or len(read) != 1:
        return None
    return _texts(read[0]), [note for _, note in read[0].notes], read[0].comment

