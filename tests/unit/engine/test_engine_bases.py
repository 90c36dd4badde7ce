"""Bodies that have one instance are written for its place; others for any."""

from __future__ import annotations

from dataclasses import replace

from hand_image import SLOTS_BYTES, behind, const, execute, image, load, own, power_on

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.image import ProgramRun, TaskRow
from fbvm.code.operations import Node
from fbvm.code.shapes import statements
from fbvm.engine.bases import fixed_bases
from fbvm.engine.python.engine import PythonEngine

MAIN = SLOTS_OFFSET + SLOTS_BYTES
COUNT = (("store", "u8", own(0), ("add", "u8", ("load", "u8", own(0)), const("u8", 1))),)


def call(body: int, place: object) -> Node:
    return "call", body, place


def only_main_runs(*codes: tuple[Node, ...]) -> dict[int, int]:
    program = image(*codes)
    return fixed_bases(replace(program, tasks=program.tasks[:1]))


def test_an_instance_in_an_instance_in_a_program() -> None:
    assert only_main_runs((call(1, own(8)),), (call(2, own(16)),), COUNT) == {0: MAIN, 1: MAIN + 8, 2: MAIN + 24}


def test_callees_may_stand_before_their_callers() -> None:
    program = image(COUNT, (call(0, own(8)),), (call(1, own(16)),))
    last = replace(program, tasks=program.tasks[2:])
    main = last.tasks[0].programs[0].offset
    assert fixed_bases(last) == {2: main, 1: main + 16, 0: main + 24}


def test_two_instances_have_no_fixed_place_and_neither_has_what_they_hold() -> None:
    assert only_main_runs((call(1, own(8)), call(1, own(16))), (call(2, own(0)),), COUNT) == {0: MAIN}


def test_an_instance_behind_a_reference_or_in_an_array_has_no_fixed_place() -> None:
    for place in (behind(load("ref", 0)), own(8, (32, load("i64", 0)))):
        assert only_main_runs((call(1, place),), COUNT) == {0: MAIN}


def test_a_function_has_none_to_be_known() -> None:
    assert only_main_runs((call(1, None), call(1, None)), ()) == {0: MAIN, 1: 0}


def test_a_program_with_two_instances() -> None:
    program = image(COUNT)
    runs = (ProgramRun("A", 0, MAIN), ProgramRun("B", 0, MAIN + 8))
    program = replace(program, tasks=(TaskRow("Task", 0, 0, "", runs),))
    assert fixed_bases(program) == {}
    memory = power_on(program)
    engine = PythonEngine(program, memory)
    assert engine.run(0) is None
    assert (memory.u8[MAIN], memory.u8[MAIN + 8]) == (1, 1)


def test_calls_are_found_in_all_blocks() -> None:
    inner = call(3, None)
    code = (("if", ((const("b", 1), (inner,)),), (call(1, None),)),
            ("loop", (), (("case", "i16", const("i16", 1), ((((1, 1),), (call(2, None),)),), ()),), ()))
    assert sorted(node[1] for node in statements(code) if node[0] == "call") == [1, 2, 3]


def test_places_are_constants_and_a_call_elsewhere_still_works() -> None:
    rig = execute(COUNT)
    assert f"u8[{MAIN}] = u8_at_{MAIN} = (u8[{MAIN}] + 1) & 255" in rig.engine.source
    assert rig.engine.call(0, MAIN) is None
    assert rig.engine.call(0, MAIN + 8) is None
    assert (rig.memory.u8[MAIN], rig.memory.u8[MAIN + 8]) == (2, 1)
