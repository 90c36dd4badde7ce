"""Runs of a campaign: judged, grouped, made smaller, recorded, resumed, and the same whoever executes them."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.base.host import can_end_others
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.execution import Result
from fbvm.campaign.executors import InThisProcess, in_processes
from fbvm.campaign.judge import CRASHED
from fbvm.campaign.plan import Moments, PowerRule
from fbvm.campaign.plan_file import Written, with_about
from fbvm.campaign.planning import images_of, plan_of, program_project
from fbvm.campaign.runs import Outcome, conduct
from fbvm.campaign.store import LINES, TABLE, InUse, OtherCampaign, Store, write_table
from fbvm.campaign.work import Batch, Bench, Done, Task
from fbvm.cli.main import main

MIX = """PROGRAM Main
VAR
    Up, Down, Busy : BOOL;
    Count : INT;
    Limit : INT := 5;
    Wait  : TIME := T#100ms;
    t     : TON;
    a     : ARRAY[1..8] OF INT;
END_VAR
VAR RETAIN Kept : INT; END_VAR
    t(IN := NOT t.Q, PT := Wait);
    IF t.Q THEN
        Count := Count + 1;
        a[Count] := Count;
        Kept := Kept + 1;
    END_IF;
    Up := Count > 2;
    Down := Count > Limit;
    Busy := Count = 3;
END_PROGRAM
"""
TRAPPED, BOTH = ("trap", "mix.st", 14), ("never", "mix.st", 18)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "mix.st").write_text(MIX)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def bench_of(**about: Any) -> Bench:
    """The bench of a campaign over mix.st, of which each run takes a second."""
    rules = {name: about.pop(name) for name in ("cuts", "axes") if name in about}
    written = replace(with_about(Written(), **{"for": 1_000_000_000, **about}), **rules)
    project = program_project([Path("mix.st")], written.about, Path())
    images, _ = images_of(project)
    return Bench.of(plan_of(written, project, images), images)


def fbvm(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["campaign", *arguments])
    return result.exit_code, result.stdout if result.exit_code < 2 else result.stderr


def groups(said: str) -> dict[tuple[str, str, int], Any]:
    return {(group["kind"], group["file"], group["line"]): group for group in json.loads(said)["groups"]}


@pytest.mark.slow
def test_failures_are_grouped_by_the_statement_that_brought_them(folder: Path) -> None:
    status, said = fbvm("mix.st", "--vary", "Main.Limit=4..20", "--for", "2s", "--never", "Main.Up AND Main.Down", "--json")
    found = groups(said)
    assert (status, {key: group["runs"] for key, group in found.items()}) == (1, {TRAPPED: 13, BOTH: 4})
    assert (found[BOTH]["first"], found[BOTH]["values"], found[BOTH]["scan"]) == (0, {"Main.Limit": 4}, 58)
    assert found[TRAPPED]["code"] == "R0102"
    rows = list(csv.DictReader((folder / "campaign-results" / TABLE).read_text().splitlines()))
    assert [(row["Main.Limit"], row["result"], row["line"]) for row in rows[3:5]] == [("7", "never", "18"), ("8", "trap", "14")]


@pytest.mark.slow
def test_a_late_answer_is_told_with_the_statement_of_its_trigger(folder: Path) -> None:
    late = ["--within", "Main.Busy", "Main.Count = 4", "150ms", "--for", "1200ms", "--json"]
    status, said = fbvm("mix.st", "--vary", "Main.Wait=T#10ms,T#100ms,T#300ms", *late)
    assert (status, [(key, group["first"]) for key, group in groups(said).items()]) == (
        1, [(TRAPPED, 0), (("within", "mix.st", 19), 2)])


@pytest.mark.slow
def test_what_has_to_hold_before_the_end_fails_without_it(folder: Path) -> None:
    status, said = fbvm("mix.st", "--vary", "Main.Wait=T#100ms,T#300ms", "--until", "Main.Count = 5", "--for", "1s", "--json")
    assert (status, [(kind, group["first"]) for (kind, _, _), group in groups(said).items()]) == (1, [("until", 1)])
    assert fbvm("mix.st", "--vary", "Main.Wait=T#100ms", "--until", "Main.Count = 5", "--for", "1s", "--fresh")[0] == 0


@pytest.mark.slow
def test_the_recording_of_a_group_does_the_run_again_to_the_bit(folder: Path) -> None:
    fbvm("mix.st", "--cuts", "2", "--runs", "5", "--for", "3s", "--always", "Main.Kept < 8")
    recording = str(folder / "campaign-results" / "1.fbtrace")
    result = CliRunner().invoke(main, ["replay", recording, "--show", "Main.Kept", "--json"])
    assert (result.exit_code, json.loads(result.stdout)["values"]) == (0, {"Main.Kept": 8})


def test_a_power_cut_keeps_what_is_retained_and_parameters_and_nothing_else(folder: Path) -> None:
    """Behind the cut, 100 ms before the end, there was time for one count: the retained one goes on, the other begins anew."""
    rule = PowerRule(Moments((700_000_000, 700_000_000), (200_000_000, 200_000_000)), ())
    for is_cold, kept in ((False, 7), (True, 1)):
        bench = bench_of(runs=1, show=("Main.Kept", "Main.Count", "Main.Wait"), cuts=(replace(rule, is_cold=is_cold),),
                         axes=(axis_from_text("Main.Wait=T#90ms"),))  # fmt: skip
        result = bench.execution().result(bench.variant(0))
        assert (result.failure, result.shown) == (None, (kept, 1, 90_000_000))


@pytest.mark.slow
def test_processes_give_the_results_of_this_process(folder: Path) -> None:
    bench = bench_of(never=("Main.Up AND Main.Down",), runs=40)
    batches = [Batch(tuple(range(at, at + 10))) for at in range(0, 40, 10)]
    tables = []
    for number, executor in enumerate((InThisProcess(bench), in_processes(bench, 2))):
        outcome = Outcome(bench.plan)
        with executor:
            for _, found in executor.done(batches):
                assert isinstance(found, list)
                outcome.add(found)
        write_table(folder / f"{number}.csv", outcome)
        tables.append((folder / f"{number}.csv").read_bytes())
    assert tables[0] == tables[1]
    assert len(tables[0].splitlines()) == 41



class Six(InThisProcess):
    """Says that it does six tasks at once, as a cluster does, and keeps which there were."""

    count = 6

    def __init__(self, bench: Bench) -> None:
        super().__init__(bench)
        self.sizes: list[int] = []

    def done(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Any]]:
        self.sizes += [len(task.numbers) for task in tasks if isinstance(task, Batch)]
        return super().done(tasks)


@pytest.mark.slow
def test_runs_are_shared_by_all_who_do_them_whatever_the_processes_of_this_machine_are(folder: Path) -> None:
    bench = replace(bench_of(runs=20), batch_ns=1 << 60)
    executor = Six(bench)
    conduct(bench, outcome := Outcome(bench.plan), 1, outcome.add, executor)
    assert executor.sizes == [3] * 6


class KillsRun(Bench):
    """A bench whose processes end when they come to run 7, as a defect of machine code would end them."""

    def work(self, number: int, task: Task) -> Done:
        if isinstance(task, Batch) and 7 in task.numbers:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().work(number, task)


@pytest.mark.slow
def test_a_run_that_ends_its_process_is_a_failure_and_nothing_else_is_lost(folder: Path) -> None:
    bench = bench_of(runs=20)
    outcome = Outcome(bench.plan)
    conduct(KillsRun(**vars(bench)), outcome, 2, outcome.add, in_processes(KillsRun(**vars(bench)), 2))
    assert sorted(outcome.results) == list(range(20))
    failures = [(result.number, result.failure.kind, result.failure.text) for result in outcome.rows if result.failure]
    assert failures == [(7, CRASHED, "the process of the run ended by SIGKILL")]


@pytest.mark.slow
def test_a_campaign_goes_on_where_it_was_cut_off(folder: Path) -> None:
    """Killed while it wrote a line: the table is that of a campaign in one piece, and whole runs are not executed again."""
    arguments = ["mix.st", "--vary", "Main.Limit=1..8", "--for", "1s", "--never", "Main.Up AND Main.Down", "--jobs", "1"]
    assert fbvm(*arguments)[0] == 1
    kept, lines = folder / "campaign-results" / TABLE, folder / "campaign-results" / LINES
    whole, text = kept.read_bytes(), lines.read_bytes().splitlines(keepends=True)
    assert len(text) == 9
    marked = text[2].replace(b'"memory": ', b'"memory": 1')
    lines.write_bytes(text[0] + text[1] + marked + text[3][:20])
    assert fbvm(*arguments)[0] == 1
    assert kept.read_bytes() == whole
    assert lines.read_bytes().splitlines(keepends=True) == [text[0], text[1], marked, *text[3:]]


def lines_in(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


@pytest.mark.slow
@pytest.mark.skipif(not can_end_others(), reason="Windows cannot end a process as SIGKILL does")
def test_a_campaign_whose_own_process_is_killed_gives_the_same_table_when_it_is_called_again(folder: Path) -> None:
    """With its processes at work; a second campaign in the folder is refused meanwhile."""
    arguments = ["mix.st", "--runs", "500", "--cuts", "1", "--for", "600ms", "--never", "Main.Up AND Main.Down", "--jobs", "2"]
    lines = folder / "killed" / LINES
    victim = subprocess.Popen([sys.executable, "-m", "fbvm", "campaign", *arguments, "--out", "killed"])
    try:
        while lines_in(lines) < 20:
            assert victim.poll() is None, "it has ended before it was killed"
        with pytest.raises(InUse, match="another campaign writes its results there"):
            Store(lines.parent, "mark", fresh=True)
    finally:
        victim.kill()
        victim.wait()
    kept = lines_in(lines)
    assert 20 <= kept < 501
    assert [fbvm(*arguments, "--out", name)[0] for name in ("killed", "whole")] == [0, 0]
    assert (folder / "killed" / TABLE).read_bytes() == (folder / "whole" / TABLE).read_bytes()
    assert lines_in(folder / "whole" / LINES) == lines_in(lines) == 501


@pytest.mark.slow
def test_results_of_another_campaign_are_not_mixed(folder: Path) -> None:
    assert fbvm("mix.st", "--vary", "Main.Limit=1..3", "--for", "100ms")[0] == 0
    (folder / "mix.st").write_text(MIX.replace("Count > 2", "Count > 1"))
    status, said = fbvm("mix.st", "--vary", "Main.Limit=1..3", "--for", "100ms")
    assert status == 2
    assert "holds results of another campaign, another program or another version of fbvm" in said and "--fresh" in said
    assert fbvm("mix.st", "--vary", "Main.Limit=1..3", "--for", "100ms", "--fresh")[0] == 0


@pytest.mark.parametrize("text", [b"notes of somebody\nof a long night\n", b"a note", b'{"format": 1}\n'])
def test_a_file_that_is_no_campaign_s_is_left_as_it_is(tmp_path: Path, text: bytes) -> None:
    (tmp_path / LINES).write_bytes(text)
    with pytest.raises(OtherCampaign):
        Store(tmp_path, "mark")
    assert (tmp_path / LINES).read_bytes() == text


def test_a_file_whose_first_line_was_cut_off_begins_anew(tmp_path: Path) -> None:
    Store(tmp_path, "mark").close()
    whole = (tmp_path / LINES).read_bytes()
    (tmp_path / LINES).write_bytes(whole[:20])
    Store(tmp_path, "mark").close()
    assert (tmp_path / LINES).read_bytes() == whole


PLANTED = ("Failures := Failures + 1;", "Failures := Failures + 1; Level := Wanted;")
"""Of the gateway: it tells the panel what it wants to hear when the tank could not be read."""


class Interrupted(InThisProcess):
    """Is interrupted by Ctrl-C after two batches."""

    count = 5

    def done(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Done | None]]:
        for number, found in enumerate(super().done(tasks)):
            if number == 2:
                raise KeyboardInterrupt
            yield found


def test_what_was_done_before_ctrl_c_is_kept(folder: Path) -> None:
    bench = bench_of(runs=20)
    outcome, store = Outcome(bench.plan), Store(folder / "kept", bench.mark)

    def take(found: Sequence[Result]) -> None:
        store.add(found)
        outcome.add(found)

    with closing(store), pytest.raises(KeyboardInterrupt):
        conduct(bench, outcome, 1, take, Interrupted(bench))
    with closing(Store(folder / "kept", bench.mark)) as again:
        assert again.known == outcome.rows
        assert 3 <= len(again.known) < 20


@pytest.mark.slow
def test_the_row_of_three_plcs_is_good_and_a_fault_planted_in_a_copy_is_found(folder: Path) -> None:
    for name, planted in (("good", False), ("bad", True)):
        copy = folder / name
        shutil.copytree(data_folder("examples") / "row", copy)
        if planted:
            path = copy / "gateway.st"
            text = path.read_text()
            assert PLANTED[0] in text
            path.write_text(text.replace(*PLANTED))
        status, said = fbvm(str(copy), "--runs", "6", "--jobs", "1", "--out", f"{name}-results", "--json")
        assert status == planted
        found = json.loads(said)["groups"]
        assert len(found) == planted
    [group] = found
    assert (group["text"], len(group["faults"])) == ("panel.Main.Done AND tank.Main.Level < 700.0", 1)
    assert Path(group["file"]).read_text().splitlines()[group["line"] - 1].strip() == "Done := Level >= Wanted;"


@pytest.mark.parametrize(("arguments", "said"), [
    (("mix.st",), "say how long a run takes at most"),
    (("mix.st", "--for", "1s", "--never", "Main.Foo"), "Foo"),
    (("mix.st", "--for", "1s", "--always", "Main.Count"), "Main.Count"),
    (("mix.st", "--for", "1s", "--vary", "Main.Limit=1,abc"), "Main.Limit: 'abc' is no literal"),
    (("mix.st", "--for", "1s", "--vary", "Main.Limit=1,70000"), "Main.Limit"),
    (("mix.st", "--for", "1s", "--runs", "3", "--only", "3"), "there are runs 0 to 2"),
    (("mix.st", "--for", "1s", "--map", "10.0.0.1:502=host:1"), "runs are in memory"),
    (("mix.st", "--faults", "1"), "say how long a run takes at most"),
    (("mix.st", "--for", "1s", "--write-golden"), "no [[golden]] to write"),
    (("none.toml",), "none.toml"),
    (("mix.st", "--for", "1s", "--vary", "Main.Limit=1", "--vary", "Main.Limit=2"), "Main.Limit is varied 2 times"),
    (("mix.st", "--for", "1s", "--runs", "1000000000"), "1,000,000,000 runs are too many"),
    (("mix.st", "--for", "1s", "--vary", "Main.Limit=1..30000", "--vary", "Main.Count=1..30000"), "900,000,000 combinations"),
    (("mix.st", "--for", "1s", "--faults", "1001"), "a run has 1,000 of each at most"),
    (("mix.st", "--for", "1s", "--cuts", "1000000000"), "a run has 1,000 of each at most"),
    (("mix.st", "--for", "1s", "--jobs", "1000000000"), "is not in the range"),
    (("mix.st", "--for", "1s", "--seed", "1" + 30 * "0"), "is not in the range"),
    (("mix.st", "--for", "1s", "--cluster", "192.168.1.5"), "'192.168.1.5' is no scheduler: write local, or an address"),
])  # fmt: skip
def test_what_does_not_fit_is_said_before_anything_is_written(folder: Path, arguments: tuple[str, ...], said: str) -> None:
    status, text = fbvm(*arguments)
    assert (status, said in text) == (2, True), text
    assert not (folder / "campaign-results").exists()


IN_FILE = [
    ('never = ["Main.Foo"]', "bad.toml: Main has no Foo"),
    ('[[vary]]\nname = "Main.Foo"\nvalues = [1]', "bad.toml: Main has no Foo"),
    ('[[vary]]\nname = "cycle"\nvalues = ["5ms"]', 'what is varied beside variables is written setting = "cycle"'),
    ('[[golden]]\nfile = "g.txt"\nnames = ["Main.Up"]', "there is no golden file g.txt: --write-golden writes it"),
]


@each_of(("written", "said"), IN_FILE)
def test_what_of_a_campaign_file_does_not_fit_its_program_is_said_with_the_file(folder: Path, written: str, said: str) -> None:
    (folder / "bad.toml").write_text(f'[campaign]\nsources = ["mix.st"]\nfor = "1s"\n{written}\n')
    status, text = fbvm("bad.toml")
    assert (status, said in text) == (2, True), text


@pytest.mark.slow
def test_a_golden_file_is_written_and_the_next_run_is_compared_with_it(folder: Path) -> None:
    (folder / "mixed.toml").write_text(
        '[campaign]\nsources = ["mix.st"]\nfor = "500ms"\n[[golden]]\nfile = "mix.txt"\nnames = ["Main.Count", "Main.Up"]\n')
    assert fbvm("mixed.toml", "--write-golden") == (0, "mix.txt is written\n")
    golden = (folder / "mix.txt").read_text()
    assert [line.split()[-1] for line in golden.splitlines() if "scan" in line][1:] == ["0", "1", "2", "3", "4", "FALSE", "TRUE"]
    assert fbvm("mixed.toml")[0] == 0
    (folder / "mix.txt").write_text(golden.replace("TRUE", "FALSE"))
    status, text = fbvm("mixed.toml", "--fresh")
    assert (status, "mix.txt: Main.Up" in text) == (1, True), text


@pytest.mark.slow
def test_parameters_that_json_cannot_write_are_texts_there(folder: Path) -> None:
    (folder / "real.st").write_text("PROGRAM Main\nVAR r : REAL; b : BOOL; END_VAR\nb := r > 1.0;\nEND_PROGRAM\n")
    status, said = fbvm("real.st", "--vary", "Main.r=0.5,inf", "--for", "100ms", "--never", "Main.b", "--json")
    assert (status, json.loads(said)["groups"][0]["values"]) == (1, {"Main.r": "inf"})


def test_a_table_for_other_tools_has_numbers_as_numbers(folder: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    assert fbvm("mix.st", "--vary", "Main.Limit=1,7", "--vary", "cycle=10ms,20ms", "--for", "300ms", "--show", "Main.Kept",
                "--parquet", "t.parquet")[0] == 0  # fmt: skip
    table = parquet.read_table("t.parquet")
    kinds = {field.name: str(field.type) for field in table.schema}
    assert [kinds[name] for name in ("run", "Main.Limit", "cycle", "faults", "power", "time_ms", "line", "Main.Kept")] == [
        "int64", "int64", "string", "string", "string", "double", "int64", "int64"]  # fmt: skip
    assert table.column("Main.Limit").to_pylist() == [1, 1, 7, 7]
    assert table.column("cycle").to_pylist() == ["10ms", "20ms", "10ms", "20ms"]
