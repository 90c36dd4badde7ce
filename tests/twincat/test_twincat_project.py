"""A project of TwinCAT: what it lists, and what its tasks say."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from twincat_files import PROJECT, write_project, write_solution

from fbvm import Plc
from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.formats.given import given_sources, inputs, usual_dialect, within
from fbvm.interchange.markup import parse_markup
from fbvm.interchange.twincat.project import TaskSettings, _own, read_project


def test_the_objects_in_the_order_of_the_project_and_the_tasks_behind_them(tmp_path: Path) -> None:
    made = read_project(write_project(tmp_path))
    names = [Path(source.name).name for source in made.sources]
    assert names == ["MAIN.TcPOU", "FB_Counter.TcPOU", "ST_Point.TcDUT", "GVL_Plant.TcGVL", "Tasks.st"]
    assert made.sources[-1].text.splitlines() == [
        "CONFIGURATION Plant", "RESOURCE PLC ON fbvm", "    TASK PlcTask(INTERVAL := T#20000us, PRIORITY := 20);",
        "    PROGRAM MAIN WITH PlcTask : MAIN;", "END_RESOURCE", "END_CONFIGURATION"]  # fmt: skip
    assert [(found.code, found.message) for found in made.diagnostics] == [
        ("X0190", "VISUs\\Page.TcVIS holds no program, and is left out")]  # fmt: skip
    assert made.errors == []


@pytest.mark.parametrize(("include", "said"), [
    ("..\\..\\secret.TcPOU", "..\\..\\secret.TcPOU lies outside of the project"),
    ("C:\\secret.TcPOU", "C:\\secret.TcPOU lies outside of the project"),
    ("\\secret.TcPOU", "\\secret.TcPOU lies outside of the project"),
    ("POUs\\None.TcPOU", "POUs\\None.TcPOU cannot be read: no such file or directory"),
])  # fmt: skip
def test_objects_that_a_project_cannot_have(tmp_path: Path, include: str, said: str) -> None:
    path = write_project(tmp_path)
    path.write_text(PROJECT.replace("POUs\\MAIN.TcPOU", include), encoding="utf-8")
    made = read_project(path)
    [found] = made.errors
    assert (found.code, found.message, found.source.place(found.start)[0]) == ("X0501", said, 6)
    assert len(made.sources) == 4


@pytest.mark.parametrize(("include", "file"), [
    ("POUs %28all%29\\MAIN.TcPOU", "POUs (all)/MAIN.TcPOU"), ("pous\\Main.tcPOU", "POUs/MAIN.TcPOU"),
    ("POUs\\100%.TcPOU", "POUs/100%.TcPOU")])  # fmt: skip
def test_names_of_files_are_those_of_msbuild_and_windows(tmp_path: Path, include: str, file: str) -> None:
    path = write_project(tmp_path)
    object_ = (tmp_path / "POUs/MAIN.TcPOU").read_bytes()
    (tmp_path / "POUs/MAIN.TcPOU").unlink()
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_bytes(object_)
    path.write_text(PROJECT.replace("POUs\\MAIN.TcPOU", include), encoding="utf-8")
    made = read_project(path)
    assert made.errors == [] and Path(made.sources[0].name) == tmp_path / file


def test_a_program_of_a_library_that_a_task_calls_is_left_out_with_a_warning(tmp_path: Path) -> None:
    path = write_project(tmp_path)
    task = next(tmp_path.rglob("*.TcTTO"))
    text = task.read_text(encoding="utf-8").replace("<PouCall>", "<PouCall><Name>VisuElems.Visu_Prg</Name></PouCall><PouCall>", 1)
    task.write_text(text, encoding="utf-8")
    made = read_project(path)
    assert "VisuElems" not in made.sources[-1].text and "PROGRAM MAIN WITH PlcTask : MAIN;" in made.sources[-1].text
    assert [found.message for found in made.diagnostics if "VisuElems" in found.message] == [
        "the task PlcTask calls VisuElems.Visu_Prg, a program of a library, and that is left out"]


def test_what_is_no_project(tmp_path: Path) -> None:
    path = tmp_path / "Plant.plcproj"
    path.write_text("<TcSmProject/>", encoding="utf-8")
    assert [found.message for found in read_project(path).diagnostics] == ["the file is no project of TwinCAT"]


def test_the_first_of_several_projects_runs_its_tasks_and_the_others_are_libraries(tmp_path: Path) -> None:
    plant, core = write_project(tmp_path / "plant"), write_project(tmp_path / "core")
    tasks = [name for name in given_sources([plant, core]) if name.endswith("Tasks.st")]
    assert tasks == [f"{plant}/Tasks.st"]


def test_a_project_is_read_with_those_of_its_solution_that_it_refers_to(tmp_path: Path) -> None:
    line = write_solution(tmp_path)
    found, said = inputs([line])
    compiled = compile_sources([each for each in found if isinstance(each, Source)], dialect="twincat")
    assert said == [] and compiled.errors == []
    assert compiled.image is not None
    plc = Plc(compiled.image)
    plc.scan()
    assert (plc.read("MAIN.fbAxis.nLast"), plc.read("MAIN.fbAxis.aSteps[5]")) == (5, 7)
    assert sum(name.endswith("Tasks.st") for name in given_sources([line])) == 1


def test_a_program_of_a_library_is_none_of_the_project_that_has_one_of_that_name(tmp_path: Path) -> None:
    line = write_solution(tmp_path)
    core = tmp_path / "Core" / "Core.plcproj"
    text = core.read_text(encoding="utf-8")
    core.write_text(text.replace("<Compile ", '<Compile Include="Main.TcPOU"/><Compile Include="Other.TcPOU"/><Compile ', 1),
                    encoding="utf-8")  # fmt: skip
    for name in ("Main", "Other"):
        (core.parent / f"{name}.TcPOU").write_text(f"""<TcPlcObject><POU Name="{name}"><Declaration><![CDATA[// a test
PROGRAM INTERNAL {name}
VAR wrong : Nowhere; END_VAR]]></Declaration><Implementation><ST><![CDATA[]]></ST></Implementation></POU></TcPlcObject>""",
                                                   encoding="utf-8")
    found, _ = inputs([line])
    compiled = compile_sources([each for each in found if isinstance(each, Source)], dialect="twincat")
    assert [Path(error.source.name).name for error in compiled.errors] == ["Other.TcPOU"]


def test_a_project_that_is_named_and_used_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_solution(tmp_path)
    monkeypatch.chdir(tmp_path / "Line")
    names = list(given_sources([Path("Line.plcproj"), tmp_path / "Core" / "Core.plcproj"]))
    assert sum("FB_Axis" in name for name in names) == 1
    assert "../Core/FB_Axis.TcPOU" in [name.replace("\\", "/") for name in given_sources([Path("Line.plcproj")])]


def test_without_a_solution_around_it_a_project_has_no_neighbours(tmp_path: Path) -> None:
    line = write_solution(tmp_path)
    (tmp_path / "All.sln").unlink()
    assert not any("FB_Axis" in name for name in given_sources([line]))


@pytest.mark.skipif(os.name == "nt", reason="links need a right under Windows")
def test_a_neighbour_whose_file_is_gone_is_passed_over(tmp_path: Path) -> None:
    line = write_solution(tmp_path)
    (tmp_path / "Away").mkdir()
    (tmp_path / "Away" / "Away.plcproj").symlink_to(tmp_path / "nowhere.plcproj")
    assert sum("FB_Axis" in name for name in given_sources([line])) == 1


SYSTEM = """<?xml version="1.0"?>
<TcSmProject><Project><System><Tasks><Task Id="3" Priority="5" CycleTime="40000"><Name>PlcTask</Name></Task></Tasks></System>
<Plc>{0}</Plc></Project></TcSmProject>
"""
PART = '<?xml version="1.0"?><TcSmItem><Project Name="Plant" PrjFilePath="..\\..\\Plant\\Plant.plcproj"/></TcSmItem>'


def written_system(folder: Path, *projects: str) -> Path:
    """A system beside the folder Plant with the usual project."""
    (folder / "Plant").mkdir()
    write_project(folder / "Plant")
    (folder / "_Config" / "PLC").mkdir(parents=True)
    (folder / "_Config" / "PLC" / "Plant.xti").write_text(PART, encoding="utf-8")
    path = folder / "Line.tsproj"
    path.write_text(SYSTEM.format("".join(f"<Project {project}/>" for project in projects)), encoding="utf-8")
    return path


@pytest.mark.parametrize("project", ['PrjFilePath="Plant\\Plant.plcproj"', 'File="Plant.xti"'])
def test_a_system_runs_its_project_with_its_own_cycle(tmp_path: Path, project: str) -> None:
    path = written_system(tmp_path, project)
    made = within(path)
    assert made is not None
    assert "TASK PlcTask(INTERVAL := T#4000us, PRIORITY := 5);" in made.sources[-1].text
    differs = [found for found in made.diagnostics if found.code == "X0292"]
    assert [(found.source.text[found.start : found.end], found.message) for found in differs] == [
        ("<", "the system gives the task PlcTask 4000 us and priority 5, its own file 20000 us and 20")]
    assert made.errors == []
    assert usual_dialect([path]) == "twincat"


def test_of_several_projects_of_a_system_the_one_runs_that_no_other_uses(tmp_path: Path) -> None:
    write_solution(tmp_path)
    rows = ('PrjFilePath="Core\\Core.plcproj"', 'PrjFilePath="Line\\Line.plcproj"')
    path = tmp_path / "Line.tsproj"
    path.write_text(SYSTEM.format("".join(f"<Project {row}/>" for row in rows)), encoding="utf-8")
    names = [Path(name).name for name in given_sources([path])]
    assert names == ["MAIN.TcPOU", "Core.st", "Tasks.st", "FB_Axis.TcPOU", "Param.TcGVL", "Core.st"]


@pytest.mark.parametrize(("projects", "said"), [
    ((), "the system has no PLC project"),
    (('PrjFilePath="Plant\\Plant.plcproj"', 'File="Plant.xti"'), "the system has 2 PLC projects: Plant.plcproj Plant.plcproj"),
    (('PrjFilePath="..\\Plant.plcproj"',), "..\\Plant.plcproj lies outside of the system's folder"),
    (('PrjFilePath="C:\\Plant.plcproj"',), "C:\\Plant.plcproj lies outside of the system's folder"),
    (('PrjFilePath="Plant\\Plant.exe"',), "the PLC project has no PrjFilePath with a .plcproj"),
    (('File="..\\Plant.xti"',), "..\\Plant.xti lies outside of _Config/PLC"),
    (('File="None.xti"',), "None.xti cannot be read: no such file or directory"),
])  # fmt: skip
def test_systems_that_cannot_be_run(tmp_path: Path, projects: tuple[str, ...], said: str) -> None:
    made = within(written_system(tmp_path, *projects))
    assert made is not None
    [found] = made.errors
    assert found.message.endswith(said)
    assert made.sources == []


@pytest.mark.parametrize(("said", "own"), [
    ("", TaskSettings(10_000, 20)), ("<CycleTime>2000</CycleTime><Priority>7</Priority>", TaskSettings(2_000, 7)),
    ("<CycleTime>often</CycleTime><Priority></Priority>", TaskSettings(10_000, 20)),
])  # fmt: skip
def test_a_task_of_which_a_file_says_nothing_runs_as_a_new_one_does(said: str, own: TaskSettings) -> None:
    """Every 10 ms, with priority 20."""
    parsed = parse_markup(f'<Task Name="T">{said}</Task>'.encode(), "T.TcTTO")
    assert isinstance(parsed, tuple)
    assert _own(parsed[1]) == own


@pytest.mark.parametrize(("properties", "names"), [
    ("<Title>Core</Title>", ["Core"]), ("<DefaultNamespace>Space</DefaultNamespace><Title>Core</Title>", ["Space"]),
    ("<DefaultNamespace>Space</DefaultNamespace>", ["Space"]), ("<Name>Other</Name>", []), ("<Title>A.B</Title>", []),
    ("<Title>2 words</Title>", []),
])  # fmt: skip
def test_which_name_may_stand_in_front_of_names_of_a_project(tmp_path: Path, properties: str, names: list[str]) -> None:
    path = tmp_path / "P.plcproj"
    path.write_text(f"<Project><PropertyGroup>{properties}</PropertyGroup></Project>", encoding="utf-8")
    assert [Path(source.name).stem for source in read_project(path).sources] == names
