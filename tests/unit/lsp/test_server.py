"""The server as an editor has it: a process, the protocol, one conversation for each subject."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from in_process import PUMP
from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.client import LanguageClient

pytestmark = pytest.mark.slow

MAIN = """\
PROGRAM Main
VAR P1 : Pump; On AT %QX0.0 : BOOL; s : WSTRING; END_VAR
    s := "\U0001f600"; P1(Level := 100);
    On := P1.Runs;
END_PROGRAM
"""
WAIT_S = 60


class Editor(LanguageClient):
    """A client that keeps the diagnostics that it is told."""

    def __init__(self, folder: Path) -> None:
        super().__init__("editor", "1")
        self.folder = folder
        self.versions: dict[str, int] = {}
        self.diagnostics: dict[str, list[types.Diagnostic]] = {}
        self.told = asyncio.Event()

        @self.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def published(params: types.PublishDiagnosticsParams) -> None:
            self.diagnostics[params.uri] = list(params.diagnostics)
            self.told.set()

    def uri(self, name: str) -> str:
        return (self.folder / name).as_uri()

    def open(self, name: str, text: str | None = None) -> None:
        text = (self.folder / name).read_text(encoding="utf-8") if text is None else text
        self.versions[name] = 1
        self.text_document_did_open(types.DidOpenTextDocumentParams(types.TextDocumentItem(self.uri(name), "iecst", 1, text)))

    def replace(self, name: str, start: tuple[int, int], end: tuple[int, int], text: str) -> None:
        self.versions[name] += 1
        change = types.TextDocumentContentChangePartial(types.Range(types.Position(*start), types.Position(*end)), text)
        self.text_document_did_change(types.DidChangeTextDocumentParams(
            types.VersionedTextDocumentIdentifier(uri=self.uri(name), version=self.versions[name]), [change]))

    def watched(self, name: str, change: types.FileChangeType) -> None:
        self.workspace_did_change_watched_files(types.DidChangeWatchedFilesParams([types.FileEvent(self.uri(name), change)]))

    async def codes(self, name: str, wanted: list[str]) -> None:
        """Wait until a file has these diagnostics."""
        async def wait() -> None:
            while [str(each.code) for each in self.diagnostics.get(self.uri(name), [])] != wanted:
                self.told.clear()
                await self.told.wait()
        await asyncio.wait_for(wait(), WAIT_S)

    def at(self, name: str, line: int, character: int) -> dict[str, Any]:
        return {"text_document": types.TextDocumentIdentifier(self.uri(name)), "position": types.Position(line, character)}


BEGIN: dict[str, Any] = {"id": 1, "method": "initialize", "params": {"capabilities": {}, "processId": None, "rootUri": None}}
END: tuple[dict[str, Any], ...] = ({"id": 2, "method": "shutdown"}, {"method": "exit"})
LSP = [sys.executable, "-m", "fbvm", "lsp"]


def encoded(*messages: dict[str, Any]) -> bytes:
    bodies = [json.dumps({"jsonrpc": "2.0", **message}).encode() for message in messages]
    return b"".join(b"Content-Length: %d\r\n\r\n" % len(body) + body for body in bodies)


def conversation(folder: Path, talk: Callable[[Editor], Awaitable[None]], *names: str) -> None:
    """Start a server, open files, talk, and end it as an editor does."""
    async def all_of_it() -> None:
        editor = Editor(folder)
        await editor.start_io(sys.executable, "-m", "fbvm", "lsp")
        try:
            await asyncio.wait_for(editor.initialize_async(types.InitializeParams(
                capabilities=types.ClientCapabilities(), root_uri=folder.as_uri())), WAIT_S)
            editor.initialized(types.InitializedParams())
            for name in names:
                editor.open(name)
            await asyncio.wait_for(talk(editor), WAIT_S)
            await asyncio.wait_for(editor.shutdown_async(None), WAIT_S)
        finally:
            editor.exit(None)
            await editor.stop()

    asyncio.run(all_of_it())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "Pump.st").write_text(PUMP, encoding="utf-8")
    (tmp_path / "main.st").write_text(MAIN, encoding="utf-8")
    (tmp_path / "other.st").write_text("PROGRAM Main\nEND_PROGRAM\n", encoding="utf-8")
    return tmp_path


def test_a_mistake_is_told_while_one_types_and_goes_when_it_is_mended(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        editor.replace("main.st", (3, 13), (3, 17), "Run")
        await editor.codes("main.st", ["S0210"])
        place = editor.diagnostics[editor.uri("main.st")][0].range
        assert (place.start, place.end) == (types.Position(3, 13), types.Position(3, 16))
        editor.replace("main.st", (3, 13), (3, 16), "Runs")
        await editor.codes("main.st", [])

    conversation(folder, talk, "main.st")


def test_unsaved_text_of_another_file_counts(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        editor.replace("Pump.st", (1, 10), (1, 15), "Height")
        await editor.codes("main.st", ["S0402"])
        await editor.codes("Pump.st", ["S0201"])

    conversation(folder, talk, "main.st", "Pump.st")


def test_places_count_utf_16_units(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        found = await editor.text_document_hover_async(types.HoverParams(**editor.at("main.st", 2, 15)))
        assert found is not None and found.range is not None
        assert found.range.start == types.Position(2, 15)
        assert "VAR P1 : Pump" in str(found.contents)

    conversation(folder, talk, "main.st")


def test_names_lead_to_files_and_are_renamed_in_all_of_them(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        found = await editor.text_document_definition_async(types.DefinitionParams(**editor.at("main.st", 1, 11)))
        assert isinstance(found, types.Location)
        assert (found.uri, found.range.start) == (editor.uri("Pump.st"), types.Position(0, 15))
        places = await editor.text_document_references_async(types.ReferenceParams(
            context=types.ReferenceContext(True), **editor.at("main.st", 1, 11)))
        assert len(places or []) == 2
        edit = await editor.text_document_rename_async(types.RenameParams(new_name="Motor", **editor.at("main.st", 1, 11)))
        assert edit is not None and edit.changes is not None
        assert {uri: [change.new_text for change in changes] for uri, changes in edit.changes.items()} == {
            editor.uri("Pump.st"): ["Motor"], editor.uri("main.st"): ["Motor"]}
        with pytest.raises(JsonRpcException, match="`IF` is a word of the language"):
            await editor.text_document_rename_async(types.RenameParams(new_name="IF", **editor.at("main.st", 1, 11)))

    conversation(folder, talk, "main.st")


def test_completion_signature_and_quick_fix(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        editor.replace("main.st", (3, 13), (3, 17), "Run")
        offered = await editor.text_document_completion_async(types.CompletionParams(**editor.at("main.st", 3, 13)))
        assert isinstance(offered, types.CompletionList)
        assert [item.label for item in offered.items] == ["Level", "Runs"]
        shown = await editor.text_document_signature_help_async(types.SignatureHelpParams(**editor.at("main.st", 2, 21)))
        assert shown is not None
        assert shown.signatures[0].label == "Pump(Level := INT, Runs => BOOL)"
        await editor.codes("main.st", ["S0210"])
        wrong = editor.diagnostics[editor.uri("main.st")]
        actions = await editor.text_document_code_action_async(types.CodeActionParams(
            types.TextDocumentIdentifier(editor.uri("main.st")), wrong[0].range, types.CodeActionContext(wrong)))
        assert [(action.title, action.is_preferred) for action in actions or [] if isinstance(action, types.CodeAction)] == [
            ("Write Runs", True)]

    conversation(folder, talk, "main.st")


def test_what_a_file_holds_and_how_it_looks(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        document = types.TextDocumentIdentifier(editor.uri("main.st"))
        symbols = await editor.text_document_document_symbol_async(types.DocumentSymbolParams(document))
        assert [(each.name, [inner.name for inner in each.children or []]) for each in symbols or []
                if isinstance(each, types.DocumentSymbol)] == [("Main", ["P1", "On", "s"])]
        tokens = await editor.text_document_semantic_tokens_full_async(types.SemanticTokensParams(document))
        assert tokens is not None and len(tokens.data) == 5 * 12
        folds = await editor.text_document_folding_range_async(types.FoldingRangeParams(document))
        assert [(each.start_line, each.end_line) for each in folds or []] == [(0, 4)]
        whole = types.Range(types.Position(0, 0), types.Position(5, 0))
        hints = await editor.text_document_inlay_hint_async(types.InlayHintParams(document, whole))
        assert [(each.label, each.position.line) for each in hints or []] == [("%QX0.0", 3)]
        lenses = await editor.text_document_code_lens_async(types.CodeLensParams(document))
        assert [each.command.command for each in lenses or [] if each.command] == ["fbvm.run", "fbvm.debug", "fbvm.chart"]
        edits = await editor.text_document_formatting_async(types.DocumentFormattingParams(
            document, types.FormattingOptions(4, True)))
        assert len(edits or []) == 1
        items = await editor.text_document_prepare_call_hierarchy_async(
            types.CallHierarchyPrepareParams(**editor.at("main.st", 0, 9)))
        outgoing = await editor.call_hierarchy_outgoing_calls_async(types.CallHierarchyOutgoingCallsParams((items or [])[0]))
        assert [each.to.name for each in outgoing or []] == ["Pump"]
        found = await editor.workspace_symbol_async(types.WorkspaceSymbolParams("runs"))
        assert [(each.name, each.container_name) for each in found or []] == [("Runs", "Pump")]

    conversation(folder, talk, "main.st")


def test_a_project_file_says_what_belongs_together_and_has_mistakes_of_its_own(folder: Path) -> None:
    (folder / "fbvm.toml").write_text('[plc.pump]\nsources = ["main.st", "Pump.st"]\ncycle = "10ms"\n', encoding="utf-8")

    async def talk(editor: Editor) -> None:
        await editor.codes("fbvm.toml", [])
        editor.replace("fbvm.toml", (2, 0), (2, 5), "cicle")
        await editor.codes("fbvm.toml", ["P0102"])
        editor.replace("fbvm.toml", (2, 0), (2, 5), "dialect")
        offered = await editor.text_document_completion_async(types.CompletionParams(**editor.at("fbvm.toml", 2, 10)))
        assert isinstance(offered, types.CompletionList)
        assert "codesys" in [item.label for item in offered.items]
        editor.replace("fbvm.toml", (1, 0), (2, 20), 'sources = ["main.st"]')
        await editor.codes("fbvm.toml", [])
        await editor.codes("main.st", ["S0204"])

    conversation(folder, talk, "main.st", "fbvm.toml")


def test_files_that_come_and_go_on_disk_belong_to_the_program_or_not(folder: Path) -> None:
    pump = folder / "Pump.st"

    async def talk(editor: Editor) -> None:
        await editor.codes("main.st", [])
        pump.unlink()
        editor.watched("Pump.st", types.FileChangeType.Deleted)
        await editor.codes("main.st", ["S0204"])
        pump.write_text(PUMP.replace("Level", "Height"), encoding="utf-8")
        editor.watched("Pump.st", types.FileChangeType.Created)
        await editor.codes("main.st", ["S0402"])
        pump.write_text(PUMP, encoding="utf-8")
        editor.watched("Pump.st", types.FileChangeType.Changed)
        await editor.codes("main.st", [])

    conversation(folder, talk, "main.st")
    (folder / "fbvm.toml").write_text('[plc.pump]\nsources = ["main.st", "Pump.st"]\n', encoding="utf-8")
    conversation(folder, talk, "main.st")


def test_a_test_in_structured_text_knows_assert_and_the_blocks_that_pytest_would_find(folder: Path) -> None:
    (folder / "fbvm.toml").write_text('[plc.pump]\nsources = ["main.st", "Pump.st"]\n', encoding="utf-8")
    (folder / "src").mkdir()
    (folder / "src" / "Lamp.st").write_text(PUMP.replace("Pump", "Lamp"), encoding="utf-8")
    (folder / "tests").mkdir()
    (folder / "tests" / "test_lamp.st").write_text(
        "PROGRAM It_shines\nVAR L : Lamp; END_VAR\n    L(Level := 1);\n    ASSERT(L.Runs);\n    ASSERTS(L.Runs);\nEND_PROGRAM\n",
        encoding="utf-8")

    async def talk(editor: Editor) -> None:
        await editor.codes("tests/test_lamp.st", ["S0401"])
        assert editor.diagnostics[editor.uri("tests/test_lamp.st")][0].range.start == types.Position(4, 4)

    conversation(folder, talk, "tests/test_lamp.st")


def test_keys_that_come_faster_than_checks_end_in_the_right_diagnostics(folder: Path) -> None:
    async def talk(editor: Editor) -> None:
        for at in range(40):
            editor.replace("main.st", (3, 4 + at), (3, 4 + at), "x")
        await editor.codes("main.st", ["S0201"])
        editor.replace("main.st", (3, 4), (3, 44), "")
        await editor.codes("main.st", [])

    conversation(folder, talk, "main.st")


def test_the_end_of_a_conversation_is_the_end_of_the_process_without_a_word() -> None:
    said = encoded(BEGIN, {"method": "initialized", "params": {}}, *END)
    done = subprocess.run(LSP, input=said, capture_output=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, b"") and b'"id": 2' in done.stdout


def test_what_is_refused_is_an_answer_and_no_fault_of_the_server() -> None:
    settings = {"initializationOptions": {"dialect": {"a": 1}, "libraries": 5}}
    document = {"uri": "file:///nowhere/a.st"}
    text = "PROGRAM M VAR n : INT; END_VAR n := 1; END_PROGRAM"
    with subprocess.Popen(LSP, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0) as process:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(encoded(
            BEGIN | {"params": BEGIN["params"] | settings},
            {"method": "textDocument/didOpen", "params": {
                "textDocument": document | {"languageId": "iecst", "version": 1, "text": text}}},
            {"id": 3, "method": "textDocument/rename", "params": {
                "textDocument": document, "position": {"line": 0, "character": 14}, "newName": ""}}))  # fmt: skip
        said = b""
        while b'"id": 3' not in said:
            said += (more := process.stdout.read(1 << 16))
            assert more, said
        assert b"is no name" in said
        rest, wrong = process.communicate(encoded(*END), timeout=60)
    assert (process.returncode, wrong) == (0, b"") and b'"id": 2' in rest


def test_a_message_longer_than_any_memory_ends_the_server_with_a_sentence() -> None:
    said = encoded(BEGIN) + b"Content-Length: 99999999999999999999\r\n\r\n{}"
    done = subprocess.run(LSP, input=said, capture_output=True, check=False, timeout=60)
    assert done.returncode == 1 and done.stderr == b"Error: the editor has begun a message that is longer than any memory\n"
