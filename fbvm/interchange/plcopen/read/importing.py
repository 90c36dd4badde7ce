"""Import of PLCopen TC6 XML: a document in, source files and diagnostics out; nothing is left out without a diagnostic."""

from __future__ import annotations

from pathlib import Path

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import parse_markup, read_markup
from fbvm.interchange.plcopen.read.document import Reading
from fbvm.interchange.plcopen.read.producer import producer
from fbvm.interchange.plcopen.read.project import read_project
from fbvm.interchange.plcopen.read.sources import sources

_DECLARED_TWICE, _HEAD = "xmlns:ns1=", 4_000
"""A second prefix for the namespace of a document, and in how many characters at its beginning it stands."""


def import_xml(document: Path | str | bytes, name: str = "", order: str = "") -> Imported:
    """Import a file by its path, or the bytes of one, whose `name` messages then use.

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
    reading = Reading(source, producer(root, _DECLARED_TWICE in source.text[:_HEAD], order))
    project = read_project(reading, root)
    files = sources(reading, project) if project else {}
    reading.close()
    return Imported(files, sorted(reading.diagnostics, key=Diagnostic.order), reading.producer.family, reading.producer.because)
