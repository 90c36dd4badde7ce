"""A CONFIGURATION with several resources: a PLC is one of them, and has its tasks and variables only (S0801 if none)."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

TEXT = """
PROGRAM Count
VAR_EXTERNAL step : INT; END_VAR
VAR n : INT; END_VAR
n := n + step;
END_PROGRAM
CONFIGURATION Plant
    VAR_GLOBAL shared : INT := 7; END_VAR
    RESOURCE Left ON Cpu
        VAR_GLOBAL step : INT := 1; END_VAR
        TASK t (INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM one WITH t : Count;
    END_RESOURCE
    RESOURCE Right ON Cpu
        VAR_GLOBAL step : INT := 10; END_VAR
        PROGRAM two : Count;
        PROGRAM three : Count;
    END_RESOURCE
END_CONFIGURATION
"""


def test_one_of_them_is_chosen() -> None:
    left, right = (compile_text(TEXT, resource=name).image for name in ("LEFT", "right"))
    assert left is not None and right is not None
    assert [run.name for task in left.tasks for run in task.programs] == ["one"]
    plc = Plc(right)
    plc.scan()
    assert [plc.read(name) for name in ("two.n", "three.n", "step", "shared")] == [10, 10, 10, 7]
    assert not {"ONE", "TWO"} & left.symbols.keys() - {"ONE"}


def test_none_or_a_wrong_one_is_refused() -> None:
    several, wrong = (next(e for e in compile_text(TEXT, resource=name).errors if e.code == "S0801") for name in (None, "Middle"))
    assert "--resource Left or --resource Right" in several.hint and "no RESOURCE Middle" in wrong.message


def test_the_option(tmp_path: Path) -> None:
    file = tmp_path / "plant.st"
    file.write_text(TEXT, encoding="utf-8")
    ran = CliRunner().invoke(main, ["run", str(file), "--resource", "Left", "--for", "50ms", "--chart", "one.n"])
    assert ran.exit_code == 0, ran.output
    assert CliRunner().invoke(main, ["check", str(file)]).exit_code == 3
    assert CliRunner().invoke(main, ["check", str(file), "--resource", "Right"]).exit_code == 0
