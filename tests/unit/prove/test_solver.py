"""The solver ends at Ctrl-C."""

from __future__ import annotations

import signal
from types import FrameType
from typing import NoReturn

import pytest
from rows import each_of

from fbvm.prove.encoding.terms import Terms
from fbvm.prove.solver import UNKNOWN, Solver


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there are no timers by signals")
def test_a_signal_while_the_solver_works_ends_the_question(capfd: pytest.CaptureFixture[str]) -> None:
    def interrupt(number: int, frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt

    terms = Terms()
    left, right = terms.variable("a", 128), terms.variable("b", 128)
    solver = Solver()
    solver.assume(terms.eq(terms.mul(left, right), terms.constant(128, 1_000_003 * 998_244_353_000_000_007)))
    few, many = terms.constant(128, 1 << 21), terms.constant(128, 1 << 62)
    for factor in (left, right):
        solver.assume(terms.less(few, factor, False), terms.less(factor, many, False))
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            solver.ask()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert capfd.readouterr().err == "", "an exception in the solver's question would be printed and forgotten"


@pytest.mark.slow
@each_of(("answers", "wanted"), [((False, False, True), UNKNOWN), ((False, KeyboardInterrupt()), KeyboardInterrupt)])
def test_a_question_that_takes_too_long_is_not_answered(answers: tuple[object, ...], wanted: object) -> None:
    asked = iter(answers)

    def expired() -> bool:
        answer = next(asked, True)
        if isinstance(answer, BaseException):
            raise answer
        return bool(answer)

    solver, terms = Solver(expired), Terms()
    left, right = terms.variable("a", 128), terms.variable("b", 128)
    solver.assume(terms.eq(terms.mul(left, right), terms.constant(128, 1_000_003 * 998_244_353_000_000_007)))
    few, many = terms.constant(128, 1 << 21), terms.constant(128, 1 << 62)
    for factor in (left, right):
        solver.assume(terms.less(few, factor, False), terms.less(factor, many, False))
    if wanted is KeyboardInterrupt:
        with pytest.raises(KeyboardInterrupt):
            solver.ask()
    else:
        assert solver.ask() == wanted
    assert solver.questions == 1
