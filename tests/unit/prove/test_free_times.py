"""Verdicts where any time within bounds passes between two scans."""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.cycle import cycle_bounds, show_cycle, show_passed
from fbvm.prove.encoding.clocks import FixedCycle, FreeCycle
from fbvm.prove.encoding.terms import Terms
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import NEVER, REACH, WITHIN, Question, Verdict
from fbvm.prove.runs import Judge, repeated

MS = 1_000_000
DELAY = """PROGRAM Main
VAR In AT %IX0.0 : BOOL; t : TON; Pulse AT A1 : UINT; n : INT; END_VAR
t(IN := In, PT := T#100ms);
IF In AND NOT t.Q THEN n := n + 1; ELSE n := 0; END_IF
END_PROGRAM
"""


def asked(question: Question, low_ms: int, high_ms: int, text: str = DELAY) -> Verdict:
    image = compile_text(text).image
    assert image is not None
    limits = Limits(low_ms * MS, 80, simulated_scans=200, longest_ns=high_ms * MS)
    verdict = prove(image, question, limits)
    if verdict.run is not None:
        confirmed(image, question, verdict)
    return verdict


def confirmed(image: Image, question: Question, verdict: Verdict) -> None:
    """The run of a verdict meets the goal in its last scan."""
    assert verdict.run is not None
    plc, judge, met = Plc(image, verdict.run.cycle_ns), Judge.of(image, question), []
    plc.watchers.append(lambda plc: met.append(judge.met(plc)))
    repeated(plc, verdict.run)
    assert met == [False] * (len(met) - 1) + [True]


def test_bounds_are_read_and_shown() -> None:
    assert (cycle_bounds("10ms"), cycle_bounds("5ms..50ms")) == ((10 * MS, 10 * MS), (5 * MS, 50 * MS))
    assert (show_cycle(10 * MS, 0), show_cycle(5 * MS, 50 * MS)) == ("10ms", "5ms..50ms")
    assert show_passed([50 * MS, 50 * MS, 7 * MS]) == "50ms (2 times), 7ms"
    for wrong, why in (("50ms..5ms", "the shorter time comes first"), ("0ms", "some time passes"), ("x..5ms", "x")):
        with pytest.raises(ValueError, match=why):
            cycle_bounds(wrong)


@pytest.mark.slow
def test_fewer_scans_reach_the_end_of_a_timer_if_they_may_be_far_apart() -> None:
    verdict = asked(Question(REACH, "Main.t.Q"), 5, 50)
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans, verdict.run.passed_ns) == ("reached", 3, [50 * MS, 50 * MS])
    assert verdict.notes == ("time between two scans: 5ms..50ms",)


@pytest.mark.slow
def test_what_holds_in_one_cycle_only_is_broken_with_the_times_of_the_scans() -> None:
    question = Question(NEVER, "Main.n > 10")
    fixed = asked(question, 10, 10)
    assert (fixed.run, fixed.scans) == (None, 80)
    verdict = asked(question, 8, 10)
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans) == ("broken", 11)
    assert sum(verdict.run.passed_ns) < 100 * MS and verdict.run.has_free_times


@pytest.mark.slow
def test_what_is_proved_for_all_times_is_proved_for_each_cycle() -> None:
    question = Question(NEVER, "Main.t.Q AND Main.t.ET < T#100ms")
    assert asked(question, 1, 100).word == "proved"
    for cycle_ms in (1, 7, 100):
        assert asked(question, cycle_ms, cycle_ms).word == "proved"


@pytest.mark.slow
def test_an_answer_in_time_counts_the_time_and_not_the_scans() -> None:
    def question(within_ms: int) -> Question:
        return Question(WITHIN, "Main.t.Q", ("Main.In",), trigger="Main.In", within_ns=within_ms * MS)

    assert asked(question(150), 20, 50).word == "proved"
    late = asked(question(120), 20, 50)
    assert late.run is not None
    assert late.word == "broken"
    assert late.run.times_ns[-1] - late.run.asked_ns > 100 * MS


@cache
def two_bits() -> Image:
    image = compile_text("PROGRAM Main VAR In, Out : BOOL; END_VAR END_PROGRAM", lint=False).image
    assert image is not None
    return image


@each_of(("asked", "answered", "within_ms", "late"), (
    ("1000", "0010", 20, "----"), ("1000", "0001", 20, "--xx"),  # the next scan would be too late, too
    ("1000", "1000", 0, "----"), ("1000", "0100", 0, "xx--"), ("1000", "0000", 10, "-xxx"),
    ("1011", "0100", 10, "---x"), ("1011", "0001", 20, "--xx"),  # it waits since the first time
    ("1111", "0100", 10, "----"), ("0000", "0000", 0, "----"),
))  # fmt: skip
def test_an_answer_is_late_behind_its_time_and_where_none_can_come_within_it(asked: str, answered: str, within_ms: int,
                                                                             late: str) -> None:  # fmt: skip
    plc, found = Plc(two_bits(), 10 * MS, engine="python"), ""
    judge = Judge.of(plc.image, Question(WITHIN, "Main.Out", trigger="Main.In", within_ns=within_ms * MS))
    for now, (ask, answer) in enumerate(zip(asked, answered, strict=True)):
        plc.write("Main.In", ask == "1")
        plc.write("Main.Out", answer == "1")
        plc.scan(now * 10 * MS)
        found += "x" if judge.met(plc) else "-"
    assert found == late


@pytest.mark.slow
def test_what_the_machine_counts_follows_the_time() -> None:
    verdict = asked(Question(REACH, "Main.Pulse = 3"), 20, 60)
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans) == ("reached", 6)


@pytest.mark.slow
def test_the_test_that_is_written_scans_at_the_times_of_the_run(tmp_path: Path) -> None:
    program, test = tmp_path / "delay.st", tmp_path / "test_delay.py"
    program.write_text(DELAY, encoding="utf-8")
    result = CliRunner().invoke(main, ["prove", str(program), "--reach", "Main.t.Q", "--cycle", "5ms..50ms", "--test", str(test)])
    assert result.exit_code == 0, result.output
    assert "  times between its scans: 50ms (2 times)" in result.stdout.splitlines()
    runpy.run_path(str(test))["test_reach_main_t_q"]()


def test_what_was_in_the_scan_before_is_no_affair_of_the_clock() -> None:
    for clock in (FixedCycle(Terms(), (), 10 * MS), FreeCycle(Terms(), (), 5 * MS, 50 * MS)):
        found = [clock.value(number, (kind, 0)) for number in (0, 3) for kind in ("level", "fresh")]
        assert found == [None] * 4, clock
