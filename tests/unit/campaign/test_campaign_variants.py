"""What is drawn for the runs of a campaign, and what makes a failing run smaller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from math import inf
from pathlib import Path
from random import Random

import pytest

from fbvm.base.diagnostics import Source
from fbvm.campaign import shrinking
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.execution import Result
from fbvm.campaign.judge import NEVER, Failure
from fbvm.campaign.plan import EXACT, REAL, Axis, FaultRule, Moments, Plan, PowerRule
from fbvm.campaign.plan_file import Written, any_faults, read_plan_file
from fbvm.campaign.shrinking import FAULT, Part, least, shrink
from fbvm.campaign.variants import STEP_NS, Cut, NamedFault, Variant, _moments, draw
from fbvm.net.faults import FOREVER, NAMED
from fbvm.run.project import Project

S = 1_000_000_000


def plan(runs: int = 0, axes: Sequence[Axis] = (), **more: object) -> Plan:
    project = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())
    return Plan(project, runs=runs, axes=tuple(axes), **more)  # type: ignore[arg-type]


def test_without_a_number_of_runs_there_is_one_of_each_combination() -> None:
    made = plan(axes=[axis_from_text("a=1,2"), axis_from_text("b=5..7")])
    assert [draw(made, number).values for number in range(made.count)] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]


def test_a_run_depends_on_its_number_and_the_seed_only() -> None:
    rules = {"faults": (any_faults(3, 10 * S),), "cuts": (PowerRule(Moments((0, S), (S, 2 * S)), ("a", "b")),)}
    made = plan(1000, [axis_from_text("a=1..100")], **rules)
    assert draw(made, 17) == draw(made, 17)
    assert len({draw(made, number).seed for number in range(100)}) == 100
    assert draw(plan(1000, [axis_from_text("a=1..100")], seed=1, **rules), 17) != draw(made, 17)


def test_faults_and_cuts_come_when_their_rules_say_and_as_often() -> None:
    rule = FaultRule(Moments((S, 2 * S), (S // 10, S // 5), 10, 50), (("slow", NAMED["slow"].fault),), {"latency_ns": (5, 7)})
    drawn = [named for number in range(100) for named in draw(plan(100, faults=(rule,)), number).faults]
    assert 400 < len(drawn) < 600
    assert {named.fault.latency_ns for named in drawn} == {5, 7}
    assert all(S <= named.fault.from_ns <= 2 * S for named in drawn)
    assert all(S // 10 <= named.fault.until_ns - named.fault.from_ns <= S // 5 for named in drawn)
    cuts = draw(plan(1, cuts=(PowerRule(Moments((0, 9 * S), (S, S), 5), ("pump",), True),)), 0).cuts
    assert [cut.at_ns for cut in cuts] == sorted(cut.at_ns for cut in cuts)
    assert {(cut.plc, cut.off_ns, cut.is_cold) for cut in cuts} == {("pump", S, True)}


@pytest.mark.parametrize("chance", [1, 7, 100])
def test_a_chance_is_so_many_of_a_hundred_draws(chance: int) -> None:
    class Dice(Random):
        draws = count()

        def randrange(self, start: int, *_: object) -> int:  # type: ignore[override]
            return next(self.draws) % 100 if start == 100 else 0

    assert len([*_moments(Dice(), Moments((0, 0), (0, 0), 300, chance))]) == 3 * chance


@pytest.mark.parametrize(("written", "values"), [
    ("Main.n=1,2,5", (1, 2, 5)), ("Main.n=0..10/5", (0, 5, 10)), ("Main.x=0.1..0.3/0.1", (0.1, 0.2, 0.3)),
    ("Main.t=T#10ms..T#30ms/10ms", ("T#10ms", "T#20ms", "T#30ms")), ("Main.s='a,b','c'", ("'a,b'", "'c'")),
    ("pump.cycle=5ms,10ms", (5_000_000, 10_000_000)), ("phase=0ms..2ms", (0, 1_000_000, 2_000_000)), ("timing=real", ("real",)),
])  # fmt: skip
def test_values_of_an_axis_as_a_command_line_writes_them(written: str, values: tuple[object, ...]) -> None:
    assert axis_from_text(written).values == values


@pytest.mark.parametrize(("written", "said"), [
    ("Main.n", "is not NAME=VALUE"), ("Main.n=", "is not NAME=VALUE"), ("=1", "is not NAME=VALUE"),
    ("Main.n=5..1", "5 to 1 by 1 is no range"), ("cycle=0ms", "0ms"), ("cycle=5", "5"), ("timing=late", "late"),
    ("Main.n=a..b", "a"), ("Main.n=1..nan", "1 to nan by 1 is no range"), ("Main.n=1..2/inf", "by inf is no range"),
    (f"Main.n=1..1{400 * '0'}", "1,000,000 values at most"),
])  # fmt: skip
def test_what_is_no_axis_is_refused(written: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        axis_from_text(written)


def test_the_fewest_parts_that_fail_are_found() -> None:
    wanted, tried = {2, 5}, list[int]()

    def fails(kept: Sequence[Part]) -> bool:
        tried.append(len(kept))
        return wanted <= {number for _, number in kept}

    assert {number for _, number in least([("fault", number) for number in range(8)], fails)} == wanted
    assert least([("fault", 0), ("fault", 1)], lambda kept: True) == []
    assert len(tried) < 40


class FailsIf:
    """Executes no runs: those for which the rule holds fail."""

    def __init__(self, rule: Callable[[Variant], bool]) -> None:
        self.rule = rule

    def result(self, variant: Variant) -> Result:
        return Result(variant.number, failure=Failure(NEVER, "a") if self.rule(variant) else None)


def slow_for(lasts_ns: int) -> NamedFault:
    return NamedFault("slow", replace(NAMED["slow"].fault, from_ns=S, until_ns=S + lasts_ns))


def test_a_failing_run_keeps_what_it_fails_by_and_faults_get_as_short_as_they_may() -> None:
    """Halves of whole steps: 8 ms, 4, 2, 1."""
    run = Variant(0, 1, (1, 2), (slow_for(8 * STEP_NS), slow_for(S)), (Cut("", S, S),), REAL)
    with_fault = FailsIf(lambda variant: variant.values[1] == 2 and any(
        named.fault.until_ns <= S + 8 * STEP_NS for named in variant.faults))
    shrunk = shrink(with_fault, run, with_fault.result(run))
    assert shrunk.variant == Variant(0, 1, (0, 2), (slow_for(STEP_NS),), (), EXACT)
    assert shrunk.result.failure == Failure(NEVER, "a")
    with_cut = FailsIf(lambda variant: bool(variant.cuts) and variant.timing == REAL)
    assert shrink(with_cut, run, with_cut.result(run)).variant == Variant(0, 1, (0, 0), (), run.cuts, REAL)


def test_parts_of_which_none_can_be_left_out_are_found_in_few_trials() -> None:
    tried: list[Sequence[Part]] = []

    def both(parts: Sequence[Part]) -> bool:
        tried.append(parts)
        return {3, 7} <= {number for _, number in parts}

    eight = [(FAULT, number) for number in range(1, 9)]
    assert least(eight, both) == [(FAULT, 3), (FAULT, 7)] and len(tried) < 20
    assert least(eight, lambda parts: True) == [] and least([], lambda parts: False) == []
    assert least(eight, lambda parts: len(parts) == 8) == eight and least(eight[:1], lambda parts: bool(parts)) == eight[:1]


def test_runs_are_tried_so_often_and_not_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shrinking, "MOST_TRIES", 5)
    run = Variant(0, 1, tuple(range(1, 20)))
    tries = []

    def whole(variant: Variant) -> bool:
        tries.append(variant)
        return sum(map(bool, variant.values)) == len(run.values)

    execution = FailsIf(whole)
    shrunk = shrink(execution, run, execution.result(run))
    assert (shrunk.variant, shrunk.tries, len(tries)) == (run, 5, 6)


def test_what_goes_wrong_is_told_in_words() -> None:
    assert str(slow_for(S)) == "slow 1s..2s"
    assert str(replace(slow_for(S), fault=replace(slow_for(S).fault, until_ns=FOREVER))) == "slow 1s.."
    assert [str(cut) for cut in (Cut("", S, S), Cut("pump", 2 * S, S), Cut("pump", 0, S // 10, True))] == [
        "power 1s..2s", "power pump 2s..3s", "power cold pump 0s..100ms"]
    values, cycle = Axis("Main.r", "value", (0.5, inf)), Axis("cycle", "cycle", (10_000_000,))
    assert [values.plain(value) for value in (0.5, inf, -inf, "a", 3)] == [0.5, "inf", "-inf", "a", 3]
    assert (values.text(0.5), cycle.text(10_000_000)) == ("0.5", "10ms")


FILE = """[campaign]
project = "fbvm.toml"
runs = 100
for = "10s"
never = ["Main.a AND Main.b"]
[[vary]]
name = "Main.n"
from = 1
to = 3
[[vary]]
setting = "cycle"
values = ["5ms", "10ms"]
[[fault]]
kind = ["slow", "silent"]
latency = ["20ms", "80ms"]
between = ["1s", "9s"]
chance = 30
[[power]]
between = "2s"
lasts = ["1s", "2s"]
[[within]]
trigger = "Main.a"
answer = "Main.b"
within = "100ms"
"""


def test_a_campaign_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    found = read_plan_file(tmp_path / "campaign.toml")
    assert isinstance(found, Written)
    assert [(axis.name, axis.values) for axis in found.axes] == [("Main.n", (1, 2, 3)), ("cycle", (5_000_000, 10_000_000))]
    (rule,) = found.faults
    assert ([kind for kind, _ in rule.kinds], rule.choices, rule.moments.chance_percent) == (
        ["slow", "silent"], {"latency_ns": (20_000_000, 80_000_000)}, 30)
    assert rule.moments.lasts_ns == (S // 100, 2 * S), "if nobody says it"
    assert found.cuts[0].moments.begins_ns == (2 * S, 2 * S)
    assert found.judging.responses[0].within_ns == S // 10


@pytest.mark.parametrize(("wrong", "said"), [
    ("runs = 0", "campaign.runs: 0 is no whole number"), ("ever = 1", "campaign.ever is no key of a campaign"),
    ("[[vary]]\nvalues = [1]", "vary 1 varies nothing"), ("[[vary]]\nname = \"a\"", "vary 1: values are missing"),
    ("[[fault]]\nkind = \"slow\"", "fault 1.between is missing"), ("[[power]]\nbetween = [\"2s\", \"1s\"]", "is no range"),
    ("sources = [\"a.st\"]\nproject = \"b.toml\"", "sources or a project, not both"),
])  # fmt: skip
def test_what_a_campaign_file_gets_wrong_is_told(tmp_path: Path, wrong: str, said: str) -> None:
    (tmp_path / "campaign.toml").write_text(f"[campaign]\n{wrong}\n")
    found = read_plan_file(tmp_path / "campaign.toml")
    assert isinstance(found, list)
    assert said in "\n".join(each.message for each in found)
