"""Runs as the lines of a pytest: writes between scans, times that change, traps, what is compared, names that are taken."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.base.types import BOOL, ELEMENTARY
from fbvm.engine.trap import Trap
from fbvm.prove.cover import Reaching, Spot
from fbvm.prove.pytest_text import _compared, _named, _statements
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, WITHIN, WRITTEN_ONCE, Question, Run, Verdict
from fbvm.watch.paths import Place

MS = 1_000_000
A, B, N = Place("Main.a", BOOL, 0), Place("Main.b", BOOL, 1), Place("Main.n", ELEMENTARY["INT"], 2)


def run_of(*writes: dict[Place, Any], times_ms: tuple[int, ...] = (), **more: Any) -> Run:
    times = times_ms or tuple(10 * number for number in range(len(writes)))
    return Run(tuple(writes), tuple(at * MS for at in times), 10 * MS, True, **more)


STILL = ({A: True}, {}, {})
CHANGING = ({A: True}, {}, {A: False, N: 5}, {}, {})


@each_of(("question", "run", "lines"), [
    (Question(REACH, "Main.n = 1"), run_of({A: True}),
     ["plc.write('Main.a', True)", "assert plc.run(scans=1, until='Main.n = 1') == 'until'"]),
    (Question(NEVER, "Main.n = 1"), run_of(*STILL),
     ["plc.write('Main.a', True)", "plc.run(scans=2)", "assert plc.run(scans=1, until='Main.n = 1') != 'until'"]),
    (Question(ALWAYS, "Main.n = 1"), run_of(*CHANGING),
     ["plc.write('Main.a', True)", "plc.run(scans=2)", "plc.write('Main.a', False)", "plc.write('Main.n', 5)", "plc.run(scans=2)",
      "assert plc.run(scans=1, until='Main.n = 1') == 'until'"]),
    (Question(NO_TRAP), run_of({}, {A: True}), ["plc.run(scans=1)", "plc.write('Main.a', True)", "assert plc.scan() is None"]),
    (Question(WRITTEN_ONCE, "Main.b"), run_of({}, {A: True}),
     ["plc.run(scans=1)", "plc.write('Main.a', True)", "assert double_writes(plc, 'Main.b') == []"]),
    (Question(REACH, "Main.n = 1"), run_of({}, {}, {}, {A: True}, times_ms=(0, 10, 40, 70)),
     ["plc.run(scans=2)", "plc.cycle_ns = 30_000_000", "plc.run(scans=1)", "plc.write('Main.a', True)",
      "assert plc.run(scans=1, until='Main.n = 1') == 'until'"]),
    (Question(WITHIN, "Main.b", trigger="Main.a", within_ns=20 * MS), run_of({}, {A: True}, {}, {A: False}, {}, asked_ns=10 * MS),
     ["plc.run(scans=1)", "answers = []", "plc.write('Main.a', True)", "answers.append(plc.run(scans=1, until='Main.b'))",
      "answers.append(plc.run(scans=1, until='Main.b'))", "plc.write('Main.a', False)",
      "answers.append(plc.run(scans=1, until='Main.b'))", "assert 'until' in answers"]),
])  # fmt: skip
def test_a_run_as_statements_of_a_test(question: Question, run: Run, lines: list[str]) -> None:
    assert _statements(Verdict(question, "broken", ""), run) == [f"    {line}" for line in lines]


@pytest.mark.parametrize(("trap", "end"), [
    (None, ["machine.run(scans=3)", "assert machine.read('Main.b') is True", "assert machine.read('Main.n') == 9"]),
    (Trap.__new__(Trap), ["assert machine.run(scans=3) == 'trap'"]),
])  # fmt: skip
def test_outputs_are_compared_before_inputs_change_and_at_the_end(trap: Trap | None, end: list[str]) -> None:
    outputs = tuple({B: number > 2, N: number + 5} for number in range(5))
    each = Reaching(run_of(*CHANGING, trap=trap), (Spot(0),), outputs)
    assert [line.strip() for line in _compared(each)] == [
        "machine.write('Main.a', True)", "machine.run(scans=2)", "assert machine.read('Main.b') is False",
        "assert machine.read('Main.n') == 6", "machine.write('Main.a', False)", "machine.write('Main.n', 5)", *end]


def test_names_of_tests_are_told_apart() -> None:
    used: set[str] = set()
    assert [_named(text, used) for text in ("Main.n = 1", "Main.n = 1", "main n 1", "x" * 70, "x" * 60, "a" * 59 + " b")] == [
        "test_main_n_1", "test_main_n_1_2", "test_main_n_1_3", f"test_{'x' * 60}", f"test_{'x' * 60}_2", f"test_{'a' * 59}"]
