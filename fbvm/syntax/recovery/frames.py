"""The blocks that are open at an error, and the lists in which parsing can go on.

Both are found from the stack of states alone, since each state is reached by one grammar symbol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.lookahead import State, symbols
from fbvm.syntax.st.tables import tables
from fbvm.syntax.tree import Binary, EnumLiteral, Literal, NullLiteral, Unary

ENDS = {
    "IF": "END_IF", "CASE": "END_CASE", "FOR": "END_FOR", "WHILE": "END_WHILE", "REPEAT": "END_REPEAT", "TRY": "END_TRY",
    "VAR": "END_VAR", "VAR_GLOBAL": "END_VAR", "STRUCT": "END_STRUCT", "UNION": "END_UNION", "TYPE": "END_TYPE",
    "FUNCTION": "END_FUNCTION", "FUNCTION_BLOCK": "END_FUNCTION_BLOCK", "PROGRAM": "END_PROGRAM",
    "CONFIGURATION": "END_CONFIGURATION", "RESOURCE": "END_RESOURCE", "ACTION": "END_ACTION", "ACTIONS": "END_ACTIONS",
    "VAR_ACCESS": "END_VAR", "VAR_CONFIG": "END_VAR", "STEP": "END_STEP", "TRANSITION": "END_TRANSITION",
    "CLASS": "END_CLASS", "INTERFACE": "END_INTERFACE", "METHOD": "END_METHOD", "PROPERTY": "END_PROPERTY",
    "PROPERTY_HALF": "END_PROPERTY",
    "ACCESSOR": "END_ACCESSOR", "NAMESPACE": "END_NAMESPACE"}
"""Word that opens -> word that ends it."""

OPENERS: dict[str, set[str]] = {"ELSIF": {"IF"}, "ELSE": {"IF", "CASE"}, "UNTIL": {"REPEAT"}, "CATCH": {"TRY"},
                                "FINALLY": {"TRY"}}
"""Word that ends or divides a block -> the words that may open that block."""
for _opener, _end in ENDS.items():
    OPENERS.setdefault(_end, set()).add(_opener)

UNITS = {"FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "CLASS", "INTERFACE", "NAMESPACE", "TYPE", "VAR_GLOBAL", "CONFIGURATION",
         "$END"}
"""Tokens that begin a declaration at the outermost level, and the end of the text."""

POUS = {"FUNCTION", "FUNCTION_BLOCK", "PROGRAM"}
STATEMENT_WORDS = {"IF", "CASE", "FOR", "WHILE", "REPEAT", "TRY", "EXIT", "CONTINUE", "RETURN"}
HEADS = {"IF": "THEN", "ELSIF": "THEN", "WHILE": "DO", "FOR": "DO", "CASE": "OF", "UNTIL": "END_REPEAT"}
"""Word that begins a head -> the word that ends the head."""

LISTS = ("ended_list", "var_decls", "type_decls", "declarations", "config_items", "resource_items", "some_actions",
         "access_decls", "config_decls", "associations", "prototypes", "accessors")
STATEMENT_LISTS = {"ended_list", "open_list", "statement_list"}


@dataclass(frozen=True)
class Anchor:
    """A list that can go on: `size` is the number of states that remain on the stack, `symbol` the production of the list."""

    size: int
    symbol: str


def anchor(states: State, below: int | None = None) -> Anchor:
    """The innermost list that is open on the stack, or on its first `below` states."""
    names, actions = symbols(), tables("st").actions
    for at in range((len(states) if below is None else below) - 1, -1, -1):
        row = actions[states[at]]
        for symbol in LISTS:
            if symbol in row:
                follows = at + 1 < len(states) and names[states[at + 1]]
                has = follows == symbol or (symbol == "ended_list" and follows in STATEMENT_LISTS)
                return Anchor(at + 2 if has else at + 1, symbol)
    return Anchor(1, "declarations")


LEVELS = {"OR": "expression", "OR_ELSE": "expression", "XOR": "xor_expr", "AND": "and_expr", "AND_THEN": "and_expr",
          "=": "compare_expr", "<>": "compare_expr", "<": "equ_expr", ">": "equ_expr", "<=": "equ_expr",
          ">=": "equ_expr", "+": "add_expr", "-": "add_expr", "*": "term", "/": "term", "MOD": "term",
          "**": "power_expr"}
"""Operator -> production of an expression whose outermost operator it is."""

OPERANDS = set(LEVELS.values()) | {"unary_expr", "primary_expr", "variable"}


def reopen(states: State, values: list[Any]) -> None:
    """Let the expression on top of the stack take further operators, in place: settling at the error has closed it."""
    if symbols()[states[-1]] not in OPERANDS:
        return
    value = values[-1]
    if isinstance(value, Binary):
        level = LEVELS[value.op]
    elif isinstance(value, (Literal, EnumLiteral, NullLiteral)):
        level = "primary_expr"
    else:
        level = "unary_expr" if isinstance(value, Unary) else "variable"
    states[-1] = tables("st").actions[states[-2]].get(level, states[-1])


def cut(states: State, values: list[Any], place: Anchor) -> None:
    """Remove what stands behind an anchor from the stacks, in place; the list of the anchor is open again.  An empty list of
    statements is removed too, since VAR sections may stand in its place."""
    del states[place.size:]
    del values[place.size - 1:]
    if values and values[-1] == [] and symbols()[states[-1]] in STATEMENT_LISTS:
        del states[-1], values[-1]
    if symbols()[states[-1]] in STATEMENT_LISTS:
        states[-1] = tables("st").actions[states[-2]]["ended_list"]


@dataclass(frozen=True)
class Frame:
    """A block without its END: the word that opens it, which is number `at` on the stack of states."""

    at: int
    word: Token


def frames(states: State, values: list[Any]) -> list[Frame]:
    """All open blocks, the outermost first."""
    names = symbols()
    return [Frame(at, values[at - 1]) for at in range(1, len(states))
            if names[states[at]] in ENDS and isinstance(values[at - 1], Token)
            and not (names[states[at]] == "PROGRAM" and names[states[at - 1]] in ("config_items", "resource_items"))]


def open_head(states: State, values: list[Any]) -> Frame | None:
    """The IF, WHILE, FOR, CASE, ELSIF or UNTIL whose head is being read."""
    names = symbols()
    for at in range(len(states) - 1, 0, -1):
        name = names[states[at]]
        if name in HEADS:
            return Frame(at, values[at - 1])
        if name in LISTS or name in STATEMENT_LISTS or name in ("THEN", "DO", "OF", "ELSE", "REPEAT"):
            return None
    return None
