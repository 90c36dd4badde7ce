"""Pages of the documentation that are made of the product itself: of its tables, commands, docstrings and tests.

Each module beside this one makes some pages from one kind of source.  `pages` returns all of them; when Sphinx starts, they
are written into the folder of the documentation.  What is made so is not kept in the repository (docs/.gitignore).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from product_pages import (
    assumed,
    command_line,
    conformance,
    diagnostics,
    dialects,
    etn21,
    ladder,
    libraries,
    memory_map,
    project_file,
    python_api,
)

if TYPE_CHECKING:
    from sphinx.application import Sphinx

Pages = dict[str, str]
"""The text of each page by its path below `docs/`, without its suffix."""

SOURCES: tuple[Callable[[], Pages], ...] = (
    assumed.pages, command_line.pages, conformance.pages, diagnostics.pages, dialects.pages, etn21.pages, ladder.pages,
    libraries.pages, memory_map.pages, project_file.pages, python_api.pages,
)  # fmt: skip


def pages() -> Pages:
    """All pages that are made of the product."""
    made: Pages = {}
    for source in SOURCES:
        made |= source()
    return made


def write(folder: Path) -> None:
    """Write all pages below `folder`; a file that has the same text already stays untouched.

    Below `reference/` every page in a folder is made: one that is made no longer, such as that of a code which is gone, is
    removed."""
    made = {folder / f"{name}.md": text for name, text in pages().items()}
    for path in folder.glob("reference/*/**/*.md"):
        if path not in made:
            path.unlink()
    for path, text in made.items():
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the pages before Sphinx looks which there are."""
    write(Path(app.srcdir))
    python_api.connect(app)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
