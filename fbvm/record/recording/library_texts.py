"""Folders of libraries as the file of a recording holds them, so that its program can be compiled where they are not."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fbvm.base.diagnostics import Source
from fbvm.base.files import resolved, write_file
from fbvm.syntax.text import read

SUFFIXES = (".st", ".toml")
"""Of files that compiling may look at."""
MOST_CHARACTERS = 16 << 20
"""Of all folders together; larger ones are not held."""
_PART = re.compile(r"[^\x00-\x1f/\\:*?\"<>|]+")
"""A name of a file or a folder that every system takes, and that leads nowhere else."""
_DEEPEST = 16


@dataclass(frozen=True)
class LibraryTexts:
    """The texts of one folder: its name, and for each file the path below it, with slashes, and the text."""

    name: str
    files: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, data: Any) -> LibraryTexts:
        """From plain data.  Raises ValueError for a path that leads out of the folder, TypeError for other data."""
        name, files = data
        found = cls(str(name), tuple((str(path), str(text)) for path, text in files))
        for path in (found.name, *(path for path, _ in found.files)):
            parts = path.split("/")
            if len(parts) > _DEEPEST or not all(_PART.fullmatch(part) and part.strip(". ") for part in parts):
                raise ValueError(f"{path!r} is no file of a library")
        if "/" in found.name or not all(path.endswith(SUFFIXES) for path, _ in found.files):
            raise ValueError("a library has sources and their descriptions only")
        return found

    def as_data(self) -> list[Any]:
        """As plain data."""
        return [self.name, self.files]


def library_texts(folders: Sequence[Path]) -> tuple[LibraryTexts, ...]:
    """The texts in some folders of libraries, in their order; none if they are too large, or a name would not do elsewhere."""
    made = tuple(LibraryTexts(folder.name or resolved(folder).name, tuple(_texts(folder))) for folder in folders)
    if sum(len(text) for held in made for _, text in held.files) > MOST_CHARACTERS:
        return ()
    try:
        return tuple(LibraryTexts.of(held.as_data()) for held in made)
    except ValueError:
        return ()


def _texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Path below the folder and text of each file that can be read."""
    for at, _, names in sorted(os.walk(folder)):
        for name in sorted(names):
            path = Path(at, name)
            below = path.relative_to(folder).as_posix()
            if name.endswith(SUFFIXES) and isinstance(source := read(path, below), Source):
                yield below, source.text


@contextmanager
def unpacked(held: Sequence[LibraryTexts]) -> Iterator[list[Path]]:
    """The folders again, for a `with` block.  Raises OSError if they cannot be written."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as place:
        folders = [Path(place, str(number), library.name) for number, library in enumerate(held)]
        for folder, library in zip(folders, held, strict=True):
            folder.mkdir(parents=True)
            for below, text in library.files:
                path = folder / below
                path.parent.mkdir(parents=True, exist_ok=True)
                write_file(path, text)
        yield folders
