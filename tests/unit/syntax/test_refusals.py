"""What is said of texts that are refused, place and words: `refused/` has the texts, each with its messages below it.

`FBVM_REWRITE=1` writes the messages anew; each was read once beside its text.  A file begins with the frame around its texts."""

from __future__ import annotations

import os
from pathlib import Path

from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.parser import parse

FILES = sorted(Path(__file__).with_name("refused").glob("*.txt"))
TITLE, SAID = "--- ", ">>> "
Case = tuple[str, str, str, list[str]]
"""Title, frame with `{}` for the text, text, messages."""


def read(path: Path) -> list[Case]:
    frame, *parts = f"\n{path.read_text(encoding='utf-8')}".split(f"\n{TITLE}")
    cases = []
    for part in parts:
        title, *lines = part.rstrip("\n").split("\n")
        said = [line.removeprefix(SAID) for line in lines if line.startswith(SAID)]
        cases.append((title, frame.strip("\n"), "\n".join(line for line in lines if not line.startswith(SAID)), said))
    return cases


def told(found: Diagnostic) -> str:
    """A message as `line:column: code ! what is marked ! message ! hint`; `~` if some text was passed over."""
    line, column = found.source.place(found.start)
    marked = found.source.text[found.start : found.end].replace("\n", "$L")
    code = ("" if found.lossless else "~") + found.code
    return f"{line}:{column}: {code} ! {marked} ! {found.message} ! {found.hint}".rstrip(" !")


def messages(frame: str, text: str) -> list[str]:
    return list(map(told, parse(Source("x.st", frame.replace("{}", text)))[1]))


if os.environ.get("FBVM_REWRITE"):
    for file in FILES:
        rows = [f"{TITLE}{title}\n{text}\n" + "".join(f"{SAID}{each}\n" for each in messages(frame, text))
                for title, frame, text, _ in read(file)]  # fmt: skip
        file.write_text(f"{read(file)[0][1]}\n" + "".join(rows), encoding="utf-8")


@each_of(("title", "frame", "text", "said"), [case for file in FILES for case in read(file)], ids=lambda case: case[0])
def test_a_text_that_is_refused_says_what_and_where(title: str, frame: str, text: str, said: list[str]) -> None:
    assert messages(frame, text) == said != [], title
