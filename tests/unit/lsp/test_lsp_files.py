"""Which files are one program while they come, go and change, and what editors are told of them; in this process."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path

import pytest
from cx_text import SAMPLE, Cxt
from in_process import Desk, span, talk
from test_answers import MAIN, PUMP, folder  # noqa: F401

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.cx.compression import compress
from fbvm.lsp.positions import Positions
from fbvm.lsp.project_file import completions, meaning_at
from fbvm.lsp.projects import Settings, path_of
from fbvm.lsp.server import Server

HOUSE = Path(__file__).resolve().parents[3]

pytestmark = pytest.mark.slow  # pygls and the protocol take their time to be imported


def test_files_of_uris_on_every_system() -> None:
    rows = {"file:///a/B%20c.st": "/a/B c.st", "untitled:Untitled-1": "/untitled/Untitled-1", "file:///D:/x.st": "/D:/x.st"}
    assert {uri: str(path_of(uri)) for uri in rows} == rows


def test_the_letter_of_a_drive_is_in_lower_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.lsp.projects.url2pathname", lambda path: path.lstrip("/"))
    assert (str(path_of("file:///D:/Abc.st")), str(path_of("file:///Abc.st"))) == ("d:/Abc.st", "Abc.st")


def test_files_come_and_go_on_disk(folder: Path) -> None:  # noqa: F811
    async def about(desk: Desk) -> None:
        await desk.checked()
        assert desk.told == {}
        desk.written("Pump.st", None)
        await desk.shows("main.st", "S0204")
        desk.written("Pump.st", PUMP.replace("Level", "Height"))
        await desk.shows("main.st", "S0402")
        desk.written("Pump.st", PUMP)
        await desk.shows("main.st")
        desk.open("Pump.st", PUMP.replace("Level", "Height"))
        await desk.shows("main.st", "S0402")
        desk.written("Pump.st", PUMP + "// what an editor has open counts, not the disk\n")
        await desk.checked()
        assert desk.codes("main.st") == ["S0402"]
        desk.close_file("Pump.st")
        await desk.shows("main.st")
        desk.replace("main.st", (3, 4), (3, 6), "Off")
        await desk.shows("main.st", "S0201")
        desk.close_file("main.st")
        await desk.shows("main.st")
        assert desk.server.projects.all == [] and desk.server.told == {}

    talk(folder, about, "main.st")


def test_a_project_file_that_comes_and_goes_says_what_belongs_together(folder: Path) -> None:  # noqa: F811
    described = '[plc.pump]\nsources = ["main.st"]\n'

    async def about(desk: Desk) -> None:
        desk.written("fbvm.toml", described)
        await desk.shows("main.st", "S0204")
        assert [(each.plc, [path.name for path in each.paths]) for each in desk.server.projects.all] == [("pump", ["main.st"])]
        desk.open("fbvm.toml", described.replace('"main.st"', '"main.st", "Pump.st"'))
        await desk.shows("main.st")
        assert [each.name for each in desk.server.projects.all[0].paths] == ["main.st", "Pump.st"]
        desk.replace("fbvm.toml", (1, 0), (1, 7), "source_")
        await desk.until(lambda: "P0102" in desk.codes("fbvm.toml"))
        desk.replace("fbvm.toml", (1, 0), (1, 7), "sources")
        await desk.shows("fbvm.toml")
        desk.open("test_pump.st")
        assert len(desk.server.projects.all) == 2  # it is none of the PLC's sources
        desk.written("Pump.st", None)
        await desk.checked()
        assert desk.codes("main.st") == ["S0204"]
        desk.written("Pump.st", PUMP)
        await desk.shows("main.st")

    talk(folder, about, "main.st")


def test_a_file_that_was_never_there_may_belong_to_the_program(folder: Path) -> None:  # noqa: F811
    async def about(desk: Desk) -> None:
        desk.replace("main.st", (1, 9), (1, 13), "Lamp")
        await desk.shows("main.st", "S0204")
        desk.written("Lamp.st", PUMP.replace("Pump", "Lamp"))
        await desk.shows("main.st")
        assert {path.name for path in desk.server.projects.all[0].paths} == {"main.st", "Lamp.st"}

    talk(folder, about, "main.st")


def test_mistakes_of_a_project_file_are_told_with_no_source_open_and_go_when_the_disk_has_none(folder: Path) -> None:  # noqa: F811
    good = '[plc.pump]\nsources = ["main.st", "Pump.st"]\n'

    async def alone(desk: Desk) -> None:
        desk.open("fbvm.toml", good + "cicle = 1\n")
        await desk.shows("fbvm.toml", "P0102")

    async def on_disk(desk: Desk) -> None:
        await desk.shows("fbvm.toml", "P0102")
        desk.written("fbvm.toml", good)
        await desk.shows("fbvm.toml")

    (folder / "fbvm.toml").write_text(good, encoding="utf-8")
    talk(folder, alone)
    (folder / "fbvm.toml").write_text(good + "cicle = 1\n", encoding="utf-8")
    talk(folder, on_disk, "main.st")


def test_mistakes_of_blocks_that_a_test_names_are_shown_in_their_files(folder: Path) -> None:  # noqa: F811
    (folder / "src").mkdir()
    lamp = PUMP.replace("Pump", "Lamp")
    (folder / "src" / "Lamp.st").write_text(lamp.replace("200", "'a'"), encoding="utf-8")
    lit = "PROGRAM Lit\nVAR L : Lamp; END_VAR\n    L(Level := 1);\nEND_PROGRAM\n"
    (folder / "test_lamp.st").write_text(lit, encoding="utf-8")

    async def about(desk: Desk) -> None:
        await desk.until(lambda: bool(desk.codes("src/Lamp.st")))
        [told] = desk.told[desk.uri("src/Lamp.st")]
        assert told["range"]["start"]["line"] == 3

    talk(folder, about, "test_lamp.st")


def test_garbage_is_collected_once_after_the_last_key(folder: Path) -> None:  # noqa: F811
    async def about(desk: Desk) -> None:
        await desk.checked()
        first = desk.server._collection
        desk.replace("main.st", (3, 4), (3, 6), "Off")
        await desk.shows("main.st", "S0201")
        await desk.checked()
        assert first is not None and first.cancelled() and desk.server._collection is not first

    talk(folder, about, "main.st")


def test_settings_say_the_dialect_and_the_libraries_of_files_without_a_project(folder: Path) -> None:  # noqa: F811
    (folder / "own.st").write_text("PROGRAM Own\nVAR i : INT; w : WORD; END_VAR\n    w := i;\nEND_PROGRAM\n", encoding="utf-8")

    async def about(desk: Desk) -> None:
        await desk.shows("own.st", "S0301")
        desk.notify("workspace/didChangeConfiguration", settings={"fbvm": {"dialect": "codesys"}})
        assert desk.server.projects.settings == Settings("codesys")
        await desk.shows("own.st")
        desk.notify("workspace/didChangeConfiguration", settings={"dialect": "matiec", "libraries": ["/a", "/b"]})
        assert desk.server.projects.settings == Settings("matiec", (Path("/a"), Path("/b")))
        for wrong in ({"dialect": "pascal"}, {"dialect": ["codesys"]}, {"dialect": "codesys", "libraries": "x"}):
            desk.notify("workspace/didChangeConfiguration", settings=wrong)
            assert desk.server.projects.settings.dialect == "matiec"
        for none in (None, {}, {"fbvm": {"dialect": None, "libraries": None}}):
            desk.notify("workspace/didChangeConfiguration", settings=none)
            assert desk.server.projects.settings == Settings()
        await desk.shows("own.st", "S0301")

    talk(folder, about, "own.st")

    async def from_the_beginning(desk: Desk) -> None:
        await desk.checked()
        assert desk.codes("own.st") == [] and [each.program.dialect.name for each in desk.server.projects.all] == ["codesys"]

    talk(folder, from_the_beginning, "own.st", settings={"dialect": "codesys"})


def test_an_editor_that_can_is_asked_to_watch_files(folder: Path) -> None:  # noqa: F811
    for can in (True, False):
        async def about(desk: Desk, can: bool = can) -> None:
            await asyncio.sleep(0)
            registered = [each["params"]["registrations"][0] for each in desk.asked]
            assert [each["method"] for each in registered] == ["workspace/didChangeWatchedFiles"] * can
            assert all(each["registerOptions"]["watchers"][0] == {"globPattern": "**/*.st"} for each in registered)

        talk(folder, about, capabilities={"workspace": {"didChangeWatchedFiles": {"dynamicRegistration": can}}})
    talk(folder, lambda desk: desk.checked())


def test_a_project_file_is_explained_and_completed(folder: Path) -> None:  # noqa: F811
    text = '\n[plc.pump]\nsources = ["main.st"]\ncycle = "10ms"\ndialect = \n'

    async def about(desk: Desk) -> None:
        said = await desk.at("hover", "fbvm.toml", 2, 3)
        assert said["contents"]["value"].startswith("**sources**: ")
        for line in (0, 1):
            assert await desk.at("hover", "fbvm.toml", line, 0) is None
        offered = (await desk.at("completion", "fbvm.toml", 4, 10))["items"]
        assert {"label": "codesys", "insertText": '"codesys"'}.items() <= next(
            each for each in offered if each["label"] == "codesys").items()
        assert {each["kind"] for each in offered} == {10}

    (folder / "fbvm.toml").write_text(text, encoding="utf-8")
    talk(folder, about, "fbvm.toml")

    def labels(text: str) -> dict[str, str]:
        return {label: inserted for label, _, inserted in completions(text, len(text))}

    assert "cycle" in labels("[plc.a]\n") and labels("[plc.a]\n")["cycle"] == "cycle = "
    assert labels("[plc.a]\n")["[plc.NAME]"] == "[plc.NAME]" and labels("[")["plc.NAME]"] == "plc.NAME]"
    assert "[plc.NAME]" not in labels("[plc.a]\ncy") and "cycle" in labels("[plc.a]\ncy")
    assert "cycle" not in labels("\n") and "plc" not in labels("\n") and labels("[nonsense]\n").keys() == labels("").keys()
    assert labels('[plc.a]\ndialect = "')["codesys"] == "codesys"
    assert labels('[plc.a]\ndialect = ')["codesys"] == '"codesys"'
    assert labels("[plc.a]\nnobody = ") == {} == labels("[plc.a]\n= ")
    assert meaning_at("[plc.a]\ncycle = 1", 9).startswith("**cycle**: ") and "Without it: " in meaning_at("[plc.a]\ncycle = 1", 9)
    assert meaning_at("[plc.a]\nnobody = 1", 9) == ""


@pytest.fixture
def twincat(tmp_path: Path) -> Path:
    shutil.copytree(HOUSE / "examples" / "twincat", tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_an_object_of_twincat_belongs_to_its_project(twincat: Path) -> None:
    name = "FB_Conveyor.TcPOU"

    async def about(desk: Desk) -> None:
        await desk.checked()
        assert desk.codes(name) == [] and len(desk.server.projects.all) == 1
        desk.replace(name, (15, 3), (15, 14), "fbRunsOff.Q")
        await desk.shows(name, "S0201")
        assert desk.told[desk.uri(name)][0]["range"]["start"] == {"line": 15, "character": 3}
        desk.replace(name, (15, 3), (15, 14), "fbRunsOut.Q")
        await desk.shows(name)
        [block] = await desk.of("documentSymbol", name)
        assert (block["name"], block["selectionRange"]["start"]) == ("FB_Conveyor", {"line": 4, "character": 15})
        found = await desk.at("definition", name, 16, 14)
        assert found["uri"].endswith("Drives/I_Drive.TcIO")
        assert "I_Drive" in (await desk.at("hover", name, 16, 6))["contents"]["value"]
        assert await desk.at("prepareRename", name, 16, 6) is None
        assert not await desk.of("formatting", name, options={"tabSize": 4, "insertSpaces": True})
        refused = await desk.answer("textDocument/rename", textDocument={"uri": desk.uri(name)}, newName="motor",
                                    position={"line": 16, "character": 6})
        assert refused["error"]["message"] == f"{name} uses the name, which another tool writes: rename it there"
        text = (twincat / "Drives" / "I_Drive.TcIO").read_text(encoding="utf-8")
        desk.written("Drives/I_Drive.TcIO", text.replace("I_Drive", "I_Engine"))
        await desk.until(lambda: "S0204" in desk.codes(name))
        desk.written("Drives/I_Drive.TcIO", text)
        await desk.shows(name)

    talk(twincat, about, name)


def test_a_project_of_twincat_is_read_again_when_it_or_a_task_changes(twincat: Path) -> None:
    motor = (twincat / "Drives" / "FB_Motor.TcPOU").read_text(encoding="utf-8")
    (twincat / "Drives" / "FB_Motor.TcPOU").unlink()

    async def about(desk: Desk) -> None:
        await desk.shows("Conveyor.plcproj", "X0501")
        [told] = desk.told[desk.uri("Conveyor.plcproj")]
        assert "FB_Motor.TcPOU cannot be read" in told["message"] and told["range"]["start"]["line"] > 0
        desk.written("Drives/FB_Motor.TcPOU", motor)
        await desk.shows("Conveyor.plcproj")
        desk.written("Conveyor.plcproj", (twincat / "Conveyor.plcproj").read_text(encoding="utf-8"))
        await desk.shows("Conveyor.plcproj")

    talk(twincat, about, "Conveyor.plcproj")


def test_a_project_of_cx_programmer_has_its_diagnostics_symbols_and_words_in_place(tmp_path: Path) -> None:
    (tmp_path / "line3.cxt").write_bytes(SAMPLE.bytes())
    lines = SAMPLE.text.splitlines()

    async def about(desk: Desk) -> None:
        await desk.shows("line3.cxt", "S0290")
        [unused] = desk.told[desk.uri("line3.cxt")]
        line = lines.index("   Helper,,BOOL,,A,;")
        assert (unused["range"], unused["message"][:36]) == (span(line, 3, line, 9), "program NewProgram1, symbol Helper: ")
        symbols = await desk.of("documentSymbol", "line3.cxt")
        section = next(each for each in symbols if each["name"] == "NewProgram1")
        assert lines[section["range"]["start"]["line"]].strip() == "Program[0]:="
        assert section["range"] == section["selectionRange"]
        assert "DOUBLE" in {each["name"] for each in symbols}
        line = next(number for number, each in enumerate(lines) if "LD Start_PB" in each)
        shown = await desk.at("hover", "line3.cxt", line, lines[line].index("Start_PB"))
        assert "start button" in shown["contents"]["value"]
        at = lines[line].index("Start_PB")
        assert shown["range"] == span(line, at, line, at + len("Start_PB"))
        shown = await desk.at("hover", "line3.cxt", line, lines[line].index("LD"))
        assert "Begins a block with a bit" in shown["contents"]["value"]
        assert await desk.at("hover", "line3.cxt", 0, 0) is None

    talk(tmp_path, about, "line3.cxt")


def test_a_mistake_in_a_rung_is_shown_at_its_word_and_in_a_compressed_project_in_words(tmp_path: Path) -> None:
    rungs = "LD Start_PB\nOUT 100.00", "LD Start_PB\nOUT Pmp"
    project = Cxt(symbols=("Start_PB,0.00,BOOL,,,",), sections=(("Pumping", rungs),))
    (tmp_path / "line3.cxt").write_bytes(project.bytes())
    (tmp_path / "line4.cxp").write_bytes(compress(project.bytes()))
    line = project.text.splitlines().index("OUT Pmp")

    async def about(desk: Desk) -> None:
        desk.open("line3.cxt")
        desk.open("line4.cxp", "")
        for name, where in (("line3.cxt", span(line, 4, line, 7)), ("line4.cxp", span(0, 0, 0, 0))):
            await desk.shows(name, "S0201")
            [told] = desk.told[desk.uri(name)]
            assert told["range"] == where
            assert told["message"].startswith("program NewProgram1, section Pumping, rung 1, step 2 (OUT Pmp): ")
        desk.written("line3.cxt", Cxt(symbols=("Start_PB,0.00,BOOL,,,",), sections=(("Pumping", rungs[:1]),)).text)
        await desk.shows("line3.cxt")
        await desk.shows("line4.cxp", "S0201")

    talk(tmp_path, about)


def test_a_diagnostic_without_a_width_is_shown_on_one_character(monkeypatch: pytest.MonkeyPatch) -> None:
    server, source = Server("1"), Source("/a/Main.st", "PROGRAM Main\nEND_PROGRAM")
    monkeypatch.setattr(server, "positions", Positions)  # no editor has agreed upon units
    for start, columns in ((8, (8, 9)), (12, (12, 12))):  # nothing at the end of a line
        made = server.diagnostic(Diagnostic("S0201", source, start, start, "said", "do this"), source)
        assert (made.range.start.character, made.range.end.character) == columns
        assert made.message == "said\ndo this" and made.related_information is None
    end = server.diagnostic(Diagnostic("S0201", source, 24, 24, "said"), source)
    assert (end.range.end.character, end.message) == (11, "said")


def test_a_declaration_that_stands_twice_names_the_other_place(folder: Path) -> None:  # noqa: F811
    text = MAIN.replace("m : Mode;", "m : Mode; P1 : INT;")

    async def about(desk: Desk) -> None:
        await desk.until(lambda: "S0202" in desk.codes("main.st"))
        twice = next(each for each in desk.told[desk.uri("main.st")] if each["code"] == "S0202")
        [other] = twice["relatedInformation"]
        assert other["location"] == {"uri": desk.uri("main.st"), "range": span(1, 4, 1, 5)}

    (folder / "main.st").write_text(text, encoding="utf-8")
    talk(folder, about, "main.st")


def test_what_nobody_has_checked_yet_is_checked_for_an_answer(folder: Path) -> None:  # noqa: F811
    async def about(desk: Desk) -> None:
        for project in desk.server.projects.all:
            assert isinstance(project.task, asyncio.Task)
            project.task.cancel()
            await asyncio.wait([project.task])
        found = await desk.at("definition", "main.st", 1, 11)
        assert found is not None and found["uri"] == desk.uri("Pump.st")

    talk(folder, about, "main.st")


