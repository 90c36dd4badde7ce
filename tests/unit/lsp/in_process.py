"""The server in this process: an editor's messages in, answers and notifications out, as they are on the wire."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from fbvm.lsp import server as server_module
from fbvm.lsp.features import server
from fbvm.lsp.server import Server

WAIT_S = 30
PUMP = """\
FUNCTION_BLOCK Pump // moves water
VAR_INPUT Level : INT; END_VAR
VAR_OUTPUT Runs : BOOL; END_VAR
    Runs := Level < 200;
END_FUNCTION_BLOCK
"""


class Desk:
    """An editor over the messages of a server: what was answered by the number of the request, what was told of by URI."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.server: Server = server("1")
        self.server.protocol.set_writer(self, include_headers=False)
        self.asked: list[dict[str, Any]] = []
        """Requests of the server."""
        self.told: dict[str, list[dict[str, Any]]] = {}
        self.tellings: list[str] = []
        """URIs in the order in which diagnostics came."""
        self._answers: dict[int, dict[str, Any]] = {}
        self._last = 0
        self._versions: dict[str, int] = {}
        self._news = asyncio.Event()

    def write(self, data: bytes) -> None:
        """Take a message of the server."""
        message = json.loads(data)
        if message.get("method") == "textDocument/publishDiagnostics":
            self.told[message["params"]["uri"]] = message["params"]["diagnostics"]
            self.tellings.append(message["params"]["uri"])
        elif "method" in message:
            self.asked.append(message)
        else:
            self._answers[message["id"]] = message
        self._news.set()

    def close(self) -> None:
        """Nothing is open."""

    def uri(self, name: str) -> str:
        return (self.folder / name).as_uri()

    def notify(self, method: str, **params: Any) -> None:
        protocol = self.server.protocol
        protocol.handle_message(protocol.structure_message({"jsonrpc": "2.0", "method": method, "params": params}))

    async def until(self, done: Callable[[], bool]) -> None:
        async def wait() -> None:
            while not done():
                self._news.clear()
                await self._news.wait()
        await asyncio.wait_for(wait(), WAIT_S)

    async def answer(self, method: str, **params: Any) -> dict[str, Any]:
        """The whole answer to a request: `result`, or `error`."""
        self._last += 1
        number = self._last
        protocol = self.server.protocol
        protocol.handle_message(protocol.structure_message(
            {"jsonrpc": "2.0", "id": number, "method": method, "params": params}))
        await self.until(lambda: number in self._answers)
        return self._answers.pop(number)

    async def ask(self, method: str, **params: Any) -> Any:
        """The result of a request that is not refused."""
        answer = await self.answer(method, **params)
        assert "error" not in answer, answer
        return answer.get("result")

    async def at(self, method: str, name: str, line: int, character: int, **more: Any) -> Any:
        """The result of `textDocument/METHOD` at a place of a file."""
        return await self.ask(f"textDocument/{method}", textDocument={"uri": self.uri(name)},
                              position={"line": line, "character": character}, **more)

    async def of(self, method: str, name: str, **more: Any) -> Any:
        """The result of `textDocument/METHOD` for a file."""
        return await self.ask(f"textDocument/{method}", textDocument={"uri": self.uri(name)}, **more)

    def open(self, name: str, text: str | None = None) -> None:
        text = (self.folder / name).read_text(encoding="utf-8") if text is None else text
        self._versions[name] = 1
        self.notify("textDocument/didOpen", textDocument={
            "uri": self.uri(name), "languageId": "iecst", "version": 1, "text": text})

    def replace(self, name: str, start: tuple[int, int], end: tuple[int, int], text: str) -> None:
        self._versions[name] += 1
        self.notify("textDocument/didChange", textDocument={"uri": self.uri(name), "version": self._versions[name]},
                    contentChanges=[{"range": span(*start, *end), "text": text}])

    def close_file(self, name: str) -> None:
        self.notify("textDocument/didClose", textDocument={"uri": self.uri(name)})

    def written(self, name: str, text: str | None) -> None:
        """Somebody writes a file of the disk, None: removes it."""
        path, kind = self.folder / name, 2 if (self.folder / name).exists() else 1
        if text is None:
            path.unlink()
            kind = 3
        else:
            path.write_text(text, encoding="utf-8")
        self.notify("workspace/didChangeWatchedFiles", changes=[{"uri": self.uri(name), "type": kind}])

    def codes(self, name: str) -> list[str]:
        """The codes of the diagnostics that are shown in a file."""
        return [each["code"] for each in self.told.get(self.uri(name), [])]

    async def shows(self, name: str, *codes: str) -> None:
        """Wait until a file shows these diagnostics."""
        await self.until(lambda: self.codes(name) == list(codes))

    async def checked(self) -> None:
        """Wait until everything is checked."""
        while tasks := [each.task for each in self.server.projects.all
                        if isinstance(each.task, asyncio.Task) and not each.task.done()]:  # fmt: skip
            await asyncio.wait_for(asyncio.wait(tasks), WAIT_S)


def span(line: int, character: int, end_line: int, end_character: int) -> dict[str, dict[str, int]]:
    """A range of the protocol."""
    return {"start": {"line": line, "character": character}, "end": {"line": end_line, "character": end_character}}


def talk(folder: Path, about: Callable[[Desk], Awaitable[None]], *names: str, capabilities: dict[str, Any] | None = None,
         settings: Any = None) -> None:
    """Begin as an editor does, open files, talk; no check waits for somebody who types."""
    async def all_of_it() -> None:
        desk = Desk(folder)
        begun = await desk.answer("initialize", capabilities=capabilities or {}, processId=None, rootUri=folder.as_uri(),
                                  initializationOptions=settings)
        assert begun["result"]["serverInfo"] == {"name": "fbvm", "version": "1"}
        desk.notify("initialized")
        for name in names:
            desk.open(name)
        try:
            await about(desk)
        finally:
            desk.server.shutdown()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server_module, "AFTER_KEY_S", 0)
        patch.setattr(server_module, "QUIET_S", 0)
        asyncio.run(all_of_it())
