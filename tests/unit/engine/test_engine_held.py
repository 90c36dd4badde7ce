"""Values that the Python engine holds in local variables: the same answers as from the memory, and fewer looks into it."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Any

import pytest
from depth import times
from hand_image import at, behind, const, execute, image, load, own, power_on, store

from fbvm.base.areas import BUDGET, SLOTS_OFFSET
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import SIZES, Block, Node
from fbvm.engine.bases import base_ranges
from fbvm.engine.effects import Effects, Span
from fbvm.engine.python import held
from fbvm.engine.python.engine import PythonEngine

INSTANCE = SLOTS_OFFSET + 4096
"""Where the instance of the first body lies."""
X, Y = load("i16", 0), load("i16", 2)


def plus(node: Node, number: int) -> Node:
    return "add", "i16", node, const("i16", number)


def source_of(*codes: Block) -> str:
    program = image(*codes)
    return PythonEngine(program, power_on(program)).source


def looks(code: Block, offset: int) -> int:
    """How many times the generated Python reads or writes an INT among the slots."""
    return source_of(code).count(f"i16[{(SLOTS_OFFSET + offset) // 2}]")


def test_what_was_stored_or_loaded_is_not_read_again() -> None:
    code = (store("i16", 0, ("convert", "i16", "u8", load("u8", 8))), store("i16", 2, X), store("i16", 4, X), store("i16", 6, Y))
    assert (looks(code, 0), looks(code, 2)) == (1, 1)
    rig = execute(code, before={8: b"\xc8"})
    assert [rig.slot("i16", offset) for offset in (0, 2, 4, 6)] == [200] * 4
    assert looks((store("i16", 2, X), store("i16", 4, X)), 0) == 1


def test_a_part_that_is_a_function_of_its_own_holds_values_itself() -> None:
    code: Block = (store("i16", 2, X), store("i16", 4, X))
    for _ in range(60):
        code = (("if", ((("ne", "b", "i16", Y, const("i16", 9)), code),), ()),)
    rig = execute(code, before={0: b"\7\0"})
    assert [rig.slot("i16", offset) for offset in (2, 4)] == [7, 7]
    assert "def o" in source_of(code) and looks(code, 0) == 1


def test_what_one_place_alone_reads_is_not_held() -> None:
    assert "i16_at" not in source_of((store("i16", 2, X),))


def test_of_many_values_so_many_are_held_and_the_others_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    code = (store("i16", 4, X), store("i16", 6, Y), store("i16", 8, X), store("i16", 10, Y))
    assert (looks(code, 0), looks(code, 2)) == (1, 1)
    monkeypatch.setattr(held, "MOST_NAMES", 1)
    assert (looks(code, 0), looks(code, 2)) == (1, 2)
    rig = execute(code, before={0: b"\1\0\2\0"})
    assert [rig.slot("i16", offset) for offset in (4, 6, 8, 10)] == [1, 2, 1, 2]


def test_the_range_of_a_temporary_is_known_behind_it() -> None:
    """A sum that its type holds for sure is not wrapped."""
    summed = store("i16", 0, plus(("tmp", "i16", 1), 1))
    known = source_of((("let", 1, "i16", ("convert", "i16", "u8", load("u8", 8))), summed))
    unknown = source_of((("let", 1, "i16", load("i16", 8)), summed))
    assert "t1 + 1" in known and "t1 + 1" in unknown and len(known.splitlines()) == len(unknown.splitlines())
    line = next(line for line in known.splitlines() if "t1 + 1" in line)
    assert line.strip().endswith("= t1 + 1") and line not in unknown


FORGETTING: dict[str, tuple[Block, int]] = {
    "another type": ((store("u8", 1, const("u8", 1)),), 256 + 5),
    "an array": ((("store", "u8", at(0, (1, ("check", "i64", ("convert", "i64", "u8", load("u8", 20)), 0, 3, "R0102", 1))),
                   const("u8", 9)),), 9),
    "a reference": ((("store_raw", "i16", behind(("reference", "ref", at(0), 255)), const("i16", 8)),), 8),
    "a copy": ((("copy", at(0), at(16), 4),), 77),
    "a text": ((("store_text", at(0), 5, const("s8", b"a")),), 97),
    "a bit": ((("store_bit", at(1), 0, const("b", 1)),), 256 + 5),
    "initial values": ((("fill", at(0), b"\x07\x00"),), 7),
    "bytes the other way round": ((("reverse", at(0), 2, ((0, 1, 2, 2),)),), 5 << 8),
}  # fmt: skip


@pytest.mark.parametrize(("change", "wanted"), FORGETTING.values(), ids=FORGETTING)
def test_a_store_elsewhere_that_is_here_too_is_seen(change: Block, wanted: int) -> None:
    code = (store("i16", 0, const("i16", 5)), store("i16", 4, X), *change, store("i16", 6, X))
    rig = execute(code, before={16: b"\x4d\x00"})
    assert rig.trap is None and (rig.slot("i16", 4), rig.slot("i16", 6)) == (5, wanted)


def test_a_store_of_what_is_held_itself_is_seen_in_what_overlaps_it() -> None:
    high, low = load("u8", 1), load("u8", 0)
    code = (store("i16", 0, const("i16", 5)), store("i16", 4, X), store("u8", 1, const("u8", 1)), store("u8", 9, high),
            store("u8", 11, high), store("i16", 6, X), store("u8", 13, low))  # fmt: skip
    rig = execute(code)
    assert [rig.slot("i16", 4), rig.slot("i16", 6), rig.slot("u8", 9), rig.slot("u8", 13)] == [5, 256 + 5, 1, 5]


def test_a_call_is_seen_with_all_that_the_body_calls() -> None:
    deep = (("store", "i16", at(0), const("i16", 30)),)
    code = (store("i16", 0, const("i16", 5)), store("i16", 2, const("i16", 6)), ("call", 1, own(0)), store("i16", 4, X),
            store("i16", 6, Y))  # fmt: skip
    rig = execute(code, (("call", 2, None),), deep)
    assert (rig.slot("i16", 4), rig.slot("i16", 6)) == (30, 6)


def test_what_a_call_does_not_store_is_held_through_it() -> None:
    program = image((store("i16", 2, Y), ("call", 1, own(0)), store("i16", 4, Y)), (store("i16", 0, const("i16", 1)),))
    effects = Effects(program, base_ranges(program), ())
    assert effects.of(("call", 1, own(0))) == (Span("abs", SLOTS_OFFSET, SLOTS_OFFSET + 2),)
    assert source_of(*(body.code for body in program.bodies)).count(f"= i16[{SLOTS_OFFSET // 2 + 1}]") == 1


def test_a_function_of_python_in_place_of_a_body_may_store_anywhere() -> None:
    program = image((store("i16", 2, Y), ("call", 1, None), store("i16", 4, Y)), ())
    engine = PythonEngine(program, memory := power_on(program))
    engine.substitute(1, lambda base: memory.write(SLOTS_OFFSET + 2, "i16", 9))
    assert engine.run(0) is None and memory.read(SLOTS_OFFSET + 4, "i16") == 9


def test_an_instance_may_lie_where_the_program_stores() -> None:
    """Two bodies call one: it is written for any instance between theirs, and the slots are not there."""
    inner = (("store", "i16", own(0), const("i16", 5)), ("store", "i16", own(2), ("load", "i16", own(0))),
             ("store", "i16", at(4096), const("i16", 6)), ("store", "i16", own(4), ("load", "i16", own(0))),
             ("store", "i16", at(0), ("load", "i16", own(0))), ("store", "i16", own(6), ("load", "i16", own(0))))  # fmt: skip
    program = image((("call", 1, own(0)), ("call", 1, own(32))), inner)
    program = replace(program, tasks=program.tasks[:1])
    rig = execute(program=program)
    assert [rig.memory.read(INSTANCE + 2 * n, "i16") for n in range(4)] == [6, 5, 6, 6]
    assert [rig.memory.read(INSTANCE + 32 + 2 * n, "i16") for n in range(4)] == [5, 5, 5, 5]
    assert rig.slot("i16") == 5
    assert rig.engine.call(1, SLOTS_OFFSET) is None
    assert [rig.slot("i16", 2 * n) for n in range(4)] == [5] * 4


@pytest.mark.parametrize(("instance", "seen"), [(0, [5, 6, 6, 7]), (32, [5, 5, 6, 6])])
def test_a_body_for_any_instance_forgets_what_may_be_the_same_place(instance: int, seen: list[int]) -> None:
    """The first instance begins at the slot 4096, the second does not: a store to the one may be a store to the other."""
    def look(place: Any, to: int) -> Node:
        return "store", "i16", at(to), ("load", "i16", place)

    inner = (("store", "i16", own(0), const("i16", 5)), look(own(0), 0), ("store", "i16", at(4096), const("i16", 6)),
             look(own(0), 2), look(at(4096), 4), ("store", "i16", own(0), const("i16", 7)), look(at(4096), 6))  # fmt: skip
    program = image((("call", 1, own(0)), ("call", 1, own(32))), inner)
    program = replace(program, tasks=program.tasks[:1])
    engine = PythonEngine(program, memory := power_on(program))
    assert "i16_0" in engine.source and "i16_at_" in engine.source, "both are held"
    assert engine.call(1, INSTANCE + instance) is None
    assert [memory.read(SLOTS_OFFSET + 2 * n, "i16") for n in range(4)] == seen


def test_branches_agree_or_it_is_forgotten() -> None:
    rows = (load("b", 20), (store("i16", 0, const("i16", 5)),)), (load("b", 21), (store("i16", 0, const("i16", 6)),))
    code = (("if", rows, ()), store("i16", 2, X), store("i16", 4, X))
    assert [execute(code, before={0: b"\x09", 20: bits}).slot("i16", 4) for bits in (b"\1\0", b"\0\1", b"\0\0")] == [5, 6, 9]


@pytest.mark.parametrize("leave", [("next",), ("exit",), ("return",), ("stop", "R0109", 1), ("raise", const("u32", 1), 1)])
def test_a_branch_that_is_left_does_not_forget_what_the_other_way_holds(leave: Node) -> None:
    """The branch stores to a byte of X.  Where the ways do meet, X is read again."""
    def passes(*behind: Node) -> Block:
        forgets = ("if", ((load("b", 20), (store("u8", 1, const("u8", 1)), *behind)),), ())
        return (("loop", (("if", ((load("b", 21), (("exit",),)),), ()),), (store("i16", 4, X), forgets, store("i16", 6, X)), ()),)

    assert (looks(passes(leave), 0), looks(passes(), 0)) == (1, 2)


def test_a_variable_is_held_from_pass_to_pass() -> None:
    """A FOR from 0 to 9: its variable is read once from the memory, behind the loop not at all."""
    loop = ("loop", (("if", ((("gt", "b", "i16", X, const("i16", 9)), (("exit",),)),), ()),),
            (store("i16", 2, ("add", "i16", Y, X)),), (store("i16", 0, plus(X, 1)),))  # fmt: skip
    code = (store("i16", 0, const("i16", 0)), store("i16", 2, const("i16", 0)), loop, store("i16", 4, X))
    rig = execute(code)
    assert (rig.slot("i16", 2), rig.slot("i16", 4)) == (45, 10)
    assert (looks(code, 0), looks(code, 2)) == (2, 2)
    assert "_at_" in rig.engine.source and f"i16_at_{SLOTS_OFFSET} + 1\n" in rig.engine.source  # behind `> 9` no wrap


def test_a_real_is_held_as_the_memory_rounds_it() -> None:
    third = ("div", "f32", const("f32", 1.0), load("f32", 8))
    product = ("mul", "f32", ("sub", "f32", load("f32", 0), load("f32", 8)), load("f32", 0))
    code = (store("f32", 0, third), store("f32", 4, product), store("u32", 12, load("u32", 8)),
            store("f32", 16, ("add", "f32", load("f32", 12), load("f32", 8))))  # fmt: skip
    rig = execute(code, before={8: STRUCTS["f32"].pack(3.0)})
    assert rig.slot("f32") == STRUCTS["f32"].unpack(STRUCTS["f32"].pack(1 / 3))[0]
    assert rig.slot("f32", 16) == 6.0


def test_the_steps_that_are_left_are_in_the_memory_behind_a_run_and_a_trap() -> None:
    index = ("check", "i64", ("convert", "i64", "i16", X), 0, 1, "R0102", 3)
    inner = (("charge", 5, 1), ("store", "u8", at(8, (1, index)), const("u8", 1)), ("charge", 7, 2))
    code = (("charge", 2, 1), ("call", 1, None), ("charge", 3, 1))
    for before, wanted in ((b"\1\0", 83), (b"\2\0", 93)):
        assert execute(code, inner, before={0: before}, budget=100).memory.read(BUDGET, "i64") == wanted


def test_steps_are_counted_where_a_reference_may_find_them() -> None:
    budget = ("load_raw", "i64", behind(const("ref", 1 << 40 | BUDGET << 8 | 255)))
    inner = (("charge", 5, 1), ("store", "i64", at(8), budget))
    rig = execute((("charge", 2, 1), ("call", 1, None), ("charge", 3, 1)), inner, budget=100)
    assert (rig.slot("i64", 8), rig.memory.read(BUDGET, "i64")) == (93, 90)


def test_a_function_of_python_finds_the_steps_in_the_memory() -> None:
    program = image((("charge", 2, 1), ("call", 1, None), ("charge", 3, 1)), (("charge", 50, 1),))
    engine = PythonEngine(program, memory := power_on(program, budget=100))
    found = []
    engine.substitute(1, lambda base: found.append(memory.read(BUDGET, "i64")))
    assert engine.run(0) is None
    assert (found, memory.read(BUDGET, "i64")) == ([98], 95)


class Maker:
    """Makes code over a few bytes in which all types overlap."""

    def __init__(self, random: Random) -> None:
        self.random = random

    def place(self, machine: str) -> Any:
        size, pick = SIZES[machine], self.random.randrange
        base = self.random.choice((at, own))
        if pick(6) == 0:
            return base(0, (size, ("check", "i64", ("convert", "i64", "u8", ("load", "u8", base(pick(16)))), 0, 16 // size - 1,
                                   "R0102", 1)))  # fmt: skip
        return base(pick(16 // size) * size)

    def value(self, machine: str, depth: int = 2) -> Node:
        pick = self.random.randrange
        if depth == 0 or pick(3) == 0:
            number = {"b": pick(2), "f32": float(pick(9)), "u8": pick(256)}.get(machine, pick(40) - 20 * (machine == "i16"))
            return ("load", machine, self.place(machine)) if pick(4) else const(machine, number)
        if machine == "b":
            kind = self.random.choice(("i16", "u8", "f32"))
            inner = (self.value("b", depth - 1), self.value("b", depth - 1))
            compare = (self.random.choice(("lt", "ge", "eq", "gt")), "b", kind, ("load", kind, self.place(kind)),
                       self.value(kind, depth - 1))  # fmt: skip
            return compare if pick(2) else (self.random.choice(("and", "or", "and_then", "or_else")), "b", *inner)
        if pick(3) == 0:
            source = "u8" if machine == "f32" else self.random.choice(("u8", "i16", "u32"))
            return ("convert", machine, source, self.value(source, depth - 1))
        name = self.random.choice(("add", "sub", "mul"))
        return name, machine, self.value(machine, depth - 1), self.value(machine, depth - 1)

    def statement(self, depth: int, looped: bool) -> Node:
        choice = self.random.randrange(12 if depth else 7)
        if choice == 0:
            return ("copy", self.place("u32"), self.place("u32"), 4)
        if choice == 1:
            return self.random.choice((("call", 1, own(0)), ("call", 1, at(0)), ("exit",) if looped else ("charge", 1, 2)))
        if choice < 7:
            machine = self.random.choice(("b", "u8", "i16", "u16", "u32", "f32"))
            address = self.place(machine)
            if machine == "u32" and self.random.randrange(2):
                return ("store", machine, address, ("load", machine, self.place(machine)))
            return ("store", machine, address, self.value(machine))
        if choice < 10:
            rows = tuple((self.value("b"), self.block(depth - 1, looped)) for _ in range(self.random.randrange(1, 3)))
            return ("if", rows, self.block(depth - 1, looped) if self.random.randrange(2) else ())
        tail = (("store", "i16", own(0), ("add", "i16", ("load", "i16", own(0)), const("i16", 1))),)
        head = (("charge", 1, 1), ("if", ((self.value("b"), (("exit",),)),), ()))
        return ("loop", head, (*self.block(depth - 1, True), *((("next",),) * (self.random.randrange(5) == 0))), tail)

    def block(self, depth: int, looped: bool = False) -> Block:
        return tuple(self.statement(depth, looped) for _ in range(self.random.randrange(1, 7)))


@pytest.mark.slow
@pytest.mark.parametrize("anywhere", [False, True], ids=["places known", "instance over the slots"])
@pytest.mark.parametrize("seed", range(times(30, 30)))
def test_random_code_over_bytes_that_overlap(seed: int, anywhere: bool) -> None:
    maker = Maker(Random(seed))
    called = Maker(Random(-seed)).block(0)
    called = tuple(("charge", 1, 2) if node[0] == "call" else node for node in called)
    program = image(maker.block(3), called)
    before = {0: bytes(maker.random.randrange(256) for _ in range(16))}
    memories = [power_on(program, before, budget=200) for _ in range(2)]
    plain, observed = PythonEngine(program, memories[0]), PythonEngine(program, memories[1], observed=True)
    for _ in range(2):
        for memory in memories:
            memory.write(BUDGET, "i64", 200)
        traps = [engine.call(0, SLOTS_OFFSET) if anywhere else engine.run(0) for engine in (plain, observed)]
        assert repr(traps[0]) == repr(traps[1])
        assert bytes(memories[0].snapshot()) == bytes(memories[1].snapshot())
