"""A text is formatted to its first and last blank; calls and words are looked for in the program that has them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from in_process import PUMP, Desk, span, talk
from lsprotocol.types import Location, Position, Range, TextEdit
from rows import each_of

from fbvm.analysis.completion import Item
from fbvm.analysis.parts import File
from fbvm.base.diagnostics import Source
from fbvm.interchange.imported import Place
from fbvm.lsp import editing, navigation
from fbvm.lsp.foreign import narrowed

pytestmark = pytest.mark.slow  # pygls and the protocol take their time to be imported

OPTIONS = {"tabSize": 4, "insertSpaces": True}
WELL = "PROGRAM Main\nVAR\n    n : INT;\nEND_VAR\n    n := 1;\nEND_PROGRAM\n"


def test_blank_lines_around_a_whole_text_go(tmp_path: Path) -> None:
    async def about(desk: Desk) -> None:
        desk.open("main.st", WELL)
        assert await desk.of("formatting", "main.st", options=OPTIONS) == []
        for lead, tail, at, wanted in (("\n\n", "", span(0, 0, 2, 0), ""), ("", "\n\n", span(6, 0, 8, 0), ""),
                                       ("  ", "", span(0, 0, 0, 2), "")):  # fmt: skip
            desk.open("main.st", lead + WELL + tail)
            [edit] = await desk.of("formatting", "main.st", options=OPTIONS)
            assert (edit["range"], edit["newText"]) == (at, wanted)
            part = await desk.of("rangeFormatting", "main.st", options=OPTIONS, range=span(0, 0, 8, 0))
            assert part == [], "what stands around the declarations stays when a part is formatted"
            desk.close_file("main.st")

    talk(tmp_path, about)


def test_what_is_chosen_is_formatted_and_its_neighbours_are_not(tmp_path: Path) -> None:
    """Also if whole lines are chosen, up to the first character of the next declaration; at an edge the one behind it."""
    bad, good = "PROGRAM {}\nVAR n:INT; END_VAR\nEND_PROGRAM\n", "PROGRAM {}\nVAR\n    n : INT;\nEND_VAR\nEND_PROGRAM\n"
    rows = [((0, 0, 3, 0), "A"), ((3, 0, 6, 0), "B"), ((6, 0, 10, 0), "C"), ((0, 0, 3, 1), "AB"), ((2, 10, 7, 1), "ABC"),
            ((0, 0, 0, 0), "A"), ((3, 0, 3, 0), "B"), ((5, 11, 5, 11), "B"), ((2, 11, 3, 0), "A"), ((7, 3, 8, 2), "C"),
            ((9, 11, 10, 0), "C"), ((10, 0, 10, 0), "C"), ((11, 0, 12, 0), "C"), ((0, 0, 10, 0), "ABC")]  # fmt: skip

    async def about(desk: Desk) -> None:
        for places, names in rows:
            texts = [bad.format("A"), bad.format("B"), "\n" + bad.format("C")]
            desk.open("main.st", "".join(texts))
            [edit] = await desk.of("rangeFormatting", "main.st", options=OPTIONS, range=span(*places))
            desk.replace("main.st", *((at["line"], at["character"]) for at in edit["range"].values()), edit["newText"])
            wanted = [text.replace(bad.format(name), (good if name in names else bad).format(name))
                      for name, text in zip("ABC", texts, strict=True)]  # fmt: skip
            [file] = [file for project in desk.server.projects.all for file in project.program.files.values()]
            assert file.text == ("\n" * ("AB" in names)).join(wanted[:2]) + wanted[2], places
            desk.close_file("main.st")
        desk.open("main.st", "")
        assert await desk.of("rangeFormatting", "main.st", options=OPTIONS, range=span(0, 0, 0, 0)) == []

    talk(tmp_path, about)


def test_calls_are_looked_for_in_the_program_that_has_the_block(tmp_path: Path) -> None:
    for name, call in (("one", "p"), ("other", "q")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "Pump.st").write_text(PUMP.replace("Pump", f"Pump_{name}"), encoding="utf-8")
        (tmp_path / name / "main.st").write_text(
            f"PROGRAM Main_{name}\nVAR {call} : Pump_{name}; END_VAR\n    {call}(Level := 1);\nEND_PROGRAM\n", encoding="utf-8")

    async def about(desk: Desk) -> None:
        await desk.checked()
        for name in ("one", "other"):
            [pump] = await desk.at("prepareCallHierarchy", f"{name}/main.st", 1, 10)
            assert pump["name"] == f"Pump_{name}"
            [incoming] = await desk.ask("callHierarchy/incomingCalls", item=pump)
            assert (incoming["from"]["name"], incoming["from"]["uri"]) == (f"Main_{name}", desk.uri(f"{name}/main.st"))
            [main] = await desk.at("prepareCallHierarchy", f"{name}/main.st", 0, 9)
            [outgoing] = await desk.ask("callHierarchy/outgoingCalls", item=main)
            assert (outgoing["to"]["name"], outgoing["fromRanges"]) == (f"Pump_{name}", [span(2, 4, 2, 17)])

    talk(tmp_path, about, "one/main.st", "other/main.st")


def test_a_word_is_looked_for_in_a_place_of_a_container() -> None:
    document = Source("x.cxt", "  n0  LD In, Run  Out")
    for text, wanted in (("LD", (6, 8)), ("In", (9, 11)), ("Out", (18, 21)), ("n", (4, 21)), ("Ru", (4, 21)), ("  ", (4, 21)),
                         ("", (4, 21)), ("LD\nIn", (4, 21)), ("In,", (9, 12)), ("(", (4, 21))):  # fmt: skip
        place = Place(document, 4, 21, "somewhere")
        assert narrowed(place, text) == wanted, text


def test_what_is_said_of_a_damaged_object_of_twincat_goes_when_it_is_mended(tmp_path: Path) -> None:
    good = ('<?xml version="1.0" encoding="utf-8"?>\n<TcPlcObject Version="1.1.0.1">\n<DUT Name="Kind" Id="{1}">\n'
            "<Declaration><![CDATA[TYPE Kind : (One, Two); END_TYPE\n]]></Declaration>\n</DUT>\n</TcPlcObject>\n")  # fmt: skip
    (tmp_path / "Kind.TcDUT").write_text(good.replace("<TcPlcObject", "<TcPlcObjekt"), encoding="utf-8")

    async def about(desk: Desk) -> None:
        for damaged in ("<TcPlcObjekt", "<TcObject"):
            await desk.shows("Kind.TcDUT", "X0101")
            desk.replace("Kind.TcDUT", (1, 0), (1, 12), "<TcPlcObject")
            await desk.shows("Kind.TcDUT")
            [kind] = await desk.of("documentSymbol", "Kind.TcDUT")
            assert kind["name"] == "Kind"
            desk.replace("Kind.TcDUT", (1, 0), (1, 12), damaged)
        await desk.shows("Kind.TcDUT", "X0101")
        assert await desk.of("documentSymbol", "Kind.TcDUT") == []
        projects = desk.server.projects
        assert projects.forget_regrouped(tmp_path / "Kind.TcDUT") == [], "it consists of the same files as before"

    talk(tmp_path, about, "Kind.TcDUT")


@each_of("text, offset, replaced", [("%Q", 2, (0, 2)), ("x:=%QX0.", 8, (3, 8)), ("%", 1, (0, 1)), ("a %M_1", 6, (2, 6))])
def test_an_address_replaces_its_beginning(text: str, offset: int, replaced: tuple[int, int]) -> None:
    server: Any = SimpleNamespace(positions=lambda source: SimpleNamespace(range=lambda start, end: (start, end)))
    edit = editing._item(server, File("x.st", text), offset, Item("%QX0.0", "address")).text_edit
    assert edit == TextEdit(replaced, "%QX0.0")  # type: ignore[arg-type]


def test_a_declaration_whose_text_is_no_longer_there_has_no_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source("Ton.st", "x TON")
    declared: Any = SimpleNamespace(source=source, node=SimpleNamespace(start=2, end=5), name="TON",
                                    pou=SimpleNamespace(kind="FUNCTION_BLOCK"))
    paths: list[Path | None] = [None, tmp_path / "Ton.st"]
    checked = SimpleNamespace(checker=None, project=SimpleNamespace(libraries=SimpleNamespace(path=lambda source: paths[0])))
    program: Any = SimpleNamespace(place=lambda source: None, checked=None)
    server: Any = SimpleNamespace(uri=lambda path: path.name, positions=lambda source: SimpleNamespace(
        range=lambda start, end: Range(Position(0, start), Position(0, end))))  # fmt: skip
    monkeypatch.setattr(navigation, "find", lambda checker, key: declared if key else None)
    assert navigation.declared_location(server, program, declared) is None
    assert navigation._item(server, program, ("pou",)) is None
    program.checked = checked
    assert navigation._item(server, program, ("pou",)) is None
    paths.reverse()
    assert navigation.declared_location(server, program, declared) == Location("Ton.st", Range(Position(0, 2), Position(0, 5)))
    item = navigation._item(server, program, ("pou", "", "TON"))
    assert item is not None and (item.name, item.detail, item.data) == ("TON", "FUNCTION_BLOCK", ["pou", "", "TON"])
    assert navigation._item(server, program, ()) is None  # type: ignore[arg-type]
