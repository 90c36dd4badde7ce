"""The page of ladder instructions: the list that stands beside their library, and what the library's README says."""

from __future__ import annotations

from product_pages.markdown import HOUSE, lowered, moved, page

NAME = "reference/ladder"
FOLDER = HOUSE / "fblib/omron/ladder"


def pages() -> dict[str, str]:
    """The page of all instructions."""
    head, _, lists = (FOLDER / "INSTRUCTIONS.md").read_text(encoding="utf-8").partition("\n## ")
    _, _, readme = (FOLDER / "README.md").read_text(encoding="utf-8").partition("\n")
    said = moved(readme, FOLDER / "README.md", NAME, {})
    return {NAME: page(head, "## How instructions are executed", lowered(said), f"## {lists}")}
