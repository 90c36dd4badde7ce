"""Parts of machine code's surroundings that work in other processes or on other hosts: what they do, step by step."""

from __future__ import annotations

import io
import struct
from types import SimpleNamespace
from typing import Any

import pytest
from hand_image import at, const, image, load, power_on, store

from fbvm.engine.choice.stoppable import StoppableEngine
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.stops import LineStop, StopTable, Watchpoint

llvm = pytest.importorskip("llvmlite.binding")

from fbvm.engine.native.library import reading, times  # noqa: E402
from fbvm.engine.native.library.reading import GOOD, MALFORMED, OUTSIDE  # noqa: E402
from fbvm.engine.native.library.subset import data, peek_all  # noqa: E402
from fbvm.engine.native.llvm import cache, compiler, worker  # noqa: E402

# --- processes that compile ---------------------------------------------------------------------------------------------


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a process that compiles does, in its order; a module `wrong` cannot be compiled."""
    seen: list[str] = []

    def compiled(text: str, level: int) -> bytes:
        seen.append(f"{text} at {level}")
        if text == "wrong":
            raise RuntimeError(text)
        return text.upper().encode()

    monkeypatch.setattr(worker, "compile_text", compiled)
    monkeypatch.setattr(worker, "give_way", lambda: seen.append("gives way"))
    monkeypatch.setattr(worker, "search_less", lambda: seen.append("searches less"))
    return seen


def job(text: str) -> bytes:
    return len(text).to_bytes(8, "little") + text.encode()


@pytest.mark.parametrize("large", [False, True])
def test_the_helper_process_answers_each_job_until_they_end(done: list[str], large: bool) -> None:
    answers = io.BytesIO()
    worker.serve(io.BytesIO(job("one") + job("wrong") + job("three") + b"cut"), answers, large)
    assert answers.getvalue() == job("ONE") + job("") + job("THREE")
    assert done == ["gives way", *["searches less"] * large, "one at 2", "wrong at 2", "three at 2"]


def test_the_helper_process_keeps_no_answer_back(done: list[str]) -> None:
    """The one who asked waits for each answer before the next job."""
    class Kept(io.BytesIO):
        def flush(self) -> None:
            done.append(f"{len(self.getvalue())} bytes")

    worker.serve(io.BytesIO(job("one") + job("wrong")), Kept())
    assert done == ["gives way", "one at 2", "11 bytes", "wrong at 2", "19 bytes"]


def test_a_process_for_one_module_answers_that(done: list[str]) -> None:
    answer = io.BytesIO()
    worker.serve_one(io.BytesIO(b"one"), answer, 1)
    assert (answer.getvalue(), done) == (b"ONE", ["searches less", "one at 1"])


def test_a_helper_process_that_was_never_begun_or_is_anothers_is_not_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    helper = worker.Worker()
    helper.stop()
    killed: list[bool] = []
    process: Any = SimpleNamespace(kill=lambda: killed.append(True), wait=lambda: None, stdin=None, stdout=None)
    helper._process = process
    monkeypatch.setattr(helper, "_owner", -1)
    helper.stop()
    assert (killed, helper._process) == ([], None)


def test_what_no_thread_can_wait_for_is_not_compiled_and_the_next_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[str] = []

    class Thread:
        def __init__(self, **options: Any) -> None:
            self.name = options["name"]

        def start(self) -> None:
            begun.append(self.name)
            raise RuntimeError("can't start new thread")

    monkeypatch.setattr(worker.threading, "Thread", Thread)
    helper = worker.Worker()
    for _ in range(2):
        helper.compile(Thread(name="any job"))  # type: ignore[arg-type]
    assert begun == ["fbvm compiler", "fbvm compiler"]


# --- LLVM and the host ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "made"), [
    ((19, 1, 7), ["initialize", "initialize_native_target", "initialize_native_asmprinter"]),
    ((20, 1, 0), ["initialize_native_target", "initialize_native_asmprinter"]),
])
def test_older_releases_of_llvm_are_initialised_by_hand(monkeypatch: pytest.MonkeyPatch, version: tuple[int, ...],
                                                        made: list[str]) -> None:  # fmt: skip
    seen: list[str] = []
    monkeypatch.setattr(llvm, "llvm_version_info", version)
    for name in ("initialize", "initialize_native_target", "initialize_native_asmprinter"):
        monkeypatch.setattr(llvm, name, lambda name=name: seen.append(name))
    compiler.llvm.__wrapped__()
    assert seen == made


def test_how_far_llvm_searches_is_an_option_of_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, str]] = []
    monkeypatch.setattr(compiler, "llvm", lambda: SimpleNamespace(set_option=lambda *given: seen.append(given)))
    compiler.search_less.__wrapped__()
    assert seen == [("fbvm", f"-memdep-block-scan-limit={compiler.SEARCHED}")]


def test_where_the_library_of_mathematics_has_no_file_the_process_has_its_functions(monkeypatch: pytest.MonkeyPatch) -> None:
    known = compiler._symbols.__wrapped__()
    monkeypatch.setattr(compiler, "math_library", lambda: "libfbvm-is-not-there.so")
    found = compiler._symbols.__wrapped__()
    assert found.keys() == known.keys() and all(found.values())


def test_a_damaged_object_is_none(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path))
    for number, content in enumerate((b"", b"\x03\0\0\0{x}object", b"\x02\0\0\0\xff\xfe")):
        cache.FILES.write(f"{number}" * 64, content)
        assert cache.read(f"{number}" * 64) is None
    cache.FILES.write("a" * 64, b"\x02\0\0\0{}object")
    assert cache.read("a" * 64) == cache.Stored({}, b"object")


# --- reading texts --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("digits", "size", "found", "value"), [
    ("5", 1000, GOOD, 500), ("250", 1000, GOOD, 250), ("1_25", 1000, GOOD, 125), ("000", 1000, GOOD, 0), ("", 1000, GOOD, 0),
    ("0001", 1000, OUTSIDE, 0), ("123456789", 10**9, GOOD, 123456789), ("1" * 16, 10**16, GOOD, int("1" * 16)),
    ("1" * 17, 10**17, OUTSIDE, 0), ("5" + "0" * 20, 1000, GOOD, 500), ("25_0" + "_0" * 20, 1000, GOOD, 250),
])
def test_a_fraction_of_a_unit(digits: str, size: int, found: int, value: int) -> None:
    out, text = data(bytes(8) + b"out"), digits.encode() + b"."
    assert times.read_fraction(out, data(text), len(digits), size) == found
    if found == GOOD:
        assert peek_all(out) == value


@pytest.mark.parametrize(("text", "found"), [
    ("16#" + "F" * 255, GOOD), ("16#" + "F" * 256, OUTSIDE), ("16#1" + "0" * 255, GOOD), ("16#1" + "0" * 256, OUTSIDE),
    ("16#FFFFFFFFFFFFF8" + "0" * 242, GOOD), ("16#FFFFFFFFFFFFFC" + "0" * 242, OUTSIDE), ("16#1" + "0" * 300, OUTSIDE),
    ("2#" + "1" * 53 + "0" * 40, GOOD), ("2#" + "1" * 53 + "0" * 10 + "1", GOOD), ("2#1" + "0" * 52 + "1" + "0" * 9 + "1", GOOD),
    ("2#1" + "0" * 52 + "1" + "0" * 10, GOOD), ("16#1", GOOD), ("2#" + "1" * 63, GOOD),
    ("16#12_34", GOOD), ("16#0", GOOD), ("16#", MALFORMED), ("3#1", MALFORMED), ("16#G", MALFORMED),
])
def test_a_real_with_a_base_is_below_the_greatest_one(text: str, found: int) -> None:
    out = data(bytes(500) + b"number")
    assert reading.read_number(out, reading.LREAL, data(text.encode() + b"7"), len(text)) == found
    if found == GOOD:
        base, _, digits = text.partition("#")
        assert peek_all(out) == struct.unpack("<q", struct.pack("<d", float(int(digits, int(base)))))[0]


@pytest.mark.parametrize(("text", "found"), [
    ("16#FF", 255), ("8#17", 15), ("2#1_0", 2), ("16#" + "F" * 16, -1), ("16#1" + "0" * 16, None), ("8#1" + "7" * 21, -1),
    ("8#2" + "0" * 21, None), ("2#" + "1" * 64, -1), ("2#1" + "0" * 64, None), ("16#0" + "F" * 16, -1),
])
def test_a_whole_number_with_a_base_has_64_bits(text: str, found: int | None) -> None:
    out = data(bytes(500) + b"whole")
    status = reading.read_number(out, reading.KINDS["ULINT"], data(text.encode() + b"7"), len(text))
    assert status == OUTSIDE if found is None else (status, peek_all(out)) == (GOOD, found)


# --- ends of runs -----------------------------------------------------------------------------------------------------------


def test_a_change_without_an_observation_stops_the_run_at_the_end_of_the_program() -> None:
    program = image((("observe", "statement", 3, None),))
    memory = power_on(program)
    stops = StopTable(memory, len(program.sites))
    line = LineStop(frozenset([3]), lambda base: bool(memory.write(at(8)[1], "i16", 5)))
    engine = StoppableEngine(program, memory, stops, "python", {})
    stops.put([Watchpoint([(at(8)[1], 2)], 0), line])
    stops.begin({})
    assert engine.run(0) is None and engine.seen is not None
    assert (engine.seen.kind, engine.seen.site, len(engine.calls)) == ("return", -1, 1)
    assert engine.go_on() is None and engine.seen is None


def test_a_plain_build_has_no_observations() -> None:
    program = image(())
    with pytest.raises(ValueError, match="a plain build has no observations"):
        PythonEngine(program, power_on(program)).observations(0)


@pytest.mark.parametrize("divisor", [2, 0])
def test_a_contact_that_can_trap_is_told_behind_what_was_before(divisor: int) -> None:
    value = ("eq", "b", "i16", ("div", "i16", const("i16", 8), load("i16", 2), 4), const("i16", 4))
    program = image((("observe", "statement", 3, None), store("i16", 0, const("i16", 7)), ("observe", "contact", 5, (0, value))))
    told = []
    for way in ("observe", "observations"):
        memory = power_on(program, {2: divisor.to_bytes(2, "little")})
        told.append([*getattr(PythonEngine(program, memory, observed=True), way)(0), bytes(memory.u8)])
    assert told[0] == told[1]
