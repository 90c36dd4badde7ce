"""`fbvm sfc` and `fbvm run --sfc`."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main

PROGRAM = """FUNCTION_BLOCK Lamp
VAR_INPUT on : BOOL; END_VAR
VAR_OUTPUT lit : BOOL; END_VAR
INITIAL_STEP Dark: END_STEP
TRANSITION FROM Dark TO Bright := on; END_TRANSITION
STEP Bright: lit(N); END_STEP
TRANSITION FROM Bright TO Dark := NOT on; END_TRANSITION
END_FUNCTION_BLOCK
PROGRAM Main
VAR left, right : Lamp; switch : BOOL; END_VAR
    left(on := switch);
    right(on := NOT switch);
END_PROGRAM
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "lamps.st"
    path.write_text(PROGRAM, encoding="utf-8")
    return path


def test_charts_are_drawn(file: Path) -> None:
    result = CliRunner().invoke(main, ["sfc", str(file), "--width", "60"])
    assert result.exit_code == 0
    lines = [line.strip() for line in result.output.splitlines()]
    assert lines[:3] == ["FUNCTION_BLOCK Lamp", "╔══════╗", "║ Dark ║"] and "└► Dark" in lines


def test_a_picture_goes_to_a_file(file: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["sfc", str(file), "--svg", str(tmp_path / "lamps.svg")])
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "lamps.svg").read_text(encoding="utf-8").startswith("<svg ")


@pytest.mark.slow
def test_a_run_draws_each_instance_in_some_scans(file: Path) -> None:
    result = CliRunner().invoke(main, ["run", str(file), "--scans", "5", "--set", "Main.switch=TRUE@20ms", "--sfc", "1,3"])
    assert result.exit_code == 0
    drawn = result.output.split("scan ")[1:]
    assert [part.splitlines()[0] for part in drawn] == ["1, Main.left", "1, Main.right", "3, Main.left", "3, Main.right"]
    assert ["● Bright" in part for part in drawn] == [False, True, True, False]
    assert "on → TRUE" in drawn[1] and "NOT on → FALSE" in drawn[2]


def test_without_a_chart_there_is_nothing_to_draw(tmp_path: Path) -> None:
    path = tmp_path / "plain.st"
    path.write_text("PROGRAM Main\nEND_PROGRAM\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["sfc", str(path)])
    assert result.exit_code == 2 and "no POU has an INITIAL_STEP" in result.output


def test_a_value_for_people_has_no_names_that_nobody_wrote(file: Path) -> None:
    result = CliRunner().invoke(main, ["run", str(file), "--scans", "1", "--show", "Main.left"])
    shown = "(on := FALSE, lit := FALSE, Dark := (X := TRUE, T := T#0s), Bright := (X := FALSE, T := T#0s))"
    assert result.output == f"Main.left = {shown}\n"
