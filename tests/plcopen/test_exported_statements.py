"""Statements between rungs as they are drawn in a document: boxes, the wires between them, and what has no form there."""

from __future__ import annotations

from rows import each_of
from test_exported_rungs import drawn, exported, lie_on_each_other, said

HEAD = ("VAR a, x, y : BOOL; n, m : INT; t : TON; c : CTU; list : ARRAY[1..2] OF TON; s : STRUCT b : TON; END_STRUCT; "
        "z : LREAL; END_VAR\n")  # fmt: skip
RUNG = "\nLADDER\nLD a\nOUT x\nEND_LADDER"


@each_of("statements, drawing", [

    ("t();",
     "1 TON t 3 0"),
    ("t(IN := a, PT := T#1s, Q => x, ET => );",
     "1 a; 2 T#1s; 3 TON t 3 0 IN <1 PT <2 Q ET; 4 x <3.Q"),
    ("n := m * (n + 1);",
     "1 m * (n + 1); 2 n <1"),
    ("m := INT#1 * (n + 2);",
     "1 INT#1; 2 n + 2; 3 MUL 3 0 IN1 <1 IN2 <2 OUT; 4 m <3.OUT"),
    ("m := n MOD INT#3 - INT#4 / n;",
     "1 n; 2 INT#3; 3 MOD 3 0 IN1 <1 IN2 <2 OUT; 4 INT#4; 5 n; 6 DIV 3 1.67 IN1 <4 IN2 <5 OUT; 7 SUB 3 3.33 IN1 <3.OUT IN2 "
     "<6.OUT OUT; 8 m <7.OUT"),
    ("z := n ** INT#2;",
     "1 n; 2 INT#2; 3 EXPT 3 0 IN1 <1 IN2 <2 OUT; 4 z <3.OUT"),
    ("x := T#1s > t.ET;",
     "1 T#1s; 2 t.ET; 3 GT 3 0 IN1 <1 IN2 <2 OUT; 4 x <3.OUT"),
    ("x := NOT (n = INT#3) AND a;",
     "1 n; 2 INT#3; 3 EQ 3 0 IN1 <1 IN2 <2 OUT; 4 NOT 3 1.67 IN <3.OUT OUT; 5 a; 6 AND 3 3.33 IN1 <4.OUT IN2 <5 OUT; 7 x "
     "<6.OUT"),
    ("n := -INT#3;",
     "1 -INT#3; 2 n <1"),
    ("n := Own(INT#5);",
     "1 Own(INT#5); 2 n <1"),
    ("n := ABS(INT#-5);",
     "1 INT#-5; 2 ABS 3 0 IN <1 OUT; 3 n <2.OUT"),
    ("n := INT_TO_DINT(IN := INT#5);",
     "1 INT#5; 2 INT_TO_DINT 3 0 IN <1 OUT; 3 n <2.OUT"),
    ("m := MAX(MUX(n, INT#1, 2, 3, 4, 5), n);",
     "1 n; 2 INT#1; 3 2; 4 3; 5 4; 6 5; 7 MUX 3 0 K <1 IN0 <2 IN1 <3 IN2 <4 IN3 <5 IN4 <6 OUT; 8 n; 9 MAX 3 3.67 IN1 <7.OUT "
     "IN2 <8 OUT; 10 m <9.OUT"),
    ("m := LIMIT(IN := n, MN := INT#0, MX := 9);",
     "1 n; 2 INT#0; 3 9; 4 LIMIT 3 0 IN <1 MN <2 MX <3 OUT; 5 m <4.OUT"),
    ("m := LIMIT(INT#0, n);",
     "1 LIMIT(INT#0, n); 2 m <1"),
    ("m := MAX(INT#0, IN2 => n);",
     "1 MAX(INT#0, IN2 => n); 2 m <1"),
    ("c(CU := a, PV := INT#3); n := c.CV + 1; m := (c.cv + n) * 2; x := c.CV > 3 & NOT a; y := a XOR C.Q;",
     "1 a; 2 INT#3; 3 CTU c 3 0 CU <1 PV <2 CV Q; 4 1; 5 ADD 3 2.67 IN1 <3.CV IN2 <4 OUT; 6 n <5.OUT; 7 n; 8 ADD 3 6 IN1 "
     "<3.CV IN2 <7 OUT; 9 2; 10 MUL 3 7.67 IN1 <8.OUT IN2 <9 OUT; 11 m <10.OUT; 12 3; 13 GT 3 11 IN1 <3.CV IN2 <12 OUT; 14 "
     "NOT a; 15 AND 3 12.7 IN1 <13.OUT IN2 <14 OUT; 16 x <15.OUT; 17 a; 18 XOR 3 16 IN1 <17 IN2 <3.Q OUT; 19 y <18.OUT"),
    ("c(CU := a); n := -c.CV; n := c.CV;",
     "1 a; 2 CTU c 3 0 CU <1; 3 -c.CV; 4 n <3; 5 c.CV; 6 n <5"),
    ("c(CU := a); n := 3; m := c.CV;",
     "1 a; 2 CTU c 3 0 CU <1; 3 3; 4 n <3; 5 c.CV; 6 m <5"),
    ("c(CU := a); n := c.PV;",
     "1 a; 2 CTU c 3 0 CU <1; 3 c.PV; 4 n <3"),
    ("c(CU := a); t(IN := c.Q); x := t.Q; y := c.Q;",
     "1 a; 2 CTU c 3 0 CU <1 Q; 3 TON t 3 2.67 IN <2.Q Q; 4 x <3.Q; 5 y <2.Q"),
    ("c(CU := a); x := c.Q; t(IN := a); y := c.Q;",
     "1 a; 2 CTU c 3 0 CU <1 Q; 3 x <2.Q; 4 a; 5 TON t 3 4.33 IN <4; 6 c.Q; 7 y <6"),
    ("c(CU := a); x := c.Q; t(IN := NOT c.Q); y := c.Q;",
     "1 a; 2 CTU c 3 0 CU <1 Q; 3 x <2.Q; 4 NOT 3 4.33 IN <2.Q OUT; 5 TON t 3 6 IN <4.OUT; 6 y <2.Q"),
    ("t(IN := a); t(IN := x); x := t.Q;",
     "1 a; 2 TON t 3 0 IN <1; 3 x; 4 TON t 3 2.67 IN <3 Q; 5 x <4.Q"),
    ("t(EN := a, IN := x, ENO => y); x := t.Q; y := NOT t.Q;",
     "1 a; 2 x; 3 TON t 3 0 EN <1 IN <2 ENO Q; 4 y <3.ENO; 5 MOVE 3 2.67 IN <3.Q OUT; 6 x <5.OUT; 7 NOT 3 6 IN <3.Q OUT; 8 y "
     "<7.OUT"),
    ("; IF a THEN n := INT#4 + n; END_IF; IF a THEN m := 3; END_IF;",
     "1 INT#4; 2 n; 3 ADD 3 0 IN1 <1 IN2 <2 OUT; 4 a; 5 MOVE 3 1.67 EN <4 IN <3.OUT ENO OUT; 6 n <5.OUT; 7 a; 8 3; 9 MOVE 3 "
     "4.33 EN <7 IN <8 ENO OUT; 10 m <9.OUT"),
    ("t(IN := a); IF t.Q THEN x := t.Q; END_IF; y := t.Q;",
     "1 a; 2 TON t 3 0 IN <1 Q; 3 MOVE 3 2.67 EN <2.Q IN <2.Q ENO OUT; 4 x <3.OUT; 5 y <2.Q"),
], ids=lambda row: row[0])  # fmt: skip
def test_the_boxes_of_statements_and_what_their_wires_come_from(statements: str, drawing: str) -> None:
    made = exported(statements + RUNG, HEAD)
    assert "; ".join(drawn(made)[:-4]) == drawing
    assert lie_on_each_other(made) == []


@each_of("statement", [
    "list[1]()", "s.b()", "list[1](IN := a)", "t(a, T#1s)", "t(IN := a, NOT Q => x)", "u(IN := a)", "t", "n := m := 3",
    "x REF= y", "RETURN", "FOR n := 1 TO 3 DO m := 1; END_FOR", "IF a THEN n := 1; ELSE n := 2; END_IF",
    "IF a THEN n := 1; ELSIF x THEN n := 2; END_IF", "IF a THEN n := 1; m := 1; END_IF", "IF a THEN t(); END_IF",
    "IF a THEN n := m := 1; END_IF", "IF a THEN x REF= y; END_IF",
])  # fmt: skip
def test_a_statement_that_has_no_form_among_rungs_is_named(statement: str) -> None:
    made = exported(f"{statement};{RUNG}", HEAD)
    assert said(made) == [f"X0301 {statement}: this statement among rungs has no form in a ladder diagram"]
    assert [each.hint for each in made.diagnostics] == ["put it into a POU of Structured Text"]
