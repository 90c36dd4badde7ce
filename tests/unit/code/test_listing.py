"""The Image as text for people."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import dedent

import pytest
from expression_rows import NUMBERS, RUNS, STRINGS
from growth import assert_linear
from hand_image import at, behind, const, image, load, own, store
from images import counter_image, task
from rows import each_of
from statement_rows import OBSERVED, PROGRAMS

from fbvm.base.areas import AREAS
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image, Layout
from fbvm.code.listing import listing
from fbvm.code.operations import EXPRESSIONS, OBSERVATIONS, Block
from fbvm.code.shapes import statements


def code_of(program: Image, observations: bool = False) -> str:
    """The lines of the first body without its heading and the margin's width."""
    lines = listing(program, observations).split("\n")
    first = next(number for number, line in enumerate(lines) if line.startswith("body 0"))
    rest = lines[first + 1:]
    return "\n".join(rest[:rest.index("")] if "" in rest else rest)


def test_located_variables_stand_where_they_are() -> None:
    made = compile_text("PROGRAM Main VAR level AT %D7 : INT; lamp AT %Q3.5 : BOOL; END_VAR lamp := level > 0; END_PROGRAM")
    assert made.image is not None
    shown = dict(line.split()[2:0:-1] for line in listing(made.image).splitlines() if line.startswith("symbol "))
    assert (shown["Main.level"], shown["Main.lamp"]) == ("D7", "%QX3.5")


def test_all_around_the_code() -> None:
    program = counter_image(task("Fast", 1, 10_000_000), task("Edge", 2, 0, "Go"), task("Main"))
    shown = listing(program)
    assert shown.startswith(dedent("""\
        layout    184320 bytes: 4096 of slots from 180224
        task      Fast: priority 1, every 10 ms
                  Main at 180224: body 0 Counter
        task      Edge: priority 2, when Go rises
                  Main at 180224: body 0 Counter
        task      Main: priority 0, every cycle
                  Main at 180224: body 0 Counter
        symbol    180224       Main : Counter
        symbol    180232       Main.n : INT
        symbol    180234       Main.done : BOOL
        symbol    180236       Main.kept : INT
        symbol    180238       Main.step : INT
        symbol    180240       Main.started : TIME
        symbol    180248       Main.limit : INT
        symbol    180324       Go : BOOL
        initial   180238       01 00
        initial   180248       05 00
        retained  180236       Main.kept, 2 bytes

        body 0  PROGRAM Counter, instance of 32 bytes, counter.st
                  charge 4 @4:5
                  store i16 self+8 <- add i16 (load i16 self+8) (load i16 self+14)
        """))
    assert "          store u16 D200 <- add u16 (load u16 D200) 1\n" in shown


def test_e_banks_are_named() -> None:
    program = image()
    shown = listing(Image(Layout(10, ("E0", "E1")), (), (), {}, ((184320, b"\1"), (184323, bytes(50))), (),
        program.sites))
    assert shown.split("\n") == [
        "layout    315392 bytes: 10 of slots from 180224, E banks E0 E1",
        "initial   E0_0         01",
        "initial   E0_1+1       " + "00 " * 32 + "... 50 bytes",
    ]


def test_areas_for_sizes_are_named() -> None:
    sized = Layout(10, ("E0",), (), ("%QW", "%QX"))
    shown = listing(Image(sized, (), (), {}, ((184320, b"\1"), (184323, b"\2"), (188416, b"\4")), (), image().sites))
    assert shown.split("\n") == [
        "layout    258048 bytes: 10 of slots from 180224, E banks E0",
        "apart     %QW at 184320 %QX at 188416",
        "initial   %QW0         01",
        "initial   %QW1+1       02",
        "initial   %QX0         04",
    ]


def test_statements_stand_beside_their_lines() -> None:
    t1 = ("tmp", "i16", 1)
    code: Block = (
        ("observe", "statement", 3, None),
        ("let", 1, "i16", ("neg", "i16", load("i16", 2))),
        ("observe", "statement", 4, None),
        ("if", ((load("b", 8), (("observe", "statement", 5, None), ("return",))),
                (("not", "b", load("b", 9)), (("call", 0, own(8)), ("call", 0, None)))), (("stop", "R0109", 12),)),
        ("case", "i16", t1, ((((1, 1), (3, 5)), (("copy", at(0), at(8), 4),)),), (("fill", at(0), b"\1\2"),)),
        ("loop", (("if", ((("gt", "b", "i16", t1, const("i16", 9)), (("exit",),)),), ()),), (("next",),), ()),
        ("store", "i16", behind(load("ref", 16), 4, (2, load("u8", 3))), ("div", "i16", t1, const("i16", -3), 7)),
        ("store_bit", ("abs", AREAS["CIO"].offset + 20, ()), 3, const("b", 1)),
        ("store_text", at(64), 20, ("concat", "s8", const("s8", b"it's"), ("to_text", "s8", "INT", t1))),
        ("charge", 3, 9), ("due", ("now", "i64")),
        ("store", "u8", ("abs", -5, ((1, load("i64", 0)),)), ("mux", "u8", const("i64", 1), (t1, load("u8", 1)), 8)),
    )
    assert code_of(image(code)) == dedent("""\
        3:5       t1 i16 <- neg i16 (load i16 180226)
        4:5       if load b 180232
        5:5         return
                  elsif not b (load b 180233)
                    call Body0 of self+8
                    call Body0
                  else
                    stop R0109 @12:5
                  end
                  case i16 t1
                  1, 3..5:
                    copy 180224 <- 180232 4 bytes
                  else
                    fill 180224 01 02
                  end
                  loop
                    if gt b i16 t1 9
                      exit
                    end
                  body
                    next
                  end
                  store i16 ref (load ref 180240)+4+2*(load u8 180227) <- div i16 t1 -3 @7:5
                  store_bit CIO 10 bit 3 <- TRUE
                  store_text 180288 20 <- concat s8 "it's" (to_text s8 INT t1)
                  charge 3 @9:5
                  due (now i64)
                  store u8 0-5+1*(load i64 180224) <- mux u8 1 (t1, load u8 180225) @8:5""")


def test_observations_are_shown_if_asked_for() -> None:
    assert "observe" not in listing(image(OBSERVED))
    assert code_of(image(OBSERVED), observations=True) == dedent("""\
        3:5       observe read i16 self+2+2*(load i64 180224)
                  store_bit 180233 bit 4 <- TRUE
                  observe write b 180233.4
                  observe rung 17
                  observe contact (1, 'x') load_bit b 180233 bit 4
                  observe write b ref (load ref 180240)
                  observe write ('s8', 20) ref (load ref 180240)+8""")


@each_of("code", [code for _, code, _, _ in PROGRAMS], ids=[name for name, *_ in PROGRAMS])
def test_every_statement_can_be_listed(code: Block) -> None:
    helpers: tuple[Block, ...] = ((), ())
    assert listing(image(code, *helpers), observations=True).count("\n") >= len(code)


@pytest.mark.slow
def test_every_expression_can_be_listed() -> None:
    nodes = [row[1] for row in RUNS] + [row[0] for row in STRINGS]
    for name, machine, a, b, _ in NUMBERS:
        site = (3,) if "site" in EXPRESSIONS[name].operands.split() else ()
        nodes.append((name, machine, const(machine, a), const(machine, b), *site))
    for node in nodes:
        shown = code_of(image((store(node[1], 0, node),)))
        assert f"<- {node[0]} {node[1]}" in shown


def test_objects_that_pointers_are_moved_in() -> None:
    text = """FUNCTION F : INT VAR x : INT; p : POINTER TO INT; END_VAR p := ADR(x); F := p^; END_FUNCTION
PROGRAM Main VAR a : ARRAY [0..4] OF INT; p : POINTER TO INT; x : INT; END_VAR p := ADR(a); x := F(); END_PROGRAM"""
    made = compile_text(text).image
    assert made is not None
    shown = listing(made)
    assert "number 2, 10 bytes" in shown and "1 of what ends while pointers are kept" in shown


def test_lowering_makes_the_observations_of_the_table_and_no_others() -> None:
    made = compile_text("PROGRAM P VAR a, b : BOOL; END_VAR\na := NOT a;\nLADDER\nLD a\nOUT b\nEND_LADDER\nEND_PROGRAM\n").image
    assert made is not None
    assert {node[1] for body in made.bodies for node in statements(body.code) if node[0] == "observe"} == set(OBSERVATIONS)


def test_a_number_that_becomes_a_time_is_checked_only_where_it_may_be_none() -> None:
    made = compile_text("PROGRAM Main VAR l : LTIME; t : TIME; i : LINT; d : DINT; u : ULINT; w : LWORD; END_VAR\n"
                        "l := LINT_TO_LTIME(i);\nl := ULINT_TO_LTIME(u);\nl := LWORD_TO_LTIME(w);\n"
                        "t := DINT_TO_TIME(d);\nt := LINT_TO_TIME(i);\nEND_PROGRAM\n").image
    assert made is not None
    made_of = [line.partition(" <- ")[2] for line in code_of(made).splitlines() if " <- " in line]
    assert made_of == [
        "load i64 self+24", "convert i64 u64 (check u64 (load u64 self+40) 0 9223372036854775807 R0105 @3:6)",
        "convert i64 u64 (load u64 self+48)", "mul i64 (convert i64 i32 (load i32 self+32)) 1000000",
        "mul i64 (check i64 (load i64 self+24) -9223372036854 9223372036854 R0105 @6:6) 1000000",
    ]


@pytest.mark.slow
def test_the_time_of_a_listing_grows_with_its_bodies() -> None:
    def prepared(count: int) -> Callable[[], object]:
        blocks = "".join(f"FUNCTION_BLOCK F{at} VAR n : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK\n" for at in range(count))
        held = "".join(f"f{at} : F{at}; " for at in range(count))
        calls = "".join(f"f{at}(); " for at in range(count))
        made = compile_text(f"{blocks}PROGRAM Main VAR {held}END_VAR {calls}END_PROGRAM").image
        assert made is not None
        return lambda: listing(made)

    assert_linear(prepared, 400)


def test_subscripts_within_subscripts_are_listed_as_deep_as_they_may_be() -> None:
    text = f"PROGRAM Main VAR n : INT; x : ARRAY[0..3] OF INT; END_VAR n := {'x[' * 190}0{']' * 190}; END_PROGRAM"
    image = compile_text(text).image
    assert image is not None
    assert listing(image).count(" R0102 ") == 189
