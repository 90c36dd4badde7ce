"""A whole project beside its sources, their places in it and all that is said of it, and exports beside the lines that they
change, word for word.  `FBVM_REWRITE=1 pytest` of this file writes the texts anew; read the difference before you keep it."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

import pytest
from cx_text import SEPARATOR
from test_exporting import LATER

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.cx.write.exporting import export_into
from fbvm.interchange.imported import Imported

TEXTS = Path(__file__).parent / "texts"
SAVED = (TEXTS / "line.cxt").read_text(encoding="utf-8").replace("|", SEPARATOR)
"""A project of our own making with whatever a table, a rung and a block can hold; `|` stands between fields of cells."""


def check(name: str, lines: list[str]) -> None:
    path, text = TEXTS / name, "\n".join(lines).replace(SEPARATOR, "|") + "\n"
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


def told(found: Diagnostic) -> str:
    line, column = found.source.place(found.start)
    marked = found.source.text[found.start : found.end].strip()
    return f"{line}:{column}: {found.severity} {found.code}: {found.message}; {found.hint} [{marked}]"


def placed(made: Imported, file: str) -> list[str]:
    """The lines of a source, each with the place in the project for which it stands."""
    lines = made.files[file].splitlines()
    places = made.places.get(file, [None] * len(lines))
    return [f"{line:48} | {place.where} [{' '.join(place.document.text[place.start : place.end].split())}]" if place else line
            for line, place in zip(lines, places, strict=True)]  # fmt: skip


@pytest.mark.slow
def test_what_a_project_is_imported_to() -> None:
    made = import_project(SAVED.encode(), "line.cxt", memory=True)
    check("line.txt", [*(line for file in made.files for line in (f"=== {file}", *placed(made, file))),
                       "=== messages", *map(told, made.diagnostics)])  # fmt: skip


TWO = LATER.bytes()
MAIN, GLOBALS = "NewProgram1.st", "globals.st"
CHANGES: dict[str, tuple[str, str, str]] = {
    "nothing": (MAIN, "", ""), "a step": (MAIN, "OUT     Pump", "OUT     100.07"),
    "a step with a prefix and a code": (MAIN, "MOV(021)", "!@MOV(021)"),
    "a note of a step": (MAIN, "// a note", '// a "quoted", note'),
    "a comment of two lines": (MAIN, "RUNG 1 alone", "RUNG 1 alone\n    ' and more"),
    "a comment that goes": (MAIN, "RUNG 1 alone", "RUNG 1"),
    "a rung in front": (MAIN, "    RUNG 0", "    RUNG 7 new\n        LD      Start\n        OUT     Pump\n    RUNG 0"),
    "two rungs for one": (MAIN, "RUNG 1 alone", "RUNG 1\n        LD Start\n        OUT 100.02\n    RUNG 2 alone"),
    "a rung without a head": (MAIN, "SECTION END", "SECTION END\n    LD      Start\n    OUT     100.03"),
    "all rungs of a section": (MAIN, "SECTION END", "' SECTION"), "names in capitals": (MAIN, "LD      Start", "LD      START"),
    "a section that there is not": (MAIN, "SECTION END", "SECTION Last"), "an error": (MAIN, "END_LADDER", ""),
    "a type": (GLOBALS, ": WORD", ": INT"), "a size": (GLOBALS, ": WORD", ": ARRAY [0 .. 4] OF WORD"),
    "the comment of a CHANNEL": (GLOBALS, ": WORD;", ": WORD;  // rough"), "an address": (GLOBALS, "CIO 0.00", "%W3.01"),
    "an address that goes": (GLOBALS, "AT CIO 0.00", ""), "a timer's flag": (GLOBALS, "AT CIO 0.00", "AT TF0003"),
    "a counter's flag": (GLOBALS, "AT CIO 0.00", "AT CNF0003"), "a comment with a quote": (GLOBALS, "start button", '2" button'),
    "a symbol that goes": (GLOBALS, "    Start AT CIO 0.00   : BOOL;  // start button\n", ""),
    "a type that tables have not": (GLOBALS, ": WORD", ": TON"), "a constant": (GLOBALS, "520", "521"),
    "a local symbol": (MAIN, "Helper : BOOL;", "Helper : BOOL;\n    More AT D9 : INT; // of it"),
    "another POU": (MAIN, "PROGRAM NewProgram1", "FUNCTION_BLOCK F END_FUNCTION_BLOCK\nPROGRAM NewProgram1"),
    "another name": (MAIN, "PROGRAM NewProgram1", "PROGRAM Another"),
}  # fmt: skip
"""What is changed: the file, a text in it, and what stands there instead."""


def exported(file: str, old: str, new: str) -> list[str]:
    """What the export of a change says, and the lines of the project that go and come."""
    files = import_project(TWO, "two.cxt").files
    assert old in files[file], files[file]
    sources = [Source(name, text.replace(old, new, 1) if name == file else text) for name, text in files.items()]
    made = export_into(TWO, "two.cxt", sources, compressed=False)
    before, after = (data.decode("cp1252").splitlines() for data in (TWO, made.data or TWO))
    rows = difflib.unified_diff(before, after, n=0, lineterm="")
    changed = [row for row in rows if not row.startswith(("---", "+++", "@@"))]
    return [*made.changed, *map(told, made.diagnostics), *changed]


@pytest.mark.slow
def test_what_the_export_of_a_change_changes() -> None:
    check("exports.txt", [line for name, change in CHANGES.items() for line in (f"=== {name}", *exported(*change))])
