"""Rungs as drawings: what stands where, what is thick when power was there, and what has no drawing."""

from __future__ import annotations

from textwrap import dedent
from xml.etree import ElementTree

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.ladder_text import ladder_surface, ladder_text
from fbvm.record.draw.power import PowerFlow, RungExecution
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.trace.observing import observing
from fbvm.syntax.ladder.drawing.widths import Annotations


def image(rungs: str, declarations: str = "a, b, c, d, e, f : BOOL;") -> Image:
    made = compile_text(f"PROGRAM Main VAR {declarations} END_VAR\nLADDER\n{rungs}\nEND_LADDER\nEND_PROGRAM")
    assert made.image is not None, made.errors[0].render()
    return made.image


def drawn(rungs: str, width: int = 80) -> str:
    """The drawing of the first rung without its headline."""
    return "\n".join(ladder_text(image(rungs).rungs[0], width)[1:])

DRAWINGS = {
    "series, parallel and coil": ("LD a\nOR b\nANDNOT c\nOUT d", """
        │    a        c        d   │
        ├┬──┤ ├──┬───┤/├──────( )──┤
        ││   b   │                 │
        │└──┤ ├──┘                 │
    """),
    "blocks joined": ("LD a\nLD b\nAND c\nLD d\nANDNOT e\nORLD\nANDLD\nOUT f", """
        │   a       b      c          f   │
        ├──┤ ├──┬──┤ ├────┤ ├──┬─────( )──┤
        │       │   d      e   │          │
        │       └──┤ ├────┤/├──┘          │
    """),
    "branch points": ("LD a\nOUT TR0\nAND b\nOUT c\nLD TR0\nANDNOT d\n@SET e", """
        │   a      b         c   │
        ├──┤ ├─┬──┤ ├───────( )──┤
        │      │   d        e    │
        │      └──┤/├──────(@S)──┤
    """),
    "a box whose inputs begin at a branch point": ("LD a\nOUT TR0\nAND b\nLD TR0\nAND c\nCNT 5 #10\nLD TR0\nAND b\nOUT d", """
        │   a      b       ┌─────┐ │
        ├──┤ ├─┬──┤ ├──────┤ CNT │ │
        │      │   c       │ 5   │ │
        │      ├──┤ ├──────┤ #10 │ │
        │      │           └─────┘ │
        │      │   b           d   │
        │      └──┤ ├─────────( )──┤
    """),
    "blocks that begin at a branch point": ("LD a\nOUT TR0\nAND b\nLD TR0\nUP\nORLD\nOUT c", """
        │   a       b            c   │
        ├──┤ ├──┬──┤ ├────┬─────( )──┤
        │       │ ┌────┐  │          │
        │       └─┤ UP ├──┘          │
        │         └────┘             │
    """),
    "edges": ("@LD a\n%AND b\nUP\nDIFU c", """
        │   a      b    ┌────┐       c   │
        ├──┤↑├────┤↓├───┤ UP ├──────(↑)──┤
        │               └────┘           │
    """),
    "boxes whose names begin as those of contacts": ("LD a\nANDW D1 D2 D3\nORW D1 D2 D3", """
        │   a         ┌──────┐ │
        ├──┤ ├─┬──────┤ ANDW │ │
        │      │      │ D1   │ │
        │      │      │ D2   │ │
        │      │      │ D3   │ │
        │      │      └──────┘ │
        │      │       ┌─────┐ │
        │      └───────┤ ORW │ │
        │              │ D1  │ │
        │              │ D2  │ │
        │              │ D3  │ │
        │              └─────┘ │
    """),
    "a box with two inputs": ("LD a\nLD b\nLD c\nANDLD\nCNT 5 #10", """
        │   a          ┌─────┐ │
        ├──┤ ├─────────┤ CNT │ │
        │   b      c   │ 5   │ │
        ├──┤ ├────┤ ├──┤ #10 │ │
        │              └─────┘ │
    """),
    "a block that lets power on": ("LD a\nFBCALL TON t IN:=b PT:=T#1s Q=>c\nAND t.Q\nOUT c", """
        │   a        ┌─ t : TON ─┐     t.Q       c   │
        ├──┤ ├───────┤EN      ENO├─────┤ ├──────( )──┤
        │          b─┤IN         │                   │
        │       T#1s─┤PT        Q├─c                 │
        │            └───────────┘                   │
    """),
    "a comparison": ("LD=S D0 -5\nOR a\nOUT b", """
        │  D0 -5           b   │
        ├┬──┤=S├──┬───────( )──┤
        ││   a    │            │
        │└──┤ ├───┘            │
    """),
}


def text(drawing: str) -> list[str]:
    return dedent(drawing).strip("\n").rstrip().split("\n")


@pytest.mark.slow
@each_of("name", DRAWINGS)
def test_drawing(name: str) -> None:
    rungs, drawing = DRAWINGS[name]
    assert drawn(rungs).split("\n") == text(drawing)


def test_a_long_rung_goes_on_below() -> None:
    assert drawn("LD a\nAND b\nAND c\nAND d\nAND e\nAND f\nOUT a", 40).split("\n") == text("""
        │   a      b      c      d      e      │
        ├──┤ ├────┤ ├────┤ ├────┤ ├────┤ ├───►1│
        │         f                        a   │
        │ ►1─────┤ ├──────────────────────( )──┤
    """)


def test_addresses_stand_below_and_nothing_collides() -> None:
    here = image("LD Start\nOUT W0.00", "Start AT CIO 0.05 : BOOL;")
    addresses = Annotations(places=lambda name: {"Start": "0.05"}.get(name, ""))
    assert ladder_text(here.rungs[0], annotations=addresses)[1:] == text("""
        │ Start         W0.00  │
        ├──┤ ├───────────( )───┤
        │ 0.05                 │
    """)


def test_what_has_no_drawing_is_shown_as_instructions() -> None:
    assert drawn("LD a\nOUT b\nOR c\nOUT d").split("\n") == ["    LD a", "    OUT b", "    OR c", "    OUT d"]


@pytest.mark.slow
@each_of("width", range(24, 200, 7))
def test_no_line_is_wider_than_asked(width: int) -> None:
    rungs = "LD a\nOR b\n" + "\n".join(f"AND {name}" for name in "cdefab") + "\nOUT a\nAND c\n@MOV #1 D0"
    lines = drawn(rungs, width).split("\n")
    assert max(map(len, lines)) <= width
    assert {line[0] for line in lines} <= set("│├") and {line[-1] for line in lines} <= set("│┤") | {"1", "2", "3"}


# --- power --------------------------------------------------------------------------------------------------------


def executed(rungs: str, on: str, declarations: str = "a, b, c, d, e, f : BOOL;") -> list[RungExecution]:
    """What the first scan saw with these variables ON."""
    plc = Plc(image(rungs, declarations))
    power = PowerFlow(plc.image.rungs, lambda scan: scan == 0)
    for name in on:
        plc.write(f"Main.{name}", True)
    with observing(plc, power):
        plc.scan()
        plc.scan()
    return power.executed


def lit(rungs: str, on: str) -> list[str]:
    made = executed(rungs, on)[0]
    return ladder_text(made.picture, annotations=Annotations(made.states))[1:]


def test_power_ends_at_a_contact_that_is_open() -> None:
    assert lit("LD a\nOR b\nANDNOT c\nOUT d", "ac") == text("""
        ┃    a        c        d   │
        ┣┳━━┫ ┣━━┳━━━┤/├──────( )──┤
        ┃┃   b   ┃                 │
        ┃┗━━┤ ├──┚                 │
    """)


def test_power_is_what_was_seen_and_not_what_is_there_at_the_end_of_the_scan() -> None:
    """The contact was closed when the rung was executed; the next rung opens it."""
    first, second = executed("LD a\nOUT b\nLD P_On\nRSET a\n", "a")
    assert first.states == {0: [True], 1: [True]}
    assert "┫ ┣━━" in ladder_text(first.picture, annotations=Annotations(first.states))[2]
    assert second.picture.steps[1][2] == "RSET"


def test_each_input_of_a_box_has_its_own_power() -> None:
    assert lit("LD a\nLD b\nKEEP c", "a") == text("""
        ┃   a         ┌──────┐ │
        ┣━━┫ ┣━━━━━━━━┥ KEEP │ │
        ┃   b         │ c    │ │
        ┣━━┤ ├────────┤      │ │
        ┃             └──────┘ │
    """)


def test_power_behind_a_block_is_its_ENO() -> None:
    rungs = "LD a\nFBCALL Never x\nOUT b"
    block = "FUNCTION_BLOCK Never VAR_OUTPUT ENO : BOOL; END_VAR ENO := FALSE; END_FUNCTION_BLOCK\n"
    made = compile_text(f"{block}PROGRAM Main VAR a, b : BOOL; END_VAR\nLADDER\n{rungs}\nEND_LADDER\nEND_PROGRAM")
    plc = Plc(made.image)  # type: ignore[arg-type]
    plc.write("Main.a", True)
    power = PowerFlow(plc.image.rungs, lambda scan: True)
    with observing(plc, power):
        plc.scan()
    made = power.executed[0]
    assert ladder_text(made.picture, annotations=Annotations(made.states))[2] == "┣━━┫ ┣━━━┥EN        ENO├──────( )──┤"


@pytest.mark.slow
def test_values_are_those_that_the_rung_read() -> None:
    """The second rung changes what the first one compared and gave to the block."""
    declared = "n : INT; d : WORD := 7; b : BOOL; t : CTU;"
    plc = Plc(image("LD> d &5\nFBCALL CTU t PV:=n\nOUT b\nLD P_On\n++ d", declared))
    values = RungValues(plc.image, plc.memory.areas)
    power = PowerFlow(plc.image.rungs, lambda scan: scan == 0, values.keep)
    plc.write("Main.n", 3)
    with observing(plc, power):
        plc.scan()
    first = power.executed[0]
    assert ladder_text(first.picture, annotations=Annotations(first.states, values=values.of(first)))[1:] == text("""
        ┃ d &5        ┌─ t : CTU ─┐       b   │
        ┣━━┫>┣━━━━━━━━┥EN      ENO┝━━━━━━( )━━┥
        ┃  = 7  n = 3─┤PV         │           │
        ┃             └───────────┘           │
    """)


def test_a_rung_that_was_passed_over_is_not_there() -> None:
    made = executed("LD a\nJMP 1\nLD b\nOUT c\nJME 1", "b")
    assert [len(one.states) for one in made] == [2, 0, 0]
    assert "┫" not in "".join(ladder_text(made[1].picture, annotations=Annotations(made[1].states)))


def test_each_instance_has_its_own_power() -> None:
    plc = Plc(compile_text("""
        FUNCTION_BLOCK Lamp
        VAR_INPUT on : BOOL; END_VAR
        VAR_OUTPUT light : BOOL; END_VAR
        LADDER
            LD on
            OUT light
        END_LADDER
        END_FUNCTION_BLOCK
        PROGRAM Main VAR one, two : Lamp; END_VAR one(on := TRUE); two(on := FALSE); END_PROGRAM
    """).image)
    power = PowerFlow(plc.image.rungs, lambda scan: True)
    with observing(plc, power):
        plc.scan()
    assert [made.states for made in power.executed] == [{0: [True], 1: [True]}, {0: [False], 1: [False]}]
    assert power.executed[0].base != power.executed[1].base


@pytest.mark.slow
def test_a_picture_is_well_formed_and_shows_power() -> None:
    made = executed("LD= D0 #0\nOUT a", "")[0]
    root = ElementTree.fromstring(ladder_svg([ladder_surface(made.picture, 60, Annotations(made.states))]))
    kinds = [(part.tag.rpartition("}")[2], part.get("class")) for part in root]
    assert ("path", None) in kinds and ("path", "power") in kinds and ("text", "head") in kinds
    assert "D0 #0" in [part.text for part in root]
