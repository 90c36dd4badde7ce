"""Small parts of Markdown from which pages are put together."""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath

HOUSE = Path(__file__).resolve().parents[3]
"""The folder of the repository."""


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; a `|` within a cell is escaped."""
    lines = [heads, ["---"] * len(heads), *rows]
    cells = ([str(cell).replace("|", "\\|").replace("\n", " ") for cell in line] for line in lines)
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def code(text: object) -> str:
    """Text within a line as code."""
    return f"`{text}`"


def fence(text: str, language: str = "text") -> str:
    """Lines as code; the fence is longer than any in the text."""
    marks = "`" * max([3, *(len(found) + 1 for found in re.findall(r"^`{3,}", text, re.M))])
    return f"{marks}{language}\n{text.rstrip()}\n{marks}"


def page(*parts: str) -> str:
    """Parts with an empty line between them, as a text that ends with a line."""
    return "\n\n".join(part.strip("\n") for part in parts if part) + "\n"


def lowered(text: str, by: int = 1) -> str:
    """Markdown whose headings are so many levels lower.  Blocks of code stay as they are."""
    pieces = re.split(r"(^```.*?^```)", text, flags=re.M | re.S)
    return "".join(piece if piece.startswith("```") else re.sub(r"^(#+ )", "#" * by + r"\1", piece, flags=re.M)
                   for piece in pieces)  # fmt: skip


def structured_text(text: str) -> str:
    """Markdown whose blocks of Structured Text have the name under which the documentation colours them."""
    return re.sub(r"^```st$", "```iecst", text, flags=re.M)


def moved(text: str, origin: Path, name: str, pages: dict[Path, str]) -> str:
    """Markdown of the file `origin` as part of the page `name`: relative links lead where they led.

    `pages` are the pages made of files of the repository; a link to such a file becomes one to its page."""
    here = PurePosixPath("docs") / PurePosixPath(name).parent

    def link(found: re.Match[str]) -> str:
        target, mark, part = found[2].partition("#")
        if not target or "://" in target:
            return found[0]
        path = (origin.parent / target).resolve()
        where = f"docs/{pages[path]}.md" if path in pages else path.relative_to(HOUSE).as_posix()
        return f"{found[1]}({os.path.relpath(where, here)}{mark}{part})"

    return re.sub(r"(\[[^\]\n]*\])\(([^)\s]+)\)", link, text)


def sentences_of_constants(path: Path) -> list[str]:
    """The strings that stand behind constants of a Python module and say what each is, in order."""
    found = []
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for before, node in pairwise(body):
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        if is_text and isinstance(before, ast.Assign | ast.AnnAssign):
            found.append(" ".join(ast.literal_eval(node.value).split()))
    return found
