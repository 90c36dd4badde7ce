"""`fbvm run --journal` and `fbvm replay`: what a user sees of a journal."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from rows import first_quick

from fbvm.cli.main import main

DEMO = str(Path(__file__).resolve().parents[3] / "examples" / "demo.st")
PEER = ["--map", "192.168.250.1:502=peer"]
COUNTER = "PROGRAM Main VAR n : INT; d : INT := 3; END_VAR n := n + 6 / d; END_PROGRAM\n"


def fbvm(*arguments: str) -> Result:
    result = CliRunner().invoke(main, arguments)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("timing", first_quick(["exact", "real"]))
def test_a_run_is_done_again(here: Path, timing: str) -> None:
    asked = ["--show", "D200..D204", "--show", "Main.Read.Rcv_Counter", "--json"]
    first = fbvm("run", DEMO, *PEER, "--until", "Main.Done", "--timing", timing, "--seed", "9",
                 "--set", "Main.Quantity=5@20ms", "--journal", "run.journal", *asked)  # fmt: skip
    again = fbvm("replay", "run.journal", *asked)
    assert (first.exit_code, again.exit_code) == (0, 0)
    told, found = json.loads(first.stdout), json.loads(again.stdout)
    assert (told.pop("stopped"), found.pop("stopped")) == ("until", "end")
    assert told == found
    assert found["values"]["D200..D204"] == [1000, 1001, 1002, 1003, 1004]


@pytest.mark.slow
def test_the_same_seed_is_the_same_run(here: Path) -> None:
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        fbvm("run", DEMO, *PEER, "--scans", "60", "--timing", "real", "--seed", seed, "--journal", name)
    header = json.loads(Path("c").read_text(encoding="utf-8").splitlines()[0])
    assert header["about"]["options"]["seed"] == 2
    assert header["about"]["options"]["timing"] == "real"
    a, b, c = (Path(name).read_text(encoding="utf-8").splitlines()[2:] for name in "abc")
    assert a == b != c


@pytest.mark.slow
def test_a_replay_shows_what_was_not_asked_for(here: Path) -> None:
    fbvm("run", DEMO, *PEER, "--until", "Main.Done", "--journal", "run.journal")
    result = fbvm("replay", "run.journal", "--until", "Main.Read.Rcv_Counter = 1", "--show", "Main.Step",
                  "--chart", "CIO 1519.03,CIO 1519.04")  # fmt: skip
    assert result.exit_code == 0
    assert "CIO1519.03  ....#....\nCIO1519.04  ......#..\n" in result.output
    assert "Main.Step = Reading" in result.output


def test_it_goes_on_without_the_files(here: Path) -> None:
    fbvm("run", "counter.st", "--scans", "4", "--journal", "run.journal")
    Path("counter.st").unlink()
    result = fbvm("replay", "run.journal", "--scans", "3", "--show", "Main.n")
    assert (result.exit_code, result.output) == (0, "Main.n = 6\n")


def test_a_program_that_stopped_stops_again(here: Path) -> None:
    first = fbvm("run", "counter.st", "--scans", "9", "--set", "Main.d=0@20ms", "--journal", "run.journal")
    again = fbvm("replay", "run.journal")
    assert (first.exit_code, again.exit_code) == (4, 4)
    assert again.output == first.output
    assert "counter.st:1:58 in Main: 6 divided by 0" in again.output


def test_a_condition_that_never_held(here: Path) -> None:
    fbvm("run", "counter.st", "--scans", "4", "--journal", "run.journal")
    result = fbvm("replay", "run.journal", "--until", "Main.n > 99")
    assert (result.exit_code, result.output) == (1, "Main.n > 99 did not hold in 40ms\n")


@pytest.mark.parametrize(
    ("old", "new", "status", "message"),
    [
        ('"memory":"', '"memory":"f', 1, "after scan 0 the memory is not what the journal says"),
        ('{"end":4}\n', '{"en', 0, "the journal was cut off after 4 scans"),
        ('{"scan":2', '{"scan":7', 2, "line 5: scan 7 where 2 should be"),
        ('"journal":1', '"journal":9', 2, "a journal of format 9"),
        ('n := n + 6', 'n := n + 7', 2, "was written by another program"),
        ('n := n + 6', 'n := m + 6', 3, "S0201"),
        ('"sources"', '"sauces"', 2, "it holds no program"),
        ('"libraries":[]', '"libraries":["gone"]', 2, "needs the library folder gone; say where it is now"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_journal_is_said(here: Path, old: str, new: str, status: int, message: str) -> None:
    fbvm("run", "counter.st", "--scans", "4", "--journal", "run.journal")
    text = Path("run.journal").read_text(encoding="utf-8")
    assert old in text
    Path("run.journal").write_text(text.replace(old, new, 1), encoding="utf-8")
    result = fbvm("replay", "run.journal")
    assert result.exit_code == status, result.output
    assert message in result.output


def test_files_that_are_no_journals(here: Path) -> None:
    Path("junk").write_bytes(bytes(range(256)))
    for name, message in (("junk", "this is no text, so no journal"), ("counter.st", "this is no journal of fbvm")):
        result = fbvm("replay", name)
        assert result.exit_code == 2
        assert message in result.output
    assert fbvm("run", "counter.st", "--scans", "1", "--journal", "no/where").exit_code == 2
    assert fbvm("replay", "run.journal").exit_code == 2


def test_names_that_are_not_in_the_program(here: Path) -> None:
    fbvm("run", "counter.st", "--scans", "4", "--journal", "run.journal")
    for asked in (["--show", "Main.m"], ["--chart", "Main.m"], ["--until", "Main.m > 0"]):
        result = fbvm("replay", "run.journal", *asked)
        assert result.exit_code == 2
        assert "Main has no m; it has n, d" in result.output
    assert fbvm("replay", "run.journal", "--until", "Main.n >").exit_code == 2


def test_how_long_scans_took_is_told_on_demand(here: Path) -> None:
    result = fbvm("run", "counter.st", "--scans", "50", "--scan-time")
    assert result.output.startswith("scan time: ")
    assert " on average, 99 % within " in result.output
    told = json.loads(fbvm("run", "counter.st", "--scans", "50", "--scan-time", "--json").stdout)
    times = told["scan_time"]
    assert 0 < times["mean_ns"] <= times["longest_ns"]
    assert "scan_time" not in json.loads(fbvm("run", "counter.st", "--scans", "5", "--json").stdout)
