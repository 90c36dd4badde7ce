"""The pages of diagnostics: one a code, made of what `fbvm explain` prints, and a list of all."""

from __future__ import annotations

import re

from fbvm.base import codes
from fbvm.base import pages as product
from fbvm.base.codes import CODES
from product_pages.markdown import page, structured_text, table

FOLDER = "reference/diagnostics"
HEAD = """---
tocdepth: 2
---"""
"""Leaves the pages of codes out of the sidebar: with over a hundred lines it is most of each page of the documentation."""
HEADINGS = {"S": "Sources", "P": "Project file and libraries", "X": "PLCopen XML", "R": "Traps: running stopped"}
OFF = """## Switching it off

In a text between `{warning disable CODE}` and `{warning restore CODE}`, for a check with `fbvm check --no-warn CODE`.
"""
"""What the page of a warning says besides."""


def pages() -> dict[str, str]:
    """The list of all codes, and the page of each."""
    return {f"{FOLDER}/index": _index()} | {f"{FOLDER}/{name}": _page(name) for name in CODES}


def _index() -> str:
    parts = [
        HEAD,
        "# Diagnostics",
        "Every message has a code, a place and, where there is one, a hint of what to write instead. `fbvm explain S0301` "
        "prints the page of a code in a terminal: a wrong program, the reason, the program that mends it. Every code of a "
        "warning can be switched off, for a run of the check (`--no-warn S0390`) or in a text (`{warning disable S0390}`).",
        (codes.__doc__ or "").partition("\n\n")[2],
    ]
    for letter, heading in HEADINGS.items():
        rows = [(f"[{name}]({name}.md)", row.severity, row.title) for name, row in CODES.items() if name.startswith(letter)]
        parts += [f"## {heading}", table(("code", "", "title"), rows)]
    listed = "\n".join(CODES)
    return page(*parts, f"```{{toctree}}\n:hidden:\n\n{listed}\n```")


def _page(name: str) -> str:
    """The product's page; codes that it names are links to theirs."""
    text = structured_text(product.page(name))
    head, mark, tail = text.partition("## See also")
    tail = re.sub(r"\b([SPXR]\d{4})\b", lambda found: f"[{found[1]}]({found[1]}.md)" if found[1] in CODES else found[1], tail)
    off = OFF.replace("CODE", name) if CODES[name].severity == "warning" else ""
    return page(head, off, mark + tail)
