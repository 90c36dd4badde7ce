"""Sources beside the tree or the messages that they give.  `FBVM_REWRITE=1 pytest tests/golden` writes them anew; look at
the difference before you keep it."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from lang_corpus import HERE as CORPUS
from lang_corpus import read
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.node import walk
from fbvm.syntax.tree.outline import dump

HERE = Path(__file__).resolve().parent
REWRITE = bool(os.environ.get("FBVM_REWRITE"))


def check_golden(path: Path, actual: str) -> None:
    if REWRITE:
        path.write_text(actual, encoding="utf-8")
    assert actual == path.read_text(encoding="utf-8")


@each_of("path", sorted((HERE / "syntax").glob("*.st")), ids=lambda p: p.stem)
def test_tree_of_a_good_source(path: Path) -> None:
    tree, diagnostics = parse(Source(path.name, path.read_text(encoding="utf-8")))
    assert [d.render() for d in diagnostics if d.severity == "error"] == []
    check_golden(path.with_suffix(".tree"), dump(tree))


@pytest.mark.slow
@each_of("path", sorted((HERE / "errors").glob("*.st")), ids=lambda p: p.stem)
def test_messages_of_a_wrong_source(path: Path) -> None:
    tree, diagnostics = parse(Source(path.name, path.read_text(encoding="utf-8")))
    assert diagnostics and tree.end == path.stat().st_size - sum(len(c.encode()) - 1 for c in path.read_text("utf-8"))
    check_golden(path.with_suffix(".messages"), "".join(d.render() + "\n\n" for d in diagnostics))


PLACES = HERE / "places"
KEPT = {kept: CORPUS / kept.replace(".", "/", 1) for kept in sorted(path.name for path in PLACES.iterdir())}
"""The kept files, each with the file of the corpus whose mistakes it has."""


def told(found: Diagnostic, first_line: int) -> str:
    """A message on one line: `line:column: code ! what is marked ! message ! hint`; `~` if some text was passed over.

    Lines are those of the program, which begins at `first_line` of its file."""
    line, column = found.source.place(found.start)
    line -= first_line
    marked = found.source.text[found.start : found.end]
    lost = "" if found.lossless else "~"
    parts = [f"{line}:{column}: {lost}{found.code}", marked, found.message, found.hint]
    return " ! ".join(parts).rstrip(" !").replace("\n", "$L")


@pytest.mark.slow
@each_of("name", KEPT)
def test_places_of_mistakes_and_how_much_is_read(name: str) -> None:
    """A program that was written since has no place yet: `FBVM_REWRITE=1` takes it in."""
    titles = None if REWRITE else re.findall("^--- (.*)$", (PLACES / name).read_text(encoding="utf-8"), re.M)
    lines = []
    for program in read(KEPT[name].with_suffix(".st")):
        is_wrong = any(message.code < "S02" for message in program.diagnostics)
        if not is_wrong or titles is not None and program.title not in titles:
            continue
        tree, diagnostics = parse(Source(program.path.name, program.text))
        if wrong := [told(found, program.line) for found in diagnostics]:
            lines += [f"--- {program.title}", *wrong, f"{sum(1 for _ in walk(tree))} nodes"]
    check_golden(PLACES / name, "\n".join([*lines, ""]))
