"""Whatever the text, the parser answers with a tree and messages whose places lie in the text."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import Node
from fbvm.syntax.tree.node import names_of
from fbvm.syntax.tree.outline import dump

GOLDEN = Path(__file__).resolve().parent.parent / "golden"
TEXTS = [path.read_text(encoding="utf-8") for path in sorted(GOLDEN.glob("*/*.st"))]
PIECES = [re.findall(r"\w+|\s+|[^\w\s]", text) for text in TEXTS]
WORDS = sorted({piece for pieces in PIECES for piece in pieces if not piece.isspace()})


def check_places(text: str) -> None:
    tree, diagnostics = parse(Source("x.st", text))
    for diagnostic in diagnostics:
        assert 0 <= diagnostic.start <= diagnostic.end <= len(text)
        assert diagnostic.message and diagnostic.render()
    todo: list[Any] = [tree]
    while todo:
        value = todo.pop()
        if isinstance(value, (tuple, list)):
            todo.extend(value)
        elif isinstance(value, Node):
            assert 0 <= value.start <= value.end <= len(text)
            todo.extend(getattr(value, name) for name in names_of(value))
        else:
            assert value is None or isinstance(value, (bool, int, float, str))


@pytest.mark.slow
@given(st.text(max_size=400))
def test_any_text(text: str) -> None:
    check_places(text)


@pytest.mark.slow
@given(st.lists(st.sampled_from(WORDS), max_size=60), st.sampled_from([" ", "\n", ""]))
def test_any_words(words: list[str], between: str) -> None:
    check_places("PROGRAM p " + between.join(words))


@pytest.mark.slow
@settings(deadline=None)
@given(st.data())
def test_any_change_of_a_program(data: st.DataObject) -> None:
    pieces = list(data.draw(st.sampled_from(PIECES)))
    start = data.draw(st.integers(0, len(pieces) - 1))
    pieces = pieces[start:start + data.draw(st.sampled_from([20, 100, 300]))]
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(pieces)))
        how = data.draw(st.sampled_from(["insert", "delete", "double", "cut"]))
        if how == "insert":
            pieces.insert(at, data.draw(st.sampled_from(WORDS)))
        elif how == "delete":
            del pieces[at:at + 1]
        elif how == "double":
            pieces[at:at] = pieces[at:at + 3]
        else:
            del pieces[at:]
    check_places("".join(pieces))


@pytest.mark.slow
@settings(deadline=None, max_examples=times(30))
@given(st.sampled_from(sorted((GOLDEN / "syntax").glob("*.st"))), st.sampled_from([str.upper, str.lower, str.swapcase]))
def test_case_does_not_matter_to_the_structure(path: Path, change: Any) -> None:
    text = path.read_text(encoding="utf-8")
    changed, diagnostics = parse(Source("x", change(text)))
    assert [d for d in diagnostics if d.severity == "error"] == []
    same = dump(parse(Source("x", text))[0]).lower().splitlines()
    assert [line.split("=")[0] for line in dump(changed).lower().splitlines()] == [line.split("=")[0] for line in same]


@pytest.mark.slow
@given(st.sampled_from(TEXTS), st.integers(0, 3000))
@settings(deadline=None)
def test_a_text_cut_anywhere_is_read_to_its_end(text: str, at: int) -> None:
    check_places(text[:at])
