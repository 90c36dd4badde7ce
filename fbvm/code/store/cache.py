"""Compilations on disk.

One with the same sources, libraries and options, by the same version of this package, is read instead of done again.  Only
compilations without an error are kept."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from fbvm.base.cache import Cache, name_of, state_of
from fbvm.base.data import PACKAGE, data_folder
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, Unreadable, folders_below, read_file, reason
from fbvm.code.image import Image
from fbvm.code.store.encoding import decode, encode

FILES = Cache("images", b"fbvm image 1\n", 128 << 20)
LENGTH_BYTES = 4
ROOMS = ("base", "syntax", "check", "code")
"""The folders of this package that decide what an image holds."""


def name(sources: Sequence[Source], libraries: Sequence[Path], options: Sequence[object]) -> str:
    """The name of the cache entry for a compilation: a hash of all that its result depends on.

    sources: the texts and their names.
    libraries: the folders of libraries besides the shipped ones.
    options: all other parameters that make a difference."""
    texts = [part for source in sources for part in (source.name, source.library, source.text)]
    return name_of((*texts, repr(tuple(options)), *map(_library, libraries), _own()))


def read(named: str, sources: Sequence[Source]) -> tuple[Image, list[Diagnostic]] | None:
    """The image and the warnings of the cache entry `named`; None if there is no entry, or one that is damaged.

    sources: those of which the name was made; diagnostics refer to them."""
    content = FILES.read(named)
    if content is None:
        return None
    size = int.from_bytes(content[:LENGTH_BYTES], "little")
    try:
        rows = json.loads(content[LENGTH_BYTES:LENGTH_BYTES + size])
        diagnostics = [_diagnostic(row, sources) for row in rows]
        return decode(content[LENGTH_BYTES + size:]), diagnostics
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def write(named: str, sources: Sequence[Source], image: Image, diagnostics: Sequence[Diagnostic]) -> None:
    """Keep a compilation under a name, unless it has a warning about a library, or code that is nested too deep."""
    numbers = {id(source): number for number, source in enumerate(sources)}
    try:
        rows = json.dumps([_row(diagnostic, numbers) for diagnostic in diagnostics]).encode()
        FILES.write(named, len(rows).to_bytes(LENGTH_BYTES, "little") + rows + encode(image))
    except (LookupError, TypeError, RecursionError):
        return


def _row(diagnostic: Diagnostic, numbers: dict[int, int]) -> list[object]:
    """A message about one of the sources.  Raises KeyError for one about a library."""
    related = diagnostic.related and [numbers[id(diagnostic.related[0])], *diagnostic.related[1:]]
    return [diagnostic.code, numbers[id(diagnostic.source)], diagnostic.start, diagnostic.end, diagnostic.message,
            diagnostic.hint, related, diagnostic.raised]  # fmt: skip


def _diagnostic(row: list[Any], sources: Sequence[Source]) -> Diagnostic:
    code, number, start, end, message, hint, related, raised = row
    other = (sources[related[0]], related[1], related[2]) if related else None
    return Diagnostic(code, sources[number], start, end, message, hint, other, raised)


@cache
def _own() -> str:
    """A hash of the state of the modules that make images, of the grammar and of the shipped libraries."""
    return state_of(*(PACKAGE / room for room in ROOMS), data_folder("grammar"), data_folder("fblib"))


def _library(folder: Path) -> str:
    """A hash of all that compiling may find in a folder of libraries."""
    try:
        paths = (at / name for at, names in folders_below(folder) for name in names if name.endswith((".st", ".toml")))
        return name_of([str(folder), *(part for path in paths for part in (path.relative_to(folder).as_posix(), _content(path)))])
    except Unreadable as error:
        return reason(error)


def _content(path: Path) -> str:
    """The text of a file, or why there is none."""
    try:
        return read_file(path, SOURCE_BYTES).decode("latin-1")
    except OSError as error:
        return reason(error)
