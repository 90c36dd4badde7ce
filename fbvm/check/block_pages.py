"""The page of a block or function of the shipped libraries: what it does, and its pins as they are declared."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.base.types import fold

PINS = ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT")
HEADS = ("FUNCTION_BLOCK", "FUNCTION", "PROGRAM")


@cache
def _files() -> dict[str, Path]:
    """By folded name; of several with one name that of the standard's library, else the first one."""
    found: dict[str, Path] = {}
    for path in sorted(data_folder("fblib").rglob("*.st"), key=lambda path: (path.parent.name != "iec", path)):
        found.setdefault(fold(path.stem), path)
    return found


def names() -> list[str]:
    """The names of all files of the libraries, in capitals and small letters as they are declared."""
    return [path.stem for path in _files().values()]


def page(name: str) -> str | None:
    """The page of that name in any case; None if there is none."""
    path = _files().get(fold(name.strip()))
    return page_of(path) if path else None


def page_of(path: Path) -> str | None:
    """The page of what a file of the libraries declares; None for a file without a block or function."""
    shown = _interface(path.read_text(encoding="utf-8").splitlines())
    if not any(line.startswith(HEADS) for line in shown):
        return None
    said = [line[2:].strip() for line in shown if line.startswith("//")]
    folder = path.parent.relative_to(data_folder("fblib")).as_posix()
    described = path.parent / "library.toml"
    title = tomllib.loads(described.read_text(encoding="utf-8")).get("title", "") if described.is_file() else ""
    library = f"Library {folder}" + (f": {title}" if title else "")
    return "\n".join([f"# {path.stem}", "", *said, "", "```st", *(line for line in shown if not line.startswith("//")), "```", "",
                      library])


def _interface(lines: list[str]) -> list[str]:
    """The comment at the head, the POU's first line, and the sections of its pins."""
    kept: list[str] = []
    begun, wanted = False, None  # type: bool, bool | None
    for line in lines:
        word = line.split(None, 1)[0] if line.strip() else ""
        if wanted is None and word.startswith("VAR"):
            wanted = word in PINS
        if wanted is None and begun and word:
            break
        begun = begun or word in HEADS
        if wanted or wanted is None and (word in HEADS or word.startswith("//")):
            kept.append(line)
        if word == "END_VAR":
            wanted = None
    return kept
