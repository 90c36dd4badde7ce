"""Source files as somebody names them, with the sources within a project of another tool in place of its file.

The readers of other tools' files are loaded when there is such a file: most runs have none."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, read_file, resolved
from fbvm.interchange.codesys2 import is_binary, is_export
from fbvm.interchange.cx.markup import is_project
from fbvm.interchange.dialect_signs import FAMILIES
from fbvm.interchange.imported import Imported
from fbvm.interchange.twincat import OBJECT_SUFFIXES, PROJECT_SUFFIX, SYSTEM_SUFFIX, TASK_SUFFIX, TASKS

CX_SUFFIXES = (".cxp", ".cxt")
TWINCAT_SUFFIXES = (*OBJECT_SUFFIXES, TASK_SUFFIX)
PROJECT_SUFFIXES = (PROJECT_SUFFIX, SYSTEM_SUFFIX)
SUFFIXES = (*CX_SUFFIXES, *PROJECT_SUFFIXES, *TWINCAT_SUFFIXES)
"""Endings, in small letters, of files of other tools; PLCopen XML is known by what it says."""
_PROGRAM = re.compile(r"(?im)^\s*PROGRAM\s+(?:(?:PUBLIC|INTERNAL)\s+)?([a-z_]\w*)")
DOCUMENT, HEAD_BYTES = b"plcopen.org/xml/tc6", 4_000
"""What a document in PLCopen XML has among its first bytes."""


def usual_dialect(paths: Iterable[Path]) -> str:
    """The dialect of files for which nobody has named one: that of the tool whose files they are.

    For documents in PLCopen XML that is the dialect of the tool that wrote the first of them, if its header names one."""
    paths = list(paths)
    if any(path.suffix.lower() in (*PROJECT_SUFFIXES, *TWINCAT_SUFFIXES) for path in paths):
        return "twincat"
    documents = (made for path in paths if (made := _document(path)) is not None)
    return next((FAMILIES[made.family] for made in documents if made.family in FAMILIES), "standard")


def _document(path: Path) -> Imported | None:
    """The sources within a document in PLCopen XML; None for all other files, and for one that cannot be read."""
    if path.suffix.lower() in (".st", *SUFFIXES):
        return None
    try:
        return within(path)
    except OSError:
        return None


def is_cx_project(path: Path) -> bool:
    """Whether a file is a project of CX-Programmer, or is called so; devices and pipes are none.  Raises OSError if the
    file cannot be read."""
    return path.suffix.lower() in CX_SUFFIXES or path.is_file() and is_project(read_file(path, SOURCE_BYTES))


def within(path: Path, resource: str | None = None, memory: bool = False) -> Imported | None:
    """The sources within a file: a project of CX-Programmer or TwinCAT, an object of TwinCAT, a document in PLCopen XML, an
    export, project or library of CODESYS 2.3; None for all others.

    `resource` is the name of the PLC where a project has several; with `memory` the contents of CX-Programmer's memory window are
    initial values.  Raises OSError if a file that is called so cannot be read."""
    suffix = path.suffix.lower()
    if suffix == PROJECT_SUFFIX:
        from fbvm.interchange.twincat.project import read_project

        return read_project(path)
    if suffix == SYSTEM_SUFFIX:
        from fbvm.interchange.twincat.system import read_system

        return read_system(path)
    try:
        data = read_file(path, SOURCE_BYTES) if path.is_file() or suffix in SUFFIXES else b""
    except OSError:
        if suffix in SUFFIXES:
            raise
        return None
    return _within(data, str(path), suffix, resource, memory)


@lru_cache(maxsize=4)
def _within(data: bytes, name: str, suffix: str, resource: str | None, memory: bool) -> Imported | None:
    if suffix in TWINCAT_SUFFIXES:
        from fbvm.interchange.twincat.objects import read_object
        from fbvm.interchange.twincat.project import task_source

        made = read_object(data, name)
        source = task_source(name, [made.task]) if made.task else made.source
        texts = {source.name: source.text} if source else {}
        return Imported(texts, made.diagnostics, "twincat", f"{name} is an object of TwinCAT")
    if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") and DOCUMENT in data[:HEAD_BYTES]:
        from fbvm.interchange.plcopen.read.importing import declared_beside, import_xml

        return _below(name, import_xml(data, name, beside=declared_beside(Path(name))))
    if is_binary(data):
        from fbvm.interchange.codesys2.importing import read_binary

        return _below(name, read_binary(data, name))
    if is_export(data):
        from fbvm.interchange.codesys2.importing import read_export

        return read_export(data, name)
    if suffix in CX_SUFFIXES or is_project(data):
        from fbvm.interchange.cx.read.importing import import_project

        return _below(name, import_project(data, name, resource, memory=memory))
    return None


def _below(name: str, made: Imported) -> Imported:
    """The same with names of files that lie below the document."""
    return replace(made, files={f"{name}/{file}": text for file, text in made.files.items()},
                   find_places=lambda: {f"{name}/{file}": places for file, places in made.places.items()})


def given_sources(paths: Sequence[Path], resource: str | None = None, memory: bool = False) -> dict[str, Path | str]:
    """By the name that messages use, each source of these files: its path, or its text if it stands within another file; see
    `within`.  Raises OSError if a project cannot be read."""
    return sources_by_name({path: within(path, resource, memory) for path in paths})


def sources_by_name(found: Mapping[Path, Imported | None]) -> dict[str, Path | str]:
    """By the name that messages use, each source of files in which `within` has looked: its path, or its text.

    Of several projects of TwinCAT the first runs its tasks; the others are libraries that it uses.  A PROGRAM of one of those
    is left out if a project in front has one of that name: in TwinCAT a project does not see programs of its libraries."""
    found = with_used(found)
    sources: dict[str, Path | str] = {}
    programs: set[str] = set()
    projects = [path for path in found if path.suffix.lower() in PROJECT_SUFFIXES]
    values = {key: value for made in found.values() if made is not None for key, value in made.parameters.items()}
    for path, made in found.items():
        if made is not None and values and path in projects[1:]:
            from fbvm.interchange.twincat.references import with_parameters

            made = with_parameters(made, values)
        own = _programs_of(made) if made is not None and path in projects else {}
        sources.update({str(path): path} if made is None else
                       {name: text for name, text in made.files.items() if own.get(name) not in programs})
        programs.update(own.values())
        if path in projects[1:]:
            for name in [name for name in made.files if name.endswith(f"{PROJECT_SUFFIX}/{TASKS}")] if made else []:
                sources.pop(name)
    return sources


def _programs_of(made: Imported) -> dict[str, str]:
    """By file of a project of TwinCAT the name, in small letters, of the PROGRAM in it."""
    return {name: said[1].lower() for name, text in made.files.items()
            if Path(name).suffix.lower() in OBJECT_SUFFIXES and (said := _PROGRAM.search(text)) is not None}


def with_used(found: Mapping[Path, Imported | None]) -> dict[Path, Imported | None]:
    """The same files, and behind them the projects that those among them refer to, and these to others.

    A project that cannot be read is left out: what names something of it says that it is not known."""
    known = dict(found)
    waiting = [used for made in found.values() if made is not None for used in made.uses]
    named = {resolved(path) for path in known} if waiting else set()
    while waiting:
        path = waiting.pop(0)
        if resolved(path) in named:
            continue
        named.add(resolved(path))
        try:
            made = within(path)
        except OSError:
            continue
        known[path] = made
        waiting += made.uses if made is not None else ()
    return known


def source_files(sources: Mapping[str, Path | str]) -> dict[str, Path]:
    """The files of sources by name: source texts, and objects of TwinCAT, whose lines are those of their files."""
    return {name: Path(name) if isinstance(one, str) else one for name, one in sources.items()
            if isinstance(one, Path) or Path(name).suffix.lower() in OBJECT_SUFFIXES}


def inputs(paths: Sequence[Path], resource: str | None = None,
           memory: bool = False) -> tuple[list[Path | Source], list[Diagnostic]]:
    """What the compiler takes for these files, and what is said about projects among them; see `within`.  Raises OSError if a
    project cannot be read."""
    return inputs_of({path: within(path, resource, memory) for path in paths})


def inputs_of(found: Mapping[Path, Imported | None]) -> tuple[list[Path | Source], list[Diagnostic]]:
    """What the compiler takes for files in which `within` has looked, and what is said about projects among them."""
    found = with_used(found)
    diagnostics = [one for made in found.values() if made is not None for one in made.diagnostics]
    return [Source(name, one) if isinstance(one, str) else one for name, one in sources_by_name(found).items()], diagnostics
