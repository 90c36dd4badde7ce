"""What is said of heads of POUs and of what stands around their bodies, word for word, and that nothing follows from it."""

from __future__ import annotations

from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.check.instructions import _wrapped
from fbvm.code.compiler.driver import compile_sources, compile_text

G = "FUNCTION_BLOCK G END_FUNCTION_BLOCK\n"
NOTHING = "extends and implements nothing"
HOME = "it stands in or behind a FUNCTION_BLOCK or PROGRAM, or names it: ACTION Motor.Reset"
MAIN = "PROGRAM Main VAR i : INT; END_VAR"


@each_of("text, said", [
    (f"{G}PROGRAM Main EXTENDS G END_PROGRAM", [("S1001", 2, f"a PROGRAM {NOTHING}", "make it a FUNCTION_BLOCK")]),
    (f"{G}FUNCTION F : INT EXTENDS G\nF := 1; END_FUNCTION", [("S1001", 2, f"a FUNCTION {NOTHING}", "")]),
    ("INTERFACE I END_INTERFACE\nPROGRAM Main IMPLEMENTS I END_PROGRAM",
     [("S1001", 2, f"a PROGRAM {NOTHING}", "make it a FUNCTION_BLOCK")]),
    (f"{G}FUNCTION_BLOCK H EXTENDS G, G2 END_FUNCTION_BLOCK\nFUNCTION_BLOCK G2 END_FUNCTION_BLOCK",
     [("S1001", 2, "H extends G already", "a block has one base; of interfaces it may implement several")]),
    ("FUNCTION_BLOCK FINAL D METHOD M END_METHOD END_FUNCTION_BLOCK\nFUNCTION_BLOCK E EXTENDS D SUPER^.M(); x := 1;\n"
     "END_FUNCTION_BLOCK", [("S1002", 2, "D is FINAL and cannot be extended", "")]),
    ("FUNCTION_BLOCK E EXTENDS Nobody SUPER^(); x := 1; END_FUNCTION_BLOCK",
     [("S1001", 1, "there is no FUNCTION_BLOCK or CLASS Nobody", "")]),
    ("FUNCTION_BLOCK B\nVAR_GENERIC k : INT := 1; END_VAR END_FUNCTION_BLOCK",
     [("S0206", 2, "VAR_GENERIC is CONSTANT", "write VAR_GENERIC CONSTANT")]),
    ("FUNCTION_BLOCK B\nVAR_GENERIC RETAIN k : INT := 1; END_VAR END_FUNCTION_BLOCK",
     [("S0206", 2, "VAR_GENERIC is CONSTANT", "write VAR_GENERIC CONSTANT")]),
    ("FUNCTION_BLOCK B\nVAR_GENERIC CONSTANT k : INT := 1; l : LREAL := 1.0; END_VAR END_FUNCTION_BLOCK",
     [("S0205", 2, "LREAL is no type of a generic constant", "its type is an integer, or a subrange of one")]),
    ("FUNCTION_BLOCK B\nVAR_GENERIC CONSTANT k : INT(1..5) := 1; END_VAR END_FUNCTION_BLOCK", []),
    (f"{MAIN}\nVAR_CONFIG a.b AT %QX0.0 : BOOL; END_VAR\nEND_PROGRAM",
     [("S0901", 2, "VAR_CONFIG of a POU is understood but not executed by this version", "")]),
    ("FUNCTION_BLOCK F\nVAR_ACCESS x : a.b : BOOL READ_ONLY; END_VAR END_FUNCTION_BLOCK",
     [("S0901", 2, "VAR_ACCESS of a POU is understood but not executed by this version", "")]),
    ("ACTION A: ; END_ACTION\nPROGRAM Main END_PROGRAM", [("S0205", 1, "the ACTION A belongs to no block or program", HOME)]),
    ("FUNCTION F : INT F := 1; END_FUNCTION\nACTION F.A: ; END_ACTION",
     [("S0205", 2, "the ACTION A belongs to no block or program", HOME)]),
    ("ACTIONS Nix\nACTION A: ; END_ACTION END_ACTIONS",
     [("S0205", 2, "the ACTION A belongs to no block or program", "there is no POU Nix")]),
    (f"{MAIN} i := Nix#a; END_PROGRAM", [("S0204", 1, "there is no enumeration Nix", "")]),
    ("VAR_GLOBAL g : ARRAY [0..2000000000] OF LREAL; END_VAR\nPROGRAM Main g[0] := 1.0; END_PROGRAM",
     [("S0603", 1, "the array takes more than 64 MiB", "")]),
    ("TYPE S : STRUCT\na : ARRAY [1..40000000] OF BYTE;\nb : ARRAY [1..40000000] OF BYTE;\nEND_STRUCT END_TYPE\n"
     "PROGRAM Main END_PROGRAM",
     [("S0603", 3, "the structure takes more than 64 MiB", "")]),
])
def test_a_head_that_is_wrong_has_one_message(text: str, said: list[tuple[str, int, str, str]]) -> None:
    errors = compile_text(text, dialect="codesys").errors
    assert [(each.code, each.line, each.message, each.hint) for each in errors] == said


def test_a_second_configuration_is_shown_beside_the_first() -> None:
    run = "RESOURCE R ON PLC TASK T(INTERVAL := T#10ms, PRIORITY := 1); PROGRAM P WITH T : Main; END_RESOURCE END_CONFIGURATION"
    first = Source("first.st", f"PROGRAM Main END_PROGRAM\nCONFIGURATION First {run}")
    [error] = compile_sources([first, Source("second.st", f"CONFIGURATION Second {run}")]).errors
    assert (error.source.name, error.code, error.line, error.message, error.hint) == \
        ("second.st", "S0801", 1, "there is a second CONFIGURATION", "a project has one")  # fmt: skip
    assert error.related is not None
    assert (error.related[0].name, first.place(error.related[1]), error.related[2]) == ("first.st", (2, 15), "the first")


@each_of("text, width, lines", [
    ("", 6, [""]), ("a bb ccc", 6, ["a bb", "ccc"]), ("aaa bb", 6, ["aaa bb"]), ("aaaa bb", 6, ["aaaa", "bb"]),
    ("aaa  bb\nc", 100, ["aaa bb c"]),
])
def test_pages_of_instructions_are_broken_between_words(text: str, width: int, lines: list[str]) -> None:
    assert _wrapped(text, width) == lines
