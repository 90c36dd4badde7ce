"""The page of conformance: CONFORMANCE.md, which the programs in `tests/conformance/` make."""

from __future__ import annotations

from product_pages.markdown import HOUSE, page

NAME = "reference/conformance"


def pages() -> dict[str, str]:
    """The page of all features of all tables."""
    return {NAME: page((HOUSE / "CONFORMANCE.md").read_text(encoding="utf-8"))}
