"""The instruction set of ladder as a table: `grammar/mnemonics.txt`, whose head explains its columns."""

from __future__ import annotations

import re
from difflib import get_close_matches
from functools import cache
from typing import NamedTuple

from fbvm.base.data import data_folder

JOINS = ("LD", "AND", "OR")
"""Prefixes of a comparison or a bit test that say how it joins the execution condition."""

IN_BLOCK_PROGRAMS = (".if", ".else", ".if_end", ".wait", ".exit", ".loop", ".loop_end", ".pause", ".restart", ".timer_wait",
                     ".counter_wait", ".block_end")
"""What instructions do that stand in block programs only."""

KINDS = {
    "b": "a bit", "B": "a bit", "w": "a word or constant", "W": "a word", "d": "two words or a constant",
    "q": "four words or a constant", "r": "a REAL in two words or a constant", "l": "an LREAL in four words or a constant",
    "z": "a word or constant in BCD", "Z": "two words or a constant in BCD", "a": "words", "k": "words or a constant",
    "A": "words", "n": "a number", "t": "the number of a timer", "c": "the number of a counter",
    "m": "a timer or counter, as in T0005 or C0005", "v": "an address or symbol", "x": "an index register"}
"""Letter for a kind of operand -> its name in messages."""


class Instruction(NamedTuple):
    """A row of the table.  `does` is a word of the front end (with a point in front), the name of a library's function or
    block, or "" for what is known and refused; `kind` is "", "?" for a contact, "FB" or "FB-" for a block."""

    mnemonic: str
    code: str
    variations: str
    inputs: int
    operands: str
    """For each operand the letter of its kind."""
    names: tuple[str, ...]
    """The names of the operands in the manual."""
    least: int
    """How many operands must be given."""
    join: str
    """LD, AND or OR in front of a comparison."""
    kind: str
    does: str
    words: str
    """What it does or why it is refused, if the library does not say it."""

    def role(self, position: int) -> str:
        """What an operand is, for messages."""
        name = self.names[position]
        return self.mnemonic if name == "B" else f"{name} of {self.mnemonic}"

    @property
    def ends_condition(self) -> bool:
        """Whether the next instruction begins at the bus bar, as in block programs."""
        return self.does == ".block_program" or self.does in IN_BLOCK_PROGRAMS

    @property
    def described(self) -> str:
        """The operands with their kinds, for a hint."""
        wanted = [f"{name} is {KINDS[kind]}" for name, kind in zip(self.names, self.operands, strict=True) if name != "B"]
        return ", ".join(wanted)


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
        name, code, variations, inputs, operands, what, words = (part.strip() for part in f"{line}||".split("|", 6))
        kind, does = _kind(what)
        wanted = [operand.partition(":") for operand in operands.split()]
        for join in JOINS if kind == "?" else ("",):
            taken = {"": int(inputs or 1), "LD": 0, "AND": 1, "OR": 1}[join]
            rows[join + name] = Instruction(
                join + name, code, variations, taken, "".join(kind_[0] for _, _, kind_ in wanted),
                tuple(word for word, _, _ in wanted), sum(not kind_.endswith("?") for _, _, kind_ in wanted),
                join, kind, does,
                words.strip(" |"))
    return InstructionSet(rows, _pattern(rows))


def _kind(what: str) -> tuple[str, str]:
    if what.startswith("?"):
        return "?", what[1:]
    kind, colon, does = what.partition(":")
    return (kind, does) if colon else ("", what)


_SPACED = re.compile(r"(LD|AND|OR|OUT|IF|WAIT|EXIT|LEND)(NOT|LD|TSTN?)")


def _pattern(rows: dict[str, Instruction]) -> re.Pattern[str]:
    """Longest first; a blank may stand where manuals have one."""
    words = [_SPACED.sub(r"\1 ?\2", re.escape(name)) for name in rows]
    return re.compile(rf"(?:{'|'.join(sorted(words, key=len, reverse=True))})(?![A-Za-z0-9_+*/<>=$-])", re.I)


ELSEWHERE = {
    "LDN": "LDNOT", "ANDN": "ANDNOT", "ORN": "ORNOT", "ST": "OUT", "STN": "OUTNOT", "S": "SET", "R": "RSET",
    "LDI": "LDNOT", "ANI": "ANDNOT", "ORI": "ORNOT", "ANB": "ANDLD", "ORB": "ORLD", "RST": "RSET", "PLS": "DIFU", "PLF": "DIFD",
    "XIC": "LD", "XIO": "LDNOT", "OTE": "OUT",
    "MOVE": "MOV", "ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/",
    **{block: f"FBCALL {block}" for block in ("TON", "TOF", "TP", "CTU", "CTD", "CTUD", "R_TRIG", "F_TRIG", "SR", "RS")}}
"""Mnemonic of another tool -> what to write: instruction lists of the standard, Mitsubishi, Rockwell; and blocks."""


NO_INSTRUCTIONS = {"NETWORK": "a rung begins with a line RUNG", "END_NETWORK": "a rung ends where the next one begins",
                   "END_RUNG": "a rung ends where the next one begins"}
"""Word around the rungs of other tools -> hint."""


def meant(name: str) -> list[str]:
    """What to write for an unknown mnemonic: the instruction that other tools call so, or those with similar names."""
    if name in ELSEWHERE:
        return [ELSEWHERE[name]]
    return get_close_matches(name, instruction_set().rows, 2, 0.6)


def spelling(text: str) -> str:
    """A mnemonic as the table has it."""
    return text.replace(" ", "").upper()


_AREAS = {"t": "T", "c": "C"}


def number_area(mnemonic: str) -> str:
    """T or C if the first operand of an instruction is the number of a timer or of a counter, else ""."""
    row = instruction_set().rows.get(mnemonic)
    return _AREAS.get(row.operands[:1], "") if row else ""


def is_bcd_number(mnemonic: str) -> bool:
    """Whether the present value of the timer or counter of an instruction is BCD."""
    row = instruction_set().rows.get(mnemonic)
    return row is not None and row.operands[:2] in ("tz", "cz")
