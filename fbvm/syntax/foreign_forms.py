"""Expressions as other languages write them: `a SHL 2`, `7 DIV 2`, `1,5`."""

from __future__ import annotations

from fbvm.syntax.automaton import Automaton
from fbvm.syntax.lexer import Token
from fbvm.syntax.mend import Mend
from fbvm.syntax.phrases import found, sign
from fbvm.syntax.prospect import advance
from fbvm.syntax.tree import Node

OPERANDS = {"NAME", "NUMBER", "TYPED_LITERAL", "DATE_LITERAL", "STRING_LITERAL", "TRUE", "FALSE", "LPAR", "DIRECT", "NOT"}
FUNCTIONS = {"SHL", "SHR", "ROL", "ROR", "MIN", "MAX", "EXPT", "ADD", "SUB", "MUL", "ATAN2", "CONCAT", "FIND"}
"""Functions of two inputs that are written between these."""
SIGNS = {"DIV": ("SLASH", ", which drops the fraction between integers"), "POW": ("POWER", ""), "GT": ("GREATER", ""),
         "GE": ("GREATER_EQUAL", ""), "LT": ("LESS", ""), "LE": ("LESS_EQUAL", ""), "EQ": ("EQUAL", ""), "NE": ("UNEQUAL", ""),
         "IS": ("EQUAL", ""), "NAND": ("AND", ""), "NOR": ("OR", "")}
"""Words between two values: our terminal, and more advice."""
WEAKER = ("PLUS", "LESS", "EQUAL", "AND", "OR")
"""What can still stand behind an expression in brackets that the word behind it has closed."""


def infix(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`a SHL 2`, `a DIV b`"""
    word = token.text.upper()
    if token.type != "NAME" or len(following) < 2 or following[1].type not in OPERANDS or not automaton.values:
        return None
    if word in SIGNS:
        kind, more = SIGNS[word]
        advice = f"write NOT (a {kind} b)" if kind in ("AND", "OR") else f"write `{sign(kind)}`{more}"
    elif word in FUNCTIONS:
        kind, left = "STAR", automaton.values[-1]
        written = automaton.text[left.start:left.end] if isinstance(left, Node) else "a"
        right = following[1].text if following[1].type in ("NAME", "NUMBER", "TYPED_LITERAL") else "b"
        advice = f"it is a function: write {word}({' '.join(written.split())}, {right})"
    else:
        return None
    kind = next((each for each in (kind, *WEAKER) if advance(automaton.states, each) is not None), "")
    if not kind:
        return None
    return Mend([Token(kind, sign(kind), token.start, token.end)], token.start, token.end,
                f"{found(token)} is no operator of Structured Text", advice, lossless=word in SIGNS)


def decimal_comma(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`x := 1,5;`"""
    before = automaton.before
    if token.type != "COMMA" or len(following) < 2 or following[1].type != "NUMBER" or before.type != "NUMBER":
        return None
    number = following[1]
    if before.end != token.start or number.start != token.end or not before.text.isdigit():
        return None
    automaton.next()
    return Mend([], before.start, number.end, f"`{before.text},{number.text}` has a comma",
                f"the decimal sign is a point: {before.text}.{number.text}", lossless=True)
