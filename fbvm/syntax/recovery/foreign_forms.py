"""Expressions as other languages write them: `a SHL 2`, `7 DIV 2`, `1,5`."""

from __future__ import annotations

import re

from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.wording import found, sign
from fbvm.syntax.st.automaton import Automaton
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.literals import ELEMENTARY
from fbvm.syntax.st.lookahead import advance, expected
from fbvm.syntax.tree import NameRef, Node

OPERANDS = {"NAME", "NUMBER", "TYPED_LITERAL", "DATE_LITERAL", "STRING_LITERAL", "TRUE", "FALSE", "LPAR", "DIRECT", "NOT"}
FUNCTIONS = {"SHL", "SHR", "ROL", "ROR", "MIN", "MAX", "EXPT", "ADD", "SUB", "MUL", "ATAN2", "CONCAT", "FIND"}
"""Functions with two inputs that other languages write as operators."""
SIGNS = {"DIV": ("SLASH", ", which drops the fraction between integers"), "POW": ("POWER", ""), "GT": ("GREATER", ""),
         "GE": ("GREATER_EQUAL", ""), "LT": ("LESS", ""), "LE": ("LESS_EQUAL", ""), "EQ": ("EQUAL", ""), "NE": ("UNEQUAL", ""),
         "IS": ("EQUAL", ""), "NAND": ("AND", ""), "NOR": ("OR", "")}
"""Operator of another language -> the terminal to write, and what the hint adds."""
UNARY = {"ABS", "SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "TRUNC", "LEN"}
"""Functions with one input that other languages write without brackets."""
_CONVERSION = re.compile(r"(?:[A-Z]+_)?TO_[A-Z]+", re.IGNORECASE)
NUMBERS = {"FLOAT": "REAL", "DOUBLE": "LREAL", "INTEGER": "INT", "LONG": "DINT", "SHORT": "INT", "UNSIGNED": "UDINT"}
"""Type of C in a conversion -> the type to write."""
WEAKER = ("PLUS", "LESS", "EQUAL", "AND", "OR")
"""Terminals to try in place of an operator where the expression has been closed already, the tightest first."""


def infix(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
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
    return Repair([Token(kind, sign(kind), token.start, token.end)], token.start, token.end,
                  f"{found(token)} is no operator of Structured Text", advice, lossless=word in SIGNS)


def decimal_comma(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`x := 1,5;`"""
    before = automaton.before
    if token.type != "COMMA" or len(following) < 2 or following[1].type != "NUMBER" or before.type != "NUMBER":
        return None
    number = following[1]
    if before.end != token.start or number.start != token.end or not before.text.isdecimal():
        return None
    if "RANGE" in expected(automaton.states):
        return None
    automaton.next()
    advice = f"thousands have no sign, or `_`: {before.text}_{number.text}" if "." in number.text else \
        f"the decimal sign is a point: {before.text}.{number.text}"
    return Repair([], before.start, number.end, f"`{before.text},{number.text}` has a comma", advice, lossless=True)


def bare_point(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`x := 1.;`"""
    before = automaton.before
    if token.type != "DOT" or before.type != "NUMBER" or before.end != token.start:
        return None
    return Repair([], before.start, token.end, f"`{before.text}.` ends with its point",
                  f"a number has digits behind it: {before.text}.0", lossless=True)


def bare_function(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`abs i`, `(INT) x`"""
    before, behind = automaton.before, token.text if token.type in ("NAME", "NUMBER") else "x"
    if token.type not in ("NAME", "NUMBER", "TYPED_LITERAL", "LPAR") or not automaton.values:
        return None
    if before.type == "NAME" and (before.text.upper() in UNARY or _CONVERSION.fullmatch(before.text)):
        return Repair([], before.start, before.end, f"{found(before)} is a function", f"write {before.text.upper()}({behind})",
                      lossless=False)
    value = automaton.values[-1]
    if before.type != "RPAR" or not isinstance(value, NameRef) or automaton.text[value.start - 1:value.start] != "(":
        return None
    kind = value.text.upper() if value.text.upper() in ELEMENTARY else NUMBERS.get(value.text.upper())
    if kind is None:
        return None
    return Repair([], value.start - 1, before.end, f"`({value.text})` converts nothing", f"write TO_{kind}({behind})",
                  lossless=False)
