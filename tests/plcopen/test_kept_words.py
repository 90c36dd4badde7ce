"""Declarations and rungs come back from a document word for word; what the format cannot say is named."""

from __future__ import annotations

import pytest
from rows import each_of
from test_round_trip import there_and_back

from fbvm.base.diagnostics import Source
from fbvm.interchange.plcopen.write.exporting import export_xml

DECLARED = """\
TYPE
Color : (Red, Green := 5, Blue);
END_TYPE
TYPE
Small : INT (-5..5) := 2;
END_TYPE
TYPE
Big : UINT (1..60000);
END_TYPE
TYPE
P : STRUCT
x : INT := 3;
y : REAL;
s : STRING[12];
w : WSTRING;
a : ARRAY[1..3, 0..1] OF BOOL;
END_STRUCT;
END_TYPE
TYPE
Q : STRUCT
p : P := (x := 4, y := 1.5);
n : ARRAY[0..4] OF INT := [2(7), 1, 2(9)];
END_STRUCT;
END_TYPE
VAR_GLOBAL RETAIN
g : INT := 5;
END_VAR
VAR_GLOBAL CONSTANT
k : REAL := 2.5;
END_VAR
FUNCTION F : DINT
VAR_INPUT
a : INT := 2;
END_VAR
VAR_OUTPUT
o : BOOL;
END_VAR
VAR_IN_OUT
io : INT;
END_VAR
VAR
t : TIME := T#5ms;
at_n : POINTER TO INT;
END_VAR
F := a * (a + 1);
o := a > 0;
END_FUNCTION
FUNCTION_BLOCK B
VAR_TEMP
a : LTIME;
END_VAR
a := LTIME#1s;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
in AT %IX0.3 : BOOL;
w AT %MW10 : WORD;
q : Q := (n := [5(1)]);
c : Color := Green;
both : B;
END_VAR
VAR_EXTERNAL
g : INT;
END_VAR
VAR RETAIN
r : INT; // kept
END_VAR
VAR CONSTANT
one : INT := 1;
END_VAR
r := F(a := one, o => in, io := r);
END_PROGRAM
CONFIGURATION Conf
RESOURCE Res ON PLC
TASK Fast(INTERVAL := T#10ms, PRIORITY := 1);
TASK Event(SINGLE := x, PRIORITY := 2);
PROGRAM One WITH Fast : Main;
PROGRAM Two : Main;
END_RESOURCE
END_CONFIGURATION
"""
HEAD = "PROGRAM Main\nVAR a, b, c, d, e, f, g : BOOL; n, m : INT; t : TON; END_VAR\nLADDER\n"
RUNGS = """\
RUNG 1 first
LD a
OR b
ANDNOT c
OUT d
RUNG 2
LD a
LD b
AND c
LD d
ANDNOT e
ORLD
ANDLD
OUT f
SET g
RUNG 3
LD a
OUT TR0
AND b
OUT c
LD TR0
ANDNOT d
RSET e
RUNG 4
@LD a
%AND b
OUT c
OUTNOT d
RUNG 5
LD a
AND>= n m
OUT b
RUNG 6
LD= n &5
OR b
OUT c
RUNG 7
LD a
FBCALL TON t IN:=c PT:=T#5ms Q=>b
OUT c
RUNG 8
LD P_On
MOV n m
RUNG 9
LD a
LD b
CNT 5 #10
RUNG 10
LD a
NOT
AND b
OUT c
RUNG 11
LD a
LDNOT b
LD c
AND d
ORLD
AND e
ORLD
OUT f
RUNG 12
LD a
@MOV &7 n
"""


def words(files: dict[str, str]) -> list[str]:
    return [" ".join(line.split()) for text in files.values() for line in text.splitlines() if line.strip()]


@pytest.mark.slow
def test_declarations_come_back_word_for_word() -> None:
    back = words(there_and_back(DECLARED).files)
    assert back == DECLARED.splitlines()


def test_an_enumeration_or_a_subrange_of_a_variable_gets_a_name_that_is_free() -> None:
    back = words(there_and_back("""TYPE Main_e : INT; END_TYPE
PROGRAM Main VAR e : (On, Off) := Off; n : INT (0..9); END_VAR ; END_PROGRAM
VAR_GLOBAL m : (One, Two); END_VAR""").files)
    for line in ("Main_e : INT;", "Main_e_2 : (On, Off);", "Main_n : INT (0..9);", "m_type : (One, Two);", "e : Main_e_2 := Off;",
                 "n : Main_n;", "m : m_type;"):  # fmt: skip
        assert line in back, back


def rungs(text: str) -> list[str]:
    back = words(there_and_back(f"{HEAD}{text}END_LADDER\nEND_PROGRAM\n").files)
    return back[back.index("LADDER") + 1 : back.index("END_LADDER")]


@pytest.mark.slow
def test_rungs_come_back_word_for_word() -> None:
    assert rungs(RUNGS) == RUNGS.splitlines()


@pytest.mark.slow
@each_of(("there", "back"), [
    ("LD a\nOUT b\nEND\n", ["LD a", "OUT b"]), ("LD a\nDIFU b\n", ["LD a", "DIFU b"]),
    ("LD a\nLD b\nKEEP c\n", ["LD a", "SET c", "RUNG 2", "LD b", "RSET c"]),
    ("LD a\nNOP\nOUT b\n", ["LD a", "OUT b"]), ("LD P_On\nAND a\nOUT b\n", ["LD a", "OUT b"]),
    ("LD a\nOR b\nOUT TR1\nAND c\nOUT d\nLD TR1\nAND e\nOUT f\n",
     ["LD a", "OR b", "OUT TR0", "AND c", "OUT d", "LD TR0", "AND e", "OUT f"]),
])  # fmt: skip
def test_a_rung_comes_back_in_the_words_that_diagrams_have(there: str, back: list[str]) -> None:
    assert [line for line in rungs(there) if line != "RUNG 1"] == back


def test_an_edge_inside_of_a_rung_becomes_a_block() -> None:
    back = words(there_and_back(f"{HEAD}LD a\nUP\nOUT b\nEND_LADDER\nEND_PROGRAM\n").files)
    assert "Edge1 : R_TRIG;" in back
    taken = words(there_and_back(HEAD.replace("t : TON", "Edge1 : TON") + "LD a\nUP\nOUT b\nEND_LADDER\nEND_PROGRAM\n").files)
    assert "Edge2 : R_TRIG;" in taken


def said(text: str) -> list[str]:
    return [found.message for found in export_xml([Source("Main.st", text)]).errors]


@each_of(("rung", "message"), [
    ("LD a\nDOWN\nOUT b", "DOWN"), ("@LDNOT a\nOUT b", "contact that is negated and has an edge"),
    ("LD P_On\nOR a\nOUT b", "wire that bridges contacts"), ("LD c\nLD a\nOR c\nKEEP c", "KEEP whose reset asks for its own bit"),
    ("LD a\nOUT TR0\nAND b\nLD TR0\nAND c\nCNT 5 #10", "CNT of which two inputs begin at a branch point"),
])  # fmt: skip
def test_what_diagrams_do_not_have_is_named(rung: str, message: str) -> None:
    assert said(f"{HEAD}{rung}\nEND_LADDER\nEND_PROGRAM")[0] == f"Main: ladder of PLCopen XML has no {message}"


@each_of(("text", "message"), [
    ("PROGRAM M VAR_INPUT a : BOOL R_EDGE; END_VAR END_PROGRAM", "M: the format has no R_EDGE and F_EDGE"),
    ("FUNCTION F : INT VAR_IN_OUT a : ARRAY[*] OF INT; END_VAR END_FUNCTION", "F: the format has no arrays of any length"),
    ("PROGRAM M VAR a : ARRAY[0..3] OF INT := [4()]; END_VAR END_PROGRAM", "M: the format cannot repeat a default value"),
    ("PROGRAM M VAR r : REF_TO INT; END_VAR END_PROGRAM", "M: the format has no type for REF_TO INT"),
    ("TYPE U : STRUCT OVERLAP a : INT; END_STRUCT; END_TYPE", "U: the format has no type for STRUCT OVERLAP a : INT; END_STRUCT"),
    ("NAMESPACE N END_NAMESPACE", "NAMESPACE and USING are not exported"),
    ("PROGRAM M VAR PUBLIC a : INT; END_VAR END_PROGRAM", "M: the format has no PUBLIC"),
    ("PROGRAM M END_PROGRAM CONFIGURATION C RESOURCE R ON PLC TASK T(PRIORITY := 1); PROGRAM P WITH T : M(a := b); "
     "END_RESOURCE END_CONFIGURATION", "C: connections and qualifiers of programs are not exported"),
    ("PROGRAM M END_PROGRAM CONFIGURATION C VAR_CONFIG R.P.a AT D100 : INT; END_VAR RESOURCE R ON PLC PROGRAM P : M; "
     "END_RESOURCE END_CONFIGURATION", "C: the address D100 in VAR_CONFIG is not exported"),
    ("ACTION M.a: END_ACTION", "the POU M of this action is not exported"),
])  # fmt: skip
def test_what_the_format_has_no_form_for_is_named(text: str, message: str) -> None:
    assert said(text) == [message]


def test_pragmas_and_addresses_that_are_lost_are_warnings() -> None:
    text = "{attribute 'displaymode' := 'hex'} " + HEAD + "LD 0.00\nOUT 100.01\nEND_LADDER\nEND_PROGRAM"
    made = export_xml([Source("Main.st", text)])
    assert [(found.code, found.severity) for found in made.diagnostics] == [("X0390", "warning")] * 2
    inside = export_xml([Source("Main.st", text.replace("VAR a", "VAR {info 'here'} a", 1))])
    assert [(found.code, found.severity) for found in inside.diagnostics] == [("X0190", "warning")] + [("X0390", "warning")] * 2


@each_of(("pragma", "code"), [
    ("info 'here'", "X0190"), (" region Pumps ", "X0190"), ("attribute 'hide'", "X0190"), ("", "X0190"),
    ("attribute 'qualified_only'", "X0301"), ("ATTRIBUTE 'Pack_Mode' := '1'", "X0301"), ("attribute 'pack_mode' := '3'", "X0301"),
    ("attribute 'odd'", "X0301"), ("odd", "X0301"), ("?", "X0301")])
def test_a_pragma_that_is_lost_is_an_error_if_it_changes_what_the_program_does(pragma: str, code: str) -> None:
    text = f"PROGRAM Main VAR a : BOOL; END_VAR {{{pragma}}} VAR b : BOOL; END_VAR a := b; END_PROGRAM"
    found, = export_xml([Source("Main.st", text)]).diagnostics
    assert (found.code, text[found.start : found.end], found.message) == \
        (code, f"{{{pragma}}}", f"the pragma {{{pragma.strip()}}} is not exported")
