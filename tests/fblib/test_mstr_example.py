"""examples/mstr.st through the command line, its journal done again, and the module travelling with a stepped program."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main

HOUSE = Path(__file__).resolve().parents[2]
EXAMPLE = str(HOUSE / "examples" / "mstr.st")
PEER = ("--map", "192.168.250.1:502=peer")
END = ("--until", "Main.Step = Ready OR Main.Step = Failed", "--max", "20s")


@pytest.mark.slow
def test_the_example_reads_writes_and_counts(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    shown = [f"--show=Main.{name}" for name in ("Step", "Sum", "Sent", "Result")]
    result = CliRunner().invoke(main, ["run", EXAMPLE, *PEER, *END, *shown, "--json", "--journal", str(journal)])
    assert result.exit_code == 0, result.output
    registers = list(range(1000, 1010))
    assert json.loads(result.stdout)["values"] == {
        "Main.Step": 4, "Main.Sum": sum(registers), "Main.Sent": 4, "Main.Result": 0}  # fmt: skip
    again = CliRunner().invoke(main, ["replay", str(journal), "--json"])
    assert again.exit_code == 0, again.output


def test_without_a_server_it_says_so() -> None:
    result = CliRunner().invoke(main, ["run", EXAMPLE, *END, "--show", "Main.Result", "--json"])
    assert json.loads(result.stdout)["values"] == {"Main.Result": 0x503D}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["NOC0", "NOC337", "MSTR_Modules[8].Rack_Slot"])
def test_words_of_the_mailbox_are_shown(name: str) -> None:
    result = CliRunner().invoke(main, ["run", EXAMPLE, "--scans", "2", "--show", name, "--json"])
    assert json.loads(result.stdout)["values"] == {name: 0 if name == "NOC0" else 7}


@pytest.mark.slow
def test_a_stepped_program_goes_back_with_its_module() -> None:
    script = "run Main.Step = Writing\nprint NOC350\nback 3\nprint Main.Step\nrun Main.Step = Ready\nprint Main.Sent\nquit\n"
    result = CliRunner().invoke(main, ["step", EXAMPLE, *PEER], input=script)
    assert result.exit_code == 0, result.output
    assert "Main.Sent = 4" in result.output
