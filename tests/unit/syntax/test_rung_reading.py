"""Drawings of rungs as text of a program: what people type is read, and what cannot be read is said with its place."""

from __future__ import annotations

from textwrap import dedent

from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.syntax.ladder.mnemonics import read_rungs
from fbvm.syntax.ladder.text import rung_lines

Message = tuple[str, int, int, str, str]


def read(drawing: str) -> tuple[list[str], list[tuple[int, int, str]]]:
    """The instructions of drawings, and their errors with row and column."""
    text, wrong = dedent(drawing).lstrip("\n"), []  # type: str, list[tuple[int, int, str]]

    def report(code: str, start: int, end: int, message: str, hint: str) -> None:
        row = text.count("\n", 0, start)
        wrong.append((row + 1, start - (text.rfind("\n", 0, start) + 1) + 1, message))
        assert code == "S0113" and end > start and hint

    rungs = read_rungs(text, 0, len(text), report)
    steps = [line.step for rung in rungs for line in rung.lines]
    return [" ".join((step.prefix + step.mnemonic, *step.operands)) for step in steps], wrong


GOOD = {
    "signs of every keyboard": ("""
        |   a       b     d|
        |--| |--+--|/|---( )
        |   c   |          |
        |--| |--+          |
    """, "LD a, OR c, ANDNOT b, OUT d"),
    "branches above the line": ("""
        │      b           │
        │   ┌─┤ ├─┐        │
        │   │ a   │   c    │
        ├───┴┤ ├──┴──( )───┤
    """, "LD b, OR a, OUT c"),
    "other strokes, edges as letters, no right rail": ("""
        |   a      b       c
        |--] [----|P|-----(N)-
    """, "LD a, @AND b, DIFD c"),
    "a bridge back to one line": ("""
        │   a   b     d   │
        ├──┤ ├┬┤ ├─┬─( )──┤
        │   c │ e  │  f   │
        ├──┤ ├┴┤ ├─┴─(R)──┤
    """, "LD a, OR c, LD b, OR e, ANDLD, OUT d, RSET f"),
    "a block with pins, one left free": ("""
        |  a      +- t : TON -+        b
        |-| |-----|EN      ENO|-------( )--|
        |    5s --|PT        Q|-- c
        |         |         ET|
        |         +-----------+
    """, "LD a, FBCALL TON t PT:=5s Q=>c, OUT b"),
    "an instruction on one row, and one at the rail": ("""
        │   a   ┌──────────────┐
        ├──┤ ├──┤ MOV #1 D0    │
        │       └──────────────┘
        │       ┌──────────────┐
        ├───────┤ END          │
        │       └──────────────┘
    """, "LD a, MOV #1 D0, END"),
    "inputs below each other": ("""
        │   a     ┌───────┐
        ├──┤ ├────┤ SFT   │
        │   b     │ D0    │
        ├──┤ ├────┤ D1    │
        │   c     │       │
        ├──┤ ├────┤       │
        │         └───────┘
    """, "LD a, LD b, LD c, SFT D0 D1"),
    "a line that goes on below": ("""
        |   a   b
        |--| |-| |->1
        |     c     d
        | >1-| |---( )
    """, "LD a, AND b, AND c, OUT d"),
    "power and values": ("""
        ┃ D0 #5        b    │
        ┣━━━┫>┣━━━━━━━( )━━━┥
        ┃  = 7              │
    """, "LD> D0 #5, OUT b"),
    "a text below a contact with signs of wires in it": ("""
        |   a       d     |
        |--| |-----( )----|
        |  old--new       |
    """, "LD a, OUT d"),
    "two rungs": ("""
        │   a      b   │
        ├──┤ ├────( )──┤

        │   c      d   │
        ├──┤ ├────(/)──┤
    """, "LD a, OUT b, LD c, OUTNOT d"),
}


@each_of("name", GOOD)
def test_drawings_are_read(name: str) -> None:
    drawing, said = GOOD[name]
    assert read(drawing) == (said.split(", "), [])


BAD = {
    "a gap": ("""
        │   a      b    │
        ├──┤ ├──  ( )───┤
    """, 2, 8, "this wire ends in the air"),
    "a wire that leads nowhere": ("""
        │   a       b   │
        ├──┤ ├──┬──( )──┤
        │       │       │
    """, 3, 9, "this wire ends in the air"),
    "a wire past a junction": ("""
        │   a       b   │
        ├──┤ ├─────( )──┤
        │   c   │       │
        ├──┤ ├──┘       │
    """, 3, 9, "this wire ends at `─`, which does not join it"),
    "a ragged rail": ("""
        │   a       b   │
        ├──┤ ├──┬──( )──┤
        │       │   c   │
        │       └──( )─┤
    """, 4, 16, "here is no rail"),
    "an unknown coil": ("""
        │   a       b   │
        ├──┤ ├─────(X)──┤
    """, 2, 12, "`(X)` is no coil"),
    "an unknown contact": ("""
        │   a       b   │
        ├──┤Z├─────( )──┤
    """, 2, 4, "`┤Z├` is no contact"),
    "no operand": ("""
        │           b   │
        ├──┤ ├─────( )──┤
    """, 2, 4, "above this contact stands no operand"),
    "a text over nothing": ("""
        │   a   zz  b   │
        ├──┤ ├─────( )──┤
    """, 1, 9, "`zz` belongs to no contact, coil or box"),
    "a tab": ("│   a\t    b   │\n├──┤ ├─────( )──┤\n", 1, 6, "there is a tab in the drawing"),
    "nothing behind a contact": ("""
        │   a       b   │
        ├──┤ ├──┬──( )──┤
        │   c   │       │
        ├──┤ ├──│───────┤
    """, 4, 8, "this wire ends at `│`, which does not join it"),
    "a contact without a coil": ("""
        │   a           │
        ├──┤ ├──────────┤
    """, 2, 4, "there is no coil and no box behind this contact"),
    "from rail to rail": ("""
        │               │
        ├───────────────┤
    """, 2, 1, "this wire leads from rail to rail with nothing on it"),
    "around a contact": ("""
        │   a      b    │
        ├─┬─┤ ├─┬─( )───┤
        │ └─────┘       │
    """, 2, 5, "a wire leads around this, so it has no effect"),
    "one arrow": ("""
        │   a      │
        ├──┤ ├──►1 │
    """, 2, 9, "there is one arrow with the number 1"),
    "a box with a crooked side": ("""
        │   a   ┌──────┐
        ├──┤ ├──┤ MOV │
        │       │ #1   │
        │       └──────┘
    """, 2, 9, "the box that begins in column 9 is open in this row"),
    "branches that do not begin at one place": ("""
        │   y                  │
        ├──┤ ├─────────┐       │
        │   a      x   │   d   │
        ├──┤ ├─┬──┤ ├──┴──( )──┤
        │      │           b   │
        │      └──────────( )──┤
    """, 2, 4, "wires meet behind this that do not begin at one place"),
    "a block without a wire": ("""
        │       ┌─ t : TON ─┐
        │       │EN      ENO│
        │       └───────────┘
    """, 1, 9, "no wire leads to this box"),
    "an operand beside no pin": ("""
        │   a    ┌─ t : TON ─┐
        ├──┤ ├───┤EN      ENO│
        │    5s ─┤           │
        │        └───────────┘
    """, 3, 10, "`5s` stands at no pin"),
    "a lower input with a branch of its own": ("""
        │   a      ┌───────┐
        ├──┤ ├─────┤ CNT   │
        │   b      │ 1     │
        ├──┤ ├──┬──┤ #3    │
        │       │  └───────┘
        │       │   c
        │       └──( )
    """, 1, 12, "a lower input of this box hangs on a wire that leads elsewhere, too"),
}


@each_of("name", BAD)
def test_what_is_wrong_is_said_with_its_place(name: str) -> None:
    drawing, row, column, said = BAD[name]
    assert read(drawing)[1] == [(row, column, said)]


DRAWN = """PROGRAM Main
VAR Start AT CIO 0.00 : BOOL; Stop AT CIO 0.01 : BOOL; Motor AT CIO 100.00 : BOOL; END_VAR
LADDER
RUNG 1 Seal-in
    | Start    Stop        Motor |
    |--| |--+---|/|---------( )--|   // stop wins
    | Motor |                    |
    |--| |--+                    |

    LD  Motor
    OUT 100.01
END_LADDER
END_PROGRAM
"""
CANONICAL = """RUNG 1 Seal-in
    // stop wins
    │  Start    Stop        Motor  │
    ├┬──┤ ├──┬───┤/├─────────( )───┤
    ││ Motor │                     │
    │└──┤ ├──┘                     │

    LD      Motor
    OUT     100.01"""


def test_a_drawing_is_executed_and_drawn_anew_by_fmt() -> None:
    made = compile_text(DRAWN)
    assert made.diagnostics == [] and made.image is not None
    assert [rung.number for rung in made.image.rungs] == [1, 2]
    plc = Plc(made.image)
    for inputs, motor in (((True, False), True), ((False, False), True), ((False, True), False), ((False, False), False)):
        plc.write("Main.Start", inputs[0])
        plc.write("Main.Stop", inputs[1])
        plc.scan()
        assert plc.read("Main.Motor") is motor and plc.read("CIO 100.01") is motor
    text = DRAWN[DRAWN.index("RUNG"):DRAWN.index("END_LADDER")]
    again = "\n".join(rung_lines(read_rungs(text, 0, len(text), lambda *message: None)))
    assert again == CANONICAL
    assert "\n".join(rung_lines(read_rungs(again, 0, len(again), lambda *message: None))) == again


def test_an_error_is_shown_with_its_line_and_a_caret() -> None:
    made = compile_text(DRAWN.replace("--+---|/|", "--+-  |/|"))
    assert [error.code for error in made.errors] == ["S0113"]
    said = made.errors[0].render()
    assert ":6:14:" in said and "this wire ends in the air" in said and "column 15" in said


def test_an_unknown_instruction_in_a_box_is_refused_by_name() -> None:
    made = compile_text("PROGRAM Main\nLADDER\n| 0.00 +-----+\n|-| |--|NOSUCH|\n|      +-----+\nEND_LADDER\nEND_PROGRAM"
                        .replace("+-----+", "+------+"))
    assert [(error.code, error.message) for error in made.errors] == [
        ("S0109", "`NOSUCH` is no instruction of this instruction set")]
