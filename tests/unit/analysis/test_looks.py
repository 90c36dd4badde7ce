"""What a file holds and how it looks: outline, folding, lenses, colours, addresses behind names."""

from __future__ import annotations

from functools import cache

from rows import each_of

from fbvm.analysis.outline import Symbol, folds, lenses, outline
from fbvm.analysis.program import Program
from fbvm.analysis.tokens import address_hints, tokens

PLANT = """\
TYPE Mode : (Off, Filling); END_TYPE

(* moves
   water *)
FUNCTION_BLOCK Pump
VAR_INPUT Level : INT; END_VAR
VAR_OUTPUT Runs : BOOL; END_VAR
    IF Level > 3 THEN
        Runs := TRUE;
    END_IF
END_FUNCTION_BLOCK

PROGRAM Main
VAR
    P1 : Pump; Words AT D100 : ARRAY [1..4] OF INT; Lamp AT %QX0.0 : BOOL; m : Mode; x : INT;
END_VAR
    P1(Level := Words[3]);
    Lamp := P1.Runs AND m = Filling;
    x := ABS(Words[x]);
LADDER
RUNG the lamp again
LD P1.Runs
OUT Lamp
END_LADDER
END_PROGRAM
"""


@cache
def plant(name: str = "pump.st", text: str = PLANT) -> Program:
    program = Program()
    program.replace(name, text)
    program.check_all()
    return program


def tree_of(symbols: list[Symbol]) -> list[tuple[str, str, list[str]]]:
    return [(symbol.kind, symbol.name, [each.name for each in symbol.children]) for symbol in symbols]


def test_the_outline_has_declarations_variables_and_rungs() -> None:
    assert tree_of(outline(plant().files["pump.st"])) == [
        ("TYPE", "Mode", ["Off", "Filling"]), ("FUNCTION_BLOCK", "Pump", ["Level", "Runs"]),
        ("PROGRAM", "Main", ["P1", "Words", "Lamp", "m", "x", "rung 1 the lamp again"])]


def test_the_outline_has_actions_and_steps() -> None:
    text = """\
PROGRAM Main
INITIAL_STEP Wait: END_STEP
STEP Work: Count(N); END_STEP
TRANSITION FROM Wait TO Work := TRUE; END_TRANSITION
TRANSITION FROM Work TO Wait := TRUE; END_TRANSITION
ACTION Count: ; END_ACTION
END_PROGRAM
"""
    assert tree_of(outline(plant(text=text).files["pump.st"])) == [("PROGRAM", "Main", ["Wait", "Work", "Count"])]


def test_the_outline_has_what_stands_around_programs() -> None:
    text = """\
NAMESPACE Plant
FUNCTION Twice : INT
VAR_INPUT x : INT; END_VAR
    Twice := 2 * x;
END_FUNCTION
END_NAMESPACE
TYPE Tank : STRUCT Level, Old : INT; State : ARRAY [0..1]
    OF INT; END_STRUCT; END_TYPE
VAR_GLOBAL CONSTANT Top : INT := 9; END_VAR
PROGRAM Main
END_PROGRAM
ACTIONS Main
ACTION Stop: ; END_ACTION
END_ACTIONS
CONFIGURATION C
    VAR_GLOBAL Shared : INT; END_VAR
    RESOURCE R ON PLC
        TASK T(INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM Run WITH T : Main;
    END_RESOURCE
END_CONFIGURATION
"""
    found = outline(plant(text=text).files["pump.st"])
    assert tree_of(found) == [
        ("NAMESPACE", "Plant", ["Twice"]), ("TYPE", "Tank", ["Level", "Old", "State"]), ("VAR_GLOBAL", "VAR_GLOBAL", ["Top"]),
        ("PROGRAM", "Main", []), ("ACTION", "Stop", []), ("CONFIGURATION", "C", ["Shared", "T", "Run"])]
    assert [(each.kind, each.detail) for symbol in (found[0], found[1], found[2], found[5]) for each in symbol.children] == [
        ("FUNCTION", "INT"), ("member", "INT"), ("member", "INT"), ("member", "ARRAY [0..1] OF INT"),
        ("constant", "INT (VAR_GLOBAL)"), ("variable", "INT (VAR_GLOBAL)"), ("task", ""), ("instance", "Main")]
    assert [text[each.name_start:each.name_end] for each in found] == ["Plant", "Tank", "VAR_GLOBAL", "Main", "Stop", "C"]


def test_regions_and_comments_of_several_lines_can_be_folded() -> None:
    text = """\
PROGRAM Main
{region 'one'}
    ; (* a
         b *)
{region 'two'}
    ;
{endregion}
{endregion}
{endregion}
END_PROGRAM
"""
    found = [(each.first + 1, each.last + 1, each.kind) for each in folds(plant(text=text).files["pump.st"])]
    assert found == [(1, 10, ""), (2, 8, "region"), (3, 4, "comment"), (5, 7, "region")]


def test_what_has_several_lines_can_be_folded() -> None:
    found = [(each.first + 1, each.last + 1, each.kind) for each in folds(plant().files["pump.st"])]
    assert found == [(3, 4, "comment"), (5, 11, ""), (8, 10, ""), (13, 25, ""), (14, 16, ""), (20, 24, ""), (21, 23, "")]


def test_programs_have_words_above_them_and_tests_have_others() -> None:
    assert [(each.command, each.name) for each in lenses(plant().files["pump.st"])] == [
        ("run", "Main"), ("debug", "Main"), ("chart", "Main")]
    assert [each.command for each in lenses(plant("test_pump.st").files["test_pump.st"])] == ["test", "debug test"]


def test_names_have_colours_by_what_they_are() -> None:
    program = plant()
    found = {(PLANT[each.start:each.end], each.type, *sorted(each.modifiers))
             for each in tokens(program, program.files["pump.st"])}
    assert {("Pump", "class", "declaration"), ("Level", "parameter", "modification"), ("ABS", "function", "defaultLibrary"),
            ("Filling", "enumMember"), ("Mode", "type"), ("D100", "macro"), ("Lamp", "variable", "modification"),
            ("Runs", "parameter"), ("m", "variable")} <= found


def test_addresses_stand_behind_names_and_elements() -> None:
    program = plant()
    hints = address_hints(program, program.files["pump.st"], 0, len(PLANT))
    assert [(PLANT[each.at - 4:each.at], each.text) for each in hints][:2] == [("s[3]", "D102"), ("Lamp", "%QX0.0")]
    assert all(each.text != "D100" for each in hints), "an element whose number is not known has no address"


def test_names_of_programs_blocks_actions_and_functions_have_their_colours() -> None:
    text = ("FUNCTION_BLOCK B\nVAR n : INT; END_VAR\nACTION Stop: n := 0; END_ACTION\nEND_FUNCTION_BLOCK\n"
            "FUNCTION F : INT F := 1; END_FUNCTION\n"
            "PROGRAM Main VAR b : B; i : INT; END_VAR b(); b.Stop(); i := F() + i; END_PROGRAM\n")
    file = plant(text=text)
    colours = {(text[each.start:each.end], each.type) for each in tokens(file, file.files["pump.st"])}
    assert {("B", "class"), ("Stop", "method"), ("F", "function"), ("Main", "class"), ("b", "variable")} <= colours
    assert not {("Stop", "class"), ("B", "method"), ("F", "class")} & colours


COLOURS = """\
TYPE Mode : (Off, On); Tank : STRUCT Level : INT; END_STRUCT; END_TYPE
VAR_GLOBAL CONSTANT Top : INT := 9; END_VAR
VAR_GLOBAL Shared : INT; END_VAR
FUNCTION_BLOCK Pump
VAR_INPUT In : INT; END_VAR
VAR_OUTPUT Out : INT; END_VAR
VAR_IN_OUT Both : INT; END_VAR
VAR CONSTANT Deep : INT := 3; END_VAR
VAR T1 : Tank; END_VAR
METHOD Turn : INT
    Turn := Deep;
END_METHOD
PROPERTY Speed : INT
GET Speed := Top; END_GET
END_PROPERTY
T1.Level := In;
ACTION Stop: Out := Shared; END_ACTION
END_FUNCTION_BLOCK
FUNCTION Twice : INT
VAR_INPUT x : INT; END_VAR
END_FUNCTION
PROGRAM Main
VAR P1 : Pump; m : Mode; t : TON; a AT D10 : INT; END_VAR
P1(); P1.Stop(); a := P1.Turn(); a := P1.Speed; t(IN := TRUE); m := On; a := Twice(ABS(a)); %MW7 := a;
LADDER
LD P_On
MOV D3 D200
END_LADDER
END_PROGRAM
"""


@each_of("line, colours", [
    (1, "Mode:type declaration, Off:enumMember declaration, On:enumMember declaration, Tank:type declaration, "
        "Level:property declaration"),
    (2, "Top:variable declaration readonly static"), (3, "Shared:variable declaration static"), (4, "Pump:class declaration"),
    (5, "In:parameter declaration"), (6, "Out:parameter declaration"), (7, "Both:parameter declaration"),
    (8, "Deep:variable declaration readonly"), (9, "T1:variable declaration, Tank:type"), (10, "Turn:method declaration"),
    (11, "Turn:method modification, Deep:variable readonly"), (13, "Speed:property declaration"),
    (14, "Speed:property modification, Top:variable readonly static"),
    (16, "T1:variable, Level:property modification, In:parameter"),
    (17, "Stop:method declaration, Out:parameter modification, Shared:variable static"), (19, "Twice:function declaration"),
    (20, "x:parameter declaration"), (22, "Main:class declaration"),
    (23, "P1:variable declaration, Pump:class, m:variable declaration, Mode:type, t:variable declaration, "
         "TON:class defaultLibrary, a:variable declaration, D10:macro"),
    (24, "P1:variable, P1:variable, Stop:method, a:variable modification, P1:variable, Turn:method, a:variable modification, "
         "P1:variable, Speed:property, t:variable, IN:parameter defaultLibrary modification, m:variable modification, "
         "On:enumMember, a:variable modification, Twice:function, ABS:function defaultLibrary, a:variable, %MW7:macro, "
         "a:variable"),
    (26, ""), (27, ""),
])
def test_each_name_of_a_text_has_one_colour(line: int, colours: str) -> None:
    program = plant(text=COLOURS)
    source, found = program.files["pump.st"].source, tokens(program, program.files["pump.st"])
    assert ", ".join(f"{COLOURS[each.start:each.end]}:{' '.join([each.type, *sorted(each.modifiers)])}" for each in found
                     if source.place(each.start)[0] == line) == colours


@each_of("declared, body, shown", [
    ("a AT D5 : INT; b : INT;", "a := b;", ["a D5"]), ("a AT D5.3 : BOOL;", "a := TRUE;", ["a D5.03"]),
    ("a AT D100 : ARRAY [1..4] OF INT;", "a[1] := a[4];", ["] D100", "] D103"]),
    ("a AT D100 : ARRAY [-1..1] OF WORD;", "a[-1] := a[1];", ["] D100", "] D102"]),
    ("a AT CIO 5 : ARRAY [0..2] OF INT;", "a[1] := 1;", ["] CIO 6"]),
    ("a AT %MW4 : ARRAY [0..3] OF INT;", "a[2] := 0;", ["] %MW6"]),
    ("a AT D1 : ARRAY [0..1] OF DINT;", "a[1] := 0;", []), ("a AT D1 : ARRAY [0..3] OF SINT;", "a[1] := 0;", []),
    ("a AT D1 : ARRAY [0..1, 0..1] OF INT;", "a[1, 1] := 0;", []),
    ("a AT %MD4 : ARRAY [0..3] OF INT;", "a[2] := 0;", []), ("a AT %MB4 : ARRAY [0..3] OF INT;", "a[2] := 0;", []),
    ("a AT %MB4 : ARRAY [0..3] OF BYTE;", "a[2] := 0;", []), ("a AT %QX0.0 : ARRAY [0..3] OF BOOL;", "a[2] := TRUE;", []),
    ("a : ARRAY [0..3] OF INT;", "a[2] := 0;", []), ("a AT D1 : ARRAY [0..3] OF INT; i : INT;", "a[i] := 0;", []),
])
def test_only_words_of_arrays_with_one_index_have_addresses_of_their_own(declared: str, body: str, shown: list[str]) -> None:
    start = f"PROGRAM Main VAR {declared} END_VAR "
    program = plant(text=f"{start}{body} END_PROGRAM\n")
    hints = address_hints(program, program.files["pump.st"], len(start), len(start) + len(body))
    assert [f"{(start + body)[each.at - 1]} {each.text}" for each in hints] == shown
