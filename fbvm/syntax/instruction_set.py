"""The instruction set of ladder as a table: `grammar/mnemonics.txt`, whose head explains its columns."""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

from fbvm.base.data import data_folder

JOINS = ("LD", "AND", "OR")
"""What stands in front of a comparison or a bit test to say how it joins the rung."""


class Instruction(NamedTuple):
    """A row of the table.  `does` is a word of the front end (with a point in front), the name of a library's function or
    block, or "" for what is known and refused; `kind` is "", "?" for a contact, "FB" or "FB-" for a block."""

    mnemonic: str
    code: str
    variations: str
    inputs: int
    operands: str
    kind: str
    does: str


class InstructionSet(NamedTuple):
    """All instructions by mnemonic, and the pattern that finds the longest mnemonic, with blanks as manuals write them."""

    rows: dict[str, Instruction]
    pattern: re.Pattern[str]


@cache
def instruction_set() -> InstructionSet:
    """The table, read once."""
    rows: dict[str, Instruction] = {}
    text = (data_folder("grammar") / "mnemonics.txt").read_text(encoding="utf-8")
    for line in text.splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        name, code, variations, inputs, operands, what = (part.strip() for part in line.split("|", 5))
        kind, does = _kind(what)
        for join in JOINS if kind == "?" else ("",):
            taken = {"": int(inputs or 1), "LD": 0, "AND": 1, "OR": 1}[join]
            rows[join + name] = Instruction(join + name, code, variations, taken, operands.replace(" ", ""), kind, does)
    return InstructionSet(rows, _pattern(rows))


def _kind(what: str) -> tuple[str, str]:
    if what.startswith("?"):
        return "?", what[1:]
    kind, colon, does = what.partition(":")
    return (kind, does) if colon else ("", what)


_SPACED = re.compile(r"(LD|AND|OR|OUT)(NOT|LD|TSTN?)")


def _pattern(rows: dict[str, Instruction]) -> re.Pattern[str]:
    """Longest first; a blank may stand where manuals have one."""
    words = [_SPACED.sub(r"\1 ?\2", re.escape(name)) for name in rows]
    return re.compile(rf"(?:{'|'.join(sorted(words, key=len, reverse=True))})(?![A-Za-z0-9+*/<>=$-])", re.I)


def spelling(text: str) -> str:
    """A mnemonic as the table has it."""
    return text.replace(" ", "").upper()
