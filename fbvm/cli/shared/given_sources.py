"""The sources that a command line names: files, and the sources within a project of CX-Programmer or in PLCopen XML."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import click

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, read_file, reason
from fbvm.interchange.cx.markup import is_project
from fbvm.interchange.cx.read.importing import ImportedProject, import_project
from fbvm.interchange.plcopen.read.importing import Imported, import_xml
from fbvm.syntax.text import read

SUFFIXES = (".cxp", ".cxt")


DOCUMENT, HEAD_BYTES = b"plcopen.org/xml/tc6", 4_000
"""What a document in PLCopen XML has among its first bytes."""


def is_cx_project(path: Path) -> bool:
    """Whether a file is a project of CX-Programmer, or is called so."""
    return path.suffix.lower() in SUFFIXES or is_project(read_file(path, SOURCE_BYTES))


def imported(path: Path) -> ImportedProject | Imported | None:
    """The sources within a file if it is a project of CX-Programmer, or is called so, or a document in PLCopen XML; None for
    all others.

    The option --resource of the present command chooses a PLC where the project has several.  Ends the verb with status 2 if the
    file cannot be read."""
    resource = click.get_current_context().meta.get("fbvm.resource") if click.get_current_context(silent=True) else None
    try:
        data = read_file(path, SOURCE_BYTES) if path.is_file() else b""
    except OSError as error:
        if path.suffix.lower() in SUFFIXES:
            raise click.UsageError(f"{path} cannot be read: {reason(error)}") from None
        return None
    if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") and DOCUMENT in data[:HEAD_BYTES]:
        return _document(data, str(path))
    if path.suffix.lower() not in SUFFIXES and not is_project(data):
        return None
    return _imported(data, str(path), resource)


@lru_cache(maxsize=4)
def _imported(data: bytes, name: str, resource: str | None) -> ImportedProject:
    return import_project(data, name, resource)


@lru_cache(maxsize=4)
def _document(data: bytes, name: str) -> Imported:
    return import_xml(data, name)


def given_sources(paths: Sequence[Path]) -> dict[str, Path | str]:
    """By the name that messages use, each source of these files: its path, or its text if it stands within a project."""
    found: dict[str, Path | str] = {}
    for path in paths:
        made = imported(path)
        if made is None:
            found[str(path)] = path
        else:
            found.update((f"{path}/{name}", text) for name, text in made.files.items())
    return found


def inputs(paths: Sequence[Path]) -> tuple[list[Path | Source], list[Diagnostic]]:
    """What the compiler takes for these files, and what is said about projects among them."""
    diagnostics = [diagnostic for path in paths if (made := imported(path)) is not None for diagnostic in made.diagnostics]
    return [Source(name, one) if isinstance(one, str) else one for name, one in given_sources(paths).items()], diagnostics


def families(paths: Sequence[Path]) -> list[tuple[str, str]]:
    """The family of tools that wrote each document among some files, with the reason."""
    found = []
    for made in map(imported, paths):
        if isinstance(made, Imported):
            found.append((made.family, made.because))
    return found


def sources_of(paths: Sequence[Path]) -> list[Source]:
    """The sources of these files that can be read."""
    texts = [one if isinstance(one, Source) else read(one, str(one)) for one in inputs(paths)[0]]
    return [text for text in texts if isinstance(text, Source)]
