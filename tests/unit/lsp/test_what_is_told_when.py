"""When diagnostics come, under which names of files, and in which units."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from in_process import PUMP, Desk, span, talk
from pygls.exceptions import JsonRpcInvalidParams
from pygls.protocol import JsonRPCProtocol

from fbvm.lsp import server as server_module
from fbvm.lsp.projects import Settings
from fbvm.lsp.server import Server

pytestmark = pytest.mark.slow  # pygls and the protocol take their time to be imported

MAIN = "PROGRAM Main\nVAR p : Pump; w : WSTRING; END_VAR\n    w := \"\U0001f600\"; p(Level := 1);\nEND_PROGRAM\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "main.st").write_text(MAIN, encoding="utf-8")
    (tmp_path / "Pump.st").write_text(PUMP, encoding="utf-8")
    return tmp_path


def test_a_file_has_the_name_that_the_editor_gives_it(folder: Path) -> None:
    said = folder.as_uri() + "/P%75mp.st"

    async def about(desk: Desk) -> None:
        desk.notify("textDocument/didOpen", textDocument={"uri": said, "languageId": "iecst", "version": 1, "text": PUMP.replace(
            "200", "'a'")})  # fmt: skip
        await desk.until(lambda: bool(desk.told.get(said)))
        assert (await desk.at("definition", "main.st", 1, 9))["uri"] == said
        desk.notify("textDocument/didClose", textDocument={"uri": said})
        await desk.checked()
        assert (await desk.at("definition", "main.st", 1, 9))["uri"] == desk.uri("Pump.st")
        assert desk.uri("Pump.st") not in desk.told, "the disk has no mistake"

    talk(folder, about, "main.st")


@pytest.mark.parametrize(("units", "column"), [("utf-8", 17), ("utf-16", 15), ("utf-32", 14)])
def test_columns_are_in_the_units_that_the_editor_has_asked_for(folder: Path, units: str, column: int) -> None:
    async def about(desk: Desk) -> None:
        assert (await desk.at("hover", "main.st", 2, column))["range"] == span(2, column, 2, column + 1)

    talk(folder, about, "main.st", capabilities={"general": {"positionEncodings": [units]}})


def test_mistakes_of_a_key_come_first_and_warnings_when_nobody_types(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def about(desk: Desk) -> None:
        await desk.checked()
        assert desk.told == {}
        monkeypatch.setattr(server_module, "QUIET_S", 30)
        desk.replace("main.st", (2, 4), (2, 5), "v")
        await desk.shows("main.st", "S0201")
        [project] = desk.server.projects.all
        task = project.task
        assert isinstance(task, asyncio.Task) and not task.done(), "it waits until nobody types"
        monkeypatch.setattr(server_module, "QUIET_S", 0)
        desk.replace("main.st", (2, 4), (2, 15), "p.Level := 1; ;")
        await desk.checked()
        assert task.cancelled() and desk.codes("main.st") == ["S0290"], desk.told

    talk(folder, about, "main.st")


def test_what_has_not_changed_is_not_told_again(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        desk.replace("main.st", (2, 4), (2, 5), "v")
        await desk.shows("main.st", "S0201")
        await desk.checked()
        before = list(desk.tellings)
        desk.replace("main.st", (3, 11), (3, 11), " // said")
        await desk.checked()
        assert desk.tellings == before and list(desk.server.told) == [desk.uri("main.st")]

    talk(folder, about, "main.st")


def test_a_file_of_two_programs_has_the_mistakes_of_both_each_once(folder: Path) -> None:
    (folder / "both.st").write_text(
        "FUNCTION_BLOCK Both\nVAR a : One_only; b : Two_only; c : Nobodys; END_VAR\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    for name in ("One_only", "Two_only"):
        (folder / f"{name}.st").write_text(f"TYPE {name} : INT; END_TYPE\n", encoding="utf-8")
    toml = "".join(f'[plc.{name}]\nsources = ["{name}_only.st", "both.st"]\n' for name in ("One", "Two"))
    (folder / "fbvm.toml").write_text(toml, encoding="utf-8")

    async def about(desk: Desk) -> None:
        await desk.checked()
        assert [each["range"]["start"]["character"] for each in desk.told[desk.uri("both.st")]] == [22, 36, 8]
        desk.written("fbvm.toml", toml.partition("[plc.Two]")[0])
        await desk.checked()
        assert [each["range"]["start"]["character"] for each in desk.told[desk.uri("both.st")]] == [22, 36]

    talk(folder, about, "both.st")


def test_settings_that_change_begin_everything_anew(folder: Path) -> None:
    async def about(desk: Desk) -> None:
        await desk.checked()
        [before] = desk.server.projects.all
        desk.notify("workspace/didChangeConfiguration", settings={"dialect": "codesys"})
        [after] = desk.server.projects.all
        assert after is not before and desk.server.projects.settings == Settings("codesys")
        assert isinstance(before.task, asyncio.Task) and isinstance(after.task, asyncio.Task)
        await desk.checked()
        assert after.program.checked is not None and desk.told == {}

    talk(folder, about, "main.st")


def test_a_refusal_is_no_fault_that_is_logged(monkeypatch: pytest.MonkeyPatch) -> None:
    logger = logging.getLogger(JsonRPCProtocol.__module__)
    monkeypatch.setattr(logger, "filters", [])
    Server("1")
    for error, is_logged in ((JsonRpcInvalidParams("no"), False), (ValueError("a fault"), True), (None, True)):
        record = logging.LogRecord("x", logging.ERROR, "x", 1, "said", None, (type(error), error, None) if error else None)  # type: ignore[arg-type]
        assert bool(logger.filter(record)) is is_logged, error


@pytest.mark.parametrize(("is_current", "is_small", "is_going", "done"), [
    (True, True, True, []), (False, True, True, ["changes"]), (False, False, True, ["changes", "wait"]),
    (False, False, False, ["changes", "all"]),
])  # fmt: skip
def test_an_answer_waits_for_no_more_than_what_has_changed(
    is_current: bool, is_small: bool, is_going: bool, done: list[str]
) -> None:
    """Of a small change for its POU, of another one for the check that goes on, else for a check of everything."""
    seen: list[str] = []
    file = object()
    program: Any = SimpleNamespace(is_current=is_current, files={"/a.st": file})
    program.check_changes = lambda: seen.append("changes") or is_small
    program.check_all = lambda: seen.append("all") or setattr(program, "is_current", True)

    async def asked() -> None:
        async def check() -> None:
            seen.append("wait")
            program.is_current = True
        project = SimpleNamespace(program=program, task=asyncio.ensure_future(check()) if is_going else None)
        server: Any = SimpleNamespace(projects=SimpleNamespace(of=lambda path: [project]))
        assert await Server.ready(server, "file:///a.st") == (project, file) and seen == done
        assert await Server.ready(server, "file:///b.st") is None

    asyncio.run(asked())
