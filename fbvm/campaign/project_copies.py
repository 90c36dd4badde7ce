"""Copies of a project's folder, in which processes change files while the project itself stays as it is.

Also as bytes, for computers that do not have the folder."""

from __future__ import annotations

import io
import os
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path

MOST_BYTES = 200_000_000
"""What a project may hold, without what is left out: a home directory is not copied by mistake."""
LEFT_OUT = ("node_modules", "__pycache__", "build", "dist", "venv")
"""Folders that are no part of a project's tests, besides those that begin with a dot and Python environments."""


class TooLarge(Exception):
    """The folder is no project, or holds too much beside it."""


def files_of(folder: Path) -> Iterator[Path]:
    """The files of a project, relative to its folder, without hidden folders, environments and what tools have made."""
    for at, folders, names in os.walk(folder):
        if "pyvenv.cfg" in names and Path(at) != folder:
            folders[:] = []
            continue
        folders[:] = sorted(each for each in folders if each not in LEFT_OUT and not each.startswith("."))
        yield from (Path(at, name).relative_to(folder) for name in sorted(names))


def _kept(folder: Path) -> Iterator[Path]:
    """The files of a project that are copied.  Raises TooLarge, OSError."""
    total = 0
    for file in files_of(folder):
        source = folder / file
        if not source.is_file():  # a socket, or a link to nowhere
            continue
        total += source.stat().st_size
        if total > MOST_BYTES:
            raise TooLarge(f"{folder} holds more than {MOST_BYTES // 1_000_000} MB: go to the folder of the project")
        yield file


def copy_project(folder: Path, target: Path) -> None:
    """Copies the files of a project into the folder `target`, which is made.  Raises TooLarge, OSError."""
    target.mkdir(parents=True)
    for file in _kept(folder):
        (target / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / file, target / file)


def pack_project(folder: Path) -> bytes:
    """The files of a project as a ZIP archive, the same bytes for the same files.  Raises TooLarge, OSError."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in _kept(folder):
            archive.writestr(zipfile.ZipInfo(file.as_posix()), (folder / file).read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def unpack_project(packed: bytes, target: Path) -> None:
    """Makes the folder `target` with the files of a packed project.  Raises OSError."""
    target.mkdir(parents=True)
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(target)
