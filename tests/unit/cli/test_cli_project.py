"""`fbvm run` of a project: which one is meant, what it prints, and the status with which it ends."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fbvm.cli.main import main
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

PROGRAM = """
PROGRAM Main
VAR n : INT; step : INT := 1; divisor : INT := 1; END_VAR
    n := n + step / divisor;
END_PROGRAM
"""
PROJECT = """
run = {for = "50ms"}

[plc.pump]
sources = ["counter.st"]
count = 3
watch = ["Main.n", "D0"]

[plc.valve]
sources = ["counter.st"]
cycle = "5ms"
watch = ["Main.n"]
set = [{name = "Main.step", value = 10, at = "20ms"}]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "counter.st").write_text(PROGRAM, encoding="utf-8")
    (tmp_path / "fbvm.toml").write_text(PROJECT, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str) -> Result:
    result = CliRunner().invoke(main, ["run", *arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


SAID = """\
pump: 3 PLCs, 5 scans each in 50ms, ended by time
  Main.n = 5
  D0 = 0 (16#0000)
valve: 10 scans in 50ms, ended by time
  Main.n = 64
"""


def test_in_the_folder_of_a_project_nothing_needs_to_be_said(folder: Path) -> None:
    result = run()
    assert (result.exit_code, result.stdout, result.stderr) == (0, SAID, "")


def test_a_project_is_named_by_its_folder_or_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")
    assert run(str(folder)).stdout == SAID
    assert run(str(folder / "fbvm.toml")).stdout == SAID


@pytest.mark.slow
def test_what_is_warned_of_in_a_program_is_told_before_the_run(folder: Path) -> None:
    text = PROGRAM.replace("divisor :", "unused : INT; divisor :")
    (folder / "counter.st").write_text(text, encoding="utf-8")
    result = run()
    assert (result.exit_code, result.stdout) == (0, SAID)
    assert "warning" in result.stderr and "unused" in result.stderr


@pytest.mark.slow
def test_values_that_differ_are_a_range(folder: Path) -> None:
    (folder / "counter.st").write_text(PROGRAM.replace("step : INT", "step AT D1 : INT"), encoding="utf-8")
    (folder / "client.st").write_text("""
PROGRAM Main
VAR sent : BOOL; conn : MTCP_ETN_Connect; END_VAR
    conn(IP_Address1 := 10, IP_Address2 := 0, IP_Address3 := 0, IP_Address4 := 9, Connect := TRUE);
END_PROGRAM
""", encoding="utf-8")
    (folder / "fbvm.toml").write_text("""
run = {for = "1s"}
[[plc.door.unit]]
address = "10.0.0.1"
[plc.door]
sources = ["client.st"]
count = 2
watch = ["Main.conn.ENO", "D30009..D30010"]
[[fault]]
silent = true
peer = "10.0.0.2:0"
[[server]]
address = "10.0.0.9:502"
""", encoding="utf-8")
    assert run().stdout == """\
door: 2 PLCs, 100 scans each in 1s, ended by time
  Main.conn.ENO = FALSE .. TRUE
  D30009..D30010 has 2 different values
"""


def test_for_scripts(folder: Path) -> None:
    result = run("--json", "--scans", "2", "--scan-time")
    data = json.loads(result.stdout)
    assert list(data["plcs"]) == ["pump[1]", "pump[2]", "pump[3]", "valve"]
    assert data["plcs"]["pump[2]"] == {
        "scans": 2, "time_ns": 20_000_000, "stopped": "scans", "values": {"Main.n": 2, "D0": 0}, "trap": None}  # fmt: skip
    assert data["scan_time"]["pump"]["overruns"] in range(7)  # of six scans, by the clock of a computer that may have other work
    assert data["lateness"]["valve"]["missed_periods"] == 0


def test_scan_times_are_of_all_plcs_of_a_kind(folder: Path) -> None:
    lines = run("--scan-time").stderr.splitlines()
    assert [line.split(" on average")[0].rsplit(" ", 2)[0] for line in lines] == ["pump: scan time:", "valve: scan time:"]


@pytest.mark.slow
def test_a_trap_stops_one_plc_and_is_told(folder: Path) -> None:
    text = PROJECT + '\n[[plc.bad.set]]\nname = "Main.divisor"\nvalue = 0\n[plc.bad]\nsources = ["counter.st"]\n'
    (folder / "fbvm.toml").write_text(text, encoding="utf-8")
    result = run()
    assert result.exit_code == 4
    assert result.stdout.startswith(SAID + "bad: 1 scan in 10ms, ended by trap")
    assert result.stderr == "bad: R0101 counter.st:4:14 in Main: 1 divided by 0\n"
    told = json.loads(run("--json").stdout)["plcs"]["bad"]["trap"]
    assert (told["code"], told["file"], told["line"], told["column"]) == ("R0101", "counter.st", 4, 14)


def test_a_bad_file_is_refused_as_a_bad_program_is(folder: Path) -> None:
    (folder / "fbvm.toml").write_text("[plc.a]\nsource = 1\n", encoding="utf-8")
    result = run()
    assert (result.exit_code, result.stdout) == (3, "")
    assert result.stderr.startswith("fbvm.toml:1:1: error P0104: plc.a.sources is missing")
    assert result.stderr.endswith("2 errors; `fbvm explain CODE` says more about each\n")
    codes = [message["code"] for message in json.loads(run("--json").stdout)["diagnostics"]]
    assert codes == ["P0104", "P0102"]


@pytest.mark.parametrize(("arguments", "message"), [
    (["--set", "a=1", "--chart", "x"], "--set, --chart: what a project does stands in its file; beside it there are --net, "),
    (["--cycle", "1ms"], "--cycle: what a project does"),
])  # fmt: skip
def test_what_has_no_place_beside_a_project(folder: Path, arguments: list[str], message: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr


def test_without_an_end_nothing_begins(folder: Path) -> None:
    (folder / "fbvm.toml").write_text(PROJECT.replace('run = {for = "50ms"}', ""), encoding="utf-8")
    result = run()
    assert result.exit_code == 2
    assert 'say when to end: by --for or --scans, by for = "10s" in [run], or by until of a PLC' in result.stderr


def test_where_there_is_no_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = run("--scans", "1")
    assert result.exit_code == 2
    assert f"there is no fbvm.toml in {tmp_path}; give a FILE, or a folder with a project" in result.stderr
    assert run(".", "--scans", "1").exit_code == 2
    assert f"neither an fbvm.toml nor a source (.st) in {tmp_path}" in run(".", "--scans", "1").stderr


@pytest.mark.slow
def test_a_folder_without_a_project_stands_for_its_sources(tmp_path: Path) -> None:
    (tmp_path / "main.st").write_text("PROGRAM Main VAR n AT D5 : UINT; END_VAR n := Twice(n + 1); END_PROGRAM", encoding="utf-8")
    (tmp_path / "twice.st").write_text("FUNCTION Twice : UINT VAR_INPUT a : UINT; END_VAR Twice := 2 * a; END_FUNCTION",
                                       encoding="utf-8")  # fmt: skip
    (tmp_path / "notes.txt").write_text("no source", encoding="utf-8")
    assert run(str(tmp_path), "--scans", "2", "--show", "D5").stdout == "D5 = 6 (16#0006)\n"
    assert check(str(tmp_path)).output == ""
    shown = CliRunner().invoke(main, ["list", str(tmp_path)])
    assert (shown.exit_code, "Twice" in shown.output) == (0, True)


@pytest.mark.parametrize("verb", ["list", "ladder", "serve", "prove"])
def test_a_project_is_told_to_verbs_that_take_sources(tmp_path: Path, verb: str) -> None:
    (tmp_path / "fbvm.toml").write_text("")
    result = CliRunner().invoke(main, [verb, str(tmp_path)])
    assert result.exit_code == 2 and result.stderr.endswith(f"`main {verb}` takes sources: name the files of one PLC\n")


def check(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["check", *arguments])


@pytest.mark.slow
def test_a_project_is_checked_with_all_its_plcs(folder: Path) -> None:
    assert (check().exit_code, check(".").output, check("fbvm.toml").output) == (0, "", "")
    (folder / "counter.st").write_text(PROGRAM.replace("step / divisor", "steps / divisor"), encoding="utf-8")
    found = check()
    assert found.exit_code == 3
    assert found.stderr.count("error S0201: steps is not declared") == 1, "both kinds of PLC have the file"
    (folder / "counter.st").write_text(PROGRAM.replace("step :", "unused, step :"), encoding="utf-8")
    assert "warning S0290: unused is never used" in check(".").stderr
    assert check(".", "--no-warn", "S0290").output == ""
    assert check(".", "--warnings-as-errors").exit_code == 3
    assert json.loads(check(".", "--json").stdout)["diagnostics"][0]["code"] == "S0290"


@pytest.mark.slow
def test_a_check_makes_one_plc_of_each_kind(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def plc(image: Image, cycle_ns: int, **more: str) -> Plc:
        made.append(cycle_ns)
        return Plc(image, cycle_ns, **more)

    monkeypatch.setattr("fbvm.run.plant.Plc", plc)
    assert (check().output, made) == ("", [10_000_000, 5_000_000])


def test_what_the_file_of_a_project_says_is_checked(folder: Path) -> None:
    text = PROJECT.replace('watch = ["Main.n", "D0"]', 'watch = ["Main.m"]')
    (folder / "fbvm.toml").write_text(text, encoding="utf-8")
    assert "Main has no m; it has n, step, divisor" in check().stderr
    assert check().exit_code == 3
    (folder / "fbvm.toml").write_text("[plc.pump]\n", encoding="utf-8")
    assert "fbvm.toml" in check().stderr
    assert "what a project does stands in its file" in check("--dialect", "codesys").stderr
    (folder / "fbvm.toml").unlink()
    assert "there is no fbvm.toml" in check().stderr
