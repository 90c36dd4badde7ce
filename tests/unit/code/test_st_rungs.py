"""Structured Text as rungs: what is drawn, what is named because it is not, and the power that a scan really saw."""

from __future__ import annotations

from textwrap import dedent

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.record.draw.ladder_text import ladder_text
from fbvm.record.draw.power import PowerFlow, RungExecution
from fbvm.record.trace.observing import observing
from fbvm.syntax.ladder.drawing.widths import Annotations

DECLARED = """a, b, c, d, e, f : BOOL; n, m : INT; r : REAL; w : WORD; t : TON; k : CTUD; s : SR; list : ARRAY[0..3] OF BOOL;
    seen : BOOL; edge : R_TRIG;"""


def image(body: str, drawn: bool = True) -> Image:
    made = compile_text(f"PROGRAM Main VAR {DECLARED} END_VAR\n{body}\nEND_PROGRAM", drawn=drawn, lint=False)
    assert made.image is not None, made.errors[0].render()
    return made.image


def steps(body: str) -> list[str]:
    """The steps of all rungs, as text; of what is no rung, what is said about it."""
    return ["; ".join(" ".join((p + m, *o)) for _, p, m, o in rung.steps) or rung.comment for rung in image(body).rungs]


RUNGS = {
    "a := b AND NOT c OR d;": "LD b; ANDNOT c; OR d; OUT a",
    "a := NOT (b AND c);": "LDNOT b; ORNOT c; OUT a",
    "a := NOT (b OR NOT c) AND d;": "LDNOT b; AND c; AND d; OUT a",
    "a := b XOR c;": "LD b; ANDNOT c; LDNOT b; AND c; ORLD; OUT a",
    "a := NOT (b XOR c);": "LD b; AND c; LDNOT b; ANDNOT c; ORLD; OUT a",
    "a := b = c;": "LD b; AND c; LDNOT b; ANDNOT c; ORLD; OUT a",
    "a := b <> c;": "LD b; ANDNOT c; LDNOT b; AND c; ORLD; OUT a",
    "a := (b OR c) AND (d OR e OR f);": "LD b; OR c; LD d; OR e; OR f; ANDLD; OUT a",
    "a := (b OR c) AND d OR e;": "LD b; OR c; AND d; OR e; OUT a",
    "a := b OR c OR (d OR e) AND f;": "LD b; OR c; LD d; OR e; AND f; ORLD; OUT a",
    "a := n > 5 AND NOT (m = n + 1);": "LD> n 5; AND<> m n + 1; OUT a",
    "a := b := c;": "LD c; OUT a; OUT b",
    "a S= b; c R= NOT b;": "LD b; SET a",
    "IF b AND c THEN a := TRUE; d := FALSE; END_IF": "LD b; AND c; SET a; RSET d",
    "a := TRUE;": "LD TRUE; OUT a",
    "a := list[n] AND w.3 AND t.Q AND %W0.3;": "LD list[n]; AND w.3; AND t.Q; AND %W0.3; OUT a",
    "a := b AND_THEN c OR_ELSE d;": "LD b; AND c; OR d; OUT a",
    "t(IN := a AND b, PT := T#1s, Q => c);": "LD a; AND b; CALL TON t IN:= PT:=T#1s Q=>c",
    "k(CU := a, CD := b OR c, R := FALSE, PV := n);": "LD a; LD b; OR c; CALL CTUD k CU:= CD:= R:=FALSE PV:=n",
    "t();": "CALL TON t",
    "edge(a);": "LD a; CALL R_TRIG edge CLK:=",
    "t(IN := SEL(a, b, c), PT := T#1s);": "CALL TON t IN:=SEL(a, b, c) PT:=T#1s",
    "k(CU := a AND NOT b, CD := SEL(a, b, c), PV := n);": "LD a; ANDNOT b; CALL CTUD k CU:= CD:=SEL(a, b, c) PV:=n",
}
REFUSED = {
    "n := m + 1;": "in line 3 is not drawn: an assignment that is not of BOOL",
    "IF a THEN n := 1; END_IF": "in line 3 is not drawn: an IF that does more than setting and resetting",
    "IF a THEN b := TRUE; ELSE b := FALSE; END_IF": "in line 3 is not drawn: an IF with ELSE",
    "FOR n := 1 TO 3 DO list[n] := a; END_FOR": "in line 3 is not drawn: FOR",
    "a := MAX(n, m) > 3 AND SEL(b, c, d);": "in line 3 is not drawn: a call in an expression",
    "RETURN;": "in line 3 is not drawn: RETURN",
}


@pytest.mark.slow
@each_of("body", RUNGS)
def test_a_statement_is_a_rung(body: str) -> None:
    assert steps(body)[0] == RUNGS[body]


@pytest.mark.slow
@each_of("body", REFUSED)
def test_what_is_no_rung_is_named_with_its_line_and_the_rest_is_drawn(body: str) -> None:
    assert steps(f"{body}\na := b;") == [REFUSED[body], "LD b; OUT a"]


@pytest.mark.slow
@each_of("dialect, body, said", [
    ("rusty", "IF n THEN a := TRUE; END_IF", "an expression that is not of BOOL"),
    ("codesys", "a := (b := c);", "this expression"),
    ("codesys", "a := b AND (c := d);", "this expression"),
])
def test_conditions_of_dialects_are_no_contacts(dialect: str, body: str, said: str) -> None:
    made = compile_text(f"PROGRAM Main VAR {DECLARED} END_VAR\n{body}\nEND_PROGRAM", drawn=True, lint=False, dialect=dialect)
    assert made.image is not None, made.errors[0].render()
    assert [rung.comment for rung in made.image.rungs] == [f"in line 3 is not drawn: {said}"]


LISTS = {
    "LD n\nST m\nST n": ["in line 3 is not drawn: an assignment that is not of BOOL"],
    "LD b\nOR( c\nAND d\n)\nORN e\nST a": ["LD b; LD c; AND d; ORLD; ORNOT e; OUT a"],
    "LD b\nANDN c\nS a\nST d\nSTN e\nR f": ["LD b; ANDNOT c; SET a; OUT d; OUTNOT e; RSET f"],
    "LD n\nGT 5\nAND( m\nEQ 1\n)\nST a\nLD b\nST c": ["LD> n 5; AND= m 1; OUT a", "LD b; OUT c"],
    "LD a\nST b\nCAL t(IN := b, PT := T#1s)\nLD t.Q\nST c": ["LD a; OUT b", "LD b; CALL TON t IN:= PT:=T#1s", "LD t.Q; OUT c"],
    "LD n\nADD 1\nST m\nLD a\nJMPC x\nLD b\nST c\nx: LD d\nST e": [
        "in line 3 is not drawn: an assignment that is not of BOOL",
        "in line 6 is not drawn: a jump, or a current result that is used again",
        "in line 8 is not drawn: an IF that does more than setting and resetting",
        "in line 10 is not drawn: a jump, or a current result that is used again", "LD d; OUT e"],
}


@pytest.mark.slow
@each_of("body", LISTS)
def test_an_instruction_list_is_drawn_as_the_rungs_that_it_stands_for(body: str) -> None:
    assert steps(body) == LISTS[body]


def test_power_at_several_coils_is_what_the_current_result_was() -> None:
    (made,) = executed("LD b\nANDN c\nST b\nSTN d", {"b": True, "c": True})
    assert made.states == {0: [True], 1: [False], 2: [False], 3: [False]}


def executed(body: str, on: dict[str, object]) -> list[RungExecution]:
    plc = Plc(image(body))
    power = PowerFlow(plc.image.rungs, lambda scan: True)
    for name, value in on.items():
        plc.write(f"Main.{name}", value)
    with observing(plc, power):
        plc.scan()
    return power.executed


def test_power_is_what_the_statement_saw() -> None:
    """The second statement changes what the first one read."""
    first, second = executed("a := b AND NOT c; b := FALSE;", {"b": True})
    assert first.states == {0: [True], 1: [True], 2: [True]}
    assert ladder_text(first.picture, annotations=Annotations(first.states))[1:] == dedent("""
        ┃   b      c        a   │
        ┣━━┫ ┣━━━━┫/┣━━━━━━( )━━┥
    """).strip("\n").split("\n")
    assert second.states == {0: [False], 1: [False]}


def test_comparisons_and_subscripts_are_observed_and_not_worked_out_again() -> None:
    on = {"n": 3, "m": 2, "list": [False, False, True, False], "c": True}
    (made,) = executed("a := NOT (n > 5) AND list[m] AND (b XOR c);", on)
    assert [(step[2], seen) for step, seen in zip(made.picture.steps, map(made.states.get, range(8)), strict=False)] == [
        ("LD<=", [True]), ("AND", [True]), ("LD", [False]), ("ANDNOT", [False]), ("LDNOT", [True]), ("AND", [True]),
        ("ORLD", None), ("ANDLD", None)]


def test_conditions_of_a_block_are_observed() -> None:
    (made,) = executed("k(CU := a AND b, CD := c, PV := n);", {"a": True, "c": True})
    assert made.states == {0: [True], 1: [False], 2: [True], 3: [False]}


@pytest.mark.slow
def test_drawing_changes_nothing_but_what_is_told() -> None:
    body = "\n".join(one + ";" for one in RUNGS)
    plain, drawn = (Plc(image(body, drawn)) for drawn in (False, True))
    for number in range(16):
        for plc in (plain, drawn):
            plc.write("Main.b", bool(number & 1))
            plc.write("Main.c", bool(number & 2))
            plc.write("Main.n", number % 4)
            plc.scan()
        assert bytes(plain.memory.map) == bytes(drawn.memory.map)
