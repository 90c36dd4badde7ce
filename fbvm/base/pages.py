"""The page of each diagnostic: what is wrong and why, a wrong program, and the program that mends it.

The pages are Markdown files beside this module, so that they travel with the package wherever it is installed.
"""

from __future__ import annotations

import re
from difflib import get_close_matches
from importlib.resources import files

from fbvm.base.codes import CODES, Code

_SHOWN = 4
"""How many rows are offered for a misspelt code."""


class UnknownCode(LookupError):
    """There is no diagnostic of that `code`; `near` are the rows that may have been meant."""

    def __init__(self, code: str, near: list[Code]) -> None:
        meant = "".join(f"\n  {row.code}  {row.title}" for row in near)
        super().__init__(f"there is no diagnostic {code}" + (f"; near it are{meant}" if near else ""))
        self.code, self.near = code, near


def page(code: str) -> str:
    """The page of a diagnostic as Markdown; case and spaces around the code do not matter.  Raises UnknownCode."""
    row = CODES.get(code.strip().upper())
    if row is None:
        raise UnknownCode(code, near(code))
    return (files("fbvm.base") / "pages" / f"{row.code}.md").read_text(encoding="utf-8").rstrip("\n")


def near(text: str) -> list[Code]:
    """Rows whose code is like `text`, the likest first; if none is, those whose title has that word.

    A code of a range that there is, such as S02, is near to others of that range only."""
    wanted = text.strip()
    same_range = [code for code in CODES if code[:3] == wanted[:3].upper()]
    codes = get_close_matches(wanted.upper(), same_range or CODES, n=_SHOWN)
    if codes or not wanted:
        return [CODES[code] for code in codes]
    word = re.compile(rf"\b{re.escape(wanted)}s?\b", re.I)
    return [row for row in CODES.values() if word.search(row.title)][:_SHOWN]
