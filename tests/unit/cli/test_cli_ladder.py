"""`fbvm ladder` and `fbvm run --ladder`."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main

PROGRAM = """PROGRAM Main
VAR
    Start AT CIO 0.00 : BOOL;
    Motor AT CIO 100.00 : BOOL;
END_VAR
LADDER
RUNG 1 Seal-in
    LD      Start
    OR      Motor
    OUT     Motor
END_LADDER
END_PROGRAM
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "motor.st"
    path.write_text(PROGRAM, encoding="utf-8")
    return path


def test_rungs_are_drawn_with_addresses(file: Path) -> None:
    result = CliRunner().invoke(main, ["ladder", str(file), "--width", "60"])
    assert result.exit_code == 0
    assert result.output.splitlines()[:3] == ["PROGRAM Main", "RUNG 1 Seal-in", "│  Start           Motor  │"]
    assert "│  100.00" in result.output


def test_the_right_rails_of_a_program_stand_in_one_column(file: Path) -> None:
    more = "RUNG 2\n    LD Start\n    ANDNOT 0.05\n    AND W0.07\n    MOV #1234 D100\nRUNG 3\n    LD Start\n    OUT 100.01\n"
    apart = "RUNG 4\n    LD Start\n    OUT 100.02\n    OR 0.06\n    OUT 100.03\n"
    file.write_text(PROGRAM.replace("END_LADDER", more + apart + "END_LADDER"), encoding="utf-8")
    rows = CliRunner().invoke(main, ["ladder", str(file), "--width", "70"]).output.splitlines()
    drawn = [row for row in rows if row[:1] in "│├" and row]
    assert len(drawn) > 8 and len(set(map(len, drawn))) == 1
    assert "    OUT 100.02" in rows, "a rung without a drawing"


def test_rungs_of_subroutines_are_drawn_once(file: Path) -> None:
    rungs = "LD P_On\nSBS 5\nSBN 5\nLD P_On\nMOV A262 D230\nRET\nEND"
    file.write_text(f"PROGRAM Main\nLADDER\n{rungs}\nEND_LADDER\nEND_PROGRAM", encoding="utf-8")
    heads = [line for line in CliRunner().invoke(main, ["ladder", str(file)]).output.splitlines() if line.startswith("RUNG")]
    assert heads == ["RUNG 1", "RUNG 2", "RUNG 5", "RUNG 3", "RUNG 4"]


def test_a_picture_goes_to_a_file(file: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["ladder", str(file), "--svg", str(tmp_path / "motor.svg")])
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "motor.svg").read_text(encoding="utf-8").startswith("<svg ")


def test_a_run_draws_the_power_of_some_scans(file: Path) -> None:
    options = ["--scans", "5", "--set", "Main.Start=TRUE@20ms", "--ladder", "1..2"]
    result = CliRunner().invoke(main, ["run", str(file), *options])
    first, second = result.output.split("scan 2, Main")
    assert first.startswith("scan 1, Main") and "┫ ┣" not in first
    assert "┣┳━━┫ ┣━━━┳" in second


TEXT = """PROGRAM Main
VAR Start AT CIO 0.00 : BOOL; Motor AT CIO 100.00 : BOOL; n : INT; END_VAR
Motor := Start OR Motor;
n := n + 1;
END_PROGRAM
"""


def test_structured_text_is_drawn_and_what_is_no_rung_is_named(tmp_path: Path) -> None:
    path = tmp_path / "text.st"
    path.write_text(TEXT, encoding="utf-8")
    drawn = CliRunner().invoke(main, ["ladder", str(path)]).output
    assert "├┬──┤ ├───┬" in drawn and "RUNG 2 in line 4 is not drawn: an assignment that is not of BOOL" in drawn
    run = CliRunner().invoke(main, ["run", str(path), "--scans", "5", "--set", "Main.Start=TRUE@20ms", "--ladder", "2"]).output
    assert "┣┳━━┫ ┣━━━┳" in run


@pytest.mark.parametrize(("arguments", "said"), [
    (["ladder"], "there is nothing to draw"), (["run", "--scans", "1", "--ladder", "x"], "'x' names no scans"),
    (["run", "--scans", "1", "--ladder", "7..3"], "'7..3' names no scans")])
def test_mistakes_of_usage(tmp_path: Path, arguments: list[str], said: str) -> None:
    path = tmp_path / "empty.st"
    path.write_text("PROGRAM Main END_PROGRAM", encoding="utf-8")
    result = CliRunner().invoke(main, [*arguments, str(path)])
    assert result.exit_code == 2 and said in result.output


@pytest.mark.parametrize(("options", "said"), [
    (["--ladder", "7"], "--ladder 7: no rung was executed in these scans; the run had scans 0 to 4"),
    (["--ladder", "7..999999999999999999"], "no rung was executed in these scans"),
    (["--sfc", "2"], "--sfc 2: there is no chart in this program")])
def test_what_draws_nothing_says_why(tmp_path: Path, options: list[str], said: str) -> None:
    path = tmp_path / "text.st"
    path.write_text(TEXT, encoding="utf-8")
    result = CliRunner().invoke(main, ["run", str(path), "--scans", "5", *options])
    assert result.exit_code == 0 and said in result.stderr
