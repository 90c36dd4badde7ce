"""A run of a project is recorded with its sources, and its statements are told by the name of the project."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner
from cx_text import SAMPLE

from fbvm.cli.main import main
from fbvm.interchange.cx.compression import compress


def test_a_project_runs_and_its_recording_has_its_rungs(tmp_path: Path) -> None:
    file, trace = tmp_path / "line3.cxp", tmp_path / "line3.fbtrace"
    file.write_bytes(compress(SAMPLE.bytes()))
    run = CliRunner().invoke
    done = run(main, ["run", str(file), "--set", "Start_PB=TRUE", "--for", "50ms", "--show", "Pump", "--trace", str(trace)])
    assert (done.exit_code, done.output) == (0, "Pump = TRUE\n")
    shown = run(main, ["chart", str(trace), "Pump"])
    assert shown.exit_code == 0, shown.output
    assert "Pump" in shown.output


def test_a_damaged_project_ends_every_verb_with_its_sentence(tmp_path: Path) -> None:
    file = tmp_path / "line3.cxp"
    file.write_bytes(compress(SAMPLE.bytes())[:300])
    for verb in ("check", "ladder", "list", "step"):
        done = CliRunner().invoke(main, [verb, str(file)])
        assert done.exit_code == 3, verb
        assert "error X0401" in done.output, verb
        assert "it is cut" in done.output, verb
