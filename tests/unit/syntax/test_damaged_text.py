"""What is said of a text from which a word or sign is taken, of one after the other, or in which it stands twice, or another one
in its place, and what is still read of it, word for word.  `FBVM_REWRITE=1 pytest` of this file writes the texts anew; read the
difference before you keep it."""

from __future__ import annotations

import os
import re
from itertools import cycle
from pathlib import Path

import pytest
from test_syntax_errors import ONE_ERROR

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.node import walk

TEXTS = Path(__file__).parent / "texts"
TEXT = """\
TYPE Mode : (Off, Run := 4) := Off; Tank : STRUCT a, b : ARRAY [0..3] OF INT := [1, 3(2)]; END_STRUCT; END_TYPE
VAR_GLOBAL CONSTANT top : LREAL := -1.5E3; END_VAR
FUNCTION F : INT VAR_INPUT x : STRING[12] := 'a$n'; END_VAR F := LEN(x); END_FUNCTION
FUNCTION_BLOCK B EXTENDS A IMPLEMENTS I
METHOD PUBLIC m : BOOL VAR_IN_OUT y : INT; END_VAR m := y > 3; END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main
VAR RETAIN n AT %MW4 : INT (0..9) := 2; t : TON; p : REF_TO Tank; END_VAR
    IF n >= 3 AND NOT t.Q THEN n := n ** 2 + (n - 1) * 3; ELSIF n = 1 THEN RETURN; ELSE t(IN := TRUE, PT := T#1s, Q => b); END_IF;
    CASE n OF 1, 2..4: n := 0; Mode#Run: ; ELSE p^.a[n] := F(x := 'q'); END_CASE;
    FOR n := 1 TO 9 BY 2 DO EXIT; END_FOR; WHILE TRUE DO n := n; END_WHILE; REPEAT ; UNTIL n <> 4 END_REPEAT;
END_PROGRAM
PROGRAM Chart
INITIAL_STEP S: a(N); b(L, T#2s); END_STEP STEP W: END_STEP STEP V: END_STEP
TRANSITION T1 (PRIORITY := 1) FROM S TO (W, V) := go; END_TRANSITION
ACTION a: n := 1; END_ACTION
END_PROGRAM
PROGRAM List
    LD n
    ADD (2
    MUL 3
    )
    ST n
    CALC t(IN := b)
END_PROGRAM
CONFIGURATION C RESOURCE R ON PLC TASK T(INTERVAL := T#10ms, PRIORITY := 1); PROGRAM P WITH T : Main; END_RESOURCE
END_CONFIGURATION
"""
_WORD = re.compile(r"'[^']*'|%?\w+(?:#\w+)?(?:\.\d\w*)?|:=|=>|\*\*|>=|<>|\.\.|\S")


def said(text: str) -> str:
    read, found = parse(Source("", text))
    nodes = sum(1 for _ in walk(read))
    messages = [f"{each.line}:{each.source.place(each.start)[1]}+{each.end - each.start} {each.code} {each.message}; {each.hint}"
                + ("" if each.lossless else " (lost)") for each in found[:2]]  # fmt: skip
    return " | ".join([*messages, f"{len(found)} messages, {nodes} nodes"])


@pytest.mark.slow
@pytest.mark.parametrize("how", ["missing", "twice"])
def test_what_is_said_of_a_damaged_text(how: str) -> None:
    lines = [f"as it is: {said(TEXT)}"]
    for found in list(_WORD.finditer(TEXT))[how == "twice" :: 3]:
        instead = "" if how == "missing" else f"{found[0]} {found[0]}"
        row = TEXT.count("\n", 0, found.start()) + 1
        column = found.start() - TEXT.rfind("\n", 0, found.start())
        lines.append(f"{row}:{column} {found[0]}: {said(TEXT[: found.start()] + instead + TEXT[found.end() :])}")
    check(f"{how}.txt", lines)


OTHERS = ("END_IF", "(", ":=", "1", "VAR", ";", "STEP", "END_VAR", "x", "THEN", ",", "END_PROGRAM", "TYPE")


@pytest.mark.slow
def test_what_is_said_of_a_text_with_another_word_in_place_of_one() -> None:
    """In each declaration by itself; the words take turns."""
    lines, others = [], cycle(OTHERS)
    for declaration in re.split(r"(?m)^(?=TYPE|VAR_GLOBAL|FUNCTION|PROGRAM|CONFIGURATION)", TEXT):
        for found, other in zip(_WORD.finditer(declaration), others, strict=False):
            damaged = declaration[: found.start()] + other + declaration[found.end() :]
            lines.append(f"{found[0]} -> {other}: {said(damaged)}")
    check("other.txt", lines)


MISTAKES = [text for text, *_ in ONE_ERROR] + [
    "(a : INT", "(a : INT)", "(a : INT) : BOOL", "x := a SHL 2", "x := 2 DIV", "x := a NAND b", "x := SQRT a",
    "x := 1,5", "x := FLOAT(a)", "x := INT a", "x = = 2",
    "x :=", "IF a", "IF a THEN",
    "FOR i := 1 TO", "CASE a OF 1", "f(a :=", "x := a[", "x := (", "VAR a :", "VAR a : ARRAY [", "VAR a : STRING[",
    "VAR a AT", "x := b#2",
    "x := T#", "x := 'a", "(* a", "x := a.", "x := a^", "CASE a OF 1: ELSE", "REPEAT x := 1; UNTIL", "WHILE",
    "VAR a, : INT; END_VAR",
    "VAR a : INT := ; END_VAR", "VAR a b : INT; END_VAR", "VAR 2a : INT; END_VAR", "VAR a-b : INT; END_VAR",
    "VAR INT a; END_VAR",
    "VAR int a = 3; END_VAR", "VAR a : INT[3]; END_VAR", "VAR a : STRING(3) END_VAR", "GOTO x", "x := a ? b : c",
    "x := y := 2", "{ x := 1; }",
    "if (a) { x := 1; }", "while (a) x := 1;", "switch a", "return 3;", "break;", "x := null;", "x := 0x1F;", "x := 1_;",
    "x := 16#G;",
    "function f", "print(a)", "x := \"a\";", "x := a % b;", "x := a <> b <> c;", "x := a => b;", "x := NOT;",
    "x := - -1;", "x = 1;",
]  # fmt: skip


@pytest.mark.slow
def test_what_is_said_of_mistakes_at_the_end_of_a_text() -> None:
    """Nothing stands behind them; then they stand in front of others."""
    lines = []
    for text in MISTAKES:
        lines += [f"{text!r}: {said(f'PROGRAM p {text}')}", f"    {said(f'PROGRAM p {text} y := 1; END_PROGRAM')}"]
    check("mistakes.txt", lines)


def check(name: str, lines: list[str]) -> None:
    path, text = TEXTS / name, "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")
