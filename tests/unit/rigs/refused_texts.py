"""Texts that are refused, each with its messages below it, in files that begin with the frame around the texts.

`FBVM_REWRITE=1` writes the messages anew; each was read once beside its text."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic

TITLE, SAID = "--- ", ">>> "
Case = tuple[str, str, list[str]]
"""Title, text in its frame, messages."""
Check = Callable[[str], Iterable[Diagnostic]]


def refused_texts(folder: Path, check: Check) -> list[Case]:
    """The cases of all files of a folder."""
    cases: list[Case] = []
    for path in sorted(folder.glob("*.txt")):
        frame, *parts = f"\n{path.read_text(encoding='utf-8')}".split(f"\n{TITLE}")
        frame, found = frame.strip("\n"), [_parted(part) for part in parts]
        if os.environ.get("FBVM_REWRITE"):
            found = [(title, text, messages(check, frame.replace("{}", text))) for title, text, _ in found]
            rows = [f"{TITLE}{title}\n{text}\n" + "".join(f"{SAID}{each}\n" for each in said) for title, text, said in found]
            path.write_text(f"{frame}\n" + "".join(rows), encoding="utf-8")
        cases += [(f"{path.stem}: {title}", frame.replace("{}", text), said) for title, text, said in found]
    return cases


def _parted(part: str) -> Case:
    title, *lines = part.rstrip("\n").split("\n")
    said = [line.removeprefix(SAID) for line in lines if line.startswith(SAID)]
    return title, "\n".join(line for line in lines if not line.startswith(SAID)), said


def messages(check: Check, text: str) -> list[str]:
    """What is said of a text: `line:column: code ! what is marked ! message ! hint`; `~` if some text was passed over."""
    return list(map(_told, check(text)))


def _told(found: Diagnostic) -> str:
    line, column = found.source.place(found.start)
    marked = found.source.text[found.start : found.end].replace("\n", "$L")
    code = ("" if found.lossless else "~") + found.code
    return f"{line}:{column}: {code} ! {marked} ! {found.message} ! {found.hint}".rstrip(" !")
