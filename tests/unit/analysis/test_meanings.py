"""What each name in a text means, and whether it is read or written there."""

from __future__ import annotations

from functools import cache

from editing import MARK, at_mark
from rows import each_of

from fbvm.analysis.program import Program
from fbvm.analysis.references import applied, rename

PLANT = """\
TYPE Mode : (Off, Filling); Tank : STRUCT Level : INT; State : Mode; END_STRUCT; END_TYPE
TYPE Vessel EXTENDS Tank : STRUCT Height : INT; END_STRUCT END_TYPE
TYPE Full : Vessel := (Level := 9, State := Filling); END_TYPE
VAR_GLOBAL Total : INT; Big : Vessel := (Level := 1, Height := 2); END_VAR
FUNCTION_BLOCK Pump
VAR_INPUT Level : INT; END_VAR
VAR_OUTPUT Runs : BOOL; END_VAR
VAR inner : Full := (Height := 3); END_VAR
    Stop();
ACTION Stop: Runs := inner.Level > 3; END_ACTION
END_FUNCTION_BLOCK
PROGRAM Main
VAR_EXTERNAL Total : INT; END_VAR
VAR P1 : Pump := (Level := 4); i : INT; m : Mode := Filling; END_VAR
VAR a : ARRAY [0..1] OF Tank := [(Level := 5), (State := Off)]; r : REF_TO Tank; b : BYTE; on : BOOL; END_VAR
VAR CONSTANT third : INT := 2; END_VAR VAR pumps : ARRAY [1..2] OF Pump; END_VAR
    FOR i := 0 TO 1 DO a[i].Level := Total; END_FOR
    P1.Stop(); P1(Level := i, Runs => on);
    r := REF(a[0]); r^.Level := 1;
    m := Mode#Off; Big.Level := Big.Height + ABS(i);
    b.third := P1.Runs;
END_PROGRAM
FUNCTION Twice : INT VAR_INPUT x : INT; END_VAR Twice := 2 * x; END_FUNCTION
CONFIGURATION C
    VAR_GLOBAL Shared : INT; END_VAR
    RESOURCE R ON PLC
        TASK T(INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM Run WITH T : Main;
    END_RESOURCE
END_CONFIGURATION
"""
ROLES = {"declared": "=", "read": "", "written": "!", "called": "()"}


def meanings(program: Program, line: int) -> list[str]:
    """The names of a line that mean something: where each is declared (`TANK.LEVEL`), and `=` at its declaration, `!` if it is
    written, `()` if it is called."""
    file = program.files["pump.st"]
    return [".".join(use.key[2:]) + ROLES[use.role] for part in file.parts for use in program.uses(part)
            if file.source.place(part.base + use.start)[0] == line]


@each_of("line, expected", [
    (1, "MODE= MODE.OFF= MODE.FILLING= TANK= TANK.LEVEL= TANK.STATE= MODE"), (2, "VESSEL= TANK VESSEL.HEIGHT="),
    (3, "FULL= VESSEL TANK.LEVEL! TANK.STATE! MODE.FILLING"), (4, "TOTAL= BIG= VESSEL TANK.LEVEL! VESSEL.HEIGHT!"),
    (5, "PUMP="), (6, "PUMP.LEVEL="), (7, "PUMP.RUNS="), (8, "PUMP.INNER= FULL VESSEL.HEIGHT!"), (9, "PUMP.STOP()"),
    (10, "PUMP.STOP= PUMP.RUNS! PUMP.INNER TANK.LEVEL"), (12, "MAIN="), (13, "TOTAL"),
    (14, "MAIN.P1= PUMP PUMP.LEVEL! MAIN.I= MAIN.M= MODE MODE.FILLING"),
    (15, "MAIN.A= TANK TANK.LEVEL! TANK.STATE! MODE.OFF MAIN.R= TANK MAIN.B= MAIN.ON="), (16, "MAIN.THIRD= MAIN.PUMPS= PUMP"),
    (17, "MAIN.I! MAIN.A MAIN.I TANK.LEVEL! TOTAL"),
    (18, "MAIN.P1 PUMP.STOP() MAIN.P1() PUMP.LEVEL! MAIN.I PUMP.RUNS MAIN.ON!"), (19, "MAIN.R! REF() MAIN.A MAIN.R TANK.LEVEL!"),
    (20, "MAIN.M! MODE MODE.OFF BIG TANK.LEVEL! BIG VESSEL.HEIGHT ABS() MAIN.I"), (21, "MAIN.B MAIN.THIRD! MAIN.P1 PUMP.RUNS"),
    (25, "SHARED="), (28, "RUN= MAIN"),
])
def test_what_the_names_of_a_line_mean(line: int, expected: str) -> None:
    assert meanings(_checked(PLANT), line) == expected.split()


@each_of("line, expected", [
    ("nobody(a[1].Level, r^.State, P1.Level, Mode#Off);", "MAIN.A TANK.LEVEL MAIN.R TANK.STATE MAIN.P1 PUMP.LEVEL MODE MODE.OFF"),
    ("a[nobody].Level := 1;", "MAIN.A TANK.LEVEL!"), ("P1(Level := nobody);", "MAIN.P1() PUMP.LEVEL!"),
    ("nobody := Filling + Big.Height;", "MODE.FILLING BIG VESSEL.HEIGHT"), ("nobody.Level := P1.Stop;", "MAIN.P1 PUMP.STOP"),
    ("P1.inner.Level := nobody;", "MAIN.P1 PUMP.INNER TANK.LEVEL!"), ("Total := Pump.nobody;", "TOTAL! PUMP"),
    ("m := Mode.Filling + nobody;", "MAIN.M! MODE MODE.FILLING"),
    ("nobody(Filling, pumps[1](Level := i), P1(Level := 1), Twice(x := i));",
     "MODE.FILLING MAIN.PUMPS PUMP.LEVEL! MAIN.I MAIN.P1() PUMP.LEVEL! TWICE() TWICE.X! MAIN.I"),
    ("nobody(P1.Stop(), Main, Pump, b.third, Total, R, NOBODY);", "MAIN.P1 PUMP.STOP() MAIN PUMP MAIN.B MAIN.THIRD TOTAL MAIN.R"),
])
def test_names_beside_a_mistake_keep_their_meaning(line: str, expected: str) -> None:
    program = _checked(PLANT.replace("    b.third := P1.Runs;", f"    {line}"))
    assert program.diagnostics("pump.st")
    assert meanings(program, 21) == expected.split()


def test_a_member_is_renamed_in_initial_values_too() -> None:
    program, offset = at_mark(PLANT.replace("STRUCT Level", f"STRUCT {MARK}Level"))
    made = applied(rename(program, "pump.st", offset, "Filled"), "Filled")["pump.st"]
    assert [made.splitlines()[line - 1] for line in (3, 4, 8, 15, 17)] == [
        PLANT.splitlines()[line - 1].replace("Level", "Filled") for line in (3, 4, 8, 15, 17)]
    assert made.count("Filled") == 8 and "P1 : Pump := (Level := 4)" in made


@cache
def _checked(text: str) -> Program:
    return at_mark(text + MARK)[0]
