"""The native engine's own: levels, sharing, many scans at once, traps with values.  That it agrees is tests/property."""

from __future__ import annotations

import ctypes
import gc
import math
import os
import re
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hand_image import at, behind, const, image, load, own, power_on, store
from rows import each_of, first_quick

from fbvm import compile_text
from fbvm.base.areas import BUDGET, DUE, NEVER, NOW, SCANS, SLOTS_OFFSET
from fbvm.base.arithmetic import FUNCTIONS, NAN, limits, power, single
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import EXPRESSIONS, STATEMENTS, Node
from fbvm.engine.native import engine as native
from fbvm.engine.native.engine import NativeEngine

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

from fbvm.base import cache
from fbvm.engine.native.code import code_of
from fbvm.engine.native.emit import conversions
from fbvm.engine.native.emit.module import BodyWriter, translate
from fbvm.engine.native.emit.writer import TRAPPED
from fbvm.engine.native.llvm import compiler as native_compiler
from fbvm.engine.native.llvm import entry_points as entries
from fbvm.engine.native.llvm.worker import LONGEST_HERE, worker
from fbvm.engine.native.scans.scans import ScheduledTask

ONE = const("i16", 1)
COUNT = (store("i16", 0, ("add", "i16", load("i16", 0), ONE)),)
LEVELS = [0, 2]


def engine(*codes: Any, before: dict[int, bytes] | None = None, level: int = 0, budget: int = 100_000) -> NativeEngine:
    program = image(*codes)
    return NativeEngine(program, power_on(program, before, budget), level)


def slot(e: NativeEngine, machine: str = "i16", offset: int = 0) -> Any:
    return e.memory.read(SLOTS_OFFSET + offset, machine)


def test_every_operation_has_a_row() -> None:
    assert set(BodyWriter.values) | set(BodyWriter.texts) == set(EXPRESSIONS)
    assert set(BodyWriter.statements) == set(STATEMENTS)


def test_an_engine_is_made_while_fast_code_is_compiled_for_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "compile", lambda job: None)  # it never gets ready
    program = image((store("i16", 0, ("add", "i16", load("i16", 0), const("i16", 77))),))
    code = code_of(program)  # which lives as long as somebody holds it
    code.request()
    e = NativeEngine(program, power_on(program))
    assert e.run(0) is None
    assert slot(e) == 77


@pytest.mark.parametrize("level", LEVELS)
def test_a_task_runs(level: int) -> None:
    e = engine(COUNT, level=level)
    assert [e.run(0) for _ in range(3)] == [None] * 3
    assert slot(e) == 3


def test_a_memory_that_is_too_small_is_refused() -> None:
    with pytest.raises(ValueError, match="the image needs"):
        NativeEngine(image((), size=8192), power_on(image(())), 0)


def test_source_is_the_module() -> None:
    assert "define i32 @task0" in engine(COUNT).source


# --- sharing --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_plcs_with_one_image_share_its_code() -> None:
    program = image(COUNT)
    engines = [NativeEngine(program, power_on(program), 0) for _ in range(3 * entries.BLOCK)]
    for number, e in enumerate(engines):
        for _ in range(number % 3):
            e.run(0)
    assert [slot(e) for e in engines] == [number % 3 for number in range(len(engines))]
    assert len({id(e._code) for e in engines}) == 1


@pytest.mark.slow
def test_an_entry_is_used_again() -> None:
    gc.collect()  # what other tests have left gives back its entries now
    program = image(COUNT)
    e: NativeEngine | None = NativeEngine(program, power_on(program), 0)
    assert e is not None
    slot_of = e._entries[0]._slot
    where = ctypes.addressof(slot_of)
    e = None
    gc.collect()
    others = [NativeEngine(program, power_on(program), 0) for _ in range(8 * entries.BLOCK)]
    assert where in [ctypes.addressof(other._entries[0]._slot) for other in others]


def test_a_memory_stays_while_an_engine_runs_over_it() -> None:
    e = engine(COUNT)
    e.memory.close()
    assert e.run(0) is None


# --- many scans at once ---------------------------------------------------------------------------------------------


def test_many_scans_advance_time_and_count() -> None:
    e = engine((*COUNT, ("due", ("add", "i64", ("now", "i64"), const("i64", 5))), ("charge", 7, 1)), budget=10)
    assert e.run_many([ScheduledTask(0)], 1000, 1_000_000) == (1000, None)
    assert slot(e) == 1000
    read = e.memory.read
    assert (read(NOW, "i64"), read(SCANS, "i64")) == (1_005_000_000, 1000)
    assert (read(DUE, "i64"), read(BUDGET, "i64")) == (1_005_000_005, 3)


def test_many_scans_end_with_a_trap() -> None:
    left = ("sub", "i16", const("i16", 5), load("i16", 0))
    e = engine((*COUNT, store("i16", 2, ("div", "i16", ONE, left, 4))))
    done, trap = e.run_many([ScheduledTask(0)], 1000, 1000)
    assert done == 5 and trap is not None
    assert (trap.code, trap.values) == ("R0101", (1, 0))
    assert e.memory.read(SCANS, "i64") == 5


def test_many_scans_of_nothing() -> None:
    e = engine(COUNT)
    assert e.run_many([ScheduledTask(0)], 0, 1000) == (0, None)
    assert slot(e) == 0 and e.memory.read(DUE, "i64") == NEVER


# --- levels ---------------------------------------------------------------------------------------------------------


def test_fast_code_follows_quick_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path))
    asked: list[Any] = []
    monkeypatch.setattr(worker, "compile", asked.append)
    program = image((*COUNT, store("i16", 2, ONE)))
    engines = [NativeEngine(program, power_on(program)) for _ in range(2)]
    assert not engines[0].optimised and len(asked) == 1
    engines[0].run(0)
    [job] = asked
    job.improve(native_compiler.compile_text(job.job_text(), 2))
    engines[0].run(0)
    assert engines[0].optimised and slot(engines[0]) == 2
    again = NativeEngine(image((*COUNT, store("i16", 2, ONE))), power_on(program))
    assert again.optimised and len(asked) == 1, "the cache has it"


@pytest.mark.slow
def test_the_helper_process_optimises() -> None:
    helper = type(worker)()  # whom nobody else asks meanwhile
    try:
        assert helper._answer(b"no module") == b""
        linked = native_compiler.Linked(helper._answer(b"define i32 @f() { ret i32 7 }"), ["f"])
        assert ctypes.CFUNCTYPE(ctypes.c_int32)(linked.address("f"))() == 7
    finally:
        helper.stop()


@pytest.mark.slow
def test_large_modules_have_a_helper_process_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """LLVM's options are those of a process, and some are for large modules only."""
    monkeypatch.setitem(LONGEST_HERE, 2, 100)
    helper, small = type(worker)(), b"define i32 @f() { ret i32 7 }"
    large, used = small + 100 * b"\n", []
    try:
        for text in (small, large, large, small):
            assert ctypes.CFUNCTYPE(ctypes.c_int32)(native_compiler.Linked(helper._answer(text), ["f"]).address("f"))() == 7
            used.append(helper._process)
    finally:
        helper.stop()
    first, second, third, last = used
    assert second is third and len({first, second, last}) == 3
    assert [process.args[-1].endswith("True)") for process in used if process] == [False, True, True, False]  # type: ignore[union-attr]


def test_a_helper_process_is_begun_anew_where_the_last_one_has_ended_or_is_anothers(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[SimpleNamespace] = []

    def begin(*command: object, **pipes: object) -> SimpleNamespace:
        begun.append(SimpleNamespace(poll=lambda: begun[-1].status, status=None))
        return begun[-1]

    monkeypatch.setattr("fbvm.engine.native.llvm.worker.subprocess.Popen", begin)
    monkeypatch.setattr("atexit.register", lambda stop: None)
    helper = type(worker)()
    assert helper._started() is helper._started() is begun[0]
    begun[0].status = -9
    assert helper._started() is begun[1]
    helper._owner = -1  # as behind a fork
    assert helper._started() is begun[2] and len(begun) == 3


def test_a_module_declares_what_it_calls_and_nothing_else() -> None:
    """LLVM goes through all that is declared, which takes longer than a small body."""
    root: Node = ("pow", "f64", const("f64", 2.0), ("math", "f64", "sqrt", load("f64", 0)))
    text = translate(image((store("f64", 8, root),))).text
    called = set(re.findall(r"call .*?@([\w.]+)\(", text))
    assert set(re.findall(r"(?m)^declare .*?@([\w.]+)\(", text)) <= called
    assert {"fbvm_pow", "llvm.sqrt.f64"} <= called


class Job:
    """What wants a module with this text, and tells when it has it."""

    def __init__(self, text: str) -> None:
        self.text, self.done = text, threading.Event()

    def job_text(self) -> str:
        return self.text

    def improve(self, compiled: bytes) -> None:
        assert compiled == self.text.encode()
        self.done.set()


def test_what_nobody_waits_for_any_more_is_not_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    helper, asked, go_on = type(worker)(), [], threading.Event()

    def answer(text: bytes) -> bytes:
        asked.append(text)
        assert go_on.wait(10)
        return text

    monkeypatch.setattr(helper, "_answer", answer)
    first, gone, last = Job("first"), Job("gone"), Job("last")
    for job in (first, gone, last):
        helper.compile(job)
    del job, gone
    go_on.set()
    assert last.done.wait(10) and first.done.is_set()
    assert asked == [b"first", b"last"]


def test_a_helper_process_that_is_ended_while_it_is_told_something() -> None:
    helper = type(worker)()
    process = helper._started()
    assert process.stdin
    process.stdin.write(b"x" * 100)
    process.kill()
    process.wait()
    helper.stop()
    assert process.stdin.closed


def test_a_helper_process_that_is_ended_while_it_starts_answers_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    helper = type(worker)()
    monkeypatch.setattr("atexit.register", lambda stop: stop())
    assert helper._answer(b"define i32 @f() { ret i32 7 }") == b""


# --- budget, references and the system page ---------------------------------------------------------------------------


@pytest.mark.parametrize("level", LEVELS)
def test_a_budget_below_zero_is_no_trap_where_nothing_is_charged(level: int) -> None:
    e = engine((("call", 1, at(0)), *COUNT), COUNT, budget=-5, level=level)
    assert e.run(0) is None
    assert slot(e) == 2 and e.memory.read(BUDGET, "i64") == -5


@pytest.mark.parametrize("level", LEVELS)
def test_a_store_to_the_budget_counts(level: int) -> None:
    reference = const("ref", 1 << 40 | BUDGET << 8 | 255)
    e = engine((("charge", 1, 1), ("store", "i64", behind(reference), const("i64", 3)), ("charge", 2, 2),
                ("store", "i64", ("abs", BUDGET, ()), const("i64", 1)), ("charge", 2, 3)), level=level)
    trap = e.run(0)
    assert trap is not None and (trap.code, trap.site.line) == ("R0104", 3)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("stored", [
    ("store_flag", behind(const("ref", 1 << 40 | BUDGET << 8 | 3)), const("b", False)),
    ("store_bit", ("abs", BUDGET, ()), 3, const("b", False)),
])  # fmt: skip
def test_a_store_of_a_bit_of_the_budget_counts(level: int, stored: Any) -> None:
    trap = engine((("charge", 1, 1), stored, ("charge", 1, 2)), budget=9, level=level).run(0)
    assert trap is not None and (trap.code, trap.site.line) == ("R0104", 2)


@pytest.mark.parametrize("level", LEVELS)
def test_instances_of_one_body_do_not_mix(level: int) -> None:
    inner = (("store", "i16", own(2), ("add", "i16", ("load", "i16", own(2)), ("load", "i16", own(0)))),)
    calls = tuple(("call", 1, at(64 * number)) for number in range(4))
    e = engine(calls, inner, before={64 * n: STRUCTS["i16"].pack(n + 1) for n in range(4)}, level=level)
    e.run(0)
    e.run(0)
    assert [slot(e, "i16", 64 * n + 2) for n in range(4)] == [2, 4, 6, 8]


def test_a_call_at_the_end_of_a_program_leaves_the_registers_of_the_host_alone() -> None:
    """The called body is too long to be written in place of its calls, and keeps no registers for who calls it."""
    steps = [load("i32", 4 * number) for number in range(12)]
    sums = [store("i32", 4 * n, ("add", "i32", ("mul", "i32", step, steps[n - 1]), steps[(n + 5) % 12]))
            for n, step in enumerate(steps)]  # fmt: skip
    count = ("store", "i16", own(0), ("add", "i16", ("load", "i16", own(0)), ONE))
    again = ("if", ((("lt", "b", "i16", ("load", "i16", own(0)), const("i16", 999)), (*sums, count)),), ())
    called = (("charge", 1, 1), *sums, again, *sums)
    program = image(tuple(("call", 1, own(8 * number)) for number in range(8)), called)
    task = program.tasks[0]
    program = replace(program, tasks=(replace(task, programs=task.programs * 2),))
    assert re.search(r"define internal fastcc i64 @b1\(.*#6 ", code_of(program).translation.text)
    ends = []
    for level in LEVELS:
        e = NativeEngine(program, power_on(program, {0: bytes(range(48))}), level)
        assert e.run_many([ScheduledTask(0)], 50, 1_000) == (50, None)
        ends.append(bytes(e.memory.u8[SLOTS_OFFSET:]))
    assert ends[0] == ends[1] and ends[0][4096] == 100


def test_a_text_that_grows_without_bound_is_not_supported() -> None:
    grow = ("let", 1, "s8", ("concat", "s8", ("tmp", "s8", 1), const("s8", b"x")))
    with pytest.raises(native.Unsupported, match="grows without bound"):
        engine((("let", 1, "s8", const("s8", b"x")), ("loop", (), (grow,), ())))


@pytest.mark.parametrize("stops", [False, True])
def test_quick_code_does_not_say_what_accesses_cannot_meet(stops: bool) -> None:
    program = image((*COUNT, store("i16", 8, ("div", "i16", ONE, load("i16", 0), 3)), ("call", 1, at(64))),
                    (*COUNT, ("charge", 1, 2)))
    made = translate(program, stops)
    fast, quick = (text.partition("attributes")[0] for text in (made.text, made.quick))
    assert fast.count("alias.scope") > quick.count("alias.scope") == fast.count("alias.scope !2")
    assert not re.search(r" ;[0-9]+$", fast, re.MULTILINE)


def test_code_deeper_than_the_host_recurses() -> None:
    deep: Any = load("i16", 0)
    for _ in range(400):
        deep = ("add", "i16", deep, ONE)
    before = sys.getrecursionlimit()
    e = engine((store("i16", 0, deep),))
    assert e.run(0) is None and slot(e) == 400 and sys.getrecursionlimit() == before


# --- what LLVM must not do --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("machine", ["f32", "f64"])
def test_a_product_and_a_sum_are_rounded_each(machine: str) -> None:
    product = ("mul", machine, load(machine, 8), load(machine, 16))
    program = image((store(machine, 0, ("add", machine, product, load(machine, 24))),))
    _, assembly = native_compiler.assembly(translate(program).text, 2)
    assert "mul" in assembly and "fma" not in assembly.lower() and "fmadd" not in assembly.lower()


def test_shifts_across_two_registers_are_not_for_processors_of_amd() -> None:
    assert native_compiler.tuning("znver5") == ",+slow-shld" and native_compiler.tuning("skylake") == ""
    _, _, processor, features = native_compiler.host()
    assert features.endswith(native_compiler.tuning(processor))


def test_behind_a_body_that_is_inlined_nobody_looks_whether_it_has_ended() -> None:
    """The steps that are left behind a charge are never taken for a point: a task that takes its bodies in has no look."""
    program = compile_text("PROGRAM Main VAR t : TON; q : BOOL; END_VAR t(IN := NOT q, PT := T#1s); q := t.Q; END_PROGRAM").image
    assert program
    optimised, _ = native_compiler.assembly(translate(program).text, 2)
    assert str(TRAPPED) not in optimised and optimised.count("@ask(") > 2


CRC = (
    ("let", 2, "u16", const("u16", 0xFFFF)), store("i16", 100, const("i16", 0)),
    ("loop", (("if", ((("ge", "b", "i16", load("i16", 100), const("i16", 64)), (("exit",),)),), ()),),
     (("let", 2, "u16", ("xor", "u16", ("tmp", "u16", 2), ("convert", "u16", "u8", ("load", "u8", at(
         0, (1, ("check", "i64", ("convert", "i64", "i16", load("i16", 100)), 0, 63, "R0102", 1))))))),
      store("i16", 102, const("i16", 0)),
      ("loop", (("if", ((("ge", "b", "i16", load("i16", 102), const("i16", 8)), (("exit",),)),), ()),),
       (("if", ((("ne", "b", "u16", ("and", "u16", ("tmp", "u16", 2), const("u16", 1)), const("u16", 0)),
                 (("let", 2, "u16", ("xor", "u16", ("shr", "u16", ("tmp", "u16", 2), const("i64", 1), 1),
                                     const("u16", 0xA001))),)),),
         (("let", 2, "u16", ("shr", "u16", ("tmp", "u16", 2), const("i64", 1), 1)),)),),
       (store("i16", 102, ("add", "i16", load("i16", 102), ONE)),))),
     (store("i16", 100, ("add", "i16", load("i16", 100), ONE)),)),
    store("u16", 104, ("tmp", "u16", 2)),
)  # fmt: skip
"""CRC16 over 64 bytes, bit by bit, whose counters are read afterwards: LLVM 22.1.0 would miscompile it."""


@pytest.mark.parametrize("level", LEVELS)
def test_crc_bit_by_bit(level: int) -> None:
    data = bytes(range(7, 71))
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    e = engine(CRC, before={0: data}, level=level)
    assert e.run(0) is None
    assert (slot(e, "u16", 104), slot(e, "i16", 100), slot(e, "i16", 102)) == (crc, 64, 8)


@pytest.mark.slow
@each_of("level", LEVELS)
@each_of("machine", ["u8", "u16", "u32", "u64"])
@each_of("operation", ["truncate", "nearest"])
def test_the_lesser_of_a_converted_float_and_0(level: int, machine: str, operation: str) -> None:
    """On `fptoui` and `umin` with 0 LLVM aborts at level 0."""
    made = (operation, machine, "f32", ("load", "f32", at(0)), 1)
    least = ("min", machine, made, const(machine, 0))
    rows = tuple((((label, label),), (store("u8", 24, const("u8", label + 1)),)) for label in (0, 14, 19))
    e = engine((("store", machine, at(8), made), ("case", machine, least, rows, ())),
               before={0: STRUCTS["f32"].pack(200.0)}, level=level)
    assert e.run(0) is None
    assert (slot(e, machine, 8), slot(e, "u8", 24)) == (200, 1)


@pytest.mark.slow
@each_of("level", LEVELS)
@each_of("number", [0.0, 0.9, 2.0**62, 2.0**63, 2.0**63 + 2.0**11, 2.0**64 - 2.0**11, -0.4])
@each_of("operation", ["truncate", "nearest"])
def test_large_floats_become_ulint(level: int, number: float, operation: str) -> None:
    e = engine((("store", "u64", at(8), (operation, "u64", "f64", ("load", "f64", at(0)), 1)),),
               before={0: STRUCTS["f64"].pack(number)}, level=level)
    assert e.run(0) is None
    assert slot(e, "u64", 8) == (int(number) if operation == "truncate" else round(number))


@pytest.mark.slow
@pytest.mark.parametrize("one_step", first_quick([False, True]))
@pytest.mark.parametrize("operation", first_quick(["truncate", "nearest"]))
def test_what_does_not_fit_an_integer_with_the_instruction_of_a_processor_and_without(
        monkeypatch: pytest.MonkeyPatch, operation: str, one_step: bool) -> None:
    if one_step and not conversions.ONE_STEP:
        pytest.skip("this processor has no such instruction")
    monkeypatch.setattr(conversions, "ONE_STEP", one_step)
    cache.switch(False)
    try:
        for source in ("f32", "f64"):
            for machine in ("i8", "i16", "i32", "u8", "u16", "u32"):
                code = (store(machine, 8, (operation, machine, source, load(source, 0), 1)),)
                e = engine(code, level=0)
                _bounds(e, operation, machine, source)
    finally:
        cache.switch(True)


def _bounds(e: NativeEngine, operation: str, machine: str, source: str) -> None:
    numbers = [sign * (limit + more) for limit in (0, *limits(machine), 1 << 31, 1 << 32, 1 << 63, 1 << 64)
               for more in (-1.5, -1, -0.75, -0.5, 0, 0.25, 0.5, 0.75, 1, 1.5) for sign in (1.0, -1.0)]
    for number in [*numbers, math.inf, -math.inf, math.nan]:
        e.memory.write(SLOTS_OFFSET, source, single(number) if source == "f32" else number)
        number = e.memory.read(SLOTS_OFFSET, source)
        wanted = (math.trunc if operation == "truncate" else round)(number) if math.isfinite(number) else 1 << 99
        trap = e.run(0)
        if limits(machine)[0] <= wanted <= limits(machine)[1]:
            assert (trap, slot(e, machine, 8)) == (None, wanted), (machine, number)
        else:
            assert trap and (trap.code, repr(trap.values[0])) == ("R0105", repr(number)), (machine, number)


@pytest.mark.slow
@pytest.mark.skipif(native_compiler.llvm().llvm_version_info[:3] != (22, 1, 0), reason="of LLVM 22.1.0 alone it is known")
def test_crc_bit_by_bit_shows_the_fault_that_is_switched_off() -> None:
    program = ("from fbvm.engine.native.llvm import compiler; compiler.FAULTS.clear(); from fbvm.base import cache\n"
               "cache.switch(False); import test_native; test_native.test_crc_bit_by_bit(2)")
    house = Path(__file__).parents[3]
    folders = (Path(__file__).parent, house / "tests", house / "tests" / "unit" / "rigs", house)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                         env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders))})
    assert ran.returncode == 1 and "AssertionError" in ran.stderr


@pytest.mark.parametrize("level", LEVELS)
def test_functions_are_those_of_python(level: int) -> None:
    inputs = [0.0, -0.0, 1e-300, 0.1, 0.5, 1.0, 2.0, 3.7, 100.25, 1e5, 1e22, 1e300, math.inf, -math.inf, NAN]
    inputs += [-x for x in inputs]
    places = {name: 16 * number for number, name in enumerate((*FUNCTIONS, "pow"))}
    code: list[Node] = [store("f64", 512 + at_, ("math", "f64", name, load("f64", 0))) for name, at_ in places.items()
                        if name != "pow"]
    code.append(store("f64", 512 + places["pow"], ("pow", "f64", load("f64", 0), load("f64", 8))))
    e = engine(tuple(code), level=level)
    for x in inputs:
        for y in (0.0, -3.0, 0.5, 2.0, 1e300, -math.inf, NAN):
            e.memory.write(SLOTS_OFFSET, "f64", x)
            e.memory.write(SLOTS_OFFSET + 8, "f64", y)
            e.run(0)
            wanted = {name: function(x) for name, function in FUNCTIONS.items()} | {"pow": power(x, y)}
            assert {name: repr(slot(e, "f64", 512 + at_)) for name, at_ in places.items()} == {
                name: repr(value) for name, value in wanted.items()}, (x, y)


def test_without_the_cache_all_is_the_same() -> None:
    cache.switch(False)
    try:
        e = engine((*COUNT, store("i16", 4, ONE)))
        assert e.run(0) is None and slot(e) == 1
    finally:
        cache.switch(True)
