"""The texts of a program's sources, as far as their files are still there: for lines beside what is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Source
from fbvm.code.image import Image
from fbvm.syntax.text import read


def source_texts(image: Image, own: Mapping[str, Path | str], libraries: Sequence[Path] = ()) -> dict[str, str]:
    """Texts by name.  `own` are files, or their texts; the rest is looked for in libraries."""
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
