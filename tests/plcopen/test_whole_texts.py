"""Whole documents and whole sources beside what becomes of them, word for word.  `FBVM_REWRITE=1 pytest` of this file writes them
anew; read the difference before you keep it."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from rows import each_of
from test_kept_words import DECLARED, HEAD
from test_kept_words import RUNGS as WORDS
from test_round_trip import RUNGS, lawful

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml

HERE = Path(__file__).parent
CHART = """PROGRAM Chart
VAR go, stop, a, b, c, done : BOOL; n : INT; t : TON; END_VAR
INITIAL_STEP Start:
    Count(N);
    a(S);
END_STEP
TRANSITION First (PRIORITY := 1) FROM Start TO Left := go AND NOT stop;
END_TRANSITION
TRANSITION Second (PRIORITY := 2) FROM Start TO (Up, Down) := go;
END_TRANSITION
STEP Left:
    b(L, T#500ms);
    c(D, T#1s, done);
END_STEP
TRANSITION FROM Left TO Start := Left.T > T#2s;
END_TRANSITION
STEP Up:
    a(R);
END_STEP
STEP Down:
END_STEP
TRANSITION Both FROM (Up, Down) TO Last :
    LD stop
    ANDN go
END_TRANSITION
STEP Last:
    Count(P);
END_STEP
TRANSITION Back FROM Last TO Start := n > 3;
END_TRANSITION
TRANSITION Again FROM Last TO Left := n <= 3;
END_TRANSITION
ACTION Count:
    n := n + 1;
    t(IN := go, PT := T#100ms);
END_ACTION
END_PROGRAM
"""
DOCUMENTS = sorted((HERE / "documents").glob("*.xml"))
"""A document is compared if it has a text; an empty one takes it in."""
SOURCES = {"declared": DECLARED, "words": f"{HEAD}{WORDS}END_LADDER\nEND_PROGRAM\n", "rungs": RUNGS, "chart": CHART,
           **{path.stem: path.read_text(encoding="utf-8") for path in sorted((HERE / "texts").glob("*.st"))}}


def check(path: Path, text: str) -> None:
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


def told(found: Diagnostic) -> str:
    line, column = found.source.place(found.start)
    return f"{line}:{column}: {found.severity} {found.code}: {found.message}" + (f"; {found.hint}" if found.hint else "")


def whole(made: Imported) -> str:
    """The sources of an import, and what was said of it."""
    files = [part for name, text in sorted(made.files.items()) for part in (f"=== {name}", text.rstrip("\n"))]
    return "\n".join([*files, "=== messages", *map(told, made.diagnostics), ""])


@pytest.mark.slow
@each_of("name", SOURCES)
def test_what_a_source_is_exported_to(name: str) -> None:
    made = export_xml([Source(f"{name}.st", SOURCES[name])])
    assert made.text is not None, [found.render() for found in made.diagnostics]
    lawful(made)
    text = re.sub(r'(DateTime|productVersion)="[^"]*"', r'\1=""', made.text)
    check(HERE / "texts" / f"{name}.xml", "\n".join([text, *map(told, made.diagnostics), ""]))
    check(HERE / "texts" / f"{name}.again.txt", whole(import_xml(made.text.encode())))


@pytest.mark.slow
@each_of("path", [path for path in DOCUMENTS if (HERE / "texts" / f"{path.stem}.txt").exists()], ids=lambda path: path.stem)
def test_what_a_document_is_imported_to(path: Path) -> None:
    check(HERE / "texts" / f"{path.stem}.txt", whole(import_xml(path)))
