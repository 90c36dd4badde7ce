"""How far a campaign is: rates, groups and what is left, as lines and as a page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.campaign.execution import Result
from fbvm.campaign.judge import NEVER, Failure
from fbvm.campaign.progress import RUNNING, SHRINKING, Progress
from fbvm.campaign.progress_page import progress_page
from fbvm.cli.main import main

BAD = Failure(NEVER, "Main.<b>Up</b> AND Main.Down", "plc", 3, file="mix.st", line=18)


class Clock:
    """A clock that is told the time."""

    now_s = 0.0

    def __call__(self) -> int:
        return int(self.now_s * 1e9)


def after_40_of_100() -> tuple[Progress, Clock]:
    """Ten results were there, ten a second came, of which two failed."""
    clock = Clock()
    progress = Progress(100, clock, [Result(number) for number in range(10)])
    for second in range(3):
        clock.now_s = second + 1
        first = 10 + 10 * second
        progress.add([Result(number, failure=BAD if number in (33, 21) else None) for number in range(first, first + 10)][::-1])
    return progress, clock


def test_rates_are_of_this_call_and_failures_are_grouped_by_the_first_run() -> None:
    progress, _ = after_40_of_100()
    [group] = progress.groups
    assert (progress.rate, progress.present_rate, progress.left_s) == (10, 10, 6)
    assert (progress.done, progress.failing, group.runs, group.first) == (40, 2, 2, 21)
    assert {round(rate) for _, rate in progress.rates} == {10}
    assert progress.as_dict()["groups"] == [{"kind": "never", "text": BAD.text, "file": "mix.st", "line": 18, "code": "",
                                             "runs": 2, "first": 21}]  # fmt: skip


def test_seconds_and_rates_are_told_to_a_tenth() -> None:
    progress, clock = after_40_of_100()
    clock.now_s = 3.26
    progress.add([Result(40)])
    told = progress.as_dict()
    assert (told["elapsed_s"], told["rate"], told["present_rate"], told["left_s"]) == (3.3, 9.5, 9.5, 6.2)


def test_without_a_second_result_nothing_is_said_of_what_is_left() -> None:
    assert (Progress(100, Clock()).left_s, Progress(100, Clock()).as_dict()["rate"]) == (None, 0)


def test_when_all_runs_are_done_failing_ones_are_made_smaller() -> None:
    progress, clock = after_40_of_100()
    clock.now_s = 5
    assert progress.state == RUNNING
    progress.add([Result(number) for number in range(40, 100)])
    assert (progress.state, progress.present_rate) == (SHRINKING, 18)


def test_results_that_come_close_to_one_another_are_one_sample() -> None:
    clock = Clock()
    progress = Progress(100, clock)
    for tenth in range(1, 41):
        clock.now_s = tenth / 10
        progress.add([Result(tenth)])
    assert len(progress._samples) < 20 and progress._samples[-1] == (4.0, 40) and progress.rate == 10


def test_a_page_without_failures_or_rates_says_so() -> None:
    page = progress_page(Progress(100, Clock()), "Campaign", {})
    assert '<p class="good">none so far</p>' in page and "<figure>" not in page
    progress, clock = after_40_of_100()
    clock.now_s = 3725
    progress.add([Result(41)])
    assert "runs a second over 1 h 2 min" in progress_page(progress, "Campaign", {})


def test_the_page_loads_itself_again_while_it_goes_on_and_names_of_programs_stay_text() -> None:
    progress, _ = after_40_of_100()
    page = progress_page(progress, "Campaign", {21: "1.fbtrace"})
    assert '<meta http-equiv="refresh" content="2">' in page and "<title>40 % of Campaign</title>" in page
    assert "<td>2<td>21<td>never Main.&lt;b&gt;Up&lt;/b&gt; AND Main.Down (mix.st:18)<td><code>1.fbtrace</code>" in page
    assert "<script" not in page and re.search(r"default-src 'none'; style-src 'sha256-[^']+'", page)
    progress.state = "over"
    assert "refresh" not in progress_page(progress, "Campaign", {})


@pytest.mark.slow
def test_a_campaign_leaves_its_page_and_prints_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("count.st").write_text("PROGRAM Main VAR n, limit : INT; END_VAR n := n + 1; END_PROGRAM")
    result = CliRunner().invoke(main, ["campaign", "count.st", "--vary", "Main.limit=1..4", "--for", "50ms", "--never",
                                       "Main.n > Main.limit", "--json-lines"])  # fmt: skip
    first, *_, last = map(json.loads, result.stdout.splitlines())
    assert (first["state"], first["done"], first["runs"], first["failing"]) == ("running", 1, 4, 1)
    assert (result.exit_code, last["done"], last["failing"], last["groups"][0]["runs"]) == (1, 4, 4, 4)
    page = Path("campaign-results/progress.html").read_text()
    assert "<p>over</p>" in page and "<code>1.fbtrace</code>" in page


def test_a_rate_is_never_below_nothing() -> None:
    """The first result is there some time after the beginning, many together."""
    clock = Clock()
    clock.now_s = 0.01
    progress = Progress(100, clock)
    for second in (1, 2):
        clock.now_s = second
        progress.add([Result(number) for number in range(40 * (second - 1), 40 * second)])
    assert min(rate for _, rate in progress.rates) >= 0
    assert sum(rate * 2 / 60 for _, rate in progress.rates) == pytest.approx(80)
