"""Links of pages to Markdown files outside of this folder, such as a README: the built pages offer the file itself.

Written as plain relative links, they also work where the pages are read in the repository.
"""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx


def mark_files(app: Sphinx, page: str, text: list[str]) -> None:
    """Give links that leave the folder of the documentation MyST's scheme for files, `path:`."""
    folder = Path(app.srcdir, page).parent

    def marked(link: re.Match[str]) -> str:
        is_page = (folder / link[1]).resolve().is_relative_to(Path(app.srcdir).resolve())
        return link[0] if is_page else f"](path:{link[1]})"

    text[0] = re.sub(r"\]\((\.\./[^)#\s]+\.md)\)", marked, text[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Look at each page before it is read."""
    app.connect("source-read", mark_files)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
