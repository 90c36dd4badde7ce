"""Source files as somebody names them, with the sources within a project of CX-Programmer in place of its file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, read_file
from fbvm.interchange.cx.markup import is_project
from fbvm.interchange.cx.read.importing import ImportedProject, import_project

SUFFIXES = (".cxp", ".cxt")


def imported(path: Path, resource: str | None = None) -> ImportedProject | None:
    """The sources within a file if it is a project of CX-Programmer, or is called so; None for all others.

    `resource` is the name of the PLC where the project has several.  Raises OSError if a project cannot be read."""
    is_called_so = path.suffix.lower() in SUFFIXES
    try:
        data = read_file(path, SOURCE_BYTES) if path.is_file() or is_called_so else b""
    except OSError:
        if is_called_so:
            raise
        return None
    return _imported(data, str(path), resource) if is_called_so or is_project(data) else None


@lru_cache(maxsize=4)
def _imported(data: bytes, name: str, resource: str | None) -> ImportedProject:
    return import_project(data, name, resource)


def given_sources(paths: Sequence[Path], resource: str | None = None) -> dict[str, Path | str]:
    """By the name that messages use, each source of these files: its path, or its text if it stands within a project.
    Raises OSError if a project cannot be read."""
    found: dict[str, Path | str] = {}
    for path in paths:
        made = imported(path, resource)
        if made is None:
            found[str(path)] = path
        else:
            found.update((f"{path}/{name}", text) for name, text in made.files.items())
    return found


def inputs(paths: Sequence[Path], resource: str | None = None) -> tuple[list[Path | Source], list[Diagnostic]]:
    """What the compiler takes for these files, and what is said about projects among them.  Raises OSError if a project
    cannot be read."""
    diagnostics = [one for path in paths if (made := imported(path, resource)) is not None for one in made.diagnostics]
    given = given_sources(paths, resource)
    return [Source(name, one) if isinstance(one, str) else one for name, one in given.items()], diagnostics
