"""Programs of TwinCAT run as they are, and are spoken of by the lines of their files."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from twincat_files import COUNTER, MAIN, write_project

from fbvm.cli.main import main
from fbvm.code.compiler import compile_files
from fbvm.interchange.formats.given import inputs
from fbvm.machine.plc import Plc
from fbvm.run.project import Project, read_project

HOUSE = Path(__file__).resolve().parents[2]


def test_a_project_runs_with_its_task(tmp_path: Path) -> None:
    sources, said = inputs([write_project(tmp_path)])
    made = compile_files(sources, dialect="twincat", runnable=True)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    assert [message.code for message in said] == ["X0190"]
    plc = Plc(made.image)
    plc.run(scans=5)  # of 10 ms, and the task's are 20 ms
    names = ("MAIN.nSeen", "MAIN.fbCounter.nCount", "MAIN.stPoint.nX", "GVL_Plant.nScans")
    assert [plc.read(name) for name in names] == [3, 3, 3, 3]


def test_an_object_runs_by_itself(tmp_path: Path) -> None:
    file = tmp_path / "FB_Counter.TcPOU"
    file.write_text(COUNTER, encoding="utf-8")
    program = tmp_path / "main.st"
    program.write_text("PROGRAM Main VAR b : FB_Counter; n : INT; END_VAR b(); b.Reset(n := 7); n := b.Count; END_PROGRAM")
    made = compile_files(inputs([file, program])[0], dialect="twincat", runnable=True)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    plc = Plc(made.image)
    plc.scan()
    assert plc.read("Main.n") == 7


LONG = COUNTER.replace("nCount : INT;", "nCount : INT; tLong : LTIME := LTIME#213503d;")
"""What is no LTIME elsewhere."""


def test_files_have_the_dialect_of_their_tool_if_no_other_is_named(tmp_path: Path) -> None:
    assert LONG != COUNTER
    (tmp_path / "FB_Counter.TcPOU").write_text(LONG, encoding="utf-8")
    (tmp_path / "main.st").write_text("PROGRAM Main VAR b : FB_Counter; END_VAR b(); END_PROGRAM")
    both = [str(tmp_path / "main.st"), str(tmp_path / "FB_Counter.TcPOU")]
    checked = [CliRunner().invoke(main, ["check", *both, *more]).exit_code for more in ([], ["--dialect", "standard"])]
    assert checked == [0, 3]
    rows = '[plc.one]\nsources = ["main.st", "FB_Counter.TcPOU"]\n[plc.two]\nsources = ["main.st"]\n'
    (tmp_path / "fbvm.toml").write_text(rows, encoding="utf-8")
    project = read_project(tmp_path / "fbvm.toml")
    assert isinstance(project, Project)
    assert [plc.dialect for plc in project.plcs] == ["twincat", "standard"]


def test_an_import_says_that_none_is_needed(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["import", str(write_project(tmp_path)), "-o", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "Plant.plcproj needs no import: `fbvm check" in " ".join(done.output.split())


@pytest.mark.slow
def test_a_mistake_is_shown_at_its_line_of_the_file(tmp_path: Path) -> None:
    project = write_project(tmp_path)
    file = tmp_path / "POUs" / "MAIN.TcPOU"
    file.write_text(MAIN.replace("nSeen + 1", "nSen + 1"), encoding="utf-8")
    done = CliRunner().invoke(main, ["check", str(project), "--dialect", "auto"])
    assert done.exit_code == 3
    assert f"{file}:13:10: error S0201: nSen is not declared" in done.output
    assert "dialect twincat: Plant.plcproj is a project of TwinCAT" in done.output


@pytest.mark.slow
@pytest.mark.parametrize("verb", [["check"], ["run", "--scans", "1"]])
def test_files_that_are_none_are_named(tmp_path: Path, verb: list[str]) -> None:
    unclosed = '<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003">'
    for name, text in (("a.plcproj", unclosed), ("b.TcPOU", "hello")):
        (tmp_path / name).write_text(text)
        done = CliRunner().invoke(main, [*verb, str(tmp_path / name)])
        assert (done.exit_code, "X0101" in done.output) == (3, True), done.output


@pytest.mark.slow
def test_an_object_is_exported_with_its_methods_of_which_others_are_warned(tmp_path: Path) -> None:
    file, out = tmp_path / "FB_Counter.TcPOU", tmp_path / "out.xml"
    plain = COUNTER[: COUNTER.index("    <Method")] + COUNTER[COUNTER.index("    <Action") :]
    warned = f"{file}:5:16: warning X0390: the objects of FB_Counter are kept as CODESYS and TwinCAT have them"
    for text, is_object in ((COUNTER, True), (plain, False)):
        file.write_text(text, encoding="utf-8")
        done = CliRunner().invoke(main, ["export", str(file), "-o", str(out)])
        assert (done.exit_code, warned in done.output) == (0, is_object), done.output
        written = out.read_text(encoding="utf-8")
        assert '<pou name="FB_Counter"' in written and ('<Method name="Reset" ' in written) == is_object


def test_what_the_system_calls_before_the_first_cycle_is_not_warned_of() -> None:
    found = compile_files(inputs([HOUSE / "examples" / "twincat" / "Conveyor.plcproj"])[0], dialect="twincat", runnable=True)
    assert [message.code for message in found.diagnostics] == ["S0692"]
