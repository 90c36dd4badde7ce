"""The page of dialects: what `fbvm explain dialects` prints."""

from __future__ import annotations

from fbvm.base import dialects
from product_pages.markdown import page

NAME = "reference/dialects"


def pages() -> dict[str, str]:
    """The page of all dialects."""
    return {NAME: page(dialects.page())}
