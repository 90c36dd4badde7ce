"""What to do about rungs and charts as people write them who come from other tools."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text


def said(body: str) -> list[str]:
    """The diagnostics of a program, each with its hint."""
    text = f"PROGRAM Main\nVAR A AT CIO 0.00 : BOOL; M AT CIO 100.00 : BOOL; END_VAR\n{body}\nEND_PROGRAM"
    return [diagnostic.render() for diagnostic in compile_text(text).diagnostics]


@each_of(("rung", "hint"), [
    ("LDN A\nOUT M", "did you mean LDNOT?"), ("LD A\nST M", "did you mean OUT?"), ("XIC A\nOTE M", "did you mean LD?"),
    ("LD A\nCMPP D0 D1", "did you mean CMP or TCMP?"),
    ("LD A\nADD D0 D1 D2", "did you mean +?"), ("LD A\nTON D0", "did you mean FBCALL TON?"),
    ("LD A OUT M", "OUT begins a line of its own"), ("LD A\nMOV #1 D0 D1", "S is a word or constant, D is a word")])
def test_ladder(rung: str, hint: str) -> None:
    assert f"help: {hint}" in said(f"LADDER\n{rung}\nEND_LADDER")[0]


@each_of(("indent", "column"), [("", 1), ("  ", 3)])
def test_a_rung_that_is_drawn_outside_of_a_ladder_is_one_mistake(indent: str, column: int) -> None:
    assert said(f"{indent}│ A   M │\n{indent}├─┤ ├──( )─┤") == [
        f"text.st:3:{column}: error S0101: these lines are a rung that is drawn\n    {indent}│ A   M │\n    {indent}^^^^^^^^^\n"
        "  help: rungs stand between LADDER and END_LADDER"]


@each_of(("action", "condition", "message"), [
    ("M(X)", "A", "is a qualifier, and X is none"), ("M(5)", "A", "the first thing in the parentheses is a qualifier"),
    ("M(N)", "s", "the condition of a transition is a step, not BOOL"), ("M(N)", "s", "help: write s.X")])
def test_charts(action: str, condition: str, message: str) -> None:
    chart = (f"INITIAL_STEP s: {action}; END_STEP STEP t: END_STEP TRANSITION FROM s TO t := {condition}; END_TRANSITION "
             "TRANSITION FROM t TO s := A; END_TRANSITION")
    assert message in said(chart)[0]


def test_a_comment_behind_a_comment_is_a_mistake_with_its_place() -> None:
    (diagnostic,) = said("LADDER\n' a note // and another\nLD A\nOUT M\nEND_LADDER")
    assert ":4:1: error S0109: this is no instruction" in diagnostic


@each_of("pin", ["IN:=", "Q=>"])
def test_a_pin_without_its_operand_is_named(pin: str) -> None:
    (message,) = said(f"LADDER\nLD A\nFBCALL TON t {pin}\nEND_LADDER")
    assert f"error S0109: the operand behind `{pin}` is missing" in message


@pytest.mark.slow
@each_of(("constant", "fits"), [("+32767", True), ("+32768", False), ("-32768", True), ("-32769", False), ("&65535", True),
                                ("&65536", False), ("#FFFF", True), ("#10000", False)])
def test_a_constant_has_sixteen_bits_in_a_word(constant: str, fits: bool) -> None:
    messages = said(f"LADDER\nLD A\nMOV {constant} D0\nOUT M\nEND_LADDER")
    assert [f"{constant} does not fit in 16 bits" in message for message in messages] == ([] if fits else [True])


@pytest.mark.slow
@each_of(("instruction", "numbers"), [("FAL 0 #0", ""), ("FAL 511 #0", ""), ("FAL 512 #0", "0 to 511"), ("FALS 0 #0", "1 to 511"),
                                      ("FALS 1 #0", ""), ("FALS 511 D0", ""), ("FALS 512 #0", "1 to 511")])
def test_failures_have_numbers(instruction: str, numbers: str) -> None:
    messages = [each for each in said(f"LADDER\nLD A\n{instruction}\nEND_LADDER") if " error " in each]
    assert [f"numbers are {numbers}" in each for each in messages] == ([True] if numbers else [])
