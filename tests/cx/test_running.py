"""A run of a project is recorded with its sources, and its statements are told by the name of the project."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from cx_text import SAMPLE

from fbvm.cli.main import main
from fbvm.cli.shared.debug.launch import open_launch
from fbvm.dap.target import LaunchError
from fbvm.interchange.cx.compression import compress
from fbvm.testing.plant_rig import PlantRig
from fbvm.testing.rig import Rig
from fbvm.testing.subject import SubjectError, subject


@pytest.mark.slow
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


def saved(folder: Path, cut: int | None = None) -> Path:
    file = folder / "line3.cxp"
    file.write_bytes(compress(SAMPLE.bytes())[:cut])
    return file


@pytest.mark.slow
def test_a_plc_of_an_fbvm_toml_runs_a_project(tmp_path: Path) -> None:
    saved(tmp_path)
    toml = tmp_path / "fbvm.toml"
    toml.write_text('[run]\nfor = "50ms"\n[plc.line]\nsources = ["line3.cxp"]\nwatch = ["Pump"]\n'
                    'set = [{name = "Start_PB", value = true}]\n', encoding="utf-8")  # fmt: skip
    done = CliRunner().invoke(main, ["run", str(toml)])
    assert done.exit_code == 0, done.output
    assert "Pump = TRUE" in done.output
    plant = PlantRig(toml)
    plant.run("30ms")
    assert plant.line["Pump"] is True
    saved(tmp_path, 300)
    done = CliRunner().invoke(main, ["run", str(toml)])
    assert done.exit_code == 3 and "error X0401" in done.output
    with pytest.raises(SubjectError, match="it is cut"):
        PlantRig(toml)


@pytest.mark.slow
def test_a_test_takes_a_project_and_each_of_its_programs(tmp_path: Path) -> None:
    file = saved(tmp_path)
    for name in (None, "NewProgram1"):
        rig = Rig(subject([file], name))
        rig.scan(Start_PB=True)
        assert rig["Pump"] is True, name
    saved(tmp_path, 300)
    with pytest.raises(SubjectError, match="it is cut"):
        subject([file], None)
    with pytest.raises(SubjectError, match="cannot be read"):
        subject([tmp_path / "none.cxp"], None)


@pytest.mark.slow
def test_a_debugger_opens_a_project_with_the_texts_of_its_programs(tmp_path: Path) -> None:
    file = saved(tmp_path)
    target = open_launch({"program": str(file)})
    assert {Path(name).name for name in target.texts} >= {"NewProgram1.st"}
    assert "LADDER" in target.texts[f"{file}/NewProgram1.st"]
    target.close()
    saved(tmp_path, 300)
    with pytest.raises(LaunchError, match="cannot be taken over") as told:
        open_launch({"program": str(file)})
    assert "it is cut" in told.value.output


@pytest.mark.slow
def test_a_run_begins_with_the_memory_window_if_asked_to(tmp_path: Path) -> None:
    dump = " ".join(f"{byte:02X}" for byte in b"[OMRON.Data Monitor.Component]\nD=200:1f4\n")
    keys = f"  Memory:=\n  BEGIN\n   Data:=\n$?St$Bk?_#[900]\n{dump}\n$?St$Bk?_#[900]\n  END;"
    file = tmp_path / "line3.cxt"
    file.write_bytes(replace(SAMPLE, plc_keys=keys).bytes())
    for options, value in (([], 0), (["--memory"], 500)):
        done = CliRunner().invoke(main, ["run", str(file), *options, "--for", "10ms", "--show", "D200"])
        assert (done.exit_code, done.output.split()[:3]) == (0, ["D200", "=", str(value)])


WORKER = """  Program[1]:=
  BEGIN
   Name:="Worker";
   TaskID:=259;
   Sections:=
   BEGIN
    SC:=1;
    Sec[0]:=
    BEGIN
     IEC1131Type:=11;
     SecName:="Work";
     ProgramData:=
     BEGIN
      RC:=1;
      R[0]:=
      BEGIN
       Com:="";
       Flags:="1,0";
       SL:=
$?St$Bk?_#[90]
LD P_On
++(590) D7
$?St$Bk?_#[90]
      END;
     END;
    END;
   END;
  END;
"""
"""A program of cyclic task 3 that does not run from the start."""


@pytest.mark.slow
def test_a_task_that_an_instruction_starts_runs_and_goes_through_sources_and_back(tmp_path: Path) -> None:
    text = SAMPLE.text.replace("OUT Pump\n", "OUT Pump\n@TKON(820) 3\n")
    text = text.replace("  END;\r\n END;\r\nEND;", f"  END;\r\n{WORKER} END;\r\nEND;")
    file, folder, made = tmp_path / "line3.cxt", tmp_path / "line3", tmp_path / "made.cxt"
    file.write_bytes(text.encode("cp1252"))
    run = CliRunner().invoke
    imported = run(main, ["import", str(file), "-o", str(folder)])
    assert imported.exit_code == 0 and "warning" not in imported.output, imported.output
    for where in (file, folder):
        done = run(main, ["run", str(where), "--set", "Start_PB=TRUE@20ms", "--scans", "6", "--show", "D7"])
        assert (done.exit_code, done.output) == (0, "D7 = 4 (16#0004)\n")
    assert "IF NOT CX_Task(3, FALSE) THEN" in (folder / "Worker.st").read_text(encoding="utf-8")
    done = run(main, ["export", str(folder), "--into", str(file), "-o", str(made)])
    assert done.exit_code == 0, done.output
    assert made.read_bytes() == file.read_bytes()
    assert run(main, ["diff", "-q", str(file), str(folder)]).exit_code == 0
