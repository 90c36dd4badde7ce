"""What Python's parser and compiler do not take as it stands: deep nesting, long chains, long calls."""

from __future__ import annotations

import linecache
import sys
import traceback
from functools import cache

import pytest
from hand_image import at, const, execute, image, load, own, power_on, store
from rows import each_of

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.image import Image
from fbvm.code.operations import Block, Node
from fbvm.engine.python.engine import PythonEngine

ONE = const("i16", 1)


def add(offset: int, value: Node) -> Node:
    return store("i16", offset, ("add", "i16", load("i16", offset), value))


def nested_ifs(depth: int, inner: Block) -> Block:
    for _ in range(depth):
        inner = (("if", ((("ne", "b", "i16", load("i16", 40), ONE), inner),), (store("u8", 50, const("u8", 1)),)),)
    return inner


def nested_loops(depth: int, inner: Block, times: int = 2) -> Block:
    """Loops, the innermost around `inner`, each counting in a temporary of its own."""
    for number in range(depth):
        t = ("tmp", "i16", number)
        inner = (("let", number, "i16", const("i16", 0)),
                 ("loop", (("if", ((("ge", "b", "i16", t, const("i16", times)), (("exit",),)),), ()),), inner,
                  (("let", number, "i16", ("add", "i16", t, ONE)),)))
    return inner


@pytest.mark.slow
@pytest.mark.parametrize("depth", [10, 59, 60, 61, 99, 250])
def test_blocks_nest(depth: int) -> None:
    rig = execute((*nested_ifs(depth, (add(0, ONE), ("let", 1, "i16", load("i16", 0)))),
        store("i16", 2, ("tmp", "i16", 1))))
    assert rig.trap is None
    assert (rig.slot("i16", 0), rig.slot("i16", 2)) == (1, 1)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [14, 15, 16, 21, 40])
def test_loops_nest(depth: int) -> None:
    rig = execute(nested_loops(depth, (add(0, ONE),), times=1))
    assert rig.slot("i16", 0) == 1
    rig = execute(nested_loops(depth, (add(0, ONE), ("return",)), times=3))
    assert rig.slot("i16", 0) == 1


def test_loops_nest_behind_others() -> None:
    rig = execute((*nested_loops(12, (add(0, ONE),), times=1), *nested_loops(21, (add(2, ONE),), times=1)))
    assert (rig.slot("i16", 0), rig.slot("i16", 2)) == (1, 1)


@pytest.mark.slow
@each_of("depth", [3, 58, 61, 70, 130])
@each_of(("leave", "counted", "after"), [("exit", 4, 1), ("next", 9, 1), ("return", 4, 0)])
def test_leaving_a_loop_from_deep_inside(depth: int, leave: str, counted: int, after: int) -> None:
    t = ("tmp", "i16", 9)
    inside = ("if", ((("eq", "b", "i16", t, const("i16", 4)), ((leave,),)),), ())
    rig = execute((("let", 9, "i16", const("i16", 0)),
                   ("loop", (("if", ((("ge", "b", "i16", t, const("i16", 10)), (("exit",),)),), ()),),
                    (*nested_ifs(depth, (inside,)), add(0, ONE)),
                    (("let", 9, "i16", ("add", "i16", t, ONE)),)),
                   add(2, ONE)))
    assert (rig.slot("i16", 0), rig.slot("i16", 2)) == (counted, after)


@pytest.mark.slow
def test_a_case_in_deep_blocks_reads_its_value_from_outside() -> None:
    rows = tuple((((row, row),), (store("i16", 0, const("i16", row)),)) for row in range(300))
    rig = execute(nested_ifs(58, (("case", "i16", load("i16", 4), rows, ()),)), before={4: b"\xff\0"})
    assert rig.slot("i16", 0) == 255


@cache
def branches() -> Image:
    """IF with 2000 branches, of which each compares the same value."""
    rows = tuple((("eq", "b", "i16", load("i16", 4), const("i16", row)), (store("i16", 0, const("i16", row)),))
                 for row in range(2000))
    return image((("if", rows, (store("i16", 0, const("i16", -1)),)),))


@pytest.mark.slow
@pytest.mark.parametrize("value", [0, 1, 24, 25, 26, 999, 1999, 2500])
def test_a_long_chain_of_branches(value: int) -> None:
    rig = execute(program=branches(), before={4: value.to_bytes(2, "little")})
    assert rig.slot("i16", 0) == (value if value < 2000 else -1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["add", "mul", "sub", "min", "div"])
def test_expressions_nest_to_both_sides(name: str) -> None:
    site = (3,) if name == "div" else ()
    left, right = load("i16", 4), load("i16", 4)
    for _ in range(300):
        left, right = (name, "i16", left, ONE, *site), (name, "i16", ONE, right, *site)
    number = wanted = 1
    for _ in range(300):
        number, wanted = {"add": (number + 1, wanted + 1), "mul": (1, 1), "sub": (number - 1, 1 - wanted),
                          "min": (1, 1), "div": (1, 1)}[name]
    rig = execute((store("i16", 0, left), store("i16", 2, right)), before={4: b"\1"})
    assert (rig.slot("i16", 0), rig.slot("i16", 2)) == (number, wanted)


@pytest.mark.slow
def test_deep_conditions_and_addresses_read_temporaries_and_instance() -> None:
    condition: Node = ("eq", "b", "i16", ("tmp", "i16", 1), ("load", "i16", own(4)))
    index: Node = ("convert", "i64", "i16", ("tmp", "i16", 1))
    for _ in range(100):
        condition = ("and_then", "b", const("b", 1), ("not", "b", ("not", "b", condition)))
        index = ("add", "i64", index, const("i64", 0))
    rig = execute((("store", "i16", own(4), const("i16", 7)), ("let", 1, "i16", const("i16", 7)),
                   ("if", ((condition, (("store", "u8", at(0, (1, index)), const("u8", 5)),)),), ())))
    assert rig.slot("u8", 7) == 5


@pytest.mark.slow
def test_a_chain_of_a_thousand_calls() -> None:
    count = 1200
    codes = [(add(0, ONE), ("call", number + 1, None)) for number in range(count - 1)]
    before = sys.getrecursionlimit()
    try:
        rig = execute(*codes, (add(0, ONE),))
    finally:
        sys.setrecursionlimit(before)
    assert rig.slot("i16", 0) == count


def test_tracebacks_show_the_generated_source() -> None:
    program = image((store("u8", 0, const("u8", 1)), store("u8", 1, ("load", "u8", ("abs", 1 << 40, ())))))
    engine = PythonEngine(program, power_on(program))
    with pytest.raises(IndexError) as caught:
        engine.run(0)
    shown = "".join(traceback.format_exception(caught.value))
    assert f"u8[{SLOTS_OFFSET + 1}] = u8[{1 << 40}]" in shown


def test_a_program_that_nobody_has_leaves_nothing() -> None:
    program = image((store("u8", 0, const("u8", 1)),))
    engine = PythonEngine(program, power_on(program))
    names = {name for name in linecache.cache if name.startswith("<fbvm")}
    mine = [name for name in names if linecache.getlines(name) == engine.source.splitlines(keepends=True)]
    assert mine
    del engine, program
    assert not names.issubset(linecache.cache)


def test_an_image_is_made_into_python_once() -> None:
    program = image((store("u8", 0, const("u8", 1)),))
    before = PythonEngine(program, power_on(program)).source
    assert PythonEngine(program, power_on(program)).source is before
