"""Import of PLCopen TC6 XML: a document in, source files and diagnostics out; nothing is left out without a diagnostic."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import parse_markup, read_markup
from fbvm.interchange.plcopen.read.document import Reading, Variable
from fbvm.interchange.plcopen.read.producer import producer
from fbvm.interchange.plcopen.read.project import read_project
from fbvm.interchange.plcopen.read.sources import sources
from fbvm.interchange.plcopen.read.types import initial_text

_DECLARED_TWICE, _HEAD = "xmlns:ns1=", 4_000
"""A second prefix for the namespace of a document, and in how many characters at its beginning it stands."""
_FILES = ("pyfile.xml", "cfile.xml")
_MOST_FOLDERS = 100
"""In folders `name@kind` beside a document of Beremiz, files that list variables of Python and C code; how many folders are
looked into."""


def import_xml(document: Path | str | bytes, name: str = "", order: str = "",
               beside: Mapping[str, Variable] | None = None) -> Imported:
    """Import a file by its path, or the bytes of one, whose `name` messages then use.  `beside` are variables that other files of
    the project declare (`declared_beside`); for a path they are found.

    `order` says in which order drawings are evaluated, "network", "beremiz1", "document",
    "position" or "ids"; without it, as the tool does it that wrote the
    document.  Never raises for what the document contains; the same document gives the same files."""
    if isinstance(document, bytes):
        found = parse_markup(document, name or "document.xml")
    else:
        found = read_markup(Path(document), name or str(document))
    if isinstance(found, Diagnostic):
        return Imported({}, [found])
    source, root = found
    if beside is None and not isinstance(document, bytes):
        beside = declared_beside(Path(document))
    reading = Reading(source, producer(root, _DECLARED_TWICE in source.text[:_HEAD], order), beside=beside or {})
    project = read_project(reading, root)
    files = sources(reading, project) if project else {}
    reading.close()
    return Imported(files, sorted(reading.diagnostics, key=Diagnostic.order), reading.producer.family, reading.producer.because)


def declared_beside(document: Path) -> dict[str, Variable]:
    """By name in capitals, the variables that the Python and C code of a project of Beremiz declares in files beside the
    document, with type and initial value; the first of several.  A damaged file has none.  The code is not executed."""
    found: dict[str, Variable] = {}
    try:
        folders = sorted(entry.path for entry in os.scandir(document.parent) if "@" in entry.name and entry.is_dir())
    except OSError:
        return {}
    for folder in folders[:_MOST_FOLDERS]:
        for path in (Path(folder, name) for name in _FILES):
            read = read_markup(path, str(path)) if path.is_file() else None
            if read is None or isinstance(read, Diagnostic):
                continue
            for listed in read[1].all("variables"):
                for one in listed.all("variable"):
                    name, kind = one.get("name"), one.get("type")
                    if name.isidentifier() and kind.isidentifier():
                        found.setdefault(name.upper(), Variable(name, kind, initial_text(one.get("initial"), kind, "beremiz")))
    return found
