"""Rungs to canonical text, for `fbvm fmt`: instructions in columns, drawings drawn anew."""

from __future__ import annotations

from fbvm.syntax.ladder.drawing.drawing import ARROW, drawn
from fbvm.syntax.ladder.drawing.reading import Picture
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.syntax.ladder.mnemonics import Line, RungText, Symbol

STEP = "    "
"""Indentation of instructions below RUNG."""
UNLIMITED = 10_000
"""Columns for a drawing without lines that go on below."""
OPERANDS_AT = 8
"""Column of the operands, counted from the beginning of the instruction."""


def rung_lines(rungs: list[RungText]) -> list[str]:
    """The lines between LADDER and END_LADDER.  Rungs without a line RUNG are set apart by an empty one."""
    lines: list[str] = []
    for rung in rungs:
        if lines and (rung.section or rung.symbols):
            lines.append("")
        lines += [_symbol(symbol) for symbol in rung.symbols]
        lines += ["", rung.section] if rung.section and rung.symbols else [rung.section] if rung.section else []
        if rung.declared:
            number = "" if rung.number is None else str(rung.number)
            lines.append(" ".join(filter(None, ("RUNG", number, rung.comment))))
        elif lines and not rung.section:
            lines.append("")
        lines += _drawing(rung, rung.picture) if rung.picture else _steps(rung)
    return lines


def _symbol(symbol: Symbol) -> str:
    return f'{symbol.name},{symbol.address},{symbol.type},,,,"{symbol.comment}";'


def _drawing(rung: RungText, picture: Picture) -> list[str]:
    """A drawing anew, with the notes in front of it: as wide as it was, wider if lines would have to go on below that did
    not."""
    annotations = Annotations(places=lambda symbol: picture.places.get(symbol, ""))
    rows = drawn(picture.bar, picture.width, annotations).rows()
    if not picture.is_broken and any(ARROW in row for row in rows):
        rows = drawn(picture.bar, UNLIMITED, annotations).rows()
    return [STEP + text for text in (*(note for _, note in rung.notes), *rows)]


def _steps(rung: RungText) -> list[str]:
    """The instructions of a rung and the notes between them, remarks one below the other."""
    written = [_instruction(line) for line in rung.lines]
    width = max((len(text) for text, line in zip(written, rung.lines, strict=True) if line.remark), default=0) + 2
    lines: list[str] = []
    for position in range(len(written) + 1):
        lines += [STEP + text for at, text in rung.notes if at == position]
        if position < len(written):
            remark = rung.lines[position].remark
            lines.append(STEP + (f"{written[position]:{width}}{remark}" if remark else written[position]))
    return lines


def _instruction(line: Line) -> str:
    step = line.step
    name = step.prefix + step.mnemonic + (f"({line.row.code})" if line.row.code and line.coded else "")
    return instruction_text(name, *step.operands)


def instruction_text(mnemonic: str, *operands: str) -> str:
    """One instruction with its operands in their column."""
    return f"{mnemonic:{OPERANDS_AT - 1}} {' '.join(operands)}".rstrip()
