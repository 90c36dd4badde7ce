"""The code of small bodies in place of their calls: the same answers, charges, counts and traps as calls."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest
from depth import times
from hand_image import SLOTS_BYTES, at, const, execute, image, load, own, power_on, store
from test_engine_held import INSTANCE, Maker

from fbvm.base.areas import BUDGET, SLOTS_OFFSET
from fbvm.code.image import Image
from fbvm.code.operations import Block, Node
from fbvm.engine.inlining import GROWTH, LEAST_GROWTH, MOST_STATEMENTS, Inlining
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.trap import NO_INSTANCE

CALLS = (("call", 1, own(0)), ("call", 1, own(32)))
COUNT_UP: Block = (("store", "i16", own(0), ("add", "i16", ("load", "i16", own(0)), const("i16", 1))),)
SUBSCRIPT = ("check", "i64", ("convert", "i64", "u8", ("load", "u8", own(4))), 0, 1, "R0102", 3)
TRAPS: Block = (("store", "u8", own(8, (1, SUBSCRIPT)), const("u8", 1)),)
"""A subscript of 0 to 1, which lies in the instance."""


def calls_of(program: Image, body: int) -> int:
    """How many times the generated Python calls a body."""
    return PythonEngine(program, power_on(program)).source.count(f"p{body}_") - 1


def test_a_small_body_stands_in_place_of_its_calls() -> None:
    program = image(CALLS, COUNT_UP)
    assert calls_of(program, 1) == 0
    rig = execute(program=program)
    assert [rig.memory.read(INSTANCE + offset, "i16") for offset in (0, 32)] == [1, 1]


def test_what_a_body_stored_is_known_behind_it() -> None:
    code = (*CALLS[:1], store("i16", 2, ("load", "i16", own(0))), store("i16", 4, ("load", "i16", own(0))))
    inner = (("store", "i16", own(0), const("i16", 7)),)
    source = PythonEngine(program := image(code, inner), power_on(program)).source
    assert f"i16[{(SLOTS_OFFSET + 2) // 2}] = 7" in source and f"i16[{(SLOTS_OFFSET + 4) // 2}] = 7" in source


CALLED: dict[str, Image] = {
    "with a RETURN": image(CALLS, (("if", ((load("b", 0), (("return",),)),), ()), *COUNT_UP)),
    "with notes of power": replace(image(CALLS, (("mark", 0, (), ("load", "b", own(0))), *COUNT_UP)), marks=2),
    "at a subscript": image((("call", 1, own(0, (32, SUBSCRIPT))),), COUNT_UP),
    "too long": image(CALLS, COUNT_UP * (MOST_STATEMENTS + 1)),
    "too many": image(CALLS * LEAST_GROWTH, COUNT_UP * int(2 + GROWTH * LEAST_GROWTH)),
    "once around": image((("call", 1, own(0)),), (*COUNT_UP, ("if", ((load("b", 0), (("call", 1, own(0)),)),), ()))),
}  # fmt: skip


@pytest.mark.parametrize("program", CALLED.values(), ids=CALLED)
def test_these_are_called(program: Image) -> None:
    assert calls_of(program, 1) >= 1
    assert execute(program=program).trap is None


def test_a_long_chain_ends_where_the_code_is_long_enough() -> None:
    chain = [(*COUNT_UP, ("call", number + 1, own(0))) for number in range(45)]
    inlining = Inlining(program := image(*chain, COUNT_UP), ())
    written = [inlining.of(("call", number, own(0))) for number in range(46)]
    longest = max(sum(node[0] not in ("begin", "end") for node in code) for code in written if code)
    assert 5 < longest <= MOST_STATEMENTS and None in written
    assert execute(program=program).memory.read(INSTANCE, "i16") == 46


def test_a_trap_names_the_instance_whose_code_it_was() -> None:
    for first, second, wanted in ((2, 0, INSTANCE), (1, 2, INSTANCE + 32)):
        program = image((store("u8", SLOTS_BYTES + 4, const("u8", first)), store("u8", SLOTS_BYTES + 36, const("u8", second)),
                         *CALLS), TRAPS)  # fmt: skip
        rig = execute(program=program)
        assert rig.trap is not None and (rig.trap.code, rig.trap.instance) == ("R0102", wanted)
        assert calls_of(program, 1) == 0


def test_a_trap_of_a_function_names_no_instance() -> None:
    index = ("check", "i64", ("convert", "i64", "u8", load("u8", 0)), 0, 1, "R0102", 3)
    program = image((("call", 1, None),), (store("u8", 8, ("load", "u8", at(8, (1, index)))),))
    program = replace(program, bodies=(program.bodies[0], replace(program.bodies[1], kind="FUNCTION", instance_size=0)))
    rig = execute(program=program, before={0: b"\x02"})
    assert rig.trap is not None and rig.trap.instance == NO_INSTANCE
    assert calls_of(program, 1) == 0


def test_a_trap_within_two_bodies_names_the_inner_instance() -> None:
    outer = (("call", 2, own(16)), *COUNT_UP)
    program = image((("call", 1, own(0)), ("call", 1, own(32))), outer, TRAPS)
    memory = power_on(program)
    memory.write(INSTANCE + 32 + 16 + 4, "u8", 2)
    engine = PythonEngine(program, memory)
    trap = engine.run(0)
    assert trap is not None and trap.instance == INSTANCE + 48
    assert [memory.read(INSTANCE + offset, "i16") for offset in (0, 32)] == [1, 0]


def test_a_trap_in_blocks_too_deep_for_python_names_its_instance() -> None:
    code: Block = CALLS
    for _ in range(130):
        code = (("if", ((load("b", 20), code),), ()),)
    program = image(code, TRAPS)
    memory = power_on(program, {20: b"\1"})
    memory.write(INSTANCE + 32 + 4, "u8", 2)
    trap = PythonEngine(program, memory).run(0)
    assert trap is not None and trap.instance == INSTANCE + 32 and calls_of(program, 1) == 0


@pytest.mark.parametrize("budget", range(9))
def test_charges_are_those_of_calls(budget: int) -> None:
    program = image((("charge", 2, 1), *CALLS, ("charge", 1, 4)), (("charge", 3, 2), *COUNT_UP))
    rig = execute(program=program, budget=budget)
    assert calls_of(program, 1) == 0 and rig.trap is not None
    assert (rig.trap.code, rig.trap.instance) == ("R0104", INSTANCE + 32 * (5 <= budget < 8))


def test_temporaries_are_of_one_body_each() -> None:
    def kept(number: int, offset: int) -> tuple[Node, ...]:
        return ("let", 0, "i16", const("i16", number)), ("let", 1, "i16", load("i16", offset))

    def result(offset: int) -> Node:
        return store("i16", offset, ("add", "i16", ("tmp", "i16", 0), ("tmp", "i16", 1)))

    rig = execute((*kept(10, 0), *CALLS, result(2)), (*kept(20, 2), result(4)), before={0: b"\5\0", 2: b"\6\0"})
    assert (rig.slot("i16", 2), rig.slot("i16", 4)) == (15, 26)


def test_a_function_of_python_takes_the_place_of_every_call() -> None:
    program = image(CALLS, COUNT_UP)
    engine = PythonEngine(program, power_on(program))
    found: list[int] = []
    engine.substitute(1, found.append)
    assert engine.run(0) is None and found == [INSTANCE, INSTANCE + 32]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(times(20, 20)))
def test_random_bodies_in_each_other(seed: int) -> None:
    """Bodies over bytes that overlap, two in each other: memory, steps and traps as with calls."""
    maker = Maker(Random(1_000 + seed))

    def called(number: int, block: Block) -> Block:
        return tuple(("call", number, node[2]) if node[0] == "call" else node for node in block)

    leaf = tuple(node for node in maker.block(0) if node[0] != "call")
    program = image(maker.block(2), called(2, (*maker.block(0), ("call", 1, own(0)))), leaf)
    before = {0: bytes(maker.random.randrange(256) for _ in range(16))}
    memories = [power_on(program, before, budget=100) for _ in range(2)]
    plain, observed = PythonEngine(program, memories[0]), PythonEngine(program, memories[1], observed=True)
    for budget in (200, maker.random.randrange(20)):
        for memory in memories:
            memory.write(BUDGET, "i64", budget)
        assert repr(plain.run(0)) == repr(observed.run(0))
        assert bytes(memories[0].snapshot()) == bytes(memories[1].snapshot())
