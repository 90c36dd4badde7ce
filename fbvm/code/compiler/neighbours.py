"""Hints for unknown names that a file beside the compiled ones declares, which was forgotten."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.files import read_file, resolved
from fbvm.base.types import fold

CODES = ("S0201", "S0204", "S0401")
"""Codes of diagnostics about unknown names."""
MOST_FILES = 100
LARGEST_BYTES = 1 << 20
"""Files beside the compiled ones that are looked into, and how large one may be."""
_HEAD = re.compile(r"^[ \t]*(?:FUNCTION_BLOCK|FUNCTION|CLASS|INTERFACE|TYPE)(?:\s+(?:FINAL|ABSTRACT))*\s+(\w+)", re.I | re.M)


def with_neighbours(diagnostics: list[Diagnostic], paths: Sequence[Path | str]) -> list[Diagnostic]:
    """The diagnostics; of unknown names that a file in the folder of a compiled one declares, with a hint that says which."""
    if not any(each.code in CODES for each in diagnostics):
        return diagnostics
    known: dict[str, Path] = {}
    for path in islice(_beside(paths), MOST_FILES):
        try:
            text = read_file(path, LARGEST_BYTES).decode("utf-8", "replace")
        except OSError:
            continue
        for name in _HEAD.findall(text):
            known.setdefault(fold(name), path)
    return [_hinted(each, known) for each in diagnostics]


def _beside(paths: Sequence[Path | str]) -> Iterator[Path]:
    """The other sources in the folders of some files."""
    given = {resolved(Path(path)) for path in paths}
    for folder in dict.fromkeys(Path(path).parent for path in paths):
        yield from (path for path in sorted(folder.glob("*.st")) if resolved(path) not in given)


def _hinted(diagnostic: Diagnostic, known: dict[str, Path]) -> Diagnostic:
    name = diagnostic.source.text[diagnostic.start : diagnostic.end]
    path = known.get(fold(name)) if diagnostic.code in CODES else None
    if path is None:
        return diagnostic
    return replace(diagnostic, hint=f"{path} declares {name}: it is a source of the program, too")
