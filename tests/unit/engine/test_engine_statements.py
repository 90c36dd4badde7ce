"""Every statement of the table of operations, on the plain and the observed build."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hand_image import at, behind, const, execute, image, load, operations_in, own, power_on, store
from rows import each_of
from statement_rows import OBSERVED, PROGRAMS, add, reference

from fbvm.base.areas import BUDGET, DUE, NEVER, SLOTS_OFFSET
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import STATEMENTS, Block, Node
from fbvm.engine.native import engine as native
from fbvm.engine.observation import Observation
from fbvm.engine.python.engine import PythonEngine

INSTANCE = SLOTS_OFFSET + 4096
"""Where the instance of the first body lies."""















@pytest.mark.slow
@each_of(("name", "code", "before", "wanted"), PROGRAMS, ids=[row[0] for row in PROGRAMS])
def test_statement(name: str, code: Block, before: dict[int, bytes], wanted: Any) -> None:
    rig = execute(code, before=before, budget=1000)
    if isinstance(wanted, str):
        assert rig.trap is not None and rig.trap.code == wanted
    else:
        assert rig.trap is None
        assert bytes(rig.memory.u8[SLOTS_OFFSET:SLOTS_OFFSET + len(wanted)]) == wanted


CASES = {
    "one row after the other": ((((1, 1),), 1), (((2, 2), (5, 9)), 2), (((-3, 5),), 3)),
    "by a table": tuple((((row * 10, row * 10 + 3), (row * 10 + 7, row * 10 + 7)), row + 1) for row in range(20)),
    "overlapping, by a table": ((((5, 5),), 1), (((0, 9),), 2), (((3, 20),), 3), (((-5, 30),), 4), (((7, 7),), 5),
     (((25, 99),), 6)),
}


@pytest.mark.parametrize("rows", CASES.values(), ids=CASES)
def test_case_takes_the_first_row_that_fits(rows: Any) -> None:
    code = (("case", "i16", load("i16", 2),
        tuple((labels, (store("u8", 0, const("u8", mark)),)) for labels, mark in rows),
             (store("u8", 0, const("u8", 200)),)),)
    program = image(code)
    memory = power_on(program)
    engine = PythonEngine(program, memory)
    for value in range(-10, 210):
        memory.write(SLOTS_OFFSET + 2, "i16", value)
        assert engine.run(0) is None
        fitting = [mark for labels, mark in rows if any(low <= value <= high for low, high in labels)]
        assert memory.u8[SLOTS_OFFSET] == (fitting[0] if fitting else 200), value


def test_call_gives_the_instance_and_takes_functions_without_one() -> None:
    inner = (("store", "u8", own(1), ("add", "u8", ("load", "u8", own(1)), const("u8", 1))), ("return",))
    function = (add(8, const("i16", 1)),)
    rig = execute((("call", 1, at(0)), ("call", 1, ("self", 8, ())), ("call", 1, behind(reference(0))),
        ("call", 2, None)),
                  inner, function)
    assert rig.slot("u8", 1) == 2
    assert rig.memory.u8[INSTANCE + 9] == 1
    assert rig.slot("i16", 8) == 1


def test_call_of_an_instance_that_is_not_there_traps() -> None:
    rig = execute((("call", 1, behind(load("ref", 0))),), ())
    assert rig.trap is not None and rig.trap.code == "R0110"


ENDS: list[tuple[int, Callable[[Any], Node]]] = [
    (1, lambda place: ("store_bit", place, 7, const("b", 1))), (1, lambda place: ("store_flag", place, const("b", 1))),
    (1, lambda place: ("store_raw", "b", place, const("b", 1))), (2, lambda place: ("store", "i16", place, const("i16", 7))),
    (8, lambda place: ("store_raw", "f64", place, const("f64", 1.5))),
    (4, lambda place: ("store_text", place, 3, const("s8", b"abcd"))),
    (8, lambda place: ("store_text", place, 3, const("s16", "abcd"))),
    (3, lambda place: ("store_text", at(8), 3, ("load_text", "s8", place, 3))),
    (6, lambda place: ("store_text", at(8), 3, ("load_text", "s16", place, 3))),
    (2, lambda place: ("store", "i16", at(8), ("load", "i16", place))),
    (4, lambda place: ("store", "f32", at(8), ("load_raw", "f32", place))),
    (1, lambda place: ("store", "b", at(8), ("load_bit", "b", place, 7))),
    (5, lambda place: ("copy", place, at(8), 5)), (5, lambda place: ("copy", at(8), place, 5)),
    (4, lambda place: ("reverse", place, 4, ((0, 1, 4, 4),))), (3, lambda place: ("fill", place, b"abc")),
    (64, lambda place: ("call", 1, place)),
]
"""How many bytes a statement takes at a place."""


@pytest.mark.slow
@each_of(("size", "statement"), ENDS)
def test_what_lies_behind_a_reference_ends_in_the_memory(size: int, statement: Callable[[Any], Node]) -> None:
    end = image((), ()).layout.size
    for offset, trap in ((end - size, None), (end - size + 1, "R0110"), (4, None), (-1, "R0110")):
        place = ("ref", const("ref", 1 << 40 | 4 << 8 | 255), 3), offset - 4, ()
        program = image((statement(place),), ())
        found = [execute(program=program).trap]
        if native.available():
            found.append(native.NativeEngine(program, power_on(program), 0).run(0))
        assert [each and each.code for each in found] == [trap] * len(found), offset


def test_a_trap_inside_a_call_ends_all() -> None:
    rig = execute((add(0, const("i16", 1)), ("call", 1, None), add(0, const("i16", 1))), (("stop", "R0109", 12),))
    assert rig.slot("i16") == 1
    assert rig.trap is not None
    assert rig.trap.message == "R0109 Main.st:12:5 in Main: FOR step is zero"


def test_an_attempt_gives_what_has_ended_its_body() -> None:
    tried = ("let", 2, "i16", const("i16", 7))
    ways = ((add(0, const("i16", 1)), ("charge", 3, 1)), (("stop", "R0110", 12),), (("stop", "exit", 12),))
    given = []
    for way in ways:
        rig = execute((("attempt", 1, None, 1, True), ("store", "u32", at(4), ("tmp", "u32", 1)), tried), way, budget=50)
        assert rig.trap is None
        given.append((rig.slot("u32", 4), rig.memory.read(BUDGET, "i64")))
    assert given == [(0, 47), (0x51, 50), (2, 50)]


def test_what_an_attempt_gives_is_not_taken_for_what_its_temporary_was_before() -> None:
    """The checks behind it stay, although the only `let` of the temporary is within their bounds."""
    code = (("let", 1, "u32", const("u32", 0)), ("attempt", 1, None, 1, True),
            ("store", "u32", at(4), ("check", "u32", ("tmp", "u32", 1), 0, 9, "R0102", 12)))  # fmt: skip
    rig = execute(code, (("stop", "R0101", 12),))
    assert rig.trap is not None and rig.trap.code == "R0102"
    if native.available():
        program = image(code, (("stop", "R0101", 12),))
        trap = native.NativeEngine(program, power_on(program), 0).run(0)
        assert trap is not None and trap.code == "R0102"


def test_an_attempt_lets_pass_what_it_does_not_catch() -> None:
    """The step budget, whatever a program stops itself by, and traps where only ways out are caught."""
    for code, traps in (("R0104", True), ("R0120", True), ("R0101", False)):
        rig = execute((("attempt", 1, None, 1, traps), add(0, const("i16", 1))), (("stop", code, 12),))
        assert rig.trap is not None and (rig.trap.code, rig.trap.site.line, rig.slot("i16")) == (code, 12, 0)


def test_the_budget_is_stored_also_where_it_ends() -> None:
    rig = execute((("charge", 3, 1), ("charge", 4, 2)), budget=5)
    assert rig.memory.read(BUDGET, "i64") == -2
    assert rig.trap is not None and rig.trap.site.line == 2


@pytest.mark.parametrize(("times", "noted"), [((50, 20, 30), 20), ((), NEVER), ((-5,), -5)])
def test_due_notes_the_earliest(times: tuple[int, ...], noted: int) -> None:
    rig = execute(tuple(("due", const("i64", time)) for time in times))
    assert rig.memory.read(DUE, "i64") == noted


def test_an_endless_loop_ends_by_its_budget() -> None:
    rig = execute((("loop", (), (("charge", 1, 7), add(0, const("i16", 1))), ()),), budget=1000)
    assert rig.trap is not None
    assert rig.trap.message == (
        "R0104 Main.st:7:5 in Main: step budget used up (watchdog): a loop waits for what does not change within a scan, or "
        "there is too much work for one")  # fmt: skip
    assert rig.slot("i16") == 1000




def test_observations_tell_places_and_values() -> None:
    program = image(OBSERVED)
    memory = power_on(program, {0: b"\1", 16: STRUCTS["ref"].pack(1 << 40 | 5000 << 8 | 3)})
    steps = PythonEngine(program, memory, observed=True).observe(0)
    assert list(steps) == [
        Observation("call", -1, (0, INSTANCE)),
        Observation("statement", 3, None), Observation("read", 3, ("i16", INSTANCE + 4, 255)),
        Observation("write", 3, ("b", SLOTS_OFFSET + 9, 4)), Observation("rung", 4, 17),
        Observation("contact", 4, ((1, "x"), True)), Observation("write", 4, ("b", 5000, 3)),
        Observation("write", 4, (("s8", 20), 5008, 255)), Observation("return", -1, (0, INSTANCE)),
    ]


def test_observations_tell_who_is_called() -> None:
    program = image((("observe", "statement", 3, None), ("call", 1, own(8))), (("observe", "statement", 4, None),))
    steps = PythonEngine(program, power_on(program), observed=True).observe(0)
    assert list(steps)[1:-1] == [
        Observation("statement", 3, None), Observation("call", 3, (1, INSTANCE + 8)),
        Observation("statement", 4, None), Observation("return", 3, (1, INSTANCE + 8)),
    ]


def test_an_observed_run_stops_where_it_is_left() -> None:
    program = image((store("u8", 0, const("u8", 1)), ("observe", "statement", 3, None), store("u8", 0, const("u8", 2))))
    memory = power_on(program)
    steps = PythonEngine(program, memory, observed=True).observe(0)
    assert [next(steps).kind, next(steps).kind] == ["call", "statement"]
    assert memory.u8[SLOTS_OFFSET] == 1
    assert next(steps).kind == "return"
    assert memory.u8[SLOTS_OFFSET] == 2


def test_an_observed_build_runs_without_an_observer() -> None:
    program = image(OBSERVED, (("call", 0, at(64)),))
    memory = power_on(program, {16: STRUCTS["ref"].pack(1 << 40 | 5000 << 8 | 3)})
    engine = PythonEngine(program, memory, observed=True)
    assert engine.run(1) is None
    assert memory.u8[SLOTS_OFFSET + 9] == 16


def test_a_plain_build_has_no_observations() -> None:
    program = image(OBSERVED)
    engine = PythonEngine(program, power_on(program))
    assert "Observation" not in engine.source and "# Main.st:3:5 in Main" in engine.source
    with pytest.raises(ValueError, match="plain build"):
        engine.observe(0)


def test_one_body_is_called_by_itself() -> None:
    program = image((add(0, const("i16", 1)),), (("store", "i16", own(0), const("i16", 4)), ("stop", "R0109", 2)))
    memory = power_on(program)
    engine = PythonEngine(program, memory)
    assert engine.call(0) is None
    trap = engine.call(1, SLOTS_OFFSET + 16)
    assert trap is not None and trap.code == "R0109"
    assert memory.read(SLOTS_OFFSET + 16, "i16") == 4


def test_engines_of_one_image_share_its_code_but_not_its_memory() -> None:
    program = image((add(0, const("i16", 1)),))
    first, second = power_on(program), power_on(program)
    engines = [PythonEngine(program, first), PythonEngine(program, second)]
    assert engines[0].source is engines[1].source
    engines[0].run(0)
    engines[0].run(0)
    engines[1].run(0)
    assert (first.read(SLOTS_OFFSET, "i16"), second.read(SLOTS_OFFSET, "i16")) == (2, 1)


def test_a_memory_that_is_too_small_is_refused() -> None:
    small, large = image(()), image((), size=8192)
    with pytest.raises(ValueError, match="the image needs"):
        PythonEngine(large, power_on(small))


def test_every_statement_has_an_example() -> None:
    executed = set().union(*(operations_in(code) for _, code, _, _ in PROGRAMS), operations_in(OBSERVED))
    assert executed | {"case", "call", "attempt", "due"} >= set(STATEMENTS)


MESSAGES: list[tuple[str, Node, str]] = [
    ("R0101", ("div", "i16", const("i16", 7), load("i16", 0), 3), "7 divided by 0"),
    ("R0102", ("check", "i16", const("i16", 11), 0, 9, "R0102", 3), "index 11 outside 0..9"),
    ("R0103", ("check", "i16", const("i16", 11), 0, 9, "R0103", 3), "value 11 outside 0..9"),
    ("R0105", ("check", "i16", const("i16", 11), 0, 9, "R0105", 3), "11 outside 0..9"),
    ("R0105", ("nearest", "i16", "f64", const("f64", 1e9), 3), "1000000000.0 outside -32768..32767"),
    ("R0105", ("convert", "i16", "u8", ("from_bcd", "u8", "u8", const("u8", 10), 3)), "10 has no such form"),
    ("R0105", ("from_text", "i16", "INT", const("s8", b"32768"), 3), "'32768' does not fit INT"),
    ("R0106", ("shl", "i16", const("i16", 1), const("i64", -1), 3), "shift or rotate by -1"),
    ("R0107", ("mux", "i16", const("i64", 2), (const("i16", 1), const("i16", 1)), 3), "selector 2 of MUX outside 0..1"),
    ("R0108", ("length", "i16", ("left", "s8", const("s8", b"a"), const("i64", -1), 3)),
     "string position or length -1 out of range"),
    ("R0110", ("load", "i16", (("ref", const("ref", 0), 3), 0, ())), "reference is null or its object has ended"),
    ("R0111", ("from_text", "i16", "INT", const("s8", b"x"), 3), "text 'x' cannot be converted to INT"),
]


@each_of(("code", "expression", "words"), MESSAGES)
def test_traps_say_their_values(code: str, expression: Node, words: str) -> None:
    rig = execute((store("i16", 0, expression),))
    assert str(rig.trap) == f"{code} Main.st:3:5 in Main: {words}"
