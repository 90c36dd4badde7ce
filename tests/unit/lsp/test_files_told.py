"""What an editor has been told of a file goes when its reason goes; which programs a change of a file begins anew."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import pytest
from cx_text import SAMPLE
from in_process import PUMP, Desk, talk
from rows import each_of

from fbvm.lsp.project_file import meaning_at
from fbvm.lsp.projects import Project, Projects

pytestmark = pytest.mark.slow  # pygls and the protocol take their time to be imported

HOUSE = Path(__file__).resolve().parents[3]
MAIN = "PROGRAM Main\nVAR p : Pump; END_VAR\n    p(Level := 1);\nEND_PROGRAM\n"
GOOD = '[plc.pump]\nsources = ["main.st", "Pump.st"]\n'


def write(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        (folder / f"{name}.st").write_text(text, encoding="utf-8")


def test_mistakes_of_a_project_file_go_with_the_file(tmp_path: Path) -> None:
    write(tmp_path, main=MAIN, Pump=PUMP)
    (tmp_path / "fbvm.toml").write_text(GOOD + "cicle = 1\n", encoding="utf-8")

    async def about(desk: Desk) -> None:
        await desk.shows("fbvm.toml", "P0102")
        desk.written("fbvm.toml", None)
        await desk.shows("fbvm.toml")
        desk.open("fbvm.toml", GOOD + "cicle = 1\n")
        await desk.shows("fbvm.toml", "P0102")
        desk.close_file("fbvm.toml")
        await desk.shows("fbvm.toml")

    talk(tmp_path, about, "main.st")


def test_mistakes_of_a_library_go_when_they_are_mended(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "Pump.st").write_text(PUMP.replace("200", "'a'"), encoding="utf-8")
    write(tmp_path, main=MAIN)

    async def about(desk: Desk) -> None:
        await desk.until(lambda: bool(desk.codes("own/Pump.st")))
        desk.written("own/Pump.st", PUMP)
        desk.notify("workspace/didChangeConfiguration", settings={"libraries": [str(tmp_path / "own")]})
        await desk.checked()
        desk.replace("main.st", (2, 15), (2, 16), "2")
        await desk.shows("own/Pump.st")
        assert desk.codes("main.st") == []

    talk(tmp_path, about, "main.st", settings={"libraries": [str(tmp_path / "own")]})


def test_a_text_that_is_formatted_already_is_answered_with_no_change(tmp_path: Path) -> None:
    write(tmp_path, main=MAIN, Pump=PUMP)

    async def about(desk: Desk) -> None:
        options = {"tabSize": 4, "insertSpaces": True}
        [edit] = await desk.of("formatting", "main.st", options=options)
        assert edit["newText"].strip() == "p : Pump;"
        desk.replace("main.st", (1, 0), (1, 21), "VAR\n    p : Pump;\nEND_VAR")
        assert await desk.of("formatting", "main.st", options=options) == []
        assert await desk.of("formatting", "nowhere.st", options=options) == []

    talk(tmp_path, about, "main.st")


def test_what_a_key_means_at_the_very_beginning_of_a_project_file() -> None:
    for text, at in (("run = {}", 1), ("\nrun = {}", 3), ("\nrun = {}\n", 3), ("\n\nrun = {}", 3)):
        assert meaning_at(text, at).startswith("**run**: ")
    assert meaning_at("\nrun = {}", 0) == ""


def opened(folder: Path, *names: str) -> Projects:
    found = Projects(lambda path: None)
    for name in names:
        found.open(folder / name)
    return found


def named(projects: Iterable[Project]) -> list[str]:
    return [" ".join(path.name for path in each.paths) or each.named[0].name for each in projects]


@each_of(("changed", "forgotten"), [
    ("line3.cxt", ["line3.cxt"]), ("more/x.TcTTO", ["line3.cxt"]), ("main.st", ["main.st Pump.st"]),
    ("../other/x.TcTTO", []), ("../line3.cxt", []),
])
def test_a_change_within_the_folder_of_a_container_begins_its_program_anew(
    tmp_path: Path, changed: str, forgotten: list[str]
) -> None:
    folder = tmp_path / "all"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write(folder, main=MAIN, Pump=PUMP)
    (folder / "line3.cxt").write_bytes(SAMPLE.bytes())
    projects = opened(folder, "main.st", "line3.cxt")
    before = named(projects.all)
    assert before == ["main.st Pump.st", "line3.cxt"]
    gone = projects.forget_container((folder / changed).resolve())
    wanted = forgotten if changed != "main.st" else ["main.st Pump.st", "line3.cxt"]
    assert (named(gone), named(projects.all)) == (wanted, [name for name in before if name not in wanted])


@each_of(("changed", "forgotten"), [
    ("Drives/FB_Motor.TcPOU", True), ("Drives/FB_Engine.TcPOU", False), ("../main.st", False), ("Drives/FB_Motor.txt", False)])
def test_a_program_that_consists_of_other_files_now_is_begun_anew(tmp_path: Path, changed: str, forgotten: bool) -> None:
    """An object of a project of TwinCAT that a project file names is none of the files that it names itself."""
    folder = tmp_path / "plant"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(HOUSE / "examples" / "twincat", folder)
    (folder / "fbvm.toml").write_text('[plc.a]\nsources = ["Conveyor.plcproj"]\n', encoding="utf-8")
    projects = opened(folder, "FB_Conveyor.TcPOU")
    [made] = projects.all
    path = (folder / changed).resolve()
    assert projects.forget_regrouped(path) == [] and projects.all == [made], "nothing has changed yet"
    if path.exists():
        path.unlink()
    else:
        path.write_text("", encoding="utf-8")
    assert (projects.forget_regrouped(path) == [made]) is forgotten and (projects.all == []) is forgotten
