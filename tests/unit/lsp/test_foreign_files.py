"""The server on files of other tools: diagnostics, symbols and hover, and no change of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from cx_text import SAMPLE, Cxt
from lsprotocol import types
from pygls.exceptions import JsonRpcException
from test_server import Editor, conversation

from fbvm.interchange.cx.compression import compress

pytestmark = pytest.mark.slow

HOUSE = Path(__file__).resolve().parents[3]


@pytest.fixture
def twincat(tmp_path: Path) -> Path:
    shutil.copytree(HOUSE / "examples" / "twincat", tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_objects_of_twincat_are_checked_with_their_project_and_not_changed(twincat: Path) -> None:
    async def talk(editor: Editor) -> None:
        name = "FB_Conveyor.TcPOU"
        editor.replace(name, (15, 3), (15, 14), "fbRunsOff.Q")
        await editor.codes(name, ["S0201"])
        assert editor.diagnostics[editor.uri(name)][0].range.start == types.Position(15, 3)
        editor.replace(name, (15, 3), (15, 14), "fbRunsOut.Q")
        await editor.codes(name, [])
        uri = editor.at(name, 0, 0)["text_document"]
        symbols = await editor.text_document_document_symbol_async(types.DocumentSymbolParams(uri))
        assert symbols is not None
        block = symbols[0]
        assert isinstance(block, types.DocumentSymbol) and (block.name, block.selection_range.start) == (
            "FB_Conveyor", types.Position(4, 15))  # fmt: skip
        shown = await editor.text_document_hover_async(types.HoverParams(**editor.at(name, 16, 6)))
        assert shown is not None and "I_Drive" in str(shown.contents)
        found = await editor.text_document_definition_async(types.DefinitionParams(**editor.at(name, 16, 14)))
        assert isinstance(found, types.Location) and found.uri.endswith("Drives/I_Drive.TcIO")
        assert await editor.text_document_prepare_rename_async(types.PrepareRenameParams(**editor.at(name, 16, 6))) is None
        assert not await editor.text_document_formatting_async(types.DocumentFormattingParams(
            uri, types.FormattingOptions(4, True)))  # fmt: skip
        with pytest.raises(JsonRpcException, match=r"FB_Conveyor.TcPOU uses the name, which another tool writes"):
            await editor.text_document_rename_async(types.RenameParams(**editor.at(name, 16, 6), new_name="motor"))

    conversation(twincat, talk, "FB_Conveyor.TcPOU")


def test_a_project_of_twincat_tells_of_what_it_cannot_read(twincat: Path) -> None:
    async def talk(editor: Editor) -> None:
        await editor.codes("Conveyor.plcproj", ["X0501"])
        assert "FB_Motor.TcPOU cannot be read" in editor.diagnostics[editor.uri("Conveyor.plcproj")][0].message

    (twincat / "Drives" / "FB_Motor.TcPOU").unlink()
    conversation(twincat, talk, "Conveyor.plcproj")


def test_a_project_of_cx_programmer_has_diagnostics_at_their_places_symbols_and_hover(tmp_path: Path) -> None:
    async def talk(editor: Editor) -> None:
        name = "line3.cxt"
        uri = editor.at(name, 0, 0)["text_document"]
        symbols = await editor.text_document_document_symbol_async(types.DocumentSymbolParams(uri))
        assert symbols is not None and {"NewProgram1", "DOUBLE"} <= {each.name for each in symbols}
        await editor.codes(name, ["S0290"])
        lines = SAMPLE.text.splitlines()
        unused = editor.diagnostics[uri.uri][0]
        assert lines[unused.range.start.line] == "   Helper,,BOOL,,A,;"
        assert unused.message.startswith("program NewProgram1, symbol Helper: ")
        section = next(each for each in symbols if each.name == "NewProgram1")
        assert lines[section.range.start.line].strip() == "Program[0]:="
        line = next(number for number, each in enumerate(lines) if "LD Start_PB" in each)
        for word, said in (("Start_PB", "start button"), ("LD", "Begins a block with a bit")):
            shown = await editor.text_document_hover_async(types.HoverParams(**editor.at(name, line, lines[line].index(word))))
            assert shown is not None and said in str(shown.contents)

    (tmp_path / "line3.cxt").write_bytes(SAMPLE.bytes())
    conversation(tmp_path, talk, "line3.cxt")


def test_a_mistake_in_a_rung_is_shown_at_its_step_and_of_a_compressed_project_in_words(tmp_path: Path) -> None:
    rungs = "LD Start_PB\nOUT 100.00", "LD Start_PB\nOUT Pmp"
    project = Cxt(symbols=("Start_PB,0.00,BOOL,,,",), sections=(("Pumping", rungs),))
    where = "program NewProgram1, section Pumping, rung 1, step 2 (OUT Pmp): "

    async def talk(editor: Editor) -> None:
        editor.open("line3.cxt")
        editor.open("line4.cxp", "")
        for name, line, column in (("line3.cxt", project.text.splitlines().index("OUT Pmp"), 4), ("line4.cxp", 0, 0)):
            await editor.codes(name, ["S0201"])
            told = editor.diagnostics[editor.uri(name)][0]
            assert told.range.start == types.Position(line, column) and told.message.startswith(where)

    (tmp_path / "line3.cxt").write_bytes(project.bytes())
    (tmp_path / "line4.cxp").write_bytes(compress(project.bytes()))

    conversation(tmp_path, talk)
