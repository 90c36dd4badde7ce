"""How long somebody waits in an editor, beside the longest that is wanted: python tests/bench/latencies.py.

The language server and the debugger are processes, as an editor has them; what is measured is the processor time that they take
for an answer where the system tells it (Linux), so that other work of the computer does not count, else the time that passes.
Ends with status 1 if something takes longer than is wanted."""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

BENCH = Path(__file__).resolve().parent
sys.path[:0] = [str(BENCH.parents[1]), str(BENCH)]

from debugger import program as hundred_lines  # noqa: E402
from large_text import text_of  # noqa: E402

from fbvm.dap.framing import Framer, encode  # noqa: E402

LINES, MANY_LINES, NAMES, SCANS = 5_000, 50_000, 15, 10_000
"""Lines of the two texts, how often a name is typed into the first, and scans in front of a step back."""
TYPED = "pressure_low"
"""The keys of a name."""
Message = dict[str, Any]


class Server:
    """A process that speaks in messages with a length before them, and the time that it takes."""

    def __init__(self, verb: str) -> None:
        self._process = subprocess.Popen([sys.executable, "-m", "fbvm", verb], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         bufsize=0)  # fmt: skip
        self._framer, self._folder = Framer(), tempfile.TemporaryDirectory()
        self.folder = Path(self._folder.name)
        self._waiting: list[Message] = []
        self._number = 0

    def _taken_ms(self) -> float:
        """Processor time of the process, without those that it has started."""
        told = Path(f"/proc/{self._process.pid}/schedstat")
        return int(told.read_text(encoding="ascii").split()[0]) / 1e6 if told.exists() else time.perf_counter() * 1e3

    def send(self, message: Message) -> int:
        """Sends a message; returns its number."""
        assert self._process.stdin is not None
        self._number += 1
        head = {"jsonrpc": "2.0", "id": self._number, "seq": self._number, "type": "request"}
        self._process.stdin.write(encode(head | message))
        return self._number

    def until(self, fits: Callable[[Message], bool]) -> Message:
        """The next message that fits; those in front of it are left out."""
        assert self._process.stdout is not None
        while True:
            while self._waiting:
                message = self._waiting.pop(0)
                if fits(message):
                    return message
            data = self._process.stdout.read(1 << 16)
            assert data, "the process has ended"
            self._waiting += list(self._framer.feed(data))

    def timed(self, message: Message, fits: Callable[[Message], bool] | None = None) -> tuple[float, Message]:
        """Sends a message; returns the milliseconds up to the one that fits, or to its answer, and that."""
        before = self._taken_ms()
        number = self.send(message)
        found = self.until(fits or (lambda each: number in (each.get("id"), each.get("request_seq"))))
        assert "error" not in found and found.get("success", True), found
        return self._taken_ms() - before, found

    def end(self) -> None:
        """Ends the process."""
        self._process.kill()
        with self._process:
            self._folder.cleanup()


class LanguageServer(Server):
    """`fbvm lsp` with one file."""

    def __init__(self, text: str) -> None:
        super().__init__("lsp")
        self.text, self.uri, self._version = text, (self.folder / "station.st").as_uri(), 1
        self.codes: list[str] = []
        """Of the diagnostics behind the last change."""

    def told(self, message: Message) -> bool:
        """Whether a message has diagnostics."""
        return message.get("method") == "textDocument/publishDiagnostics"

    def open(self) -> float:
        """Begins and opens the file, in which a name is wrong; returns the time from the start on."""
        self.timed({"method": "initialize", "params": {"capabilities": {}, "processId": None, "rootUri": None}})
        self._notify("initialized", {})
        wrong = self.text.replace("Sum := 0;", "Summ := 0;", 1)
        self._notify("textDocument/didOpen", {"textDocument": {
            "uri": self.uri, "languageId": "iecst", "version": 1, "text": wrong}})  # fmt: skip
        self.until(self.told)
        taken = self._taken_ms()
        self.change(self.text)
        return taken

    def change(self, text: str) -> float:
        """Gives the file another text; returns the time up to the diagnostics, which have to differ from those before."""
        self._version += 1
        taken, found = self.timed({"id": None, "method": "textDocument/didChange", "params": {
            "textDocument": {"uri": self.uri, "version": self._version}, "contentChanges": [{"text": text}]}}, self.told)
        self.codes = [str(each["code"]) for each in found["params"]["diagnostics"]]
        return taken

    def at(self, word: str) -> Message:
        """The place of the first time that a word stands in the text."""
        before = self.text[:self.text.index(word)]
        return {"textDocument": {"uri": self.uri},
                "position": {"line": before.count("\n"), "character": len(before) - before.rfind("\n") - 1}}  # fmt: skip

    def ask(self, method: str, **params: Any) -> float:
        """The time of an answer, which must not be empty."""
        taken, found = self.timed({"method": f"textDocument/{method}", "params": params})
        assert found["result"], found
        return taken

    def _notify(self, method: str, params: Message) -> None:
        self.send({"id": None, "method": method, "params": params})


def keys(server: LanguageServer, names: int) -> float:
    """Types names that are not declared; the time within which 95 of 100 keys are answered."""
    chosen, taken = random.Random(1), []
    places = [at for at in range(len(server.text)) if server.text.startswith(";\n    Sum", at)]
    for _ in range(names):
        at = chosen.choice(places) + 2
        for number in range(1, len(TYPED) + 1):
            taken.append(server.change(server.text[:at] + f"    Sum := {TYPED[:number]};\n" + server.text[at:]))
        server.change(server.text)
    return sorted(taken)[int(len(taken) * 0.95)]


def editor(lines: int = LINES, many_lines: int = MANY_LINES, names: int = NAMES) -> list[tuple[str, float, float]]:
    """What the language server needs: name, milliseconds, and the most that are wanted."""
    server = LanguageServer(text_of(lines))
    rows = [(f"first diagnostics after the start, {lines:,} lines", server.open(), 2_000.0),
            ("diagnostics after a key in a POU of 300 lines, 95 of 100", keys(server, names), 100.0)]  # fmt: skip
    changed = server.text.replace("Level : INT;", "Level : INT; More : INT;", 1).replace("VAR Wait", "VAR Idle : INT; Wait", 1)
    rows += [("diagnostics and warnings after a change of an interface", server.change(changed), 500.0)]
    assert server.codes == ["S0293", "S0290"], "warnings of names that nobody uses"
    server.change(server.text)
    rows += [("hover", server.ask("hover", **server.at("Sum := Sum")), 100.0)]
    server.end()
    server = LanguageServer(text_of(many_lines))
    server.open()
    place = server.at("Station_0")
    server.ask("hover", **place)
    rows += [(f"renaming a block in {many_lines:,} lines", server.ask("rename", **place, newName="First"), 2_500.0)]
    server.end()
    return rows


def debugger(scans: int = SCANS) -> list[tuple[str, float, float]]:
    """What the debugger needs."""
    server = Server("dap")
    file = server.folder / "hundred.st"
    file.write_text(hundred_lines(), encoding="utf-8")

    def stopped(message: Message) -> bool:
        return message.get("event") == "stopped"

    def breakpoint_at(condition: str) -> None:
        server.timed({"command": "setBreakpoints", "arguments": {
            "source": {"path": str(file)}, "breakpoints": [{"line": 5, "condition": condition}]}})  # fmt: skip

    server.timed({"command": "initialize", "arguments": {"adapterID": "fbvm"}})
    server.send({"command": "launch", "arguments": {"program": str(file), "stopOnEntry": True}})
    server.until(lambda message: message.get("event") == "initialized")
    server.timed({"command": "configurationDone"}, stopped)
    breakpoint_at(f"n = {scans}")
    server.timed({"command": "continue", "arguments": {"threadId": 1}}, stopped)
    rows = [(f"one step back in scan {scans:,}", server.timed({"command": "stepBack", "arguments": {"threadId": 1}}, stopped)[0],
             100.0)]  # fmt: skip
    breakpoint_at(f"n = {scans + 1}")
    server.timed({"command": "continue", "arguments": {"threadId": 1}}, stopped)
    breakpoint_at(f"n = {scans + 2}")
    taken = server.timed({"command": "continue", "arguments": {"threadId": 1}}, stopped)[0]
    server.end()
    return [("stop at a breakpoint in the next scan", taken, 100.0), *rows]


def main() -> int:
    """Prints all rows."""
    rows = editor() + debugger()
    for what, taken, most in rows:
        print(f"{what:<60}{taken:>8.0f} ms, wanted {most:>6,.0f} ms{'' if taken <= most else ', TOO LONG'}")
    return int(any(taken > most for _, taken, most in rows))


if __name__ == "__main__":
    sys.exit(main())
