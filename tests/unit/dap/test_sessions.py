"""Whole sessions of the debug adapter, word for word, beside `sessions/`.

A line `> command {arguments}` of a file is a request, `~ slice` and `~ progress` are what the server does meanwhile; the lines
behind are all messages that come, `...` stands behind what goes on.  In arguments `$0` is the number of the innermost frame and
`$Locals` the reference of the row or scope of that name.  `FBVM_REWRITE=1 pytest` of this file writes the messages anew: read the
difference before you keep it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.diagnostics import Source
from fbvm.cli.running.dap import open_target
from fbvm.code.compiler import compile_sources
from fbvm.dap.adapter import Adapter
from fbvm.machine.plc import Plc
from fbvm.record.recording.file_writer import Described, RecordingWriter
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.recording import Recording

RECORDED = "pump.fbrec"
HERE = Path(__file__).with_name("sessions")
NAMED = re.compile(r'"\$([^"]*)"')

pytestmark = pytest.mark.slow


class Talk:
    """A client that writes down what comes."""

    def __init__(self, folder: Path) -> None:
        self.adapter = Adapter(open_target, self._take)
        self._folder = folder
        self._came: list[str] = []
        self._meant: dict[str, int] = {}
        self._asked = 0

    def _take(self, message: dict[str, Any]) -> None:
        self._learn(message)
        message.pop("seq")
        kind = message.pop("type")
        if kind == "response":
            word = "ok" if message.pop("success") else "no"
            number, command = message.pop("request_seq"), message.pop("command")
            if word == "no":
                said = message["message"]
                assert message.pop("body") == {"error": {"id": 1, "format": said, "showUser": False}}
            shown = f"{word} {command}" + ("" if number == self._asked else f" (request {number})")
        else:
            shown = f"event {message.pop('event')}"
        rest = message.pop("body", {}) if set(message) <= {"body"} else message
        self._came.append(f"{shown} {self._short(rest)}" if rest else shown)

    def _learn(self, found: object) -> None:
        """Keeps the numbers of frames and of rows."""
        if isinstance(found, dict):
            for number, frame in enumerate(found.get("stackFrames", ())):
                self._meant[str(number)] = frame["id"]
            if "variablesReference" in found and "name" in found:
                self._meant[found["name"]] = found["variablesReference"]
            for each in found.values():
                self._learn(each)
        elif isinstance(found, list):
            for each in found:
                self._learn(each)

    def _short(self, found: dict[str, Any]) -> str:
        text = json.dumps(found, ensure_ascii=False)
        text = re.sub(r', "checksums": \[\{[^]]*\}\]', "", text)
        return text.replace(str(self._folder), "FOLDER")

    def lines(self, asked: str) -> Iterator[str]:
        """What comes behind a line of a session."""
        self._came.clear()
        if asked == "~ slice":
            self._came += [] if not self.adapter.work() else ["..."]
        elif asked == "~ progress":
            self.adapter.tell_progress()
        else:
            command, _, arguments = asked.removeprefix("> ").partition(" ")
            said = NAMED.sub(lambda name: str(self._meant.get(name[1], 0)), arguments).replace("FOLDER", str(self._folder))
            self._asked += 1
            self.adapter.receive({"seq": self._asked, "type": "request", "command": command,
                                  **({"arguments": json.loads(said)} if said else {})})  # fmt: skip
            running = self.adapter.is_running and not self._meanwhile
            while running:
                running = self.adapter.work()
        yield from self._came

    _meanwhile = False

    def text(self, session: str) -> str:
        """The session with what comes now."""
        made: list[str] = []
        asked = [line for line in session.splitlines() if line.startswith(("#", ">", "~"))]
        for line, following in zip(asked, [*asked[1:], ""], strict=True):
            made.append(line)
            self._meanwhile = following.startswith("~") or following.endswith("meanwhile")
            if not line.startswith("#"):
                made += self.lines(line)
        return "".join(f"{line}\n" for line in made)


def record(folder: Path) -> None:
    """Six scans of `pump.st`; in the last one it ends with a trap."""
    source = Source("pump.st", (folder / "pump.st").read_text(encoding="utf-8"))
    image = compile_sources([source]).image
    assert image is not None
    plc = Plc(image)
    with (folder / RECORDED).open("wb") as file:
        made = Recording(file=RecordingWriter(file, "1", True))
        made.add("pump", plc, Described(ProgramText(((source.name, source.text),))))
        plc.run(scans=5)
        plc.write("Main.Trips", True)
        plc.run(scans=1)
        made.close()


@pytest.mark.parametrize("file", [pytest.param(file, id=file.stem) for file in sorted(HERE.glob("*.txt"))])
def test_a_session_goes_as_it_is_kept(file: Path, tmp_path: Path) -> None:
    for source in (HERE / "sources").iterdir():
        (tmp_path / source.name).write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    kept = file.read_text(encoding="utf-8")
    if RECORDED in kept:
        record(tmp_path)
    came = Talk(tmp_path).text(kept)
    if os.environ.get("FBVM_REWRITE"):
        file.write_text(came, encoding="utf-8")
    assert came == kept
