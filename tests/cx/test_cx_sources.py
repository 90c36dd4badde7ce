"""Sources of a project of CX-Programmer: declarations of blocks, what programs see, and what is said of what is left out."""

from __future__ import annotations

from cx_text import DOUBLE, Cxt
from rows import each_of

from fbvm.code.compiler import compile_sources
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.imported import Imported

CALL = ("0|1|1|1|1|LD|P_On|1", "2|0|7|1|1|FBCALL|Dbl1|9", "1|2|8|1|1|FB_INPUT|D100|10", "4|2|8|1|1|FB_OUTPUT|D101|11", "1|1|3")
SETUP = "  Settings:=\n  BEGIN\n   Data:=\n$?St$Bk?_#[900]\n5A 5A\n$?St$Bk?_#[900]\n  END;"
PROTECTION = "Protection:=\nBEGIN\nEnabled:=1;\nEND;\n"


def imported(text: str) -> Imported:
    return import_project(text.encode("cp1252"), "line.cxt")


def lines(made: Imported, file: str) -> list[str]:
    """The lines of a source with single spaces, without empty ones."""
    return [" ".join(line.split()) for line in made.files[file].splitlines() if line.strip()]


def block(rows: str, cells: str = '[0]:="0,0,1,1,1,1,A, 1";\n[1]:="1,0,1,0,1,2,Q, 0";') -> Imported:
    """A project with a function block of one rung whose variables are these rows."""
    before, _, behind = DOUBLE.partition("<list>\n")
    _, _, body = behind.partition("</list>")
    head, _, end = body.partition("TotEl:=6;")
    tail = end[end.index("END;"):]
    return imported(Cxt(blocks=(f"{before}<list>\n{rows}\n</list>{head}TotEl:=2;\n{cells}\n{tail}",)).text)


LEFT_OUT = "function block DOUBLE: variable {} is not taken over: {}"
NO_VALUE = "function block DOUBLE: the initial value {} of {} is not taken over: it is no {}"


@each_of("rows, declared, messages", [
    ("1,A,0,,0,FALSE,0,first  one;\n2,Q,0,,0,,0,;",
     ["VAR_INPUT", "A : BOOL := FALSE; // first one", "END_VAR", "VAR_OUTPUT", "Q : BOOL;", "END_VAR", "LADDER"], []),
    ("0,a,0,,0,1,1,;\n0,b,1,,0,-3,0,;\n0,c,2,D5,0,+4,1,at;\n0,d,3,,0,2,0,;\n0,e,4,,2,7,1,two;\n0,f,8,,1,,0,;\n0,g,10,,0,-2.5,0,;\n"
     "0,h,11,,0,3,0,;\n0,i,0,,0,2,0,;\n0,j,0,,0,TRUE,0,;\n0,k,0,0.05,0,0,0,;\n0,l,9,,x,,0,;",
     ["VAR RETAIN", "a : BOOL := TRUE;", "c AT D5 : UINT := +4; // at", "e : ARRAY[0..1] OF UDINT; // two", "END_VAR",
      "VAR", "b : INT := -3;", "d : DINT := 2;", "f : ARRAY[0..0] OF DWORD;", "g : REAL := -2.5;", "h : LREAL := 3;",
      "i : BOOL := TRUE;", "j : BOOL := TRUE;", "k AT CIO 0.05 : BOOL := FALSE;", "l : LWORD;", "END_VAR", "LADDER"], []),
    ("1,A,5,W3,0,4,1,;\n2,Q,6,H1,0,5,1,;\n1,B,7,,0,6,1,;",
     ["VAR_INPUT", "A AT W3 : LINT;", "B : WORD := 6;", "END_VAR", "VAR_OUTPUT", "Q AT H1 : ULINT;", "END_VAR", "LADDER"], []),
    ("0,A,1,,0,2.5,0,;\n0,B,9,,0,x,0,;\n0,C,10,,0,1.,0,;\n0,D,0,,0,+1,0,;\n0,E,0,,0,-,0,;",
     ["VAR", "A : INT;", "B : LWORD;", "C : REAL;", "D : BOOL;", "E : BOOL;", "END_VAR", "LADDER"],
     [NO_VALUE.format(*row) for row in (("2.5", "A", "INT"), ("x", "B", "LWORD"), ("1.", "C", "REAL"), ("+1", "D", "BOOL"),
                                        ("-", "E", "BOOL"))]),
    ("0,A,13,,0,0,0,;\n0,B,14,C7,0,0,0,a \"b\" c;\n1,C,13,,0,0,0,;\n2,D,14,,0,0,0,;",
     ["LADDER", 'A,,TIMER,,,,"";', 'B,C7,COUNTER,,,,"a \'b\' c";'],
     [LEFT_OUT.format("C", "a TIMER as a pin is not emulated"), LEFT_OUT.format("D", "a COUNTER as a pin is not emulated")]),
    ("3,A,0,,0,0,0,;\n0,C,12,,0,0,0,;\n0,D,99,,0,0,0,;\n0,E,1,Q9,0,0,0,;\n0,F;", ["LADDER"],
     [LEFT_OUT.format("A", "the usage 3 is not known: it may be an in-out or an external"),
      LEFT_OUT.format("C", "the type number 12 is not known"), LEFT_OUT.format("D", "the type number 99 is not known"),
      LEFT_OUT.format("E", "'Q9' is not an address"), LEFT_OUT.format("F", "the type number  is not known")]),
    ("1,EN,0,,0,0,0,;\n0,while,0,,0,0,0,;\n2,1st A,1,,0,0,0,;",
     ["VAR_INPUT", "EN : BOOL := FALSE;", "END_VAR", "VAR", "while_1 : BOOL := FALSE;", "END_VAR",
      "VAR_OUTPUT", "_1st_A : INT := 0;", "END_VAR", "LADDER"], []),
], ids=lambda row: row[0])  # fmt: skip
def test_variables_of_a_function_block(rows: str, declared: list[str], messages: list[str]) -> None:
    made = block(rows)
    text = lines(made, "DOUBLE.st")
    assert text[1:text.index("RUNG 0 Y = X + X")] == declared
    assert [each.message for each in made.diagnostics] == messages


@each_of("body, sections", [
    ('[0]:="0,0,1,1,1,1,EN, 0";\n[1]:="1,0,1,0,1,2,ENO, 0";',
     ["VAR_OUTPUT", "ENO : BOOL;", "Q : BOOL := FALSE;", "END_VAR", "VAR_INPUT", "EN : BOOL := TRUE;", "END_VAR", "LADDER"]),
    ('[0]:="0,0,1,1,1,1,Q, 0";\n[1]:="1,0,1,0,1,2,Q, 0";', ["VAR_OUTPUT", "Q : BOOL := FALSE;", "END_VAR", "LADDER"]),
])  # fmt: skip
def test_a_block_that_asks_for_its_enable_has_it(body: str, sections: list[str]) -> None:
    text = lines(block("2,Q,0,,0,0,0,;", body), "DOUBLE.st")
    assert text[1:text.index("RUNG 0 Y = X + X")] == sections


@each_of("outside, inside, external", [
    ("Dbl1,,FUNCTION BLOCK,DOUBLE,A,", "", ["VAR_EXTERNAL", "Dbl1 : DOUBLE;", "END_VAR"]),
    ("", "Dbl1,,FUNCTION BLOCK,DOUBLE,A,", ["VAR", "Dbl1 : DOUBLE;", "END_VAR"]),
    ("Dbl1,,FUNCTION BLOCK,DOUBLE,A,", "Dbl1,,FUNCTION BLOCK,DOUBLE,A,", ["VAR", "Dbl1 : DOUBLE;", "END_VAR"]),
])  # fmt: skip
def test_a_program_calls_its_own_instance_and_not_the_global_one_of_its_name(
        outside: str, inside: str, external: list[str]) -> None:
    made = imported(Cxt(symbols=[outside] * bool(outside), local=[inside] * bool(inside), sections=(("Main", (CALL,)),),
                        blocks=(DOUBLE,)).text)
    text = lines(made, "NewProgram1.st")
    assert text[1:text.index("LADDER")] == external
    assert compile_sources(made.sources, runnable=True).errors == []


SETUP_SAID = "the PLC Setup (cycle time, startup mode) is not read: how it is stored is not known"


def test_a_message_names_the_pou_that_it_is_about() -> None:
    """Also behind a program or a block that is left out."""
    hidden, strange = DOUBLE.replace("POUHeader", f"{PROTECTION}POUHeader"), DOUBLE.replace('"FBLadder"', '"FBSt"')
    text = Cxt(symbols=("Bad,Q1,BOOL,,,", "Dbl1,,FUNCTION BLOCK,NONE,A,"), sections=(("Main", ("LD 0.00\nOUT 1.00",)),),
               plc_keys=SETUP, blocks=(hidden, strange)).text
    made = imported(text.replace("   TaskID", f"{PROTECTION}   TaskID"))
    assert sorted(each.message for each in made.diagnostics) == [
        "function block DOUBLE: the function block is not taken over: it is protected by a password",
        "function block DOUBLE: the function block is not taken over: its body is no ladder (FBSt)",
        "global symbols: symbol Bad is not taken over: 'Q1' is not an address",
        "global symbols: symbol Dbl1 is not taken over: there is no definition of the function block NONE",
        "program NewProgram1: the program is protected by a password and is not taken over", SETUP_SAID]
    assert list(made.files) == []
