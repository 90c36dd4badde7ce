"""Which files of a folder are one program: without the protocol, from files and from texts that are not saved."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from cx_text import Cxt
from growth import assert_linear
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.lsp import foreign
from fbvm.lsp.foreign import project_with
from fbvm.lsp.projects import MOST_FILES, TEST_LIBRARY, Project, Projects, Settings, project_file_above

MAIN = "PROGRAM Main\nVAR a : Pump; END_VAR\n    a();\nEND_PROGRAM\n"
PUMP = "FUNCTION_BLOCK Pump\nEND_FUNCTION_BLOCK\n"


def folder_with(tmp_path: Path, texts: dict[str, str]) -> Path:
    folder = tmp_path / "folder"
    shutil.rmtree(folder, ignore_errors=True)
    for name, text in {"pytest.ini": "", **texts}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def names(project: Project) -> str:
    return " ".join(path.name for path in project.paths)


def programs(projects: Projects) -> list[str]:
    return [names(each) for each in projects.all]


@each_of(("opened", "texts", "wanted"), [
    ("main.st", {"main.st": MAIN, "Pump.st": PUMP, "other.st": "PROGRAM Other\nEND_PROGRAM\n"}, "main.st Pump.st"),
    ("main.st", {"main.st": MAIN, "z.st": PUMP.lower()}, "main.st z.st"),
    ("main.st", {"main.st": MAIN, "a.st": PUMP, "b.st": PUMP}, "main.st a.st"),
    ("main.st", {"main.st": MAIN + PUMP, "Pump.st": PUMP}, "main.st"),
    ("main.st", {"main.st": MAIN, "Pump.st": PUMP + MAIN}, "main.st"),
    ("main.st", {"main.st": MAIN, "z.st": PUMP.replace("K Pump", "K Pump // has a Valve"),
                 "a.st": "TYPE\n  Valve : INT;\nEND_TYPE"}, "main.st z.st a.st"),
    ("main.st", {"main.st": "PROGRAM Main\n x := Twice(Half);\nEND_PROGRAM", "b.st": "\tFUNCTION Twice : INT\nEND_FUNCTION",
                 "c.st": "TYPE Half : INT; END_TYPE", "d.st": "x FUNCTION Twice : INT"}, "main.st b.st c.st"),
    ("main.st", {"main.st": MAIN, "Pump.txt": PUMP, "Pump.ST": PUMP, "Pump.TcPOU": PUMP}, "main.st"),
    ("main.st", {"main.st": MAIN, "more/Pump.st": PUMP}, "main.st"),
    ("Pump.st", {"main.st": MAIN, "Pump.st": PUMP}, "Pump.st"),
    ("main.st", {"main.st": MAIN, **{f"a{number}.st": "" for number in range(MOST_FILES - 2)}, "b.st": PUMP}, "main.st b.st"),
    ("main.st", {"main.st": MAIN, **{f"a{number}.st": "" for number in range(MOST_FILES)}, "b.st": PUMP}, "main.st"),
])  # fmt: skip
def test_a_file_goes_with_those_of_its_folder_that_declare_what_it_names(
    tmp_path: Path, opened: str, texts: dict[str, str], wanted: str
) -> None:
    folder = folder_with(tmp_path, texts)
    projects = Projects(lambda path: None)
    [made] = projects.open(folder / opened)
    assert names(made) == wanted
    assert sorted(made.program.files) == sorted(str(path) for path in made.paths)
    assert (made.named, made.file, made.plc, made.held, made.said, projects.wrong) == ([folder / opened], None, "", (), {}, {})
    assert projects.open(folder / opened) == [made] and projects.all == [made], "it is known"


def test_texts_that_are_not_saved_count_and_files_that_cannot_be_read_do_not(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, {"main.st": "", "Pump.st": PUMP})
    unsaved = {folder / "main.st": MAIN, folder / "new.st": MAIN}
    projects = Projects(unsaved.get)
    assert [names(each) for each in projects.open(folder / "main.st")] == ["main.st Pump.st"]
    assert [names(each) for each in projects.open(folder / "new.st")] == ["new.st Pump.st"], "it is nowhere on disk"
    assert projects.text(folder / "main.st") == MAIN and projects.text(folder / "Pump.st") == PUMP
    assert projects.text(folder / "gone.st") is None
    assert [len(projects.of(folder / name)) for name in ("main.st", "Pump.st", "gone.st")] == [1, 2, 0]
    assert projects.open(folder / "gone.st") == [] and names(projects.all[-1]) == ""
    [made] = projects.of(folder / "main.st")
    unsaved[folder / "main.st"] = "PROGRAM Main\nEND_PROGRAM\n"
    assert projects.take(made, folder / "main.st")
    assert made.program.files[str(folder / "main.st")].text == "PROGRAM Main\nEND_PROGRAM\n"
    (folder / "Pump.st").unlink()
    assert not projects.take(made, folder / "Pump.st")
    assert list(made.program.files) == [str(folder / "main.st")]


def test_settings_hold_for_files_without_a_project_file(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, {"main.st": MAIN, "test_main.st": MAIN, "test_main.txt": "", "lib/library.toml": "nothing"})
    projects = Projects(lambda path: None)
    projects.settings = Settings("codesys", (folder / "lib",))
    [made] = projects.open(folder / "main.st")
    assert made.program.dialect.name == "codesys"
    assert {path.name: [each.code for each in found] for path, found in projects.wrong.items()} == {"library.toml": ["P0201"]}


def libraries_of(projects: Projects, path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The folders in which the program of a file looks for blocks."""
    seen: list[Path] = []
    from fbvm.lsp import projects as module

    made = module.Program
    monkeypatch.setattr(module, "Program", lambda **given: seen.extend(given["libraries"]) or made(**given))  # type: ignore[func-returns-value]
    projects.open(path)
    return seen


@each_of(("opened", "root", "wanted"), [
    ("app/unit/test_a.st", "pytest.ini", ["app/unit/src", "app/src", "src"]), ("app/unit/test_a.st", "app/fbvm.toml.off", [
        "app/unit/src", "app/src", "src"]),
    ("app/unit/test_a.st", "app/pyproject.toml", ["app/unit/src", "app/src"]), ("app/unit/test_a.st", "app/unit/.git", [
        "app/unit/src"]),
    ("app/unit/a.st", "pytest.ini", None), ("app/unit/my_test_a.st", "pytest.ini", None),
])  # fmt: skip
def test_a_test_knows_assert_and_the_blocks_beside_it_and_above(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opened: str, root: str, wanted: list[str] | None
) -> None:
    folder = folder_with(tmp_path, {opened: MAIN, "app/unit/src/a.st": "", "app/src/b.st": "", "src/c.st": "", root: ""})
    found = libraries_of(Projects(lambda path: None), folder / opened, monkeypatch)
    assert found == ([TEST_LIBRARY, *(folder / name for name in wanted)] if wanted is not None else [])


TWO = '[plc.a]\nsources = ["a.st", "both.st"]\ndialect = "codesys"\n[plc.b]\nsources = ["b.st", "both.st", "gone.st"]\n'


def test_a_project_file_may_name_files_outside_of_its_folder(tmp_path: Path) -> None:
    """An editor reads what its user has opened; the command line asks for `--allow-outside`."""
    folder = folder_with(tmp_path, {"main.st": MAIN, "shared/Pump.st": PUMP, "line/fbvm.toml":
                                    '[plc.a]\nsources = ["main.st", "../shared/Pump.st"]\n', "line/main.st": MAIN})
    projects = Projects(lambda path: None)
    [made] = projects.open(folder / "line" / "main.st")
    assert (names(made), projects.wrong) == ("main.st Pump.st", {folder / "line" / "fbvm.toml": []})


def test_a_project_file_says_which_files_are_programs(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, {"a.st": MAIN, "b.st": MAIN, "both.st": PUMP, "free.st": MAIN, "fbvm.toml": TWO})
    projects = Projects(lambda path: None)
    one, other = projects.open(folder / "both.st")
    assert [(each.plc, names(each), each.program.dialect.name, each.file) for each in (one, other)] == [
        ("a", "a.st both.st", "codesys", folder / "fbvm.toml"), ("b", "b.st both.st", "standard", folder / "fbvm.toml")]
    assert [path.name for path in other.named] == ["b.st", "both.st", "gone.st"]
    assert projects.open(folder / "a.st") == [one] and len(projects.all) == 2, "the file is read once"
    [free] = projects.open(folder / "free.st")
    assert (names(free), free.file) == ("free.st both.st", None)
    assert projects.wrong == {folder / "fbvm.toml": []}
    (folder / "gone.st").write_text("", encoding="utf-8")
    assert projects.forget_regrouped(folder / "gone.st") == [other] and projects.all == [one, free]
    assert projects.close([folder / "a.st"]) == [free] and projects.all == [one]
    assert projects.close([]) == [one] and projects.all == []
    projects.open(folder / "both.st")
    projects.open(folder / "free.st")
    assert [names(each) for each in projects.forget(folder / "other.toml")] == ["free.st both.st"], "it may belong to it now"
    assert len(projects.forget(folder / "fbvm.toml")) == 2 and projects.all == []
    projects.open(folder / "both.st")
    assert len(projects.forget()) == 2 and projects.all == []


def test_a_project_file_with_mistakes_describes_nothing(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, {"a.st": MAIN, "both.st": PUMP, "fbvm.toml": TWO.replace("sources", "source")})
    unsaved: dict[Path, str] = {}
    projects = Projects(unsaved.get)
    [made] = projects.open(folder / "a.st")
    assert made.file is None and names(made) == "a.st both.st"
    assert {each.code for each in projects.wrong[folder / "fbvm.toml"]} == {"P0102", "P0104"}
    unsaved[folder / "fbvm.toml"] = TWO
    assert projects.forget() == [made]
    assert [each.plc for each in projects.open(folder / "a.st")] == ["a"], "the text of an editor counts"
    assert projects.wrong == {folder / "fbvm.toml": []}


def test_the_nearest_project_file_counts(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, {"fbvm.toml": TWO, "sub/deep/a.st": MAIN, "sub/fbvm.toml/x": ""})
    assert project_file_above(folder / "sub" / "deep" / "a.st") == folder / "fbvm.toml"
    assert project_file_above(folder / "fbvm.toml") == folder / "fbvm.toml"
    assert project_file_above(tmp_path / "a.st") is None


@pytest.mark.slow
def test_sources_within_a_container_stand_at_places_of_it(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, {})
    project = Cxt(symbols=("Start_PB,0.00,BOOL,,,",), sections=(("Pumping", ("LD Start_PB\nOUT 100.00",)),))
    (folder / "line3.cxt").write_bytes(project.bytes())
    projects = Projects(lambda path: None)
    [made] = projects.open(folder / "line3.cxt")
    assert made.paths == made.named == [folder / "line3.cxt"] and made.held and not projects.take(made, folder / "line3.cxt")
    assert list(made.containers) == [folder / "line3.cxt"] and set(made.held) == set(made.program.files)
    name, file = next((name, file) for name, file in made.program.files.items() if "OUT" in file.text)
    found = [projects.place_in_container(file.source, line) for line in file.source.line_starts]
    rows = project.text.splitlines()
    shown = [(rows[place.document.place(place.start)[0] - 1].strip(), place.where) for place in found if place is not None]
    assert ("OUT 100.00", "program NewProgram1, section Pumping, rung 0, step 2 (OUT 100.00)") in shown
    assert projects.place_in_container(Source(str(folder / "a.st"), "x"), 0) is None
    places = made.containers[folder / "line3.cxt"].places[name]
    behind = [projects.place_in_container(Source(name, "\n" * 500), len(places) + more) for more in (-1, 0)]
    assert behind == [places[-1], None], "the last line, and what is behind the end"
    assert projects.forget_regrouped(folder / "line3.cxt") == []


def test_an_object_belongs_to_the_nearest_project_that_lists_it(tmp_path: Path) -> None:
    folder = tmp_path / "plant"
    shutil.copytree(Path(__file__).resolve().parents[3] / "examples" / "twincat", folder)
    motor, project = folder / "Drives" / "FB_Motor.TcPOU", folder / "Conveyor.plcproj"
    asked: list[Path] = []

    def ends(below: Path, at: Path) -> bool:
        asked.append(below)
        return below == at

    assert project_with(motor, lambda below: ends(below, tmp_path)) == project and asked == [motor.parent]
    assert project_with(motor, lambda below: ends(below, motor.parent)) is None, "it ends below the project"
    stray = folder / "Drives" / "FB_Stray.TcPOU"
    stray.write_text(motor.read_text(encoding="utf-8"), encoding="utf-8")
    assert project_with(stray, lambda below: ends(below, tmp_path)) is None and asked[-1] == tmp_path
    assert project_with(Path("/FB_Nowhere.TcPOU"), lambda below: False) is None


def test_what_cannot_be_read_is_no_part_of_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = folder_with(tmp_path, {"main.st": MAIN, "gone.plcproj": "x"})

    def within(path: Path, resource: str | None) -> None:
        raise PermissionError

    monkeypatch.setattr(foreign, "within", within)
    found = foreign.gathered([folder / "gone.plcproj", folder / "main.st"])
    assert (found.paths, found.held, found.said, found.containers) == ([folder / "main.st"], {}, {}, {})


@pytest.mark.slow
def test_the_time_to_find_the_program_of_each_file_grows_with_the_files(tmp_path: Path) -> None:
    def prepared(files: int) -> Callable[[], object]:
        projects, folder = Projects(lambda path: None), tmp_path / str(files)
        listed = ", ".join(f'"F{number}.st"' for number in range(files))
        folder_of = {"fbvm.toml": f"[plc.one]\nsources = [{listed}]\n", **{f"F{number}.st": "" for number in range(files)}}
        folder.mkdir()
        for name, text in folder_of.items():
            (folder / name).write_text(text, encoding="utf-8")
        [made] = projects.open(folder / "F0.st")
        assert len(made.paths) == files
        return lambda: [projects.of(path) for _ in range(30) for path in made.paths]

    assert_linear(prepared, 300)
