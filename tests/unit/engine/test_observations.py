"""What a run tells when it is over: the observations that it would have told at the time, with the memory of each moment."""

from __future__ import annotations

from typing import Any

import pytest
from hand_image import at, const, image, load, own, power_on, store
from observing import first_difference
from rows import each_of
from statement_rows import PROGRAMS

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.compiler import compile_text
from fbvm.code.operations import Block
from fbvm.engine.observation import Observation
from fbvm.engine.python import engine as python
from fbvm.engine.python.engine import PythonEngine

TEXT = """\
FUNCTION_BLOCK Inner
VAR_INPUT a : INT; END_VAR
VAR_IN_OUT sum : DINT; END_VAR
VAR_OUTPUT q : BOOL; s : STRING[8]; END_VAR
  sum := sum + a;
  q := sum > 3;
  IF q THEN s := 'over'; RETURN; END_IF;
  s := 'under';
END_FUNCTION_BLOCK

FUNCTION Twice : INT
VAR_INPUT n : INT; END_VAR
  Twice := 2 * n;
END_FUNCTION

PROGRAM Main
VAR
  i : INT; total : DINT; inner : ARRAY [0..2] OF Inner; list, copy : ARRAY [0..3] OF INT; x : REAL; lamp AT %CIO5.03 : BOOL;
  p : POINTER TO INT;
END_VAR
  FOR i := 0 TO 2 DO
    inner[i](a := Twice(i), sum := total);
    list[i] := i;
  END_FOR;
  list[list[0]] := 7;
  copy := list;
  p := ADR(copy[1]);
  p^ := p^ + 1;
  x := x + 0.1;
  lamp := inner[2].q AND total > 5;
  CASE copy[1] OF 2: x := 2.0; 3: x := 3.0; END_CASE;
END_PROGRAM
"""


def engine_of(*codes: Block) -> PythonEngine:
    program = image(*codes)
    return PythonEngine(program, power_on(program), observed=True)


@pytest.mark.slow
def test_all_that_a_program_does_is_told_in_its_order() -> None:
    compiled = compile_text(TEXT).image
    assert compiled is not None
    assert first_difference(compiled) == ""


@pytest.mark.slow
@each_of("name,code,before,after", PROGRAMS, ids=lambda row: row[0])
def test_every_statement(name: str, code: Block, before: dict[int, bytes], after: Any) -> None:
    program = image((*(node for each in code for node in (("observe", "statement", 3, None), each)),))
    told = []
    for way in ("observe", "observations"):
        memory = power_on(program, before)
        steps = getattr(PythonEngine(program, memory, observed=True), way)(0)
        told.append([(seen, bytes(memory.u8[SLOTS_OFFSET:])) for seen in steps] + [bytes(memory.u8)])
    assert told[0] == told[1]


def test_a_store_that_changes_its_own_subscript_is_told_where_it_went() -> None:
    """a[a[0]] := 5"""
    place = at(0, (1, load("u8", 0)))
    engine = engine_of((("store", "u8", place, const("u8", 5)), ("observe", "write", 3, ("u8", place, 255))))
    written = Observation("write", 3, ("u8", SLOTS_OFFSET, 255))
    assert list(engine.observe(0))[1] == written
    engine.memory.u8[SLOTS_OFFSET] = 0
    assert list(engine.observations(0))[1] == written


def test_what_was_told_before_a_subscript_that_traps_is_kept() -> None:
    """A statement that reads a[1 / 0]."""
    place = at(0, (1, ("div", "u8", const("u8", 1), load("u8", 8), 5)))
    engine = engine_of((("observe", "statement", 3, None), ("observe", "read", 3, ("u8", place, 255))))
    assert [each.kind for each in engine.observations(0)] == ["call", "statement"]


def test_the_memory_is_that_of_each_moment_and_then_that_of_the_end() -> None:
    engine = engine_of((store("u8", 0, const("u8", 1)), ("observe", "statement", 3, None), store("u8", 0, const("u8", 2))))
    told = engine.observations(0)
    values = [(next(told).kind, engine.memory.u8[SLOTS_OFFSET]) for _ in range(3)]
    assert values == [("call", 0), ("statement", 1), ("return", 2)]


def test_what_a_function_in_python_has_done_is_told_where_it_did_it() -> None:
    engine = engine_of((("call", 1, own(8)), ("observe", "statement", 3, None)), ())
    calls: list[int] = []

    def run(base: int) -> None:
        calls.append(base)
        engine.memory.u8[SLOTS_OFFSET + 3] = 4  # outside its instance

    engine.substitute(1, run)
    told = engine.observations(0)
    seen = [(next(told), engine.memory.u8[SLOTS_OFFSET + 3]) for _ in range(3)]
    assert calls == [seen[1][0].detail[1]]
    assert [(each.kind, value) for each, value in seen] == [("call", 0), ("call", 0), ("write", 4)]


def test_a_failure_of_such_a_function_comes_behind_what_was_told_before() -> None:
    engine = engine_of((("observe", "statement", 3, None), ("call", 1, own(8))), ())

    def fail(base: int) -> None:
        raise LookupError("no such recipe")

    engine.substitute(1, fail)
    told = engine.observations(0)
    assert [next(told).kind for _ in range(3)] == ["call", "statement", "call"]
    with pytest.raises(LookupError, match="recipe"):
        next(told)


def endless() -> PythonEngine:
    return engine_of((("loop", (), (("charge", 1, 7), ("observe", "statement", 7, None)), ()),))


@pytest.mark.slow
def test_a_run_that_does_not_end_is_told_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is done again by the build that stands still, because its list would take too much memory."""
    monkeypatch.setattr(python, "MOST_ENTRIES", 200)
    monkeypatch.setattr("fbvm.engine.python.logged.MOST_ENTRIES", 100)
    expected = list(endless().observe(0))
    assert len(expected) == 100_001 and list(endless().observations(0)) == expected


@pytest.mark.slow
def test_a_loop_is_told_as_far_as_somebody_wants() -> None:
    told, whole = endless(), endless()
    seen = list(told.observations(0, most=50))
    assert seen[:-1] == list(whole.observe(0))[: len(seen) - 1] and seen[-1].kind == "cut"
    assert 50 <= len(seen) <= 53
    assert bytes(told.memory.u8) == bytes(whole.memory.u8)


@pytest.mark.slow
def test_nothing_is_kept_for_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.engine.python.logged.MOST_ENTRIES", 100)
    engine = endless()
    longest = 0

    class Entries(list[Any]):
        def clear(self) -> None:
            nonlocal longest
            longest = max(longest, len(self))
            super().clear()

    assert engine._log
    entries = Entries()
    engine._log.entries = entries
    trap = engine.run(0)
    assert trap and trap.code == "R0104" and longest <= 102
