"""What is kept and shown of a campaign, whole: its lines, its table, its page, and what its file may say."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from fbvm.base.diagnostics import Source
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.execution import Result
from fbvm.campaign.judge import NEVER, TRAP, Failure
from fbvm.campaign.plan import EXACT, REAL, Axis, FaultRule, Golden, Judging, Moments, Plan, PowerRule, Response
from fbvm.campaign.plan_file import LASTS_NS, Written, any_cuts, any_faults, is_campaign, read_plan_file
from fbvm.campaign.progress import OVER, SHRINKING, Progress
from fbvm.campaign.progress_page import _time, progress_page
from fbvm.campaign.runs import Outcome
from fbvm.campaign.store import columns, rows, write_table
from fbvm.net.faults import NAMED, NO_FAULT
from fbvm.run.project import Project

MS, S = 1_000_000, 1_000_000_000
UP = Failure(NEVER, "Main.Up", "plc", 3, 30 * MS, file="mix.st", pou="Main", line=18)
TRAPPED = Failure(TRAP, "index out of range", "plc", 7, 75 * MS // 10, "R0102", "mix.st", "Main", 14, "detail")
PROJECT = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())


# --- lines and table --------------------------------------------------------------------------------------------------


def outcome() -> Outcome:
    rule = FaultRule(Moments((S, S), (S, S)), (("slow", NAMED["slow"].fault),))
    power = PowerRule(Moments((2 * S, 2 * S), (S // 10, S // 10)), ("",), True)
    axes = (axis_from_text("Main.n=1,2,3"), Axis("cycle", "cycle", (10 * MS,)))
    made = Outcome(Plan(PROJECT, runs=0, axes=axes, faults=(rule,), cuts=(power,), shown=("Main.a", "Main.b")))
    made.add([Result(2, 9, 90 * MS, 77, UP, ()), Result(0, 5, 1_500_000, 78, None, (4, "x"))])
    made.add([Result(1, 6, 60 * MS, 79, TRAPPED, (True, 1.5))])
    return made


def test_a_row_of_the_table_is_a_run_and_says_how_it_ended(tmp_path: Path) -> None:
    made = outcome()
    assert columns(made.plan) == ["run", "seed", "Main.n", "cycle", "faults", "power", "result", "failed", "plc", "scan",
                                  "time_ms", "code", "file", "line", "scans", "Main.a", "Main.b"]  # fmt: skip
    first, second, third = rows(made)
    wrong = ["slow 1s..2s", "power cold 2s..2s100ms"]
    assert first[:1] + first[2:] == [0, "1", "10ms", *wrong, "good", "", "", "", 1.5, "", "", "", 5, 4, "x"]
    assert second[2:] == ["2", "10ms", *wrong, "trap", "index out of range", "plc", 7, 7.5, "R0102", "mix.st", 14, 6, True, 1.5]
    assert third[2:] == ["3", "10ms", *wrong, "never", "Main.Up", "plc", 3, 30, "", "mix.st", 18, 9, "", ""]
    assert (made.failing, made.left, len({first[1], second[1], third[1]})) == (2, [], 3)
    write_table(tmp_path / "results.csv", made)
    lines = (tmp_path / "results.csv").read_bytes().split(b"\n")
    assert len(lines) == 5 and lines[4] == b"" and lines[1].startswith(b"0,") and lines[1].endswith(b",5,4,x")


def test_a_failure_is_told_with_its_place_and_grouped_by_it() -> None:
    assert [str(each) for each in (UP, TRAPPED, Failure("test", "a::b"))] == [
        "never Main.Up (mix.st:18)", "trap R0102 index out of range (mix.st:14)", "test a::b"]
    assert (UP.where, Failure("test", "a", line=4).where) == ("mix.st:18", "")
    same = replace(UP, plc="other", scan=9, now_ns=1, pou="P", detail="d")
    assert same.key == UP.key and len({replace(UP, **{name: value}).key for name, value in {
        "kind": "always", "text": "t", "code": "R1", "file": "f", "line": 1}.items()} | {UP.key}) == 6  # fmt: skip


# --- the page -----------------------------------------------------------------------------------------------------------


class Clock:
    now_s = 0.0

    def __call__(self) -> int:
        return int(self.now_s * 1e9)


def progress() -> Progress:
    """5 of 10 runs, one of them from before; a run a second for two seconds, then two at once."""
    clock = Clock()
    made = Progress(10, clock, [Result(0, failure=UP)])
    for second, numbers in ((1, [4]), (2, [3]), (4, [1, 2])):
        clock.now_s = second
        made.add([Result(number, failure=TRAPPED if number in (1, 2, 4) else None) for number in numbers])
    return made


def test_the_progress_as_data_says_all() -> None:
    made = progress()
    assert made.as_dict() == {
        "state": "running", "runs": 10, "done": 5, "good": 1, "failing": 4, "elapsed_s": 4.0, "rate": 1.0, "present_rate": 1.0,
        "left_s": 5.0, "groups": [
            {"kind": "trap", "text": "index out of range", "file": "mix.st", "line": 14, "code": "R0102", "runs": 3, "first": 1},
            {"kind": "never", "text": "Main.Up", "file": "mix.st", "line": 18, "code": "", "runs": 1, "first": 0}],
    }  # fmt: skip
    json.dumps(made.as_dict())
    rates = made.rates
    assert len(rates) == 60 and rates[-1][0] == 4.0 and rates[0][0] == pytest.approx(4 / 60)
    assert [round(rate, 6) for _, rate in rates] == [1.0] * 60
    assert [round(made._done_at(at), 6) for at in (0, 0.5, 1, 1.5, 3, 4, 9)] == [1, 1.5, 2, 2.5, 4, 5, 5]


def test_the_present_rate_is_that_of_the_last_ten_seconds() -> None:
    clock = Clock()
    made = Progress(1000, clock)
    for second, count in ((5, 50), (15, 10), (16, 2), (25, 3)):
        clock.now_s = second
        made.add([Result(number) for number in range(count)])
    assert made.present_rate == pytest.approx(5 / 10) and made.rate == pytest.approx(65 / 25)
    assert made.left_s == pytest.approx((1000 - 65) / 0.5) and len(made._samples) == 5
    clock.now_s = 25.2
    made.add([Result(0)])
    clock.now_s = 25.4
    made.add([Result(0)])
    assert made._samples[-2:] == [(25.0, 65), (25.4, 67)], "what comes within half a second is one sample"


def test_the_first_results_are_one_sample_if_they_come_within_half_a_second() -> None:
    clock = Clock()
    made = Progress(1000, clock)
    for tenth, samples in ((1, 2), (2, 2), (4, 2), (5, 3), (6, 3), (9, 4), (10, 4)):
        clock.now_s = tenth / 10
        made.add([Result(0)])
        assert len(made._samples) == samples and made._samples[-1] == (tenth / 10, made.done), tenth


def test_the_page_says_all_figures() -> None:
    made = progress()
    page = progress_page(made, "A & B", {0: "2.fbtrace"})
    figures = re.findall(r"<dt>([^<]*)</dt><dd([^>]*)>([^<]*)</dd>", page)
    assert figures == [("done", "", "5 of 10"), ("good", ' class="good"', "1"), ("failed", ' class="bad"', "4"),
                       ("runs a second, now", "", "1.0"), ("on average", "", "1.0"), ("it has run for", "", "4 s"),
                       ("and will for", "", "5 s")]  # fmt: skip
    assert "<title>50 % of A &amp; B</title>" in page and '<progress max="10" value="5"' in page and "<p>running</p>" in page
    assert re.findall(r"<tr><td>.*", page) == [
        "<tr><td>3<td>1<td>trap R0102 index out of range (mix.st:14)<td><code></code><tr><td>1<td>0<td>never Main.Up (mix.st:18)"
        "<td><code>2.fbtrace</code></tbody></table>"]  # fmt: skip
    assert 'viewBox="0 -2 600 94"' in page and "runs a second over 4 s, 1 at most" in page
    points = re.findall(r"([0-9.]+),([0-9.]+)", page.partition('points="')[2].partition('"')[0])
    assert (points[0], points[-1], len(points)) == (("10.0", "0.0"), ("600.0", "0.0"), 60)
    for state, refreshes in ((SHRINKING, True), (OVER, False)):
        made.state = state
        later = progress_page(made, "A", {})
        assert ("refresh" in later) is refreshes and "and will for" not in later
    assert "<title>0 % of A</title>" in progress_page(Progress(0, Clock()), "A", {})
    assert "<title>100 % of A</title>" in progress_page(Progress(1, Clock(), [Result(0)]), "A", {})


def test_times_are_told_in_two_units() -> None:
    assert [_time(seconds) for seconds in (0, 0.4, 0.6, 59.4, 59.6, 60, 61, 3599, 3600, 7325)] == [
        "0 s", "0 s", "1 s", "59 s", "1 min 0 s", "1 min 0 s", "1 min 1 s", "59 min 59 s", "1 h 0 min", "2 h 2 min"]


# --- the file -----------------------------------------------------------------------------------------------------------


def written(tmp_path: Path, text: str) -> Written | list[str]:
    (tmp_path / "campaign.toml").write_text(text)
    found = read_plan_file(tmp_path / "campaign.toml")
    return found if isinstance(found, Written) else [each.message for each in found]


def test_what_a_file_does_not_say_has_these_values(tmp_path: Path) -> None:
    found = written(tmp_path, """[campaign]
[[fault]]
between = "1s"
latency = "5ms"
lose_percent = 3
[[power]]
between = "0s"
[[golden]]
file = "a.txt"
names = ["Main.n"]
[[golden]]
file = "b.txt"
plc = "p"
names = ["Main.a"]
""")
    assert isinstance(found, Written), found
    assert dict(found.about) == {
        "project": None, "sources": None, "tests": (), "program": None, "dialect": None, "libraries": (), "cycle": 10 * MS,
        "servers": (), "runs": 0, "seed": 0, "timing": REAL, "for": None, "until": None, "never": (), "always": (), "show": ()}
    assert found.about == Written().about and (found.axes, found.responses) == ((), ())
    [rule], [cut] = found.faults, found.cuts
    assert rule.moments == Moments((S, S), LASTS_NS) and cut == PowerRule(Moments((0, 0), (10 * MS, 2 * S)), ())
    assert rule.kinds == (("latency lose_percent", NO_FAULT),) and rule.choices == {"latency_ns": (5 * MS,), "lose_percent": (3,)}
    assert found.judging == Judging(goldens=(Golden("a.txt", "", ("Main.n",), ""), Golden("b.txt", "p", ("Main.a",), "")))


def test_what_a_file_says_is_what_is_judged(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("golden", encoding="utf-8")
    found = written(tmp_path, """[campaign]
tests = ["tests/a.py"]
timing = "exact"
until = "Main.Done"
never = ["a"]
always = ["b", "c"]
[[within]]
trigger = "t"
answer = "u"
within = "0s"
[[power]]
plc = "pump"
start = "cold"
count = 2
chance = 5
between = ["1s", "2s"]
lasts = "3s"
[[golden]]
file = "a.txt"
names = ["Main.n"]
""")
    assert isinstance(found, Written), found
    assert found.judging == Judging(("a",), ("b", "c"), (Response("t", "u", 0),), "Main.Done",
                                    (Golden("a.txt", "", ("Main.n",), "golden"),))  # fmt: skip
    assert found.cuts == (PowerRule(Moments((S, 2 * S), (3 * S, 3 * S), 2, 5), ("pump",), True),)
    assert (found.about["tests"], found.about["timing"]) == (("tests/a.py",), EXACT)


BOUNDS = {
    "runs": ((1, 10_000_000), (0, 10_000_001)), "seed": ((0, 1 << 62), (-1, (1 << 62) + 1)),
    "count": ((1, 1000), (0, 1001)), "chance": ((1, 100), (0, 101)),
}  # fmt: skip


@pytest.mark.parametrize("key", BOUNDS)
def test_numbers_have_bounds(tmp_path: Path, key: str) -> None:
    good, bad = BOUNDS[key]
    text = "[campaign]\n{}" if key in ("runs", "seed") else '[campaign]\n[[power]]\nbetween = "1s"\n{}'
    for value in good:
        assert isinstance(written(tmp_path, text.format(f"{key} = {value}\n")), Written)
    for value in bad:
        said = written(tmp_path, text.format(f"{key} = {value}\n"))
        assert isinstance(said, list) and f"{key}: {value} is no" in said[0]


REFUSED = {
    '[campaign]\nsources = ["a.st"]\nproject = "p.toml"\n': ["a campaign runs sources or a project, not both"],
    '[campaign]\ntests = ["a"]\nsources = ["a.st"]\n': ["a campaign executes tests, or runs sources or a project: one of them"],
    '[campaign]\ntests = ["a"]\nproject = "p.toml"\n': ["a campaign executes tests, or runs sources or a project: one of them"],
    '[campaign]\n[[vary]]\nname = "a"\nsetting = "cycle"\nvalues = [1]\n': ["vary 1 varies nothing"],
    '[campaign]\n[[vary]]\nname = "a"\nvalues = [1]\n[[vary]]\nvalues = [1]\n[[vary]]\nname = "b"\n': [
        "vary 2 varies nothing", "vary 3: values are missing: write values = [...], or from and to"],
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_what_does_not_go_together_is_told(tmp_path: Path, text: str) -> None:
    assert written(tmp_path, text) == REFUSED[text]


def test_a_file_of_a_campaign_is_known_by_its_table(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    for text, said in (("[campaign]\n", True), ("[plc]\n", False), ("[campaign\n", False)):
        path.write_text(text)
        assert is_campaign(path) is said
    assert not is_campaign(tmp_path / "nothing.toml")


def test_faults_and_cuts_of_a_command_line_come_at_any_time_of_a_run() -> None:
    rule, cut = any_faults(3, 9 * S), any_cuts(4, 9 * S)
    assert rule.moments == Moments((0, 9 * S), LASTS_NS, 3) and cut == PowerRule(Moments((0, 9 * S), LASTS_NS, 4), ())
    left_out = {name for name, kind in NAMED.items() if kind.fault.lose_percent or kind.fault.duplicate_percent}
    assert left_out and {name for name, _ in rule.kinds} == set(NAMED) - left_out
    assert any_faults(1000, S).moments.count == any_cuts(1000, S).moments.count == 1000
    for made in (any_faults, any_cuts):
        with pytest.raises(ValueError, match="1,001 faults or power cuts are too many: a run has 1,000 of each at most"):
            made(1001, S)
