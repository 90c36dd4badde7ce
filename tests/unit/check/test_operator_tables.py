"""Which type an operator gives for each two types, as a table, and what is said where it is not defined.

`FBVM_REWRITE=1 pytest` of this file writes `operator_tables.txt` anew: read the difference.  A line is the left operand,
operators and the types on the right, each with the type of the result; what is missing is not defined."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from fbvm import compile_text

KEPT = Path(__file__).with_name("operator_tables.txt")
DECLARED = """TYPE Colour : (Red, Green); Plain : STRUCT n : INT; END_STRUCT; END_TYPE
PROGRAM Main
VAR
    bool_ : BOOL; int_ : INT; uint_ : UINT; lint_ : LINT; word_ : WORD; real_ : REAL; lreal_ : LREAL; time_ : TIME;
    ltime_ : LTIME; date_ : DATE; tod_ : TOD; dt_ : DT; text : STRING[5]; wide : WSTRING[5]; char_ : CHAR;
    colour_ : Colour; small : INT(0..9); ref : REF_TO INT; plain_ : Plain; row : ARRAY[0..2] OF INT; timer : TON; result : Plain;
END_VAR
"""
OPERANDS = {"bool_": "BOOL", "int_": "INT", "uint_": "UINT", "lint_": "LINT", "word_": "WORD", "real_": "REAL", "lreal_": "LREAL",
            "time_": "TIME", "ltime_": "LTIME", "date_": "DATE", "tod_": "TOD", "dt_": "DT", "text": "STRING", "wide": "WSTRING",
            "char_": "CHAR", "colour_": "Colour", "small": "INT(0..9)", "ref": "REF_TO", "plain_": "Plain", "row": "ARRAY",
            "timer": "TON", "7": "7", "1.5": "1.5", "'a'": "'a'"}  # fmt: skip
OPERATORS = ("+", "-", "*", "/", "MOD", "**", "AND", "=", "<")
DIALECTS = ("standard", "codesys", "rusty")
_GIVEN = re.compile(r"(?:the value is )?(.+?)(?: stands here)?, but Plain is needed here")


def results(dialect: str) -> tuple[dict[tuple[str, str, str], str], dict[str, list[str]]]:
    """By operator and operands the type of the result, and by what is said where there is none the operations."""
    rows = [(left, op, right) for left in OPERANDS for op in OPERATORS for right in OPERANDS]
    body = "".join(f"result := {' '.join(row)};\n" for row in rows)
    made = compile_text(f"{DECLARED}{body}END_PROGRAM", dialect=dialect, lint=False)
    first = DECLARED.count("\n") + 1
    types: dict[tuple[str, str, str], str] = {}
    said: dict[str, list[str]] = {}
    for message in made.errors:
        row = rows[message.source.place(message.start)[0] - first]
        if found := _GIVEN.fullmatch(message.message):
            types[row] = found[1]
        else:
            kind = re.sub(r" is not defined for .+", " is not defined", message.message)
            hint = re.sub(r"\w+_TO_\w+\(", "X_TO_Y(", message.hint)
            shown = f"{OPERANDS[row[0]]} {row[1]} {OPERANDS[row[2]]}"
            said.setdefault(f"{message.code} {kind} | {hint}", []).append(shown)
    return types, said


def text() -> str:
    lines: list[str] = []
    standard, said = results(DIALECTS[0])
    for dialect in DIALECTS:
        types = standard if dialect == DIALECTS[0] else results(dialect)[0]
        lines += [f"# {dialect}" + (", where it is another type" if types is not standard else "")]
        for left in OPERANDS:
            found: dict[str, list[str]] = {}
            for op in OPERATORS:
                kinds = {right: types.get((left, op, right)) for right in OPERANDS}
                row = ", ".join(f"{OPERANDS[right]} {kind}" for right, kind in kinds.items() if kind is not None
                                and (types is standard or kind != standard.get((left, op, right))))  # fmt: skip
                found.setdefault(row, []).append(op)
            lines += [f"{OPERANDS[left]} {' '.join(ops)} with {row}" for row, ops in found.items() if row]
        lines += [""]
    lines += ["# what is said in the standard, with the first operations of each"]
    lines += [f"{what} | {len(rows)}: {', '.join(rows[:6])}" for what, rows in sorted(said.items())]
    return "\n".join(lines) + "\n"


@pytest.mark.slow
def test_operators_give_the_types_that_are_listed() -> None:
    made = text()
    if os.environ.get("FBVM_REWRITE"):
        KEPT.write_text(made, encoding="utf-8")
    assert made == KEPT.read_text(encoding="utf-8")
