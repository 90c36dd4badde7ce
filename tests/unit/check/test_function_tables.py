"""Which type a standard function gives for each type of argument, as a table, and what is said of calls that are not so.

`FBVM_REWRITE=1 pytest` of this file writes `function_tables.txt` anew: read the difference.  A line is the functions, and the
types of their arguments, each with the type of the result; what is missing is not taken."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from test_operator_tables import DECLARED, OPERANDS

from fbvm import compile_text
from fbvm.check.calls.functions import OPERATORS, SIGNATURES, TIME_OPERATORS

KEPT = Path(__file__).with_name("function_tables.txt")
FIXED = {"BOOL": "bool_", "ANY_INT": "int_", "TIME": "time_", "UDINT": "7"}
"""What is given to a parameter whose type does not depend on the others."""
TOGETHER = (("int_", "uint_"), ("int_", "7"), ("7", "uint_"), ("real_", "1.5"), ("int_", "1.5"), ("real_", "lreal_"),
            ("word_", "7"), ("time_", "ltime_"), ("text", "'a'"), ("text", "char_"), ("small", "int_"), ("colour_", "int_"),
            ("bool_", "word_"))  # fmt: skip
_GIVEN = re.compile(r"(?:the value is )?(.+?)(?: stands here)?, but Plain is needed here")


def calls() -> dict[tuple[str, str], str]:
    """By function and arguments, as the table shows them, the call."""
    made: dict[tuple[str, str], str] = {}
    for name, row in SIGNATURES.items():
        if name.startswith("__"):
            continue
        free = sum(kind == "T" for _, kind in row.parameters)
        for operands in [*((one,) * max(free, 1) for one in OPERANDS), *(pair for pair in TOGETHER if free == 2)]:
            given = iter(operands)
            arguments = [next(given) if kind == "T" else FIXED[kind] for _, kind in row.parameters]
            shown = " ".join(dict.fromkeys(OPERANDS[one] for one in operands)) if free else "nothing"
            made[name, shown] = f"{name}({', '.join(arguments)})"
        made[name, "one more"] = f"{name}({', '.join([*arguments, *arguments, '7', '7', '7'])})"
        made[name, "one less"] = f"{name}({', '.join(arguments[:-1])})"
        made[name, "by another name"] = f"{name}(NOBODY := int_)"
    for name in (*OPERATORS, *TIME_OPERATORS):
        if name != "NOT":
            made |= {(name, f"{OPERANDS[one]} {OPERANDS[other]}"): f"{name}({one}, {other})" for one, other in TOGETHER}
            made |= {(name, f"{OPERANDS[one]} {OPERANDS[one]}"): f"{name}({one}, {one})" for one in OPERANDS}
    return made


def text(dialect: str) -> list[str]:
    made = calls()
    rows = list(made)
    body = "".join(f"result := {call};\n" for call in made.values())
    compiled = compile_text(f"{DECLARED}{body}END_PROGRAM", dialect=dialect, lint=False)
    first = DECLARED.count("\n") + 1
    types: dict[tuple[str, str], str] = {}
    said: dict[str, list[str]] = {}
    for message in compiled.errors:
        row = rows[message.source.place(message.start)[0] - first]
        if found := _GIVEN.fullmatch(message.message):
            types[row] = found[1]
        elif message.code != "S0302":  # an operator that is not defined: operator_tables.txt
            words = re.sub(rf"\b{row[0]}\b", "F", re.sub(r"\w+_TO_\w+\(", "X_TO_Y(", f"{message.message} | {message.hint}"))
            said.setdefault(f"{message.code} {words}", []).append(f"{row[0]} of {row[1]}")
    alike: dict[str, list[str]] = {}
    for name in dict.fromkeys(name for name, _ in rows):
        line = "; ".join(f"{shown} {kind}" for (of, shown), kind in types.items() if of == name)
        alike.setdefault(line, []).append(name)
    return [f"# {dialect}", *(f"{' '.join(names)}: {line}" for line, names in alike.items() if line), "", f"# said in {dialect}",
            *(f"{words} | {len(told)}: {', '.join(told[:4])}" for words, told in sorted(said.items())), ""]  # fmt: skip


@pytest.mark.slow
def test_functions_give_the_types_that_are_listed() -> None:
    made = "\n".join(text("standard"))
    if os.environ.get("FBVM_REWRITE"):
        KEPT.write_text(made, encoding="utf-8")
    assert made == KEPT.read_text(encoding="utf-8")
