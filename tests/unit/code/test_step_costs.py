"""What regions of a program charge to the step budget, and that it ends every loop after the same work on every engine."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native

ENGINES = ["python", "native"] if native.available() else ["python"]


def image_of(declarations: str, body: str, more: str = "") -> Image:
    compilation = compile_text(f"{more}\nPROGRAM Main\nVAR\n{declarations}\nEND_VAR\n{body}\nEND_PROGRAM\n")
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


def charges(item: Any) -> list[int]:
    """The steps of each `charge` in a piece of code, in the order of writing."""
    if not isinstance(item, tuple):
        return []
    if len(item) == 3 and item[0] == "charge":
        return [item[1]]
    return [count for part in item for count in charges(part)]


def charged(declarations: str, body: str, more: str = "") -> list[int]:
    return charges(next(body.code for body in image_of(declarations, body, more).bodies if body.name == "Main"))


NUMBERS = "a, b : INT; s, t : STRING; r : REAL; i : INT;"


@each_of(("body", "expected"), [
    ("a := b;", [2]),
    ("a := b; IF a > 1 THEN a := 1; b := 2; ELSE a := 3; END_IF;", [6]),
    ("a := (a + b) * (a - b) / (a * a + b * b + 1);", [2]),
    ("s := t;", [2]),
    ("WHILE a < 10 DO a := a + 1; b := b + a; END_WHILE;", [2, 3]),
    ("FOR i := 1 TO 3 DO REPEAT a := a + 1; UNTIL a > 5 END_REPEAT; END_FOR;", [2, 2, 2]),
])  # fmt: skip
def test_ordinary_statements_are_steps(body: str, expected: list[int]) -> None:
    assert charged(NUMBERS, body) == expected


@pytest.mark.slow
@each_of(("declarations", "body", "expected"), [
    ("a, b : ARRAY[1..1_000_000] OF DINT;", "a := b;", [2, 3906]),
    ("a, b : ARRAY[1..2000] OF INT;", "a := b;", [4]),
    ("a, b : ARRAY[1..2000] OF INT; c : BOOL;", "IF c THEN a := b; END_IF;", [4]),
    ("a, b : ARRAY[1..1_000_000] OF DINT; c : BOOL;", "IF c THEN a := b; END_IF; c := TRUE;", [4, 3906]),
    ("a, b : ARRAY[1..1_000_000] OF DINT;", "WHILE TRUE DO a := b; END_WHILE;", [2, 2, 3906]),
    ("a : INT; s, t : STRING[65_534];", "a := FIND(s, t);", [2, 1280]),
    ("s, t : STRING[65_534];", "s := t;", [2, 256]),
    ("s, t : WSTRING[65_534];", "s := t;", [2, 512]),
    ("b : BOOL; s, t : STRING[20_000];", "b := s = t;", [2, 156]),
    ("b : BOOL; s, t : STRING[20_000];", "s := SEL(b, s, t);", [2, 234]),
    ("s, t : STRING[20_000];", "s := MAX(s, t);", [2, 234]),
    ("a : INT; s, t : STRING[65_534];", "CASE a OF 1: s := t; END_CASE;", [3, 256]),
])  # fmt: skip
def test_work_is_charged_by_its_size(declarations: str, body: str, expected: list[int]) -> None:
    assert charged(declarations, body) == expected


@each_of(("body", "expected"), [
    ("s := CONCAT(s, t);", [3]),
    ("s := LEFT(RIGHT(s, 5), 3);", [5]),
    ("s := REAL_TO_STRING(r);", [8]),
    ("IF a > 1 THEN s := INT_TO_STRING(a); END_IF;", [8]),
    ("a := STRING_TO_INT(s);", [2, 32]),
    ("r := SIN(r) + COS(r) + EXP(r);", [2]),
    ("r := SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(SIN(r))))))))))))))))))));", [3]),
])  # fmt: skip
def test_functions_that_take_longer_than_a_statement_charge_for_that(body: str, expected: list[int]) -> None:
    assert charged(NUMBERS, body) == expected


@pytest.mark.slow
def test_long_expressions_are_more_than_a_step() -> None:
    assert charged("a : DINT; b : DINT;", f"a := {' + '.join(['b'] * 1000)};")[0] > 50


def test_initial_values_of_a_call_are_charged() -> None:
    function = "FUNCTION F : INT\nVAR a : ARRAY[1..100_000] OF INT; END_VAR\nF := a[1];\nEND_FUNCTION"
    bodies = {body.name: charges(body.code) for body in image_of("x : INT;", "x := F();", function).bodies}
    assert bodies["F"] == [2, 195]


@pytest.mark.slow
def test_a_large_statement_charges_where_it_stands_in_the_source() -> None:
    image = image_of("a, b : ARRAY[1..1_000_000] OF DINT; n : INT;", "n := 1;\na := b;")
    large = [node for body in image.bodies for node in body.code if node[0] == "charge" and node[1] > 1000]
    assert [image.sites[node[2]].line for node in large] == [7]


ENDLESS = {
    "copies": ("a, b : ARRAY[0..7_000_000] OF DINT;", "a := b;"),
    "copies of structures": ("a, b : Big;", "a := b;"),
    "text that is searched": ("s, t : STRING[65_534]; p : INT;", "p := FIND(s, t);"),
    "wide text that is searched": ("s, t : WSTRING[65_534]; p : INT;", "p := FIND(s, t);"),
    "text that is compared": ("s, t : STRING[65_534]; b : BOOL;", "b := s < t;"),
    "text that is put together": ("s, t : STRING[65_534];", "s := CONCAT(s, t);"),
    "text that is cut": ("s : STRING[65_534];", "s := DELETE(s, 1, 1);"),
    "text that is read": ("s : STRING[65_534] := '1'; n : LREAL;", "n := STRING_TO_LREAL(s);"),
    "short text that is read": ("s : STRING := 'T#1h2m'; t : TIME;", "t := STRING_TO_TIME(s);"),
    "values that are written": ("s : STRING; r : REAL := 1.5;", "s := CONCAT(REAL_TO_STRING(r), REAL_TO_STRING(-r));"),
    "initial values": ("x : INT;", "x := Fresh();"),
    "a long expression": ("x : DINT;", f"x := {' + '.join(['x'] * 900)};"),
}
"""What is done for ever: declarations, and the statement."""
MORE = """
TYPE Big : STRUCT a : ARRAY[1..1_000_000] OF LINT; END_STRUCT; END_TYPE
FUNCTION Fresh : INT
VAR a : ARRAY[1..1_000_000] OF INT := [1_000_000(7)]; END_VAR
Fresh := a[1];
END_FUNCTION
"""


@pytest.mark.slow
@pytest.mark.parametrize("what", ENDLESS)
def test_every_engine_ends_an_endless_loop_after_the_same_work(what: str) -> None:
    declarations, statement = ENDLESS[what]
    image = image_of(declarations + " passes : DINT;", f"WHILE TRUE DO passes := passes + 1; {statement} END_WHILE;", MORE)
    ends = []
    for engine in ENGINES:
        plc = Plc(image, engine=engine, budget=20_000)
        trap = plc.scan()
        assert trap is not None
        assert trap.code == "R0104"
        ends.append((plc.read("Main.passes"), str(trap)))
    assert len(set(ends)) == 1
    assert ends[0][0] < 2_000

