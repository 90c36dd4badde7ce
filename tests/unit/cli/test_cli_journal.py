"""`fbvm run --journal` and `fbvm replay`: what a user sees of a recording, and of a journal of fbvm 0.1."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from old_files import write_old_journal
from rows import first_quick

from fbvm import FileScans, RecordingFile
from fbvm.cli.main import main
from fbvm.record.recording import container

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


@pytest.mark.slow
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
    about, scans = [], []
    for name in "abc":
        with RecordingFile.open(name) as recording:
            about.append(recording.about["options"])
            scans.append([(moment.now_ns, bytes(moment.memory.u8)) for moment in FileScans(recording["demo"]).moments()])
    assert (about[2]["seed"], about[2]["timing"]) == (2, "real")
    assert scans[0] == scans[1] != scans[2]


@pytest.mark.slow
def test_a_replay_shows_what_was_not_asked_for(here: Path) -> None:
    fbvm("run", DEMO, *PEER, "--until", "Main.Done", "--journal", "run.journal")
    result = fbvm("replay", "run.journal", "--until", "Main.Read.Rcv_Counter = 1", "--show", "Main.Step",
                  "--chart", "CIO 1519.03,CIO 1519.04")  # fmt: skip
    assert result.exit_code == 0
    assert "CIO1519.03  ....#....   Send Request Switch\nCIO1519.04  ......#..   Receive Request Switch\n" in result.output
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "status", "message"),
    [
        ('"memory":"', '"memory":"f', 1, "after scan 0 the memory is not what was recorded"),
        ('{"end":4}\n', '{"en', 0, "the recording was cut off after 4 scans"),
        ('{"scan":2', '{"scan":7', 2, "line 5: scan 7 where 2 should be"),
        ('"journal":1', '"journal":9', 2, "a journal of format 9"),
        ('n := n + 6', 'n := n + 7', 2, "was written by another program"),
        ('n := n + 6', 'n := m + 6', 3, "S0201"),
        ('"sources"', '"sauces"', 2, "it holds no program"),
        ('"libraries":[]', '"libraries":["gone"]', 2, "needs the library folder gone; say where it is now"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_journal_is_said(here: Path, old: str, new: str, status: int, message: str) -> None:
    write_old_journal("run.journal", COUNTER)
    text = Path("run.journal").read_text(encoding="utf-8")
    assert old in text
    Path("run.journal").write_text(text.replace(old, new, 1), encoding="utf-8")
    result = fbvm("replay", "run.journal")
    assert result.exit_code == status, result.output
    assert message in result.output


def test_files_that_are_no_journals(here: Path) -> None:
    Path("junk").write_bytes(bytes(range(256)))
    for name, message in (("junk", "this is neither a recording"), ("counter.st", "nor a journal")):
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


def test_a_recording_that_was_cut_off_is_done_again_up_to_there(here: Path) -> None:
    fbvm("run", "counter.st", "--scans", "4", "--trace", "run.fbtrace")
    whole = Path("run.fbtrace").read_bytes()
    Path("run.fbtrace").write_bytes(whole[:-1])
    result = fbvm("replay", "run.fbtrace", "--show", "Main.n")
    assert (result.exit_code, result.output) == (0, "Main.n = 8\nthe recording was cut off after 4 scans\n")


def test_a_replay_that_shows_nothing_says_that_it_came_out_the_same(here: Path) -> None:
    fbvm("run", "counter.st", "--scans", "4", "--trace", "run.fbtrace")
    result = fbvm("replay", "run.fbtrace")
    assert (result.exit_code, result.output) == (0, "4 scans were done again: the memory is what was recorded\n")


def test_a_recording_of_another_run_is_found_out(here: Path) -> None:
    """A fingerprint of the memory that is not that of the run: as if this version of fbvm computed something else."""
    fbvm("run", "counter.st", "--scans", "4", "--trace", "run.fbtrace", "--verify")
    with open("run.fbtrace", "rb") as file:
        file.seek(len(container.MAGIC))
        rows = [(head, container.read_block(file, head)) for head in list(container.heads(file))]
    with open("run.fbtrace", "wb") as file:
        file.write(container.MAGIC)
        for head, payload in rows:
            if head.kind == container.SCANS:
                payload = payload[:-5] + bytes([payload[-5] ^ 1]) + payload[-4:]
            container.write_block(file, head.kind, payload, head.plc, head.first, head.scans)
    result = fbvm("replay", "run.fbtrace")
    assert result.exit_code == 1
    assert "after scan 2 the memory is not what was recorded" in result.output


def test_both_options_ask_for_the_same_file(here: Path) -> None:
    assert fbvm("run", "counter.st", "--scans", "4", "--trace", "a", "--journal", "b").exit_code == 0
    assert Path("a").read_bytes() == Path("b").read_bytes()
    assert fbvm("replay", "a", "--show", "Main.n").output == fbvm("replay", "b", "--show", "Main.n").output == "Main.n = 8\n"


@pytest.mark.slow
def test_all_plcs_of_a_project_are_in_one_recording(here: Path) -> None:
    Path("fbvm.toml").write_text('[plc.One]\nsources = ["counter.st"]\n[plc.Two]\nsources = ["counter.st"]\ncount = 2\n'
                                 'cycle = "20ms"\n', encoding="utf-8")  # fmt: skip
    result = fbvm("run", "--for", "100ms", "--trace", "run.fbtrace")
    assert result.exit_code == 0, result.output
    assert "choose a PLC with --plc NAME; the recording has One, Two[1], Two[2]" in fbvm("replay", "run.fbtrace").output
    shown = {name: fbvm("replay", "run.fbtrace", "--plc", name, "--show", "Main.n").output for name in ("One", "Two[2]")}
    assert shown == {"One": "Main.n = 20\n", "Two[2]": "Main.n = 10\n"}
    assert fbvm("chart", "run.fbtrace", "Main.n", "--plc", "Two[2]").exit_code == 0
