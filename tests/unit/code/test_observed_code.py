"""What builds that look inside a scan are told of each statement: that it begins, what it reads, what it has written."""

from __future__ import annotations

from textwrap import dedent

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.code.listing import listing

TEXT = """TYPE P : STRUCT x, y : INT; END_STRUCT; END_TYPE
FUNCTION G : P VAR_INPUT a : P; END_VAR G := a; END_FUNCTION
{attribute 'hide'}
FUNCTION F : INT VAR_INPUT a : INT; END_VAR F := a; IF a > 1 THEN F := 2; END_IF END_FUNCTION
FUNCTION_BLOCK B VAR_IN_OUT io : INT; END_VAR VAR_INPUT i : INT; END_VAR io := i; END_FUNCTION_BLOCK
PROGRAM Main
VAR a, b : INT; s : ARRAY[1..2] OF INT; p, q : P; c : B; t : BOOL; r : REFERENCE TO INT; END_VAR
p := q; q := G(p);
s[a] := b; b := s[2]; b := s[a];
IF a > 1 THEN b := 2; ELSE ; END_IF
p := (x := a, y := 2);
c(io := a, i := b);
b := F(c.i) + F(a := p.x);
CASE a OF 1: b := a; ELSE a := 0; END_CASE
FOR a := 1 TO b DO t := NOT t; END_FOR
r REF= b; b := r;
END_PROGRAM
"""
NAMES = {"self+8": "a", "self+10": "b", "self+10+2*t1": "s[a]", "self+14": "s[2]", "self+16": "p", "self+20": "q",
         "self+40": "c.i", "self+48": "t"}  # fmt: skip
"""The variables of Main by their places."""


def told(image: Image, pou: str) -> str:
    """A line for each statement of a POU: where it begins, then what it reads and writes, in order."""
    lines: list[str] = []
    inside = False
    for line in listing(image, True).splitlines():
        if line.startswith("body"):
            inside = f" {pou}," in f"{line},"
        elif inside and line[:1].isdigit():
            lines.append(line.split()[0])
        elif inside and not lines and "observe" in line:
            lines.append("nowhere")
        if inside and "observe" in line:
            _, what, *_, place = line[10:].split()
            lines[-1] += f" {what} {NAMES.get(place, place) if pou == 'PROGRAM Main' else place}"
    return "\n".join(lines)


def test_statements_tell_what_they_read_and_write() -> None:
    made = compile_text(TEXT, lint=False, dialect="rusty").image
    assert made is not None
    assert told(made, "PROGRAM Main") == dedent("""\
        8:1 read q write p
        8:9 read p write 180288 write q
        9:1 read a read b write s[a]
        9:12 read s[2] write b
        9:23 read a write b
        10:1 read a
        10:15 write b
        11:1 read a write p
        12:1 read b write c.i
        13:1 read c.i read p write 180296 write 180296 write b
        14:1 read a
        14:14 read a write b
        14:27 write a
        15:1 read b write a
        15:20 read t write t write a write a
        16:1
        16:11 write b""")
    assert told(made, "FUNCTION_BLOCK B") == "5:74 read self+16 write t1"
    assert told(made, "FUNCTION G") == "2:41 read 180288 write 180292"


def test_a_hidden_pou_tells_where_none_of_its_statements_begins() -> None:
    made = compile_text(TEXT, lint=False, dialect="rusty").image
    assert made is not None
    assert told(made, "FUNCTION F") == "nowhere read 180296 write 180298 read 180296 write 180298"
