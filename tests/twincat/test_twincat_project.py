"""A project of TwinCAT: what it lists, and what its tasks say."""

from __future__ import annotations

from pathlib import Path

import pytest
from twincat_files import PROJECT, write_project

from fbvm.interchange.formats.given import given_sources
from fbvm.interchange.twincat.project import read_project


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


def test_what_is_no_project(tmp_path: Path) -> None:
    path = tmp_path / "Plant.plcproj"
    path.write_text("<TcSmProject/>", encoding="utf-8")
    assert [found.message for found in read_project(path).diagnostics] == ["the file is no project of TwinCAT"]


def test_the_first_of_several_projects_runs_its_tasks_and_the_others_are_libraries(tmp_path: Path) -> None:
    plant, core = write_project(tmp_path / "plant"), write_project(tmp_path / "core")
    tasks = [name for name in given_sources([plant, core]) if name.endswith("Tasks.st")]
    assert tasks == [f"{plant}/Tasks.st"]
