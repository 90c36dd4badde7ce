"""Hypothesis strategies for blocks, and the state machine that drives one."""

from __future__ import annotations

import unittest
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from test_testing_rig import PUMP

from fbvm.base.types import BOOL, INT, LREAL, REAL, TIME, SubrangeType, Type, array, string
from fbvm.testing import Rig, ns
from fbvm.testing.machine import block_machine
from fbvm.testing.strategies import courses, delays, follow, inputs, values


def pump() -> Rig:
    return Rig.of("Pump", text=PUMP)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [
    BOOL, INT, REAL, LREAL, TIME, string(5), array(((1, 3),), INT), SubrangeType("INT(0..9)", 2, 2, INT, 0, 9),
], ids=str)  # fmt: skip
def test_values_fit_their_type(kind: Type) -> None:
    text = f"PROGRAM Main VAR x : {kind.name}; END_VAR END_PROGRAM".replace("SINT", "INT")
    rig = Rig.of("Main", text=text)

    @settings(max_examples=30, deadline=None)
    @given(values(kind))
    def fits(value: Any) -> None:
        rig["x"] = value
        assert repr(rig["x"]) == repr(value)

    fits()


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(st.data())
def test_inputs_are_those_of_the_block(data: st.DataObject) -> None:
    rig = pump()
    given_ = data.draw(inputs(rig, Wait=delays("100ms")))
    assert set(given_) <= {"Start", "Wait"}
    assert rig.scan(given_).scans == 1


def test_a_strategy_for_no_input() -> None:
    with pytest.raises(ValueError, match="Pump has no input Foo; it has Start, Wait"):
        inputs(pump(), Foo=st.booleans())


def test_a_function_and_a_program_have_inputs() -> None:
    function = Rig.of("F", text="FUNCTION F : INT VAR_INPUT a, b : INT; END_VAR F := a; END_FUNCTION")
    assert "'a'" in repr(inputs(function)) and "Result" not in repr(inputs(function))
    program = Rig.of("Main", text="PROGRAM Main VAR n : INT; END_VAR END_PROGRAM")
    assert "'n'" in repr(inputs(program))


@settings(max_examples=50)
@given(delays("50ms", "10ms"))
def test_delays_are_whole_steps(delay_ns: int) -> None:
    assert delay_ns % ns("10ms") == 0
    assert 0 <= delay_ns <= ns("50ms")


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.data())
def test_a_pump_runs_only_with_start(data: st.DataObject) -> None:
    rig = follow(pump(), data.draw(courses(pump(), "100ms", Wait=delays("200ms"))))
    assert rig.Start or not rig.Running


def _only_with_start(rig: Rig) -> bool:
    return rig.Start or not rig.Running


def _never(rig: Rig) -> None:
    assert not rig.Running


TestGood = block_machine(pump, [_only_with_start], "100ms", Wait=delays("50ms"))
TestGood.settings = settings(max_examples=15, stateful_step_count=15, deadline=None)  # type: ignore[attr-defined]
TestGood = pytest.mark.slow(TestGood)


@pytest.mark.slow
def test_a_rule_that_does_not_hold_is_found() -> None:
    case = block_machine(pump, [_never], "1s")
    case.settings = settings(max_examples=50, deadline=None, database=None, print_blob=False,
                             phases=[Phase.generate])  # type: ignore[attr-defined]
    result = unittest.TestResult()
    case("runTest").run(result)
    ((_, trace),) = result.failures + result.errors
    assert "Running is TRUE since scan" in trace
    assert "state.scan(" in trace
