"""The encoder follows a scan whose inputs it does not know; for each value of them it comes to what the engine comes to."""

from __future__ import annotations

import pytest
from symbolic import compare_inputs

from fbvm.code.compiler import compile_text

NUMBERS = """PROGRAM Main
VAR a, b : INT; sums : ARRAY[0..5] OF INT; END_VAR
sums[0] := a + b; sums[1] := a - b; sums[2] := a * b; sums[3] := -a; sums[4] := ABS(b); sums[5] := 3 * a + 7 - 2 * a;
END_PROGRAM"""
QUOTIENTS = """PROGRAM Main VAR a, b : INT; quotients : ARRAY[0..4] OF INT; u : UINT; END_VAR
quotients[0] := a / b; quotients[1] := a MOD b; quotients[2] := a / 7; quotients[3] := a MOD -5;
quotients[4] := 100 / b; u := INT_TO_UINT(a) / 3;
END_PROGRAM"""
COMPARED = """PROGRAM Main VAR a, b : INT; c : BOOL; chosen : ARRAY[0..3] OF INT; less : ARRAY[0..7] OF BOOL; END_VAR
chosen[0] := MIN(a, b); chosen[1] := MAX(a, b); chosen[2] := LIMIT(-10, a, 10); chosen[3] := SEL(c, a, b);
less[0] := a < b; less[1] := a <= b; less[2] := a = b; less[3] := a <> b; less[4] := a > b; less[5] := a >= b;
less[6] := INT_TO_UINT(a) < INT_TO_UINT(b); less[7] := MAX(c, a > 0) AND MIN(c, b > 0);
END_PROGRAM"""
CONVERTED = """PROGRAM Main VAR a, b : INT; w, x, y, z : WORD; wide : DINT; far : LINT; d : BYTE; e : UDINT; END_VAR
wide := INT_TO_DINT(a) * b; far := a; far := far * 65536 * b; d := INT_TO_BYTE(b);
w := INT_TO_WORD(a) AND 16#0FF0; x := INT_TO_WORD(a) XOR INT_TO_WORD(b); y := NOT w OR x; z := SHR(x, 3) OR SHL(x, 13);
e := INT_TO_UDINT(a);
END_PROGRAM"""
SHIFTS = """PROGRAM Main VAR w : WORD; n : INT; b : ARRAY[0..3] OF WORD; s : BYTE; END_VAR
b[0] := SHL(w, n); b[1] := SHR(w, n); b[2] := ROL(w, n); b[3] := ROR(w, n); s := ROL(WORD_TO_BYTE(w), 3);
END_PROGRAM"""
LAZY = """PROGRAM Main VAR a, b : INT; q, r : BOOL; i : INT; k : INT; t : ARRAY[1..3] OF INT := [5, 0, -5]; END_VAR
q := b <> 0 AND_THEN a / b > 2; r := b = 0 OR_ELSE a MOD b = 1;
i := MUX(a, 10, 20, b); k := t[b];
IF q AND_THEN t[a] = 0 THEN k := k + 1; END_IF
END_PROGRAM"""
BCD = """PROGRAM Main VAR w : WORD; n : INT; i : UINT; d : DWORD; END_VAR
d := DINT_TO_BCD_DWORD(n); i := WORD_BCD_TO_UINT(w);
END_PROGRAM"""
PATHS = """FUNCTION Sign : INT VAR_INPUT x : INT; END_VAR
IF x < 0 THEN Sign := -1; RETURN; ELSIF x = 0 THEN RETURN; END_IF Sign := 1;
END_FUNCTION
FUNCTION Place : INT VAR_INPUT x : INT; END_VAR VAR i : INT; END_VAR
FOR i := 0 TO 3 DO IF 2 * i = x THEN Place := i; RETURN; END_IF END_FOR
Place := 77;
END_FUNCTION
PROGRAM Main
VAR a, b, i, k, n, m, found, s, p : INT; t : ARRAY[-1..4] OF INT := [9, 3, 7, 7, 1, 4]; range : INT(-5..5); last : BOOL; END_VAR
CASE a OF 1: n := 10; 2, 4: n := 20 + b; -5..-2: n := -a; ELSE n := 99; END_CASE
found := -9;
FOR i := -1 TO 4 DO IF t[i] = b THEN found := i; EXIT; END_IF IF t[i] = 3 THEN CONTINUE; END_IF m := m + t[i]; END_FOR
IF a > 2 THEN k := 6; ELSIF a < 0 THEN k := -1; ELSE k := 3; END_IF
WHILE s < k DO s := s + 2; IF s = 4 THEN last := TRUE; END_IF END_WHILE
REPEAT s := s - 1; UNTIL s <= b OR s < -3 END_REPEAT
n := n + Sign(b) * 1000; p := Place(b); range := a;
IF a > 3 THEN t[a] := b; ELSIF b > 3 THEN t[b - 1] := t[b - 1] + 1; END_IF
END_PROGRAM"""
MEMORY = """TYPE P : STRUCT x : INT; y : DINT; b : BOOL; c : ARRAY[0..1] OF BYTE; END_STRUCT END_TYPE
PROGRAM Main
VAR
    w AT CIO 10 : WORD; b0 AT CIO 10.00 : BOOL; b9 AT CIO 10.09 : BOOL; long AT CIO 10 : DWORD;
    mid AT CIO 11 : DWORD; far AT CIO 13 : LWORD; lap AT CIO 15 : LWORD; odd AT %MW5 : UINT;
    low AT %MB10 : BYTE; high AT %MB11 : BYTE; bit AT %MX11.3 : BOOL; both AT %MD2 : DWORD;
    i, k : INT; c : BOOL; ps : ARRAY[0..2] OF P; q : P; u : ARRAY[0..3] OF DINT; r : REF_TO INT; x, y : INT; n : WORD; on : BOOL;
    bits AT CIO 20.05 : ARRAY[0..12] OF BOOL;
END_VAR
bits[k] := c; on := bits[i + 3]; b9 := c; n := w; w.3 := b0; long := long OR 16#8000_0000; mid := ROL(mid, 4);
far := ROL(WORD_TO_LWORD(n), 41); lap := far XOR DWORD_TO_LWORD(mid); far := lap; on := w.15 XOR b9;
low := 16#5A; bit := c; odd := odd + 1; both := ROL(both, 8); high := high XOR low;
ps[i].x := k; ps[i].b := c; ps[1].c[k] := 7; q := ps[i]; ps[2] := q; q.y := ps[k].x; u[i] := u[k] + 5;
r := REF(x); IF c THEN r := REF(y); END_IF r^ := k + 1; IF i = 1 THEN r := NULL; END_IF IF k = 1 THEN x := r^; END_IF
END_PROGRAM"""
KNOWN = """PROGRAM Main
VAR
    k, h, n : BOOL := TRUE; s, t : STRING[12] := 'ab'; w : WSTRING[5] := "xy"; i, j : INT := 5; r, x : REAL := 2.5; l : LREAL;
    a : INT; d : DINT; q : ARRAY[0..9] OF BOOL; e : REAL := 1.0E30; z : REAL; u : UINT; st : STRING[3];
END_VAR
s := CONCAT(s, BOOL_TO_STRING(k)); t := MID(s, 2, 2); j := FIND(s, 'bT') + LEN(t); r := r * x + 1.0 / x - SQRT(r);
l := EXPT(x, 2.0); a := REAL_TO_INT(x * 3.0); d := TRUNC(-x); z := e * e; z := z - z;
q[0] := s > t; q[1] := s = 'abTRUE'; q[2] := w < "xz"; q[3] := r > x; q[4] := k AND_THEN h; q[5] := NOT k OR_ELSE NOT h;
q[6] := NOT k AND_THEN 1 / (i - 5) = 1; q[7] := k OR_ELSE 1 / (i - 5) = 1; q[8] := x = r; u := STRING_TO_UINT('17');
st := RIGHT(INSERT(s, t, 1), 9); s := MAX(s, t); t := SEL(n, s, t); w := LEFT(w, 1); z := ATAN2(z, x);
END_PROGRAM"""
OVERLAY = """TYPE S : STRUCT a : DWORD; b : WORD; END_STRUCT END_TYPE
PROGRAM Main
VAR one AT %MD100 : S; two AT %MD110 : S; low AT %MB441 : BYTE; high AT %MB443 : BYTE; k : WORD; other AT %MW201 : WORD; x : BOOL;
    three AT %MD102 : S; END_VAR
one.a := one.a OR 16#8000_0001; one.b := k; two := one; low := NOT low; high := high AND BYTE#16#7F; two.b := k XOR other;
three := one; one := two; x := three.b.1; three.b.1 := NOT x;
END_PROGRAM"""
DAYS = """PROGRAM Main VAR n : INT; d : DATE; t : DT; w : ARRAY[0..2] OF TOD; k : DINT; END_VAR
t := DT#1990-01-01-00:00:00 + INT_TO_TIME(n) * 77777; d := DT_TO_DATE(t); w[0] := DT_TO_TOD(t); k := n;
END_PROGRAM"""
CALLS = """FUNCTION_BLOCK Sum VAR_INPUT x : INT; go : BOOL; END_VAR VAR_OUTPUT s, n : INT; END_VAR VAR t : TON; END_VAR
IF NOT go THEN RETURN; END_IF s := s + x; n := n + 1; t(IN := go, PT := T#5ms);
END_FUNCTION_BLOCK
PROGRAM Main VAR a, b : INT; c : BOOL; f : ARRAY[0..2] OF Sum; g : Sum; o : INT; END_VAR
f[a](x := b, go := c); f[b](x := 5, go := TRUE); g(x := f[a].s, go := a > b, s => o); f[0].x := f[0].s - a;
END_PROGRAM"""
REALS = """PROGRAM Main VAR a, b : REAL; l : LREAL; less : ARRAY[0..5] OF BOOL; c, d, e, f : REAL; h : LREAL; z : BOOL; END_VAR
less[0] := a < b; less[1] := a <= b; less[2] := a = b; less[3] := a <> b; less[4] := a > b; less[5] := a >= b;
c := -a; d := ABS(b); e := MIN(a, b); f := MAX(a, b); h := -ABS(l); z := l > 0.0;
END_PROGRAM"""
EDGES = [(-32768, -32768, False), (-1000, 7, True), (-9, -7, False), (0, 0, True), (8, 1, True), (300, -254, True),
         (32767, 10, False), (7, 254, True)]  # fmt: skip
SMALL = [(a, b) for a in (-5, 0, 1, 2, 4) for b in (-2, 0, 1, 3)]
WORDS = [(i, k, i != k, 0x8208 >> i + 1, 0xFF80 + k) for i in (-1, 0, 1, 2, 3) for k in (0, 1, 2, 7)]
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(("text", "names", "rows"), [
    pytest.param(NUMBERS, "a b", [row[:2] for row in EDGES], id="numbers"),
    pytest.param(QUOTIENTS, "a b", [row[:2] for row in EDGES], id="quotients"),
    pytest.param(COMPARED, "a b c", EDGES, id="compared"),
    pytest.param(CONVERTED, "a b", [row[:2] for row in EDGES], id="converted"),
    pytest.param(SHIFTS, "w n", [(w, n) for w in (0, 1, 0x8001, 0xABCD) for n in (-1, 0, 1, 7, 15, 16, 17, 40)], id="shifts"),
    pytest.param(LAZY, "a b", SMALL, id="lazy"),
    pytest.param(PATHS, "a b", SMALL, id="paths"),
    pytest.param(MEMORY, "i k c w odd", WORDS, id="memory"),
    pytest.param(KNOWN, "", [()], id="known"),
    pytest.param(OVERLAY, "one.a k low",
                 [(a, k, b) for a in (0, 0x12345678) for k in (0, 0xABCD) for b in (0, 0x5A)], id="overlay"),
    pytest.param(DAYS, "n", [(n,) for n in (-32768, -1, 0, 1, 86, 32767)], id="days"),
    pytest.param(CALLS, "a b c", [(a, b, a != 1) for a in (-1, 0, 1, 2) for b in (0, 1, 2, 3)], id="calls"),
    pytest.param(REALS, "a b l", [(a, b, a) for a in (-1.5, -0.0, 0.0, 2.0, INF, NAN) for b in (-INF, -1.5, 0.0, 2.5, NAN)],
                 id="reals"),
])  # fmt: skip
def test_a_scan_with_unknown_inputs_is_that_of_the_engine(text: str, names: str, rows: list[tuple[object, ...]]) -> None:
    compilation = compile_text(text, lint=False)
    assert compilation.image is not None, [each.render() for each in compilation.diagnostics]
    compare_inputs(compilation.image, [f"Main.{name}" for name in names.split()], rows)
