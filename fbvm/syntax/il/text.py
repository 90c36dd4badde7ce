"""Instruction lists as canonical text, for `fbvm fmt`: labels on lines of their own, operators and operands in columns.

Every comment stays on its line, behind what stands there; an empty line is kept once."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import groupby, pairwise

from fbvm.syntax.il.instructions import has_label, instruction_tokens, opens_list
from fbvm.syntax.il.operators import OPERATORS
from fbvm.syntax.st.lexer import Token

STEP = "    "
"""Indentation of instructions below labels, and of those in brackets."""
OPERANDS_AT = 8
"""Column of the operands, counted from the beginning of the instruction."""
_GAP = re.compile(r"(?s)\n|//[^\n]*|\(\*.*?\*\)|/\*.*?\*/|\{[^}]*\}")
"""What may stand between two tokens: line ends, comments, pragmas."""
_NOTHING_BEFORE = frozenset(",)].^[")
_NOTHING_BEHIND = frozenset("([.-+")

Spelled = Callable[[Token], str]
"""A token as it is to be written."""


def list_lines(text: str, start: int, end: int, spelled: Spelled) -> list[str]:
    """The lines of the instruction list from `start` to `end` of a text, without indentation of the whole."""
    lines: list[str] = []
    instructions = list(instruction_tokens(text, start, end, lambda *message: None))
    level, before = int(any(map(has_label, instructions))), start
    for tokens in instructions:
        level -= tokens[0].text == ")"
        for number, row in enumerate(_physical_lines(text, tokens)):
            _add_gap(lines, text[before:row[0].start], STEP * level)
            remarks = _remarks(text, row)
            if not number and has_label(row):
                lines.append(f"{row[0].text}:")
                row = row[2:]
            written = _arguments(row, spelled) if number else _instruction(row, spelled)
            inside = number and row[0].text != ")"
            if row or remarks:
                indent = STEP * level + (" " * OPERANDS_AT if number else "") + (STEP if inside else "")
                lines.append(indent + "  ".join(filter(None, (written, *remarks))))
            before = max(before, tokens[-1].end if not row else row[-1].end)
        level += opens_list(tokens)
    return lines


def _physical_lines(text: str, tokens: list[Token]) -> list[list[Token]]:
    """The tokens of an instruction by the lines that they stand on."""
    return [list(row) for _, row in groupby(tokens, lambda token: text.count("\n", tokens[0].start, token.start))]


def _add_gap(lines: list[str], gap: str, indent: str) -> None:
    """Add the comments between two rows: those on the line of the row above behind it, others on lines of their own."""
    ends = 0
    for found in _GAP.finditer(gap):
        if found[0] == "\n":
            ends += 1
        elif not ends and lines:
            lines[-1] += f"  {found[0]}"
        else:
            if ends > 1 and lines:
                lines.append("")
            lines += [indent + row for row in _from_its_column(gap, found.start(), found[0])]
            ends = 0
    if ends > 1 and lines:
        lines.append("")


def _from_its_column(gap: str, start: int, comment: str) -> list[str]:
    """The lines of a comment without the indentation that all have in front of the first one."""
    first, *others = comment.split("\n")
    column = start - (gap.rfind("\n", 0, start) + 1)
    return [first, *(line[min(column, len(line) - len(line.lstrip())):] for line in others)]


def _remarks(text: str, row: list[Token]) -> list[str]:
    """The comments between the tokens of a row."""
    return [found[0] for one, other in pairwise(row) for found in _GAP.finditer(text, one.end, other.start)]


def _instruction(row: list[Token], spelled: Spelled) -> str:
    """An operator with its operands in their column."""
    if not row:
        return ""
    size = 2 if row[0].text == "&" and len(row) > 1 and row[1].text.upper() == "N" and row[1].start == row[0].end else 1
    operator = row[0].text.upper()
    name = "&N" if size == 2 else operator if operator in OPERATORS else spelled(row[0])
    if size < len(row) and row[size].text == "(" and not opens_list(row):
        return name + _arguments(row[size:], spelled)
    return f"{name:{OPERANDS_AT - 1}} {_arguments(row[size:], spelled)}".rstrip()


def _arguments(row: list[Token], spelled: Spelled) -> str:
    """Operands and arguments with a space between tokens where one is usual."""
    parts: list[str] = []
    before = ""
    for token in row:
        word = spelled(token)
        joined = not parts or token.text in _NOTHING_BEFORE or token.text[0] == "." or before in _NOTHING_BEHIND
        joined = joined or token.text == "(" and before.isidentifier()
        parts += [word] if joined else [" ", word]
        before = token.text
    return "".join(parts)
