"""Expressions of Structured Text in one line, as drawings have them."""

from __future__ import annotations

import re

from fbvm.syntax.st.comments import SILENT

_BLANKS = re.compile(rf"(?s)({SILENT})|\s+")


def squeezed(text: str) -> str:
    """A text without comments, with one blank for each run of blanks and line ends outside of strings."""
    shown = _BLANKS.sub(lambda match: match[1] if match[1] and match[1][0] in "'\"" else "\n", text)
    return re.sub("\n+", " ", shown).strip()
