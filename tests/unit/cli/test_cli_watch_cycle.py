"""`--watch-cycle` and `watch_cycle`: how long a scan may take with real connections."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner
from rows import each_of

from fbvm.cli.main import main
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project

SLOW = "PROGRAM Main VAR n : LINT; END_VAR WHILE n < 1_900_000 DO n := n + 1; END_WHILE; n := 0; END_PROGRAM\n"
"""Slower than 10 ms in Python, and no more steps than the budget has in two scans."""


def test_a_run_with_real_connections_ends_with_status_4(tmp_path: Path) -> None:
    (tmp_path / "slow.st").write_text(SLOW, encoding="utf-8")
    result = CliRunner().invoke(main, ["run", str(tmp_path / "slow.st"), "--net", "tcp", "--engine", "python",
                                       "--watch-cycle", "10ms", "--scans", "3", "--show", "A401.08"])  # fmt: skip
    assert result.exit_code == 4
    assert "R0112" in result.output
    assert "the scan took longer than the watch cycle time of 10 ms" in result.output
    assert "A401.08 = TRUE" in result.output


@each_of("time", ["9ms", "41s", "1us"])
def test_times_that_no_cpu_unit_takes(time: str) -> None:
    for command in (["run", "x.st"], ["serve"]):
        result = CliRunner().invoke(main, [*command, "--watch-cycle", time])
        assert result.exit_code == 2


def test_a_project_says_it_for_each_plc(tmp_path: Path) -> None:
    (tmp_path / "slow.st").write_text(SLOW, encoding="utf-8")
    text = '[plc.A]\nsources = ["slow.st"]\nwatch_cycle = "20ms"\n[plc.B]\nsources = ["slow.st"]\n'
    (tmp_path / "fbvm.toml").write_text(text, encoding="utf-8")
    project = read_project(tmp_path / "fbvm.toml")
    assert isinstance(project, Project)
    assert [run.plc.watch_cycle.time_ns for run in Plant(project).runs] == [20_000_000, 1_000_000_000]


def test_a_project_with_a_time_that_no_cpu_unit_takes(tmp_path: Path) -> None:
    (tmp_path / "fbvm.toml").write_text('[plc.A]\nsources = ["slow.st"]\nwatch_cycle = "1ms"\n', encoding="utf-8")
    found = read_project(tmp_path / "fbvm.toml")
    assert isinstance(found, list)
    assert [diagnostic.code for diagnostic in found] == ["P0103"]
    assert "from 10ms to 40s" in found[0].render()
