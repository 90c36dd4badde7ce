"""Good files of other tools, and programs of other dialects, for `broken_input.py` to damage."""

from __future__ import annotations

import archives
import charts
import codesys2_files

from fbvm.interchange.twincat.archive import JUMP, NEGATED, SET

DRAWN = """PROGRAM Main
VAR
a, b, c, p, q, r : BOOL; n, m, k : INT; t : TON; pt : TIME := T#40ms;
END_VAR
"""
HEAP = """{attribute 'enable_dynamic_creation'}
FUNCTION_BLOCK Node
VAR v : DINT; END_VAR
METHOD FB_init : BOOL
VAR_INPUT bInitRetains, bInCopyCode : BOOL; a : DINT; END_VAR
    v := a;
END_METHOD
METHOD Next : DINT
VAR_INPUT step : DINT := 1; END_VAR
    v := v + step; Next := v;
END_METHOD
PROPERTY Value : DINT
GET Value := v; END_GET
SET v := Value; END_SET
END_PROPERTY
END_FUNCTION_BLOCK
FUNCTION_BLOCK Buffer
VAR_GENERIC CONSTANT size : INT := 1; END_VAR
VAR kept : ARRAY [0..size] OF INT; END_VAR
kept[0] := kept[0] + size;
END_FUNCTION_BLOCK
PROGRAM Main
VAR node : POINTER TO Node; list : POINTER TO DINT; n : DINT; code : __SYSTEM.ExceptionCode; s : STRING := 'x';
b : Buffer<3>;
END_VAR
node := __NEW(Node(a := n)); list := __NEW(DINT, 4);
IF node <> 0 AND list <> 0 THEN list[2] := node^.Next(step := 2); node^.Value := 5; n := n + list[2]; END_IF
__DELETE(list); __DELETE(node);
__TRY n := n / (n - 4); __CATCH(code) n := 1; __FINALLY s := CONCAT(s, DINT_TO_STRING(n)); __ENDTRY
b();
END_PROGRAM
"""
FILES = """PROGRAM Main
VAR h : DWORD; text : STRING := 'one'; back : STRING; n : DWORD; d : DATE_AND_TIME := DT#2024-02-28-23:59:59; END_VAR
h := SysFileOpen('a.txt', 'w'); n := SysFileWrite(h, ADR(text), 3); SysFileClose(h);
h := SysFileOpen('a.txt', 'r'); n := SysFileRead(h, ADR(back), 3); SysFileClose(h);
text := LEFT(CONCAT(text, back), 9); d := d + T#1s;
END_PROGRAM
"""
CAMPAIGN = """[campaign]
sources = ["counter.st"]
runs = 2
for = "50ms"
cycle = "10ms"
never = ["Main.n > 900"]
always = ["Main.d = 3"]

[[fault]]
kind = ["silent", "slow"]
peer = "192.168.250.23:502"
latency = ["5ms", "40ms"]
count = 1
chance = 70
between = ["0ms", "20ms"]

[[vary]]
name = "Main.d"
values = [3, 4]
"""
PICTURES = """[plc.tank]
sources = ["counter.st"]
cycle = "100ms"
watch = ["Main.n"]

[[plc.tank.unit]]
type = "Tianxing"
model = "T3"
address = "192.168.250.23"

[[door]]
address = "192.168.250.23:502"
bind = "127.0.0.1:0"

[[picture]]
file = "tank.svg"
title = "Tank"

[[picture.bind]]
element = "water"
name = "Main.n"
fill = [0, 1000]

[[picture.bind]]
element = "motor"
name = "Main.d"
color = { TRUE = "#1b7f4d", else = "#8a919c" }
click = "toggle"
"""
SYSTEM = """<TcSmProject TcSmVersion="1.0"><Project>
<Plc><Project Name="Plant" PrjFilePath="Plant.plcproj"/></Plc>
</Project></TcSmProject>
"""


def drawn_objects() -> list[bytes]:
    """Objects of TwinCAT with ladder, FBD and CFC."""
    a, c = archives, charts
    both = a.box("AND", [a.leaf("a"), a.leaf("b", bits=NEGATED)], "Operator", names=("- -", "BOOL BOOL"), outs=("-", "BOOL"))
    ladder = a.drawn("Ld", a.network(a.assign(both, a.operand("p"))),
                     a.network(a.wire(1, a.parallel(a.leaf("a"), a.leaf("c"))), a.assign(a.wire(1), a.operand("q", bits=SET)),
                               label="again", comment="two ways"),
                     a.network(a.assign(a.leaf("c"), a.operand("again", bits=JUMP))))
    blocks = a.drawn("Fbd", a.network(a.assign(a.box("TON", [a.leaf("a"), a.leaf("pt", "TIME")], "FunctionBlock", instance="t",
                                                     names=("IN PT", "BOOL TIME"), outs=("Q ET", "BOOL TIME"),
                                                     targets=(a.LEADS, a.NOTHING)), a.operand("p"))))  # fmt: skip
    chart = c.chart(c.operand("a", "1"), c.operand("b", "2"), c.box("AND", "Operator", ":3 :-4", ":5"), c.result("p", "6"),
                    c.box("TON", "FunctionBlock", "IN:11 PT:12", "Q:13 ET:14", "t"), c.operand("pt", "7"), c.result("q", "8"),
                    c.wired("1", "3"), c.wired("2", "4"), c.wired("5", "6", "11"), c.wired("7", "12"),
                    c.wired("13", "8"))  # fmt: skip
    return [a.pou(DRAWN, body).encode() for body in (ladder, blocks, chart)]


def exports() -> list[bytes]:
    """Exports of CODESYS 2.3: as text alone, with ladder and with FBD."""
    c = codesys2_files
    row = c.row("AND", c.row("OR", c.contact("a"), c.contact("p")), c.contact("b", "_NEGATIV"))
    timer = c.row("AND", c.contact("a"), c.instance("t", "TON", ("_EMPTY", c.operand("t#20ms"))), c.contact("b"))
    ladder = c.export(c.rung(row, "p", "-q"), c.rung(c.contact("c"), "set m.0", "reset m.1"), c.rung(timer, "p"))
    blocks = c.export(c.assigned(c.box("ADD", c.operand("n"), c.operand("1")), "n"), language="FBD")
    return [text.encode() for text in (c.EXPORT, ladder, blocks)]
