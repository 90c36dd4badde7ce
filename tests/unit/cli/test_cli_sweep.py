"""`fbvm sweep`: a row for each combination of values, how each run ended, and statuses."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fbvm.cli.main import main

pytestmark = pytest.mark.slow  # what campaigns use takes its time to be imported

GAIN = """PROGRAM Main
VAR Gain : INT := 1; Limit : INT := 3; n : INT; Done, Odd : BOOL; z : INT := 1; END_VAR
n := n + Gain; Done := n >= Limit; Odd := n MOD 2 = 1;
IF n > 8 THEN z := 0; n := n / z; END_IF;
END_PROGRAM
"""


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("gain.st").write_text(GAIN, encoding="utf-8")


def sweep(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["sweep", *arguments, "--jobs", "1"], catch_exceptions=False)


def test_each_combination_of_values_is_a_row() -> None:
    result = sweep("gain.st", "--vary", "Main.Gain=1,2", "--vary", "Main.Limit=2,6", "--until", "Main.Done", "--for", "50ms",
                   "--show", "Main.n,Main.Odd")  # fmt: skip
    assert result.exit_code == 0 and result.stdout.splitlines() == [
        "Main.Gain  Main.Limit  Main.n  Main.Odd  end          time",
        "1          2           2       FALSE     good         20ms",
        "1          6           5       TRUE      not reached  50ms",
        "2          2           2       FALSE     good         10ms",
        "2          6           6       FALSE     good         30ms"]


def test_a_failing_run_is_executed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.campaign.runs._shrink", lambda *given: pytest.fail("a failing run was made smaller"))
    assert sweep("gain.st", "--vary", "Main.Gain=4,5", "--for", "50ms").exit_code == 4


def test_a_trap_has_status_4_and_its_place() -> None:
    result = sweep("gain.st", "--vary", "Main.Gain=1,4", "--for", "50ms", "--show", "Main.n", "--json", "--csv", "out.csv")
    assert (result.exit_code, json.loads(result.stdout)) == (4, {"runs": 2, "rows": [
        {"values": {"Main.Gain": "1"}, "shown": {"Main.n": 5}, "end": "good", "time": "50ms", "scans": 5},
        {"values": {"Main.Gain": "4"}, "shown": {"Main.n": 12}, "end": "R0101 gain.st:4", "time": "30ms", "scans": 3}]})
    with open("out.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    columns = ("Main.Gain", "result", "code", "line", "scans", "Main.n")
    assert [tuple(row[column] for column in columns) for row in rows] == [
        ("1", "good", "", "", "5", "5"), ("4", "trap", "R0101", "4", "3", "12")]


@pytest.mark.parametrize(("arguments", "status", "said"), [
    (["gain.st", "--for", "1s"], 2, "say what to vary: --vary Main.Gain=1,2,5"),
    (["test_a.py", "--vary", "a=1"], 2, "sweep varies programs and projects; fbvm campaign varies tests"),
    (["gain.st", "--vary", "Main.Nope=1", "--for", "1s"], 2, "Main has no Nope; it has Gain, Limit"),
    (["gain.st", "--vary", "Main.Gain=1", "--show", "Main.Nope", "--for", "1s"], 2, "Main has no Nope; it has Gain, Limit"),
    (["bad.st", "--vary", "a=1", "--for", "1s"], 3, "END_PROGRAM expected before the end of the text"),
])
def test_what_cannot_be_swept_is_said(arguments: list[str], status: int, said: str) -> None:
    Path("test_a.py").touch()
    Path("bad.st").write_text("PROGRAM\n", encoding="utf-8")
    result = sweep(*arguments)
    assert result.exit_code == status and said in " ".join(result.stderr.split())


def test_what_to_vary_that_is_no_axis_is_refused_in_words() -> None:
    for text in ("x", "="):
        result = sweep("gain.st", "--vary", text, "--for", "50ms")
        assert (result.exit_code, f"{text!r} is not NAME=VALUE,VALUE or NAME=FIRST..LAST" in result.stderr) == (2, True), text
