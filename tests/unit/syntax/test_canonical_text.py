"""Canonical text of charts, objects, tables of symbols and types: each piece once; the layout was read by a person."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.syntax import tree
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.parser import parse

CHART = """\
PROGRAM p VAR x,y:BOOL; END_VAR
initial_step a: x(n); y(l,t#5s,x);act(p1); z(); end_step step b:end_step
transition t1(priority:=2) from a to b:=x and not y; end_transition
transition from b to (a,c):=x;end_transition
transition nam from (a,b) to c: nam:=x; end_transition
step c: end_step action act: x:=not x; end_action action two: y:=x; end_action
end_program"""
LAID_OUT_CHART = """\
PROGRAM p
VAR
    x, y : BOOL;
END_VAR

INITIAL_STEP a:
    x(N);
    y(L, T#5s, x);
    act(P1);
    z();
END_STEP

STEP b:
END_STEP

TRANSITION t1 (PRIORITY := 2) FROM a TO b := x AND NOT y;
END_TRANSITION

TRANSITION FROM b TO (a, c) := x;
END_TRANSITION

TRANSITION nam FROM (a, b) TO c:
    nam := x;
END_TRANSITION

STEP c:
END_STEP

ACTION act:
    x := NOT x;
END_ACTION

ACTION two:
    y := x;
END_ACTION
END_PROGRAM
"""
SPELLING = """\
VAR_GLOBAL Level : INT; END_VAR
PROGRAM p VAR_EXTERNAL LEVEL : INT; END_VAR VAR Own : INT; END_VAR level := OWN + 1; OWN := lEVEL; END_PROGRAM
FUNCTION_BLOCK fb VAR_INPUT In : INT; END_VAR METHOD M : INT VAR_INPUT In : REAL; END_VAR M := in; END_METHOD END_FUNCTION_BLOCK
INTERFACE I METHOD Go : BOOL END_METHOD END_INTERFACE
"""
LAID_OUT_SPELLING = """\
VAR_GLOBAL
    Level : INT;
END_VAR

PROGRAM p
VAR_EXTERNAL
    Level : INT;
END_VAR
VAR
    Own : INT;
END_VAR
    Level := Own + 1;
    Own := Level;
END_PROGRAM

FUNCTION_BLOCK fb
VAR_INPUT
    In : INT;
END_VAR

    METHOD M : INT
    VAR_INPUT
        In : REAL;
    END_VAR
        M := In;
    END_METHOD
END_FUNCTION_BLOCK

INTERFACE I
    METHOD Go : BOOL
    END_METHOD
END_INTERFACE
"""
RUNGS = """\
PROGRAM p VAR a : BOOL; END_VAR
LADDER
SECTION one
n,100.01,BOOL,,,,"says";
m,D5,UINT,,,,"";
RUNG 5 hello
' note
LD a
OUT n
RUNG
LD n
OUT 1.00
END_LADDER
END_PROGRAM"""
LAID_OUT_RUNGS = """\
PROGRAM p
VAR
    a : BOOL;
END_VAR
    LADDER
    SECTION one

    n,100.01,BOOL,,,,"says";
    m,D5,UINT,,,,"";
    RUNG 5 hello
        ' note
        LD      a
        OUT     n
    RUNG
        LD      n
        OUT     1.00
    END_LADDER
END_PROGRAM
"""
DECLARATIONS = """\
TYPE a : STRUCT x : INT; // one
yy : REAL := 1.0; (* two *) END_STRUCT;
b : ARRAY [0..3] OF INT := [1,2,3,4]; c : (one, two := 5) := two; d : INT (0..5); e : REF_TO INT; f : STRING [20] := 'a'; END_TYPE
CONFIGURATION c
VAR_GLOBAL g : INT; END_VAR RESOURCE r ON PLC TASK t (INTERVAL := T#5ms, PRIORITY := 1);
PROGRAM p1 WITH t : p (a := g, b => g); END_RESOURCE
VAR_CONFIG r.p1.x AT %QX0.0 : BOOL; END_VAR END_CONFIGURATION
FUNCTION_BLOCK fb EXTENDS base IMPLEMENTS i, j VAR PRIVATE x : INT; END_VAR
METHOD PUBLIC m : INT VAR_INPUT a : INT; END_VAR m := a; END_METHOD
PROPERTY q : INT GET q := x; END_GET SET x := q; END_SET END_PROPERTY
x := 1;
END_FUNCTION_BLOCK
NAMESPACE n USING k, m; FUNCTION z : INT z := 1; END_FUNCTION FUNCTION y : INT END_FUNCTION END_NAMESPACE"""
LAID_OUT_DECLARATIONS = """\
TYPE
    a : STRUCT
        x  : INT;  // one
        yy : REAL := 1.0;
    (* two *) END_STRUCT;
    b : ARRAY[0..3] OF INT := [1, 2, 3, 4];
    c : (one, two := 5) := two;
    d : INT (0..5);
    e : REF_TO INT;
    f : STRING[20] := 'a';
END_TYPE

CONFIGURATION c
    VAR_GLOBAL
        g : INT;
    END_VAR
    RESOURCE r ON PLC
        TASK t(INTERVAL := T#5ms, PRIORITY := 1);
        PROGRAM p1 WITH t : p(a := g, b => g);
    END_RESOURCE
    VAR_CONFIG
        r.p1.x AT %QX0.0 : BOOL;
    END_VAR
END_CONFIGURATION

FUNCTION_BLOCK fb EXTENDS base IMPLEMENTS i, j
VAR PRIVATE
    x : INT;
END_VAR

    METHOD PUBLIC m : INT
    VAR_INPUT
        a : INT;
    END_VAR
        m := a;
    END_METHOD

    PROPERTY q : INT
        GET
            q := x;
        END_GET
        SET
            x := q;
        END_SET
    END_PROPERTY

    x := 1;
END_FUNCTION_BLOCK

NAMESPACE n
USING k, m;

FUNCTION z : INT
    z := 1;
END_FUNCTION

FUNCTION y : INT
END_FUNCTION
END_NAMESPACE
"""


@pytest.mark.parametrize(("text", "laid_out"), [
    (CHART, LAID_OUT_CHART), (SPELLING, LAID_OUT_SPELLING), (RUNGS, LAID_OUT_RUNGS), (DECLARATIONS, LAID_OUT_DECLARATIONS),
], ids=["chart", "spelling", "rungs", "declarations"])  # fmt: skip
def test_canonical_text(text: str, laid_out: str) -> None:
    assert formatted(Source("x.st", text)) == (laid_out, [])
    assert formatted(Source("x.st", laid_out)) == (laid_out, [])


def test_what_follows_the_body_of_a_program_stands_apart() -> None:
    text, _ = formatted(Source("x.st", "PROGRAM p x := 1; ACTION a: y := 2; END_ACTION ACTION b: END_ACTION END_PROGRAM"))
    assert text == """\
PROGRAM p
    x := 1;

ACTION a:
    y := 2;
END_ACTION

ACTION b:
END_ACTION
END_PROGRAM
"""


# --- trees and messages -----------------------------------------------------------------------------------------------


def body(text: str) -> tuple[list[tree.Statement], list[str]]:
    found, wrong = parse(Source("x.st", f"PROGRAM p {text} END_PROGRAM"))
    [pou] = found.declarations
    assert isinstance(pou, tree.Pou)
    return list(pou.body), [each.message for each in wrong]


def test_s_sets_behind_an_operand_and_is_a_name_elsewhere() -> None:
    [one, other, third], wrong = body("a S= b; y := S=b; IF S=1 THEN S:=2; END_IF")
    assert wrong == [] and isinstance(one, tree.Assign) and one.op == "S="
    assert isinstance(other, tree.Assign) and isinstance(other.value, tree.Binary) and other.value.op == "="
    assert isinstance(third, tree.If)


@each_of(("part", "is_one"), [
    ("w.0", True), ("w.123456789", True), ("w.1234567890", False), ("w.%X3", True), ("w.%B1", True), ("w.%B1234567890", False),
])  # fmt: skip
def test_a_part_of_a_variable_has_a_number_of_nine_digits_at_most(part: str, is_one: bool) -> None:
    _, wrong = body(f"x := {part};")
    assert (wrong == []) is is_one
    assert is_one or "is no part of a variable" in wrong[0]


@each_of(("text", "message"), [
    ("x := SIZEOF(ARRAY [0..9] OF INT);", "a type that is written out is no argument"),
    ("x := ARRAY;", "an expression expected, but `ARRAY` found"),
    ("x := (IF);", "an expression expected, but `IF` found"),
])  # fmt: skip
def test_a_type_in_place_of_a_value(text: str, message: str) -> None:
    assert body(text)[1][0] == message
