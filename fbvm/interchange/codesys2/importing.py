"""Sources of a project, library or export of CODESYS 2.3: a file for each POU, type and list of global variables."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.codesys2 import is_binary
from fbvm.interchange.codesys2.exports import as_source
from fbvm.interchange.codesys2.objects import Piece, pieces
from fbvm.interchange.imported import Imported
from fbvm.interchange.source_files import SourceFiles
from fbvm.syntax.text import decode

FAMILY = "codesys2"
_MARKS = re.compile(r"(?ms)^\(\* @[A-Z_]+ := .*?\*\)[ \t]*\r?\n?")
_LINES_LEFT = re.compile(r"\n(?:[ \t]*\n){3,}")
"""What is left of the lines of a diagram, of which few are needed for its text."""
_FRONT = re.compile(r"(?m)(?:^\(\* @(?:NESTEDCOMMENTS|GLOBAL_VARIABLE_LIST|PATH|OBJECTFLAGS|SYMFILEFLAGS) := .*\r?\n)+")
"""The marks in front of an object."""
_DECLARED = re.compile(r"(?m)^[ \t]*(?:(?:FUNCTION_?BLOCK|FUNCTION|PROGRAM|TYPE)\s+(\w+)|VAR_GLOBAL\b|VAR_CONFIG\b|TYPE\b)")
_EMPTY = re.compile(r"(?:\s|\(\*(?:[^*]|\*(?!\)))*\*\))*VAR_(?:GLOBAL|CONFIG)(?:\s+(?:RETAIN|CONSTANT|PERSISTENT))*\s+END_VAR\s*")
_LIST_NAME = re.compile(r"\(\* @GLOBAL_VARIABLE_LIST := '([^']*)' \*\)")


def read_export(data: bytes, name: str) -> Imported:
    """The program in an export as one source, at the lines and columns of the file."""
    found = decode(data, name)
    if not isinstance(found, Source):
        return Imported({}, [found])
    source, said = as_source(found)
    return Imported({name: source.text}, said, FAMILY, f"{name} is an export of CODESYS 2.3")


def read_binary(data: bytes, name: str) -> Imported:
    """The objects of a project or library.  PROGRAMs of a library that are diagrams are left out with a warning."""
    files, said, because = SourceFiles(), [], f"{name} is a file of CODESYS 2.3"
    document = Source(name, "")
    for piece in pieces(data):
        if piece.diagram:
            said.append(_diagram(document, piece, name))
        elif piece.kind or not _is_empty(piece.text):
            files.add(piece.name, [piece.text.rstrip("\n")])
    if not files.lines:
        said.append(Diagnostic("X0105", document, 0, 0, f"{name} has no declaration that can be read",
                               "export the project as text from CODESYS: Project > Export"))
    return Imported({f"{file}.st": lines[0] + "\n" for file, lines in files.lines.items()}, said, FAMILY, because, is_text=False)


def _diagram(document: Source, piece: Piece, name: str) -> Diagnostic:
    if piece.kind == "PROGRAM" and name.lower().endswith(".lib"):
        return Diagnostic("X0190", document, 0, 0, f"the PROGRAM {piece.name} of the library is a diagram and is left out")
    why = f"the body of {piece.kind} {piece.name} is a diagram, which is not read from {name}"
    return Diagnostic("X0203", document, 0, 0, why, "open the project in CODESYS 3 and export it as PLCopen XML")


def _is_empty(text: str) -> bool:
    """Whether a text is a list of global variables without a variable."""
    return _EMPTY.fullmatch(text) is not None


def import_codesys2(data: bytes, name: str) -> Imported:
    """A project, library or export as a file for each of its objects."""
    if is_binary(data):
        return read_binary(data, name)
    made = read_export(data, name)
    if not made.files:
        return made
    files = SourceFiles()
    for title, text in _objects(made.files[name]):
        files.add(title, [text])
    return replace(made, files={f"{file}.st": lines[0] + "\n" for file, lines in files.lines.items()})


def _objects(text: str) -> Iterator[tuple[str, str]]:
    """The name and the text of each object of an export, without the marks of CODESYS."""
    starts = [found.start() for found in _FRONT.finditer(text)] or [0]
    for start, end in pairwise((*starts, len(text))):
        listed, declared = _LIST_NAME.search(text, start, end), _DECLARED.search(text, start, end)
        written = _LINES_LEFT.sub("\n\n", _MARKS.sub("", text[start:end]).strip())
        if written and declared and not _is_empty(written):
            yield listed[1] if listed else declared[1] or "Globals", written


def library_description(made: Imported, name: str) -> str:
    """The `library.toml` for the sources of a library, so that programs find them by name."""
    lists = [file for file, text in made.files.items() if re.search(r"(?m)^\s*VAR_GLOBAL\b", text)]
    words = ", ".join(f'"{file}"' for file in lists)
    return f'title = "{name}"\nglobals = []\nlists = [{words}]\n'
