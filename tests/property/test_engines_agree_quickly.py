"""A few programs on Python and on machine code, in every run: memory to the bit after each scan, and the same traps.

tests/property/test_engines_agree.py and test_st_programs.py compare thousands in the long run.  These few take every kind of
value, statement and check once, so that a mistake in machine code is seen at once."""

from __future__ import annotations

from functools import cache

import pytest

from fbvm.base.memory import compare
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

SCANS = 24
PROGRAMS = {
    "integers": """
PROGRAM Main
VAR
    n : DINT := 1; s : SINT; i : INT; l : LINT; us : USINT; u : UINT; ud : UDINT; ul : ULINT;
    b : BYTE; w : WORD; dw : DWORD; lw : LWORD; q : ARRAY [0..7] OF BOOL; r : ARRAY [0..9] OF DINT;
END_VAR
n := n * 1103515245 + 12345;
dw := DINT_TO_DWORD(n); lw := SHL(DWORD_TO_LWORD(dw), 31) OR ROL(DWORD_TO_LWORD(dw), 7);
s := DWORD_TO_SINT(SHR(dw, 9)); i := DWORD_TO_INT(SHR(dw, 13)); l := LWORD_TO_LINT(lw);
us := DWORD_TO_USINT(SHR(dw, 5)); u := DWORD_TO_UINT(SHR(dw, 11)); ud := DWORD_TO_UDINT(dw); ul := LWORD_TO_ULINT(lw);
b := ROR(USINT_TO_BYTE(us), 3); w := ROL(UINT_TO_WORD(u), USINT_TO_INT(us MOD 16)) XOR 16#A5A5; w.3 := NOT w.4;
q[0] := s < SINT#5; q[1] := i <= -7; q[2] := l > n; q[3] := us >= 100; q[4] := u = 3 OR w.15; q[5] := ud <> ul;
q[6] := q[0] XOR q[1] AND NOT q[2]; q[7] := NOT (q[3] OR q[4]) & q[5];
r[0] := n / 7; r[1] := n MOD 7; r[2] := -n; r[3] := ABS(n / 2); r[4] := n / -7 + n MOD -7; r[5] := MAX(n, i, s);
r[6] := LIMIT(-1000, n, 1000); r[7] := SEL(q[0], n, i); r[8] := MUX(us MOD 3, n, i, s); r[9] := TO_DINT(l / 3 MOD 1000);
s := s + 100; i := i * 300; us := us - 200; u := u + 65000; l := l * n; ul := ul - ud;
END_PROGRAM
""",
    "reals": """
PROGRAM Main
VAR
    n : INT; x : REAL := 0.1; y : LREAL := -2.5; z : ARRAY [0..15] OF LREAL; a : ARRAY [0..7] OF INT; q : ARRAY [0..5] OF BOOL;
    zero : LREAL; f : REAL;
END_VAR
n := n + 1;
x := x * 1.7 - INT_TO_REAL(n); y := y + 1.25 * INT_TO_LREAL(n MOD 5) - x / 3.0;
z[0] := SIN(y); z[1] := COS(y) + TAN(x); z[2] := SQRT(ABS(y)); z[3] := EXP(y / 50.0); z[4] := LN(ABS(y) + 1.0);
z[5] := LOG(ABS(y) + 0.5); z[6] := ATAN(y); z[7] := ASIN(1.0 / (2.0 + ABS(y))); z[8] := ABS(y) ** 1.5; z[9] := y / zero;
z[10] := zero / zero; z[11] := MIN(y, x, z[10]); z[12] := TRUNC(y / 3.0); z[13] := LIMIT(-1.0, y, 1.0); z[14] := -y; z[15] := x;
a[0] := LREAL_TO_INT(z[0] * 1000.0); a[1] := REAL_TO_INT(INT_TO_REAL(n) + 0.5); a[2] := REAL_TO_INT(INT_TO_REAL(-n) - 0.5);
a[3] := LREAL_TO_INT(INT_TO_LREAL(n) / 2.0); a[4] := TRUNC_INT(z[13] * 9.9);
q[0] := y < x; q[1] := y = y; q[2] := z[10] = z[10]; q[3] := z[9] > 1.0E300; q[4] := z[10] <> z[10]; q[5] := zero = -zero;
f := LREAL_TO_REAL(y); IF ABS(x) > 1.0E6 THEN x := 0.3; END_IF
END_PROGRAM
""",
    "texts and times": """
PROGRAM Main
VAR
    n : INT; t : STRING[20] := 'abc'; short : STRING[5]; wide : WSTRING[12] := "wide"; r : ARRAY [0..5] OF INT;
    q : ARRAY [0..3] OF BOOL; d : TIME := T#1s; hour : TIME_OF_DAY := TOD#23:59:58; day : DATE := D#2024-02-28;
    stamp : DATE_AND_TIME;
END_VAR
n := n + 7;
t := CONCAT(LEFT(t, 3), INT_TO_STRING(n), RIGHT(t, 2)); short := MID(t, 4, 2);
t := REPLACE(t, 'xy', 1, 2); t := INSERT(DELETE(t, 1, 4), '-', 3); wide := CONCAT(LEFT(wide, 4), "!");
r[0] := LEN(t); r[1] := FIND(t, 'y'); r[2] := STRING_TO_INT(INT_TO_STRING(n)); r[3] := LEN(short); r[4] := LEN(wide);
q[0] := t < short; q[1] := t = 'abc'; q[2] := short >= 'c'; q[3] := wide <> "wide!";
d := d * 3 / 2 - T#1ms; IF d > T#1h THEN d := T#1s; END_IF
hour := hour + T#1s700ms; stamp := CONCAT_DATE_TOD(day, hour); r[5] := DINT_TO_INT(TIME_TO_DINT(d) MOD 1000);
END_PROGRAM
""",
    "statements and blocks": """
TYPE Kind : (Idle, Busy := 5, Done); Pair : STRUCT a : INT; b : ARRAY [1..3] OF INT; END_STRUCT END_TYPE
FUNCTION Sum : DINT
VAR_INPUT values : ARRAY [1..3] OF INT; END_VAR
VAR_IN_OUT calls : INT; END_VAR
VAR i : INT; END_VAR
calls := calls + 1;
FOR i := 3 TO 1 BY -1 DO IF values[i] = 4 THEN CONTINUE; END_IF; Sum := Sum + values[i] * i; END_FOR
END_FUNCTION
FUNCTION_BLOCK Counter
VAR_INPUT up : BOOL; END_VAR
VAR_OUTPUT n : INT; END_VAR
VAR edge : R_TRIG; END_VAR
edge(CLK := up);
IF NOT edge.Q THEN RETURN; END_IF
n := n + 1;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    n, calls, k : INT; kind : Kind; p, o : Pair; all : ARRAY [0..2] OF Pair; total : DINT; c : ARRAY [0..1] OF Counter;
    on : TON; off : TOF; cu : CTU; rr : REF_TO INT; sub : INT (0..50); w AT %D100 : WORD; toggle : BOOL;
END_VAR
n := n + 1; toggle := n MOD 3 = 0;
CASE n MOD 7 OF 0: kind := Idle; 1, 2: kind := Busy; 3..5: kind := Done; ELSE kind := Kind#Busy; END_CASE
p.a := n; p.b[n MOD 3 + 1] := p.a * 2; o := p; all[n MOD 3] := o; rr := REF(all[1].b[2]); IF rr^ > 5 THEN rr^ := -rr^; END_IF
total := total + Sum(p.b, calls);
FOR k := 0 TO 1 DO c[k](up := toggle XOR k = 1); END_FOR
on(IN := n MOD 10 < 6, PT := T#30ms); off(IN := on.Q, PT := T#20ms); cu(CU := off.Q, R := n = 17, PV := 2);
k := 0; WHILE k < n DO k := k + 2; IF k > 9 THEN EXIT; END_IF END_WHILE
REPEAT k := k - 1; UNTIL k <= 0 END_REPEAT
FOR k := 0 TO 9 DO
    FOR calls := 0 TO 2 DO total := total + 1; END_FOR
    WHILE calls > 1 DO calls := calls - 1; END_WHILE
    REPEAT calls := calls + 1; UNTIL calls > 3 END_REPEAT
    IF k = n MOD 5 THEN EXIT; ELSIF k = 2 THEN CONTINUE; END_IF
    total := total + 100;
END_FOR
sub := n; w := SHL(w, 1) OR INT_TO_WORD(n); %W3.2 := cu.Q; %D102 := w;
END_PROGRAM
""",
}
TRAPS = [
    ("a := 10 / z;", "R0101"), ("a := 10 MOD z;", "R0101"), ("b[z] := 1;", "R0102"), ("a := b[z + 4];", "R0102"),
    ("s := a;", "R0103"), ("WHILE TRUE DO ; END_WHILE", "R0104"), ("FOR a := 1 TO 9 BY z DO ; END_FOR", "R0109"),
    ("a := r^;", "R0110"), ("a := LREAL_TO_INT(x);", "R0105"), ("w := UINT_TO_BCD_WORD(60000);", "R0105"),
    ("w := SHL(w, z - 1);", "R0106"),
    ("a := STRING_TO_INT(t);", "R0111"), ("a := F(0);", "R0101"), ("x := SQRT(-x); a := LREAL_TO_INT(x);", "R0105"),
]  # fmt: skip
TRAPPING = """
FUNCTION F : INT
VAR_INPUT a : INT; END_VAR
F := 1 + 10 / a;
END_FUNCTION
PROGRAM Main
VAR
    k, before, after, a, z : INT; b : ARRAY [1..3] OF INT; s : INT (1..9) := 5; r : REF_TO INT; x : LREAL := 1.0E30; w : WORD;
    t : STRING := 'x';
END_VAR
before := before + 1; a := 100;
CASE k OF %s END_CASE
after := after + 1;
END_PROGRAM
"""
LEVELS = pytest.mark.parametrize("level", [0, 2])


@cache
def image_of(text: str) -> Image:
    made = compile_text(text)
    assert made.image is not None, [d.render() for d in made.diagnostics]
    return made.image


def both(image: Image, level: int) -> tuple[Plc, Plc]:
    """The program on Python, and on machine code of a level."""
    python, code = Plc(image, budget=5000), Plc(image, budget=5000)
    code.engine = native.NativeEngine(image, code.memory, level)
    return python, code


@LEVELS
@pytest.mark.parametrize("name", PROGRAMS)
def test_memory_is_equal_after_every_scan(name: str, level: int) -> None:
    python, code = both(image_of(PROGRAMS[name]), level)
    seen = set()
    for scan in range(SCANS):
        assert python.scan() is None and code.scan() is None
        assert compare(python.memory.snapshot(), code.memory.snapshot()) == [], f"after scan {scan}"
        seen.add(bytes(python.memory.snapshot()))
    assert len(seen) == SCANS, "something is worked out in every scan"


@LEVELS
def test_traps_are_equal(level: int) -> None:
    image = image_of(TRAPPING % "\n".join(f"{number}: {text}" for number, (text, _) in enumerate(TRAPS)))
    for number, (text, wanted) in enumerate(TRAPS):
        plcs, traps = both(image, level), []
        for plc in plcs:
            plc.write("Main.k", number)
            traps.append(plc.scan())
            assert (plc.read("Main.before"), plc.read("Main.after")) == (1, 0), text
        assert traps[0] is not None and traps[0].code == wanted, text
        assert repr(traps[1]) == repr(traps[0]), text
        assert compare(*(plc.memory.snapshot() for plc in plcs)) == [], text


READ = """
PROGRAM Main
VAR
    k : INT; t : STRING[40]; d : DINT; u : USINT; w : WORD; l : LREAL; r : REAL; b : BOOL; span : TIME; long : LTIME; day : DATE;
    clock : TIME_OF_DAY; stamp : DATE_AND_TIME; back : STRING[40];
END_VAR
CASE k OF
    0: d := STRING_TO_DINT(t); back := DINT_TO_STRING(d);
    1: u := STRING_TO_USINT(t); back := USINT_TO_STRING(u);
    2: w := STRING_TO_WORD(t); back := WORD_TO_STRING(w);
    3: l := STRING_TO_LREAL(t); back := LREAL_TO_STRING(l);
    4: r := STRING_TO_REAL(t); back := REAL_TO_STRING(r);
    5: b := STRING_TO_BOOL(t); back := BOOL_TO_STRING(b);
    6: span := STRING_TO_TIME(t); back := TIME_TO_STRING(span);
    7: long := STRING_TO_LTIME(t); back := LTIME_TO_STRING(long);
    8: day := STRING_TO_DATE(t); back := DATE_TO_STRING(day);
    9: clock := STRING_TO_TOD(t); back := TOD_TO_STRING(clock);
    10: stamp := STRING_TO_DT(t); back := DT_TO_STRING(stamp);
END_CASE
END_PROGRAM
"""
TEXTS = {
    "0": "0 7 -7 +7 007 1_000 12__3 _1 2147483647 2147483648 -2147483648 -2147483649 16#7F_FF 16#fg 12#5 2#1010 2#12 8#17 8#18 "
         "DINT#5 INT#-5 1.5 1.0 2E3 x 99999999999999999999 16#FFFFFFFFF",
    "1": "255 256 -1 USINT#16#FF 16#100 2#1111_1111",
    "2": "65535 65536 -1 16#FFFF WORD#16#A5 8#177777 8#200000",
    "3": "1.5 -0.25 1e3 1.5E-3 2_5.0 .5 5. 1e 1.5E+400 -INF NaN inf 16#10 LREAL#2.5 3 12345678901234567890",
    "4": "1.5 1.1 3.5E38 1E-46 REAL#0.1 7",
    "5": "TRUE false 1 0 2 BOOL#TRUE BOOL#1 yes",
    "6": "T#1s T#1m30s500ms TIME#1.5s t#-2d3h T#1d25h T#90m T#1s2m T#1ms1us T#5 T#1_0s T# 1s T#24d20h31m23s648ms T#0.5ms",
    "7": "LTIME#1us500ns LT#1d T#1h2m3s4ms5us6ns LTIME#-1ns LTIME#1.0005ms LTIME#1d1d "
         "LTIME#106751d23h47m16s854ms775us807ns LTIME#106751d23h47m16s854ms775us808ns LTIME#-106751d23h47m16s854ms775us808ns",
    "8": "D#2024-02-29 D#2023-02-29 DATE#1970-01-01 D#1969-12-31 D#2024-13-01 D#2024-1-5 D#2024-04-31 "
         "2024-05-06 D#2000-02-29 D#2100-02-29",
    "9": "TOD#12:34:56 TOD#23:59:59.999 TOD#24:00:00 TOD#12:60:00 TIME_OF_DAY#1:2:3.5 TOD#12:34",
    "10": "DT#2024-02-29-23:59:59 DT#2024-02-29-24:00:00 DATE_AND_TIME#2001-01-01-1:2:3.25 DT#2024-02-30-1:1:1 DT#2024-01-01",
}


@LEVELS
def test_texts_are_read_and_written_alike(level: int) -> None:
    image, read = image_of(READ), 0
    for kind, texts in TEXTS.items():
        for text in (*texts.split(), ""):
            plcs, traps = both(image, level), []
            for plc in plcs:
                plc.write("Main.k", int(kind))
                plc.write("Main.t", text)
                traps.append(plc.scan())
            assert repr(traps[1]) == repr(traps[0]), (kind, text)
            assert compare(*(plc.memory.snapshot() for plc in plcs)) == [], (kind, text)
            read += traps[0] is None
    assert read > 40
