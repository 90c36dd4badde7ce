"""How libraries and standard functions spell their names, for the formatter."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.check.calls.standard import is_known
from fbvm.syntax.formatter.names import Outside
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read
from fbvm.syntax.tree import Declaration, Pou, TypeDecl


@cache
def _library_files() -> dict[str, Path]:
    return {fold(path.stem): path for path in sorted(data_folder("fblib").rglob("*.st"))}


@cache
def _library_declaration(key: str) -> Declaration | None:
    path = _library_files().get(key)
    source = read(path, path.name) if path else None
    if not isinstance(source, Source):
        return None
    found = (d for d in parse(source)[0].declarations if isinstance(d, (Pou, TypeDecl)) and fold(d.name.text) == key)
    return next(found, None)


OUTSIDE = Outside(lambda name: _library_declaration(fold(name)), is_known)
"""The spelling of names that a text does not declare."""
