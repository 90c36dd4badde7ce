"""The page of what is assumed about the hardware: every test whose name ends in `_assumed`, with what it says."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from product_pages.markdown import HOUSE, code, page

NAME = "explanation/assumed"
HEADINGS = {
    "tests/unit/units": "The ETN21", "tests/unit/machine": "The CPU unit", "tests/unit/net": "The network",
    "tests/fblib": "Blocks and ladder instructions", "tests/lang": "The language", "tests/plcopen": "PLCopen XML",
    "tests/interop": "Other programs", "tests": "Everything else",
}  # fmt: skip
"""What heads the assumptions of a folder of tests; the first folder that fits counts."""


@dataclass(frozen=True)
class Assumption:
    """A rule that no source settles: the file and line of its test, and its sentence."""

    file: str
    line: int
    sentence: str


def pages() -> dict[str, str]:
    """The page of all assumptions."""
    parts = [
        "# What is assumed",
        "fbvm is written after manuals, the standard and the sheets of its blocks. Where none of them settles a question, one "
        "answer was chosen, and a test holds it; the name of such a test ends in `_assumed`. This page lists them all. If you "
        "have the hardware and it answers another way, that is a bug of fbvm: tell us what you saw, and the test is the place "
        "to begin.",
    ]
    rows = list(assumptions())
    for folder, heading in HEADINGS.items():
        mine = [row for row in rows if folder == _folder(row)]
        if mine:
            parts += [f"## {heading}", "\n".join(f"- {row.sentence} ({code(f'{row.file}:{row.line}')})" for row in mine)]
    return {NAME: page(*parts)}


def assumptions() -> Iterator[Assumption]:
    """Every assumption, in the order of files and lines."""
    for path in sorted((HOUSE / "tests").rglob("test_*.py")):
        if "_assumed" in (text := path.read_text(encoding="utf-8")):
            for node in _functions(text):
                yield Assumption(path.relative_to(HOUSE).as_posix(), node.lineno, _sentence(node))


@cache
def _functions(text: str) -> tuple[ast.FunctionDef, ...]:
    functions = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef))
    return tuple(node for node in functions if node.name.startswith("test_") and node.name.endswith("_assumed"))


def _sentence(node: ast.FunctionDef) -> str:
    """The name of a test as a sentence, and what its docstring adds."""
    words = node.name.removeprefix("test_").removesuffix("_assumed").replace("_", " ")
    words = re.sub(r"^[0-9a-f]{4}(?= )", lambda found: f"Response code {found[0].upper()}:", words)
    words = re.sub(r"\b(fin|rst|tcp|udp|rs|xml)\b", lambda found: found[0].upper(), words)
    said = " ".join((ast.get_docstring(node) or "").split())
    return f"{words[0].upper()}{words[1:]}." + (f" {said}" if said else "")


def _folder(row: Assumption) -> str:
    return next(folder for folder in HEADINGS if Path(row.file).is_relative_to(folder))
