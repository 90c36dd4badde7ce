"""Whole conversations of a page with its workbench, word for word, beside `conversations/`.

The first line of a file names a program; a line `> {...}` is a message of the page, `~ scan N` does scans, `~ update` asks what
has changed, `~ page` opens another page; the lines behind are what comes.  How long scans took is left out, as are words of units
that are 0.  `FBVM_REWRITE=1 pytest` of this file writes what comes anew: read the difference before you keep it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsers import Page

from fbvm.base.data import data_folder
from fbvm.live.messages import ACTIONS
from fbvm.live.session import Session
from fbvm.live.updates import UPDATE_NS, VIEW_NS

WORDS, KINDS = re.compile(">([^<>]+)</text>"), re.compile('class="([^"]*)"')
"""In a drawing: its texts, and the kinds of its lines, some of which are those with power."""
HERE = Path(__file__).with_name("conversations")

pytestmark = pytest.mark.slow


def short(message: dict[str, Any]) -> str:
    """A message without what depends on the host."""
    update = message.get("update", {})
    for name in ("taken", "times"):
        if name in update:
            update[name] = bool(update[name])
    for picture in update.get("inside", {}).get("pictures", ()):
        drawn = picture.pop()
        picture.append(f"{' '.join(WORDS.findall(drawn))}; {', '.join(KINDS.findall(drawn))}")
    for unit in update.get("units", ()):
        unit["words"] = [row for row in unit["words"] if row[2] not in ("FALSE", "0 (16#0000)", "0")]
    return json.dumps(message, ensure_ascii=False)


class Talk:
    """A page that writes down what comes."""

    def __init__(self, text: str) -> None:
        self._page = Page(text)
        self._asked = 0
        self._now_ns = 0

    def lines(self, asked: str) -> Iterator[str]:
        """What comes behind a line of a conversation."""
        word, _, rest = asked.removeprefix("~ ").partition(" ")
        if asked.startswith(">"):
            self._asked += 1
            message = json.loads(asked.removeprefix("> "))
            answer = self._page.session.answer(json.dumps({"id": self._asked, **message}))
            while answer is None:
                answer = self._page.session.update(self._now_ns)
            reply = json.loads(answer)
            assert reply.pop("re") == self._asked
            yield short(reply)
        elif word == "scan":
            for _ in range(int(rest)):
                if self._page.plc.trap is None:
                    self._page.scan()
        elif word == "page":
            self._page.session = Session(self._page.bench)
        else:
            self._now_ns += UPDATE_NS if rest != "later" else VIEW_NS
            text = self._page.session.update(self._now_ns)
            yield short(json.loads(text)) if text else "nothing"
            self._page.session.answer('{"do": "ready"}')


def whole(conversation: str) -> str:
    """A conversation with what comes now."""
    asked = [line for line in conversation.splitlines() if line.startswith(("#", ">", "~"))]
    named = asked[0].removeprefix("# ").partition(":")[0]
    file = HERE / named if (HERE / named).is_file() else data_folder("examples") / named
    talk, made = Talk(file.read_text(encoding="utf-8")), list[str]()
    for line in asked:
        made += [line, *(talk.lines(line) if not line.startswith("#") else ())]
    return "".join(f"{line}\n" for line in made)


def test_which_messages_change_anything() -> None:
    assert {name for name, action in ACTIONS.items() if action.changes} == {
        "predict", "check", "write", "force", "release", "group", "run", "pause", "step", "statement", "break", "unbreak",
        "speed", "mode", "start", "restart", "branch", "cable", "fault", "mend"}  # fmt: skip


@pytest.mark.parametrize("file", [pytest.param(file, id=file.stem) for file in sorted(HERE.glob("*.txt"))])
def test_a_conversation_goes_as_it_is_kept(file: Path) -> None:
    kept = file.read_text(encoding="utf-8")
    came = whole(kept)
    if os.environ.get("FBVM_REWRITE"):
        file.write_text(came, encoding="utf-8")
    assert came == kept
