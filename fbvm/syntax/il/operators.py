"""The operators of the instruction list (IEC 61131-3 ed. 3, tables 67, 68 and 70; ed. 2, Annex B.2.2)."""

from __future__ import annotations

from typing import NamedTuple


class Operator(NamedTuple):
    """What an operator does: `kind` says how it is executed, `sign` is the operator of Structured Text that does the same.

    `negated` inverts the operand (N), `condition` is "" (always), "C" (if the current result is TRUE) or "CN" (if it is FALSE);
    `nests` if a `(` may stand behind it."""

    kind: str
    sign: str = ""
    negated: bool = False
    condition: str = ""
    nests: bool = False


_BINARY = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/", "MOD": "MOD",
           "GT": ">", "GE": ">=", "EQ": "=", "NE": "<>", "LE": "<=", "LT": "<"}  # fmt: skip
_LOGICAL = ("AND", "OR", "XOR")
_CONDITIONAL = {"JMP": "jump", "CAL": "call", "RET": "return"}
BLOCK_INPUTS = ("S1", "R1", "CLK", "CU", "CD", "PV", "IN", "PT", "LD")
"""Inputs of standard blocks that are operators, table 70: `IN t1` gives the current result to an input, and calls the instance.
S and R are such operators in front of an instance, LD (of the counters down) only in its own form `CAL c(LD := ..)`."""

OPERATORS: dict[str, Operator] = {
    "LD": Operator("load"), "LDN": Operator("load", negated=True),
    "ST": Operator("store"), "STN": Operator("store", negated=True),
    "S": Operator("set", "S="), "R": Operator("set", "R="),
    "NOT": Operator("not"),
    **{word: Operator("binary", sign, nests=True) for word, sign in _BINARY.items()},
    **{word: Operator("binary", word, nests=True) for word in _LOGICAL},
    **{f"{word}N": Operator("binary", word, negated=True, nests=True) for word in _LOGICAL},
    **{word + condition: Operator(kind, condition=condition)
       for word, kind in _CONDITIONAL.items() for condition in ("", "C", "CN")},
    **{word: Operator("input") for word in BLOCK_INPUTS if word != "LD"},
    ")": Operator("close"),
}  # fmt: skip
"""Operator as written, in capitals (`&` is AND) -> what it does.  Any other word is the name of a function."""

