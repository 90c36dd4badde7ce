"""What the pointer shows over each word of a program: which piece of the text it is about, and the first line about it."""

from __future__ import annotations

import re
from functools import cache

from editing import MARK, at_mark
from rows import each_of

from fbvm.analysis.hover import Hover, hover, hover_of_word
from fbvm.analysis.program import Program

PLANT = """\
FUNCTION_BLOCK Pump VAR_INPUT up AT %I* : BOOL; END_VAR END_FUNCTION_BLOCK
PROGRAM Main
VAR on AT W3.05 : BOOL; t : TON; n AT D200 : INT; lamp AT %QX0.1 : BOOL; w : WORD; END_VAR
n := n + MAX(1, n); w := %D201; lamp := on; t();
LADDER
LD on
@MOV #1 D200
LD W3.05
OUT 100.00
LD P_On
TIM 0001 #10
LD on
MOV(021) &5 n
LD T1
SET %QX0.1
END_LADDER
END_PROGRAM
"""


@cache
def plant() -> Program:
    return at_mark(PLANT + MARK, "codesys")[0]


def told(shown: Hover | None, text: str) -> str:
    """The piece that a hover is about, and the first line about it with more than signs of Markdown."""
    if shown is None:
        return ""
    lines = (line.strip("*`") for line in shown.markdown.splitlines() if line.strip("*`") not in ("", "st"))
    return f"{text[shown.start:shown.end]} | {next(lines)}"


@each_of("line, word, expected", [
    (1, "Pump", "Pump | FUNCTION_BLOCK Pump"), (1, "up", "up | VAR_INPUT up : BOOL"), (1, "VAR_INPUT", ""), (2, "PROGRAM", ""),
    (2, "Main", "Main | PROGRAM Main"), (3, "on", "on | VAR on AT W3.05 : BOOL"), (3, "AT", ""), (3, "BOOL", ""),
    (3, "W3.05", "W3.05 | W3.05**: work words"), (3, "t", "t | VAR t : TON"), (3, "D200", "D200 | D200**: data words"),
    (3, "%QX0.1", "%QX0.1 | %QX0.1**: outputs of portable programs"), (4, "n", "n | VAR n AT D200 : INT"), (4, "+", ""),
    (4, "%D201", "%D201 | D201**: data words"), (4, "MAX", "MAX | MAX(IN1 : T, ..) : T  (T: ANY_ELEMENTARY)"), (4, "1", ""),
    (5, "LADDER", ""), (6, "LD", "LD | LD"), (6, "on", "on | VAR on AT W3.05 : BOOL"), (7, "@MOV", "@MOV | MOV(021)"),
    (7, "#1", ""), (7, "D200", "D200 | D200**: data words"), (8, "W3.05", "W3.05 | W3.05**: work words"), (9, "OUT", "OUT | OUT"),
    (9, "100.00", "100.00 | CIO 100.00**: inputs, outputs and words of units"),
    (10, "P_On", "P_On | CF113**: condition flags and clock pulses"), (11, "TIM", "TIM | TIM"),
    (11, "0001", "0001 | T1**: present values of timers"), (11, "#10", ""), (13, "MOV(021)", "MOV(021) | MOV(021)"),
    (13, "&5", ""), (13, "n", "n | VAR n AT D200 : INT"), (14, "T1", "T1 | T0001**: completion flags of timers"),
    (15, "SET", "SET | SET"), (15, "%QX0.1", "%QX0.1 | %QX0.1**: outputs of portable programs"), (16, "END_LADDER", ""),
])
def test_each_word_shows_what_it_is(line: int, word: str, expected: str) -> None:
    lines = PLANT.splitlines(keepends=True)
    at = re.search(rf"(?<!\w){re.escape(word)}(?!\w)", lines[line - 1])
    assert at is not None
    start = sum(map(len, lines[:line - 1])) + at.start()
    for offset in range(start, start + len(word)):
        assert told(hover(plant(), "pump.st", offset), PLANT) == expected, offset - start


@each_of("text, expected", [
    ("21", "21 | CIO 21**: inputs, outputs and words of units"), ("99999", ""), ("", ""), ("MOV(021)", "MOV(021) | MOV(021)"),
    (" @MOV", "@MOV | MOV(021)"), ("W3.05", "W3.05 | W3.05**: work words"), ("Main.n", ""), ("n", ""), ("+ ", ""),
    ("main", "main | PROGRAM Main"), ("TON:", "TON | # TON"),
])
def test_a_word_of_a_text_that_is_no_source_is_an_address_a_global_name_or_an_instruction(text: str, expected: str) -> None:
    piece = expected.partition(" | ")[0]
    for offset in range(len(text) + 1):
        inside = text.find(piece) <= offset <= text.find(piece) + len(piece)
        assert told(hover_of_word(plant(), text, offset), text) == (expected if inside else ""), offset


def test_a_diagnostic_is_shown_from_its_first_letter_to_its_last_and_at_its_place_if_it_has_none() -> None:
    text = "PROGRAM Main VAR n : INT; END_VAR n := nobody; n := 1 n := 2; END_PROGRAM\n"
    program, _ = at_mark(text + MARK)
    name, gap = text.index("nobody"), text.index(" n := 2")
    pages = {offset: shown.markdown.split(" ")[1] for offset in range(len(text))
             if (shown := hover(program, "pump.st", offset)) is not None and shown.markdown.startswith("# ")}
    assert pages == {**dict.fromkeys(range(name, name + len("nobody")), "S0201"), gap: "S0101"}
