"""Every statement of the table of operations, on the plain and the observed build."""

from __future__ import annotations

from typing import Any

import pytest
from hand_image import at, behind, const, execute, image, load, operations_in, own, power_on, store
from rows import each_of

from fbvm.base.areas import BUDGET, DUE, NEVER, SLOTS_OFFSET
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import STATEMENTS, Block, Node
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.python.runtime import Observation

INSTANCE = SLOTS_OFFSET + 4096
"""Where the instance of the first body lies."""


def reference(offset: int, bit: int = 255) -> Node:
    return const("ref", 1 << 40 | SLOTS_OFFSET + offset << 8 | bit)


def add(offset: int, value: Node) -> Node:
    """slot := slot + value"""
    return store("i16", offset, ("add", "i16", load("i16", offset), value))


def is_(value: Node, number: int) -> Node:
    return "eq", "b", "i16", value, const("i16", number)


def when(condition: Node, *then: Node) -> Node:
    return "if", ((condition, then),), ()


def counting(first: int, last: int, *body: Node, tmp: int = 1) -> tuple[Node, ...]:
    """FOR t := first TO last DO body"""
    t = ("tmp", "i16", tmp)
    return (("let", tmp, "i16", const("i16", first)),
            ("loop", (when(("gt", "b", "i16", t, const("i16", last)), ("exit",)),), body,
             (("let", tmp, "i16", ("add", "i16", t, const("i16", 1))),)))


T1 = ("tmp", "i16", 1)
WORDS = b"\1\0\2\0\3\0\4\0"

# name, code, bytes before by slot, bytes of slots 0.. after (or the trap's code)
PROGRAMS: list[tuple[str, Block, dict[int, bytes], Any]] = [
    ("store wraps", (store("i8", 0, ("add", "i8", load("i8", 1), const("i8", 1))),), {1: b"\x7f"}, b"\x80\x7f"),
    ("store with terms", (("store", "i16", at(-2, (2, load("u8", 8))), const("i16", 7)),), {8: b"\3"}, b"\0\0\0\0\7"),
    ("store in the instance", (("store", "u8", own(3), const("u8", 9)), store("u8", 0, ("load", "u8", own(3)))), {},
     b"\x09"),
    ("store_raw", (("store_raw", "i32", at(1), const("i32", -2)),), {}, b"\0\xfe\xff\xff\xff\0"),
    ("store_raw wraps", (("store_raw", "u16", at(1), ("sub", "u16", load("u16", 0), const("u16", 1))),), {},
     b"\0\xff\xff\0"),
    ("store_raw rounds to infinity",
     (("store_raw", "f32", at(1), ("mul", "f32", const("f32", 1e30), const("f32", 1e30))),), {},
     b"\0\0\0\x80\x7f"),
    ("store_bit", (("store_bit", at(0), 3, load("b", 8)), ("store_bit", at(1), 7, ("not", "b", load("b", 8)))),
     {0: b"\x01\xff", 8: b"\1"}, b"\x09\x7f"),
    ("store_bit of constants", (("store_bit", at(0), 0, const("b", 1)), ("store_bit", at(1), 0, const("b", 0))),
     {0: b"\x80\xff"},
     b"\x81\xfe"),
    ("store_bit with terms", (("store_bit", at(0, (1, load("u8", 8))), 1, load("b", 8)),), {8: b"\1"}, b"\0\2"),
    ("store_flag of a byte", (("store_flag", behind(reference(2)), load("b", 8)),), {8: b"\5"}, b"\0\0\1"),
    ("store_flag of a bit",
     (("store_flag", behind(reference(2, 6)), const("b", 1)), ("store_flag", behind(reference(2, 1)), const("b", 0))),
     {2: b"\3"}, b"\0\0\x41"),
    ("store_flag without reference", (("store_flag", at(2), const("b", 1)),), {}, b"\0\0\1"),
    ("store_flag to null", (("store_flag", behind(load("ref", 40)), const("b", 1)),), {}, "R0110"),
    ("store behind a reference at any place", (("store", "i16", behind(reference(1), 2), const("i16", -2)),), {},
     b"\0\0\0\xfe\xff"),
    ("store to null", (("store", "i16", behind(load("ref", 40)), const("i16", 1)),), {}, "R0110"),
    ("store_text", (("store_text", at(0), 3, const("s8", b"abcdef")),), {0: b"\xff" * 5}, b"abc\0\xff"),
    ("store_text shorter", (("store_text", at(0), 3, const("s8", b"a")),), {0: b"\xff" * 3}, b"a\0\xff"),
    ("store_text behind a reference", (("store_text", behind(reference(1)), 3, const("s8", b"a")),), {0: b"\xff" * 3},
     b"\xffa\0"),
    ("copy", (("copy", at(0), at(16), 4),), {16: WORDS}, b"\1\0\2\0\0\0"),
    ("copy upward over itself", (("copy", at(2), at(0), 6),), {0: WORDS}, b"\1\0\1\0\2\0\3\0"),
    ("copy downward over itself", (("copy", at(0, (1, const("i64", 0))), at(2), 6),), {0: WORDS}, b"\2\0\3\0\4\0\4\0"),
    ("copy behind references", (("copy", behind(reference(0)), behind(reference(17)), 2),), {16: WORDS}, b"\0\2"),
    ("copy from null", (("copy", at(0), behind(load("ref", 40)), 2),), {}, "R0110"),
    ("fill", (("fill", at(1), b"\7\x08"),), {}, b"\0\7\x08\0"),
    ("reverse", (("reverse", at(0), 8, ((0, 2, 2, 2), (5, 1, 3, 3))),), {0: b"\1\2\3\4\5\6\7\x08"},
     b"\2\1\4\3\5\x08\7\6"),
    ("reverse with gaps", (("reverse", behind(reference(1)), 7, ((0, 2, 4, 2),)),), {0: b"\0\1\2\3\4\5\6\7"},
     b"\0\2\1\3\4\6\5\7"),
    ("reverse at null", (("reverse", behind(load("ref", 40)), 4, ((0, 1, 4, 4),)),), {}, "R0110"),
    ("let is kept", (("let", 1, "i16", load("i16", 0)), store("i16", 0, const("i16", 5)), store("i16", 2, T1)),
     {0: b"\3"}, b"\5\0\3"),
    ("if takes the first that is true", (("if", ((load("b", 8), (store("u8", 0, const("u8", 1)),)),
                                                 (load("b", 9), (store("u8", 0, const("u8", 2)),)),
                                                 (load("b", 10), (store("u8", 0, const("u8", 3)),))), (store("u8", 0,
                                                  const("u8", 4)),)),),
     {9: b"\1\1"}, b"\2"),
    ("if takes the last block", (("if", ((load("b", 8), ()),), (store("u8", 0, const("u8", 4)),)),), {}, b"\4"),
    ("loop", counting(1, 10, add(0, T1)), {}, b"\x37"),
    ("exit", counting(1, 10, when(is_(T1, 4), ("exit",)), add(0, T1)), {}, b"\6"),
    ("next goes to the tail", counting(1, 10, when(is_(T1, 4), ("next",)), add(0, T1)), {}, b"\x33"),
    ("exit in the tail",
     (("loop", (), (add(0, const("i16", 1)), when(is_(load("i16", 0), 3), ("next",)), add(2, const("i16", 1))),
                           (when(is_(load("i16", 0), 5), ("exit",)),)),), {}, b"\5\0\4"),
    ("exit leaves the innermost loop", counting(1, 3, *counting(1, 9, when(is_(("tmp", "i16", 2), 2), ("exit",)),
                                                               add(0, const("i16", 1)), tmp=2)), {}, b"\3"),
    ("return", (add(0, const("i16", 1)), ("return",), add(0, const("i16", 1))), {}, b"\1"),
    ("return from loops", (*counting(1, 3, *counting(1, 3, add(0, T1), ("return",), tmp=2)), add(0, T1)), {}, b"\1"),
    ("charge", (("charge", 100, 3),) * 5, {}, b"\0"),
    ("charge too much", (store("u8", 0, const("u8", 1)), ("charge", 1001, 3), store("u8", 0, const("u8", 2))), {},
     "R0104"),
    ("stop", (("stop", "R0109", 3),), {}, "R0109"),
    ("empty", (), {}, b"\0"),
    ("address before value",
     (("store", "i16", behind(load("ref", 40)), ("div", "i16", const("i16", 1), load("i16", 0), 3)),), {}, "R0110"),
    ("index before value", (("store", "i16", at(0, (2, ("check", "i64", const("i64", 5), 0, 4, "R0102", 3))),
                             ("div", "i16", const("i16", 1), load("i16", 0), 3)),), {}, "R0102"),
    ("flag's address before value", (("store_flag", behind(load("ref", 40)),
                                      ("is_set", "b", "i16",
                                       ("div", "i16", const("i16", 1), load("i16", 0), 3))),), {}, "R0110"),
]


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


def test_a_trap_inside_a_call_ends_all() -> None:
    rig = execute((add(0, const("i16", 1)), ("call", 1, None), add(0, const("i16", 1))), (("stop", "R0109", 12),))
    assert rig.slot("i16") == 1
    assert rig.trap is not None
    assert rig.trap.message == "R0109 Main.st:12:5 in Main: FOR step is zero"


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
    assert rig.trap.message == "R0104 Main.st:7:5 in Main: step budget used up (watchdog)"
    assert rig.slot("i16") == 1000


OBSERVED = (
    ("observe", "statement", 3, None), ("observe", "read", 3, ("i16", own(2, (2, load("i64", 0))), 255)),
    ("store_bit", at(9), 4, const("b", 1)), ("observe", "write", 3, ("b", at(9), 4)),
    ("observe", "rung", 4, 17), ("observe", "contact", 4, ((1, "x"), ("load_bit", "b", at(9), 4))),
    ("observe", "write", 4, ("b", behind(load("ref", 16)), 255)),
    ("observe", "write", 4, (("s8", 20), behind(load("ref", 16), 8), 255)),
)


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
    assert executed | {"case", "call", "due"} >= set(STATEMENTS)


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
