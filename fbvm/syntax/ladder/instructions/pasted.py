"""Recognises ladder mnemonics among statements, so that one message is reported for all their lines."""

from __future__ import annotations

from fbvm.syntax.ladder.instructions.instruction_set import instruction_set, spelling

INSTRUCTION_LIST = frozenset((
    "LD", "LDN", "ST", "STN", "S", "R", "AND", "ANDN", "OR", "ORN", "XOR", "XORN", "NOT", "ADD", "SUB", "MUL", "DIV", "MOD", "GT",
    "GE", "EQ", "NE", "LE", "LT", "JMP", "JMPC", "JMPCN", "CAL", "CALC", "CALCN", "RET", "RETC", "RETCN"))
"""Operators of the instruction list, as names (IEC 61131-3 ed. 3, table 68)."""
LOOK, SURE = 600, 2
"""Characters that are searched, and lines of instructions that must follow one another."""


def ladder_lines(text: str, at: int) -> bool:
    """Whether the line at an offset and those below it are ladder: only instructions, one of which no other language has.

    Functions may be called as instructions, LIMIT and SQRT are: an operator of the instruction list behind them tells."""
    start = text.rfind("\n", 0, at) + 1
    lines, own = 0, False
    for line in text[start:start + LOOK].split("\n"):
        if not line.strip():
            continue
        code = line.strip().lstrip("@%!")
        found = instruction_set().pattern.match(code)
        if found is None or code[found.end():found.end() + 1] not in ("", " ", "\t", "(") or ":=" in code or ";" in code:
            own = own and code.split()[0].upper() not in INSTRUCTION_LIST
            break
        lines += 1
        name = spelling(found[0])
        own = own or name not in INSTRUCTION_LIST and bool(instruction_set().rows[name].does)
    return own and lines >= SURE
