"""What the server answers, question by question, in this process: `test_server.py` has it as a process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from in_process import PUMP, Desk, span, talk

HOUSE = Path(__file__).resolve().parents[3]

pytestmark = pytest.mark.slow  # pygls and the protocol take their time to be imported

MAIN = """\
PROGRAM Main
VAR P1 : Pump; On AT %QX0.0 : BOOL; s : WSTRING; m : Mode; t : TON; END_VAR
    s := "\U0001f600"; P1(Level := 100);
    On := P1.Runs;
    m := Fast; t(PT := T#1s);
    (* a
       comment *)
END_PROGRAM
TYPE Mode : (Slow, Fast); END_TYPE
"""
TEST = """\
PROGRAM It_pumps
VAR P : Pump; END_VAR
    P(Level := 1); ASSERT(P.Runs);
END_PROGRAM
"""
PUMP_NAME = ("Pump.st", 0, 15, 19)
MODE_NAME = ("main.st", 8, 5, 9)
TON_NAME = ("fblib/iec/TON.st", 2, 15, 18)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "Pump.st").write_text(PUMP, encoding="utf-8")
    (tmp_path / "main.st").write_text(MAIN, encoding="utf-8")
    (tmp_path / "test_pump.st").write_text(TEST, encoding="utf-8")
    return tmp_path


def place(desk: Desk, found: dict[str, Any] | None, key: str = "range") -> tuple[str, int, int, int] | None:
    """File, line and columns of a location, of which a name is the whole."""
    if found is None:
        return None
    start, end = found[key]["start"], found[key]["end"]
    assert start["line"] == end["line"]
    name = found["uri"].removeprefix(desk.folder.as_uri() + "/").removeprefix(HOUSE.as_uri() + "/")
    return name, start["line"], start["character"], end["character"]


def test_where_names_are_declared_and_of_what_type(folder: Path) -> None:
    rows = [
        ("definition", 1, 11, PUMP_NAME), ("definition", 1, 57, MODE_NAME), ("definition", 4, 15, ("main.st", 1, 59, 60)),
        ("definition", 1, 65, TON_NAME), ("definition", 0, 0, None),
        ("typeDefinition", 2, 15, PUMP_NAME), ("typeDefinition", 4, 4, MODE_NAME), ("typeDefinition", 4, 15, TON_NAME),
        ("typeDefinition", 3, 4, None), ("typeDefinition", 0, 0, None), ("typeDefinition", 1, 11, None),
    ]  # fmt: skip

    async def about(desk: Desk) -> None:
        for method, line, character, wanted in rows:
            assert place(desk, await desk.at(method, "main.st", line, character)) == wanted, (method, line, character)

    talk(folder, about, "main.st")


def test_files_that_are_not_there_are_asked_about(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        for name in ("fbvm.toml", "gone/fbvm.toml", "gone.TcPOU", "gone.cxt"):
            assert await desk.at("hover", name, 3, 4) is None, name
        assert (await desk.at("completion", "gone/fbvm.toml", 0, 0))["isIncomplete"] is False

    talk(folder, about, "main.st")


def test_where_names_are_used(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        for declared, wanted in ((True, [("main.st", 1, 9, 13), PUMP_NAME]), (False, [("main.st", 1, 9, 13)])):
            found = await desk.at("references", "main.st", 1, 11, context={"includeDeclaration": declared})
            assert [place(desk, each) for each in found] == wanted
        assert await desk.at("references", "main.st", 0, 0, context={"includeDeclaration": True}) == []
        found = await desk.at("documentHighlight", "main.st", 3, 5)
        assert [(each["range"], each["kind"]) for each in found] == [(span(1, 15, 1, 17), 1), (span(3, 4, 3, 6), 3)]
        found = await desk.at("documentHighlight", "main.st", 1, 5)
        assert [each["kind"] for each in found] == [1, 2, 2]

    talk(folder, about, "main.st")


def test_what_can_be_renamed(folder: Path) -> None:
    rows = [(1, 5, span(1, 4, 1, 6)), (1, 11, span(1, 9, 1, 13)), (1, 16, span(1, 15, 1, 17)), (1, 65, None), (1, 31, None),
            (0, 0, None), (4, 18, None)]  # a block and a pin of a library, a standard type and a word are nobody's to rename

    async def about(desk: Desk) -> None:
        for line, character, wanted in rows:
            assert await desk.at("prepareRename", "main.st", line, character) == wanted, (line, character)
        found = await desk.at("rename", "main.st", 1, 11, newName="Motor")
        assert {uri: [(each["range"], each["newText"]) for each in edits] for uri, edits in found["changes"].items()} == {
            desk.uri("main.st"): [(span(1, 9, 1, 13), "Motor")], desk.uri("Pump.st"): [(span(0, 15, 0, 19), "Motor")]}
        found = await desk.at("rename", "main.st", 3, 5, newName="Lamp")
        assert [each["range"] for each in found["changes"][desk.uri("main.st")]] == [span(1, 15, 1, 17), span(3, 4, 3, 6)]
        refused = await desk.answer("textDocument/rename", textDocument={"uri": desk.uri("main.st")}, newName="IF",
                                    position={"line": 1, "character": 11})
        assert (refused["error"]["code"], refused["error"]["message"]) == (-32602, "`IF` is a word of the language")

    talk(folder, about, "main.st")


def test_an_address_replaces_the_sign_at_the_beginning_of_a_file_and_a_standard_function_keeps_its_name(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        desk.open("other.st", "%\nVAR_GLOBAL x AT %QX0.0 : BOOL; END_VAR\n")
        offered = (await desk.at("completion", "other.st", 0, 1))["items"]
        assert [(each["textEdit"]["newText"], each["textEdit"]["range"]) for each in offered] == [("%QX0.0", span(0, 0, 0, 1))]
        desk.replace("other.st", (0, 0), (1, 40), "FUNCTION F : INT F := ABS(1); END_FUNCTION")
        assert await desk.at("prepareRename", "other.st", 0, 9) == span(0, 9, 0, 10)
        assert await desk.at("prepareRename", "other.st", 0, 23) is None

    talk(folder, about, "main.st")


def test_who_calls_whom(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        [pump] = await desk.at("prepareCallHierarchy", "main.st", 1, 11)
        assert (pump["name"], pump["kind"], pump["detail"], place(desk, pump), pump["selectionRange"]) == (
            "Pump", 5, "FUNCTION_BLOCK", PUMP_NAME, pump["range"])
        [incoming] = await desk.ask("callHierarchy/incomingCalls", item=pump)
        assert (incoming["from"]["name"], incoming["fromRanges"]) == ("Main", [span(2, 15, 2, 31)])
        [main] = await desk.at("prepareCallHierarchy", "main.st", 0, 9)
        assert (main["kind"], main["detail"], place(desk, main)) == (2, "PROGRAM", ("main.st", 0, 8, 12))
        outgoing = await desk.ask("callHierarchy/outgoingCalls", item=main)
        assert [(place(desk, each["to"]), each["fromRanges"]) for each in outgoing] == [
            (PUMP_NAME, [span(2, 15, 2, 31)]), (TON_NAME, [span(4, 15, 4, 28)])]
        assert await desk.ask("callHierarchy/incomingCalls", item=main) == []
        assert await desk.at("prepareCallHierarchy", "main.st", 1, 40) == []
        for method in ("incomingCalls", "outgoingCalls"):
            assert await desk.ask(f"callHierarchy/{method}", item={**main, "data": ["pou", "", "GONE"]}) == []

    talk(folder, about, "main.st")


def test_hover_shows_the_declaration_at_its_word(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        found = await desk.at("hover", "main.st", 2, 15)
        assert found == {"contents": {"kind": "markdown", "value": "```st\nVAR P1 : Pump\n```"}, "range": span(2, 15, 2, 17)}
        assert await desk.at("hover", "main.st", 0, 0) is None

    talk(folder, about, "main.st")


def test_a_call_shows_its_pins_and_what_its_block_says(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        pump = await desk.at("signatureHelp", "main.st", 2, 21)
        assert pump["signatures"] == [{"label": "Pump(Level := INT, Runs => BOOL)", "activeParameter": 0,
                                       "documentation": "moves water",
                                       "parameters": [{"label": "Level := INT"}, {"label": "Runs => BOOL"}]}]
        ton = await desk.at("signatureHelp", "main.st", 4, 25)
        assert (ton["activeSignature"], ton["activeParameter"]) == (0, 1)
        assert ton["signatures"][0]["documentation"].startswith("On-delay: Q follows IN")
        assert await desk.at("signatureHelp", "main.st", 3, 4) is None

    talk(folder, about, "main.st")


async def offered(desk: Desk, line: int, character: int, label: str) -> dict[str, Any]:
    found = await desk.at("completion", "main.st", line, character)
    assert found["isIncomplete"] is False
    return next(each for each in found["items"] if each["label"] == label)  # type: ignore[no-any-return]


@pytest.mark.parametrize("snippets", [False, True])
def test_what_can_be_written_comes_with_its_kind_and_its_text(folder: Path, snippets: bool) -> None:
    async def about(desk: Desk) -> None:
        desk.replace("main.st", (3, 4), (3, 18), "On := %QX;")
        rows = [
            ((4, 4), "m", {"kind": 6, "detail": "VAR Mode", "sortText": "2m"}),
            ((4, 19), "PT :=", {"kind": 10, "insertText": "PT := " + "$0" * snippets, "insertTextFormat": 1 + snippets}),
            ((4, 4), "ABS", {"kind": 3, "insertText": "ABS($0)" if snippets else "ABS(", "insertTextFormat": 1 + snippets}),
            ((3, 13), "%QX0.0", {"kind": 18, "filterText": "%QX0.0",
                                 "textEdit": {"range": span(3, 10, 3, 13), "newText": "%QX0.0"}}),
        ]  # fmt: skip
        for (line, character), label, wanted in rows:
            item = await offered(desk, line, character, label)
            assert {name: item.get(name) for name in wanted} == wanted, item
        item = await desk.ask("completionItem/resolve", **await offered(desk, 1, 64, "TON"))
        assert item["documentation"]["kind"] == "markdown" and "On-delay" in item["documentation"]["value"]
        bare = await offered(desk, 4, 4, "m")
        assert "documentation" not in await desk.ask("completionItem/resolve", **bare)

    said = {"textDocument": {"completion": {"completionItem": {"snippetSupport": True}}}} if snippets else {}
    talk(folder, about, "main.st", capabilities=said)


def test_a_quick_fix_is_offered_where_there_is_a_mistake(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        desk.replace("main.st", (3, 13), (3, 17), "Run")
        await desk.shows("main.st", "S0210")
        wrong = desk.told[desk.uri("main.st")]

        async def actions(**context: Any) -> Any:
            return await desk.of("codeAction", "main.st", range=wrong[0]["range"], context=context)

        [fix] = await actions(diagnostics=wrong)
        assert (fix["title"], fix["kind"], fix["isPreferred"]) == ("Write Runs", "quickfix", True)
        assert fix["edit"]["changes"] == {desk.uri("main.st"): [{"range": span(3, 13, 3, 16), "newText": "Runs"}]}
        assert [each["code"] for each in fix["diagnostics"]] == ["S0210"]
        assert await actions(diagnostics=wrong, only=["quickfix"]) == await actions(diagnostics=wrong, only=[""]) == [fix]
        assert await actions(diagnostics=wrong, only=["refactor"]) == await actions(diagnostics=[]) == []

    talk(folder, about, "main.st")


def test_a_text_is_formatted_whole_or_in_part(folder: Path) -> None:
    text = "PROGRAM Main\nVAR n:INT; END_VAR\n  n:=1;\nEND_PROGRAM\n\n\nPROGRAM Other\nVAR k:INT; END_VAR\n  k:=1;\nEND_PROGRAM\n"
    options = {"tabSize": 4, "insertSpaces": True}

    def applied(before: str, edits: list[dict[str, Any]]) -> str:
        lines = before.splitlines(keepends=True)
        [edit] = edits
        places = (edit["range"]["start"], edit["range"]["end"])
        start, end = (sum(map(len, lines[:at["line"]])) + at["character"] for at in places)
        return before[:start] + str(edit["newText"]) + before[end:]

    def formatted(part: str) -> str:
        return part.replace("VAR n:INT; END_VAR", "VAR\n    n : INT;\nEND_VAR").replace("  n:=1", "    n := 1")

    async def about(desk: Desk) -> None:
        whole = applied(text, await desk.of("formatting", "two.st", options=options))
        first, second = text.split("\n\n\n")
        assert whole.startswith(formatted(first)) and "k : INT" in whole
        part = applied(text, await desk.of("rangeFormatting", "two.st", options=options, range=span(2, 0, 2, 3)))
        assert part == formatted(first) + "\n\n\n" + second
        desk.replace("two.st", (0, 0), (10, 0), whole)
        assert not await desk.of("formatting", "two.st", options=options)
        desk.replace("two.st", (0, 0), (0, 7), "PROGRAMM (")
        assert not await desk.of("formatting", "two.st", options=options)
        assert not await desk.of("formatting", "nowhere.st", options=options)

    (folder / "two.st").write_text(text, encoding="utf-8")
    talk(folder, about, "two.st")


def test_how_a_text_looks(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        data = (await desk.of("semanticTokens/full", "main.st"))["data"]
        rows = [tuple(data[at:at + 5]) for at in range(0, len(data), 5)]
        assert rows[:4] == [(0, 8, 4, 5, 1), (1, 4, 2, 0, 1), (0, 5, 4, 5, 0), (0, 6, 2, 0, 1)]
        assert rows[9:14] == [(0, 4, 3, 5, 16), (1, 4, 1, 0, 2), (0, 11, 2, 0, 0), (0, 3, 5, 1, 2), (1, 4, 2, 0, 2)]
        assert await desk.of("foldingRange", "main.st") == [
            {"startLine": 0, "endLine": 7}, {"startLine": 5, "endLine": 6, "kind": "comment"}]
        for first, last, wanted in ((0, 9, [(3, 6)]), (3, 4, [(3, 6)]), (4, 9, []), (0, 3, [])):
            hints = await desk.of("inlayHint", "main.st", range=span(first, 0, last, 0))
            assert [(each["position"]["line"], each["position"]["character"]) for each in hints] == wanted
            assert [(each["label"], each["paddingLeft"]) for each in hints] == [("%QX0.0", True)] * len(wanted)
        lenses = await desk.of("codeLens", "main.st")
        assert [(each["command"]["title"], each["command"]["command"], each["command"]["arguments"], each["range"])
                for each in lenses] == [(word.title(), f"fbvm.{word}", [desk.uri("main.st"), "Main"], span(0, 0, 0, 12))
                                        for word in ("run", "debug", "chart")]  # fmt: skip
        desk.open("test_pump.st")
        lenses = await desk.of("codeLens", "test_pump.st")
        assert [(each["command"]["title"], each["command"]["command"]) for each in lenses] == [
            ("Test", "fbvm.test"), ("Debug test", "fbvm.debugTest")]

    talk(folder, about, "main.st")


def test_what_files_hold(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        found = await desk.of("documentSymbol", "main.st")
        assert [(each["name"], each["kind"], each["range"], each["selectionRange"]) for each in found] == [
            ("Main", 2, span(0, 0, 7, 11), span(0, 8, 0, 12)), ("Mode", 23, span(8, 5, 8, 25), span(8, 5, 8, 9))]
        assert [(each["name"], each["detail"]) for each in found[0]["children"]] == [
            ("P1", "Pump (VAR)"), ("On", "BOOL (VAR)"), ("s", "WSTRING (VAR)"), ("m", "Mode (VAR)"), ("t", "TON (VAR)")]
        assert [(each["name"], each["kind"]) for each in found[1]["children"]] == [("Slow", 22), ("Fast", 22)]
        for query, wanted in (("run", [("Runs", "Pump", 13)]), ("MAIN", [("Main", None, 2)]), ("nothing", [])):
            found = await desk.ask("workspace/symbol", query=query)
            assert [(each["name"], each.get("containerName"), each["kind"]) for each in found] == wanted
        [runs] = await desk.ask("workspace/symbol", query="runs")
        assert place(desk, runs["location"]) == ("Pump.st", 2, 11, 15)

    talk(folder, about, "main.st")


def test_not_more_symbols_are_told_than_anybody_reads(folder: Path) -> None:
    names = " ".join(f"v{number} : INT;" for number in range(600))
    (folder / "many.st").write_text(f"PROGRAM Many\nVAR {names} END_VAR\nEND_PROGRAM\n", encoding="utf-8")

    async def about(desk: Desk) -> None:
        assert len(await desk.ask("workspace/symbol", query="v")) == 500

    talk(folder, about, "many.st")


def test_a_file_that_belongs_to_nothing_has_no_answers(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        for method in ("hover", "definition", "typeDefinition", "signatureHelp", "prepareRename"):
            assert await desk.at(method, "nowhere.st", 0, 0) is None, method
        assert await desk.at("rename", "nowhere.st", 0, 0, newName="x") is None
        for method in ("documentHighlight", "prepareCallHierarchy"):
            assert await desk.at(method, "nowhere.st", 0, 0) == [], method
        assert await desk.at("references", "nowhere.st", 0, 0, context={"includeDeclaration": True}) == []
        assert await desk.at("completion", "nowhere.st", 0, 0) == {"isIncomplete": False, "items": []}
        assert await desk.of("semanticTokens/full", "nowhere.st") == {"data": []}
        for method in ("foldingRange", "codeLens", "documentSymbol"):
            assert await desk.of(method, "nowhere.st") == [], method
        assert await desk.of("inlayHint", "nowhere.st", range=span(0, 0, 1, 0)) == []
        assert await desk.of("codeAction", "nowhere.st", range=span(0, 0, 1, 0), context={"diagnostics": []}) == []

    talk(folder, about)
