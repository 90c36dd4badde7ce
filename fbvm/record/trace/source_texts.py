"""The texts of a program's sources, for the lines of statements in charts, tables and traces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Source
from fbvm.code.image import Image
from fbvm.syntax.text import read


def source_texts(image: Image, own: Mapping[str, Path | str], libraries: Sequence[Path] = ()) -> dict[str, str]:
    """The texts of the sources of an image by name, without those whose files are gone.

    `own` are files or texts by name; other sources are looked for in the folders `libraries` and in `fblib`."""
    texts = {}
    for name in sorted({site.file for site in image.sites}):
        known = own.get(name)
        if isinstance(known, str):
            texts[name] = known
            continue
        folders = (*libraries, *(folder.parent for folder in libraries), data_folder("fblib"))
        for path in (known, *(folder / name for folder in folders)):
            source = read(path, name) if path and path.is_file() else None
            if isinstance(source, Source):
                texts[name] = source.text
                break
    return texts
