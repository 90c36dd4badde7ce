"""The pages of libraries: the README of each folder of `fblib/`, and the declared pins of its blocks."""

from __future__ import annotations

import tomllib
from pathlib import Path

from fbvm.check import block_pages
from product_pages import ladder
from product_pages.markdown import HOUSE, lowered, moved, page, structured_text, table

FOLDER = "reference/libraries"
FBLIB = HOUSE / "fblib"
NOT_CALLED = {"omron/ladder": "instructions", "omron/etn21": "the emulated unit"}
"""Libraries whose functions programs do not call, and what does call them: their pins are not shown."""


def names() -> list[str]:
    """Every library, by its folder below `fblib/`."""
    return sorted(path.parent.relative_to(FBLIB).as_posix() for path in FBLIB.rglob("library.toml"))


def page_name(library: str) -> str:
    """The page of a library."""
    return f"{FOLDER}/{library.replace('/', '-')}"


def pages() -> dict[str, str]:
    """The list of libraries, and the page of each."""
    readmes = {FBLIB / name / "README.md": page_name(name) for name in names()} | {ladder.FOLDER / "INSTRUCTIONS.md": ladder.NAME}
    return {f"{FOLDER}/index": _index()} | {page_name(name): _page(name, readmes) for name in names()}


def _about(library: str) -> dict[str, object]:
    return tomllib.loads((FBLIB / library / "library.toml").read_text(encoding="utf-8"))


def _index() -> str:
    rows = [(f"[{name}]({name.replace('/', '-')}.md)", _about(name)["title"], _about(name)["sheet"]) for name in names()]
    listed = "\n".join(name.replace("/", "-") for name in names())
    return page(
        "# Libraries",
        "A library is a folder of Structured Text, one program organization unit a file, with a `library.toml`. Those below "
        "come with fbvm and are found by the names of their blocks; further folders are given with `--library`. "
        "`fbvm explain TON` prints the pins of a block in a terminal.",
        table(("library", "", "after"), rows), f"```{{toctree}}\n:hidden:\n\n{listed}\n```")  # fmt: skip


def _page(library: str, readmes: dict[Path, str]) -> str:
    folder = FBLIB / library
    readme = structured_text((folder / "README.md").read_text(encoding="utf-8"))
    parts = [moved(readme, folder / "README.md", page_name(library), readmes), _facts(library)]
    if library in NOT_CALLED:
        parts.append(f"Its functions are called by {NOT_CALLED[library]}; programs do not call them.")
    else:
        blocks = [made for path in sorted(folder.glob("*.st")) if (made := block_pages.page_of(path))]
        parts += ["## Blocks and functions", *(lowered(structured_text(made), 2) for made in blocks)] if blocks else []
    return page(*parts)


def _facts(library: str) -> str:
    """What the library's description says for people."""
    about = _about(library)
    rows = []
    for key in ("sheet", "revision", "date", "author", "platforms", "unit"):
        if key in about and about[key] != "none given":
            value = about[key]
            rows.append((key, ", ".join(value) if isinstance(value, list) else value))
    return page("## Description", table(("", ""), rows))
