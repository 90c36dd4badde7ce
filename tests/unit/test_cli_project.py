"""`fbvm new` and `fbvm test`: from nothing to a green test, and to a failure that explains itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main

HOUSE = Path(__file__).resolve().parents[2]


def called(*arguments: str, cwd: Path, monkeypatch: pytest.MonkeyPatch) -> subprocess.CompletedProcess[str]:
    """`fbvm` in a process of its own, as in a terminal."""
    monkeypatch.setenv("PYTHONPATH", str(HOUSE))
    return subprocess.run([sys.executable, "-m", "fbvm", *arguments], cwd=cwd, capture_output=True, text=True, check=False)


def new(name: str) -> str:
    result = CliRunner().invoke(main, ["new", name])
    assert result.exit_code == 0, result.output
    return result.output


def test_a_new_project_is_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = new("conveyor")
    for line in said.splitlines():
        if line.startswith("  "):
            assert (tmp_path / "conveyor" / line.split()[0]).is_file()
    assert (tmp_path / "conveyor" / "README.md").read_text(encoding="utf-8").startswith("# conveyor\n")
    check = CliRunner().invoke(main, ["check", *map(str, (tmp_path / "conveyor" / "src").glob("*.st"))])
    assert (check.exit_code, check.output) == (0, "")


@pytest.mark.slow
def test_from_a_new_project_to_a_failure_that_explains_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    new("conveyor")
    green = called("test", cwd=tmp_path / "conveyor", monkeypatch=monkeypatch)
    assert green.returncode == 0
    assert "2 passed" in green.stdout
    pump = tmp_path / "conveyor" / "src" / "pump.st"
    pump.write_text(pump.read_text(encoding="utf-8").replace("T#50ms", "T#80ms"), encoding="utf-8")
    red = called("test", "-q", cwd=tmp_path / "conveyor", monkeypatch=monkeypatch)
    assert red.returncode == 1
    assert "by src/pump.st:15:  Running := Delay.Q;  with Delay.Q = FALSE" in red.stdout
    assert "Delay: TON with IN = TRUE, PT = 80ms" in red.stdout
    none = called("test", "-k", "absent", cwd=tmp_path / "conveyor", monkeypatch=monkeypatch)
    assert none.returncode == 2


@pytest.mark.parametrize("name", ["taken", "a*b", ""])
def test_what_cannot_be_made_is_said(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").mkdir()
    Path("taken", "file").touch()
    result = CliRunner().invoke(main, ["new", name])
    assert result.exit_code == 2
    assert "Error:" in result.output
