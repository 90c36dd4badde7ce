"""Breakpoints on the command line: where a run ends within a scan, and what is said of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fbvm.cli.main import main
from fbvm.engine.native import engine as native

PLANT = """\
FUNCTION_BLOCK Adder
VAR_INPUT a : INT; END_VAR
VAR_OUTPUT n : INT; END_VAR
  n := n + a;
END_FUNCTION_BLOCK

PROGRAM Main
VAR i : INT; f : Adder; d AT %D100 : INT; END_VAR
  FOR i := 1 TO 3 DO
    f(a := i);
  END_FOR;
  d := f.n;
END_PROGRAM
"""


@pytest.fixture(autouse=True)
def _plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plant.st").write_text(PLANT, encoding="utf-8")


def run(*arguments: str) -> Result:
    result = CliRunner().invoke(main, ["run", "plant.st", "--scans", "10", *arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def test_a_line_in_an_instance_is_told_with_its_callers() -> None:
    result = run("--break", "plant.st:4 IF Main.f.n > 10", "--show", "Main.f.n")
    assert result.exit_code == 0 and result.stdout == "Main.f.n = 12\n"
    assert result.stderr == """\
plant.st:4:3 in Adder, scan 2: breakpoint plant.st:4 when Main.f.n > 10
  4 | n := n + a;
  #0 Adder  Main.f  plant.st:4
  #1 Main   Main    plant.st:10
"""


@pytest.mark.parametrize(("arguments", "first"), [
    (["--watch", "D100"], "plant.st:12:3 in Main, scan 0: D100 was 0, is 6"),
    (["--watch", "D100 if D100 > 20"], "plant.st:12:3 in Main, scan 3: D100 was 18, is 24"),
    (["--break-if", "D100 > 20"], "plant.st:12:3 in Main, scan 3: D100 > 20 holds"),
    (["--break", "main"], "plant.st:9:3 in Main, scan 0: breakpoint plant.st:9"),
    (["--watch", "D9", "--set", "D9=1@20ms"], "plant.st:9:3 in Main, scan 2: D9 was 0, is 1"),
])
def test_where_a_run_stops(arguments: list[str], first: str) -> None:
    assert run(*arguments).stderr.splitlines()[0] == first


def test_a_run_that_meets_none_ends_as_ever() -> None:
    result = run("--watch", "D101", "--show", "D100")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "D100 = 60 (16#003C)\n", "")


def test_the_line_is_that_of_its_own_file() -> None:
    Path("ant.st").write_text(PLANT.replace("Main", "Other").replace("Adder", "Less").replace("n + a", "n - a"), encoding="utf-8")
    result = CliRunner().invoke(main, ["run", "plant.st", "ant.st", "--program", "Other", "--scans", "1", "--break", "ant.st:4"])
    assert "  4 | n := n - a;\n" in result.stderr


def test_a_bank_that_only_a_condition_names_is_there() -> None:
    result = run("--break", "plant.st:12 IF E3_5 = 7", "--set", "E3_5=7@20ms")
    assert "scan 2: breakpoint plant.st:12" in result.stderr
    assert "scan 0: breakpoint" in run("--break", "plant.st:12 IF E4_0 = 0").stderr


def test_json_tells_where() -> None:
    told = json.loads(run("--watch", "D100", "--json").stdout)
    assert told["stopped"] == "break" and told["scans"] == 0
    assert told["break"] == {"scan": 0, "file": "plant.st", "pou": "Main", "line": 12, "column": 3,
                             "reasons": ["D100 was 0, is 6"]}


@pytest.mark.parametrize(("arguments", "words"), [
    (["--break", "plant.st:99"], "the last statement of plant.st is on line 12"),
    (["--watch", "Main.nothing"], "nothing"),
    (["--break-if", "D100"], "is no condition"),
    (["--break", "main", "--ladder", "1"], "looks into every scan already"),
])
def test_what_cannot_be_is_refused(arguments: list[str], words: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2 and words in result.stderr


DIVIDES = """FUNCTION_BLOCK Ratio
VAR_INPUT a, b : INT; END_VAR
VAR_OUTPUT q : INT; END_VAR
    q := a / b;
END_FUNCTION_BLOCK
PROGRAM Main
VAR rows : ARRAY [1..3] OF Ratio; alone : Ratio; i : INT; zero : INT := 9; x : INT; END_VAR
    FOR i := 1 TO 3 DO
        rows[i](a := 6, b := i - zero);
    END_FOR;
    alone(a := 1, b := 10 - zero);
    x := 1 / (11 - zero);
END_PROGRAM
"""


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_trap_says_in_which_instance_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str) -> None:
    if engine == "native" and not native.available():
        pytest.skip("llvmlite is not installed")
    monkeypatch.chdir(tmp_path)
    Path("ratio.st").write_text(DIVIDES, encoding="utf-8")

    def said(zero: int) -> str:
        options = ["--scans", "3", "--engine", engine, "--set", f"Main.zero={zero}@10ms"]
        return CliRunner().invoke(main, ["run", "ratio.st", *options]).stderr

    where = "R0101 ratio.st:4:10 in Ratio"
    assert said(2) == f"{where}: 6 divided by 0 (in Main.rows[2])\n"
    assert said(10) == f"{where}: 1 divided by 0 (in Main.alone)\n"
    assert said(11) == "R0101 ratio.st:12:10 in Main: 1 divided by 0\n"
