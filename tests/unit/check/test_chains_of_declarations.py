"""Declarations that need one another: a chain of thousands is reported once, at the declaration where it begins."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from rows import each_of

from fbvm.check.symbols import size_limits
from fbvm.code.compiler import compile_text, passes

LENGTH, FRAMES = 200, 1200


@pytest.fixture(autouse=True)
def _small_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer frames than a chain of this module needs, in place of the usual 20,000."""

    @contextmanager
    def room() -> Iterator[None]:
        before = sys.getrecursionlimit()
        sys.setrecursionlimit(FRAMES)
        yield
        sys.setrecursionlimit(before)

    monkeypatch.setattr(passes, "room", room)


def _chain(link: str, last: str) -> str:
    return "".join(link.format(n=n, next=n + 1) for n in range(LENGTH)) + last.format(n=LENGTH)


BLOCKS = _chain("FUNCTION_BLOCK F{n} VAR b : F{next}; END_VAR b(); END_FUNCTION_BLOCK\n",
                "FUNCTION_BLOCK F{n} END_FUNCTION_BLOCK\n")
CONSTANTS = _chain("c{n} : INT := c{next}; ", "c{n} : INT := 1; ")


@pytest.mark.slow
@each_of(("text", "said"), (
    (BLOCKS + "PROGRAM Main VAR x : F0; END_VAR x(); END_PROGRAM", "F0 needs a declaration"),
    ("PROGRAM Main VAR x : F0; END_VAR x(); END_PROGRAM\n" + BLOCKS, "Main needs a declaration"),
    (f"VAR_GLOBAL CONSTANT {CONSTANTS} END_VAR PROGRAM Main ; END_PROGRAM", "c0 needs"),
    (f"PROGRAM Main VAR CONSTANT {CONSTANTS} END_VAR ; END_PROGRAM", "Main needs"),
    (_chain("TYPE E{n} : (a{n} := E{next}#a{next}); END_TYPE\n", "TYPE E{n} : (a{n}); END_TYPE\n") +
     "PROGRAM Main VAR x : E0; END_VAR x := E0#a0; END_PROGRAM", "E0 needs"),
))  # fmt: skip
def test_a_chain_that_is_too_long_is_one_message(text: str, said: str) -> None:
    found = compile_text(text).errors
    assert [each.code for each in found] == ["S0106"]
    assert found[0].message.startswith(said)


@pytest.mark.slow
def test_a_chain_through_files_of_a_library(tmp_path: Path) -> None:
    for part in BLOCKS.splitlines(keepends=True):
        (tmp_path / f"{part.split()[1]}.st").write_text(part, encoding="utf-8")
    found = compile_text("PROGRAM Main VAR x : F0; END_VAR x(); END_PROGRAM", libraries=[tmp_path]).errors
    assert [each.code for each in found] == ["S0106"]


@pytest.mark.slow
@each_of(("link", "last"), (
    ("TYPE T{n} : STRUCT a : T{next}; END_STRUCT END_TYPE\n", "TYPE T{n} : STRUCT a : INT; END_STRUCT END_TYPE\n"),
    ("TYPE T{n} : ARRAY [0..0] OF T{next}; END_TYPE\n", "TYPE T{n} : ARRAY [0..0] OF INT; END_TYPE\n"),
    ("TYPE T{n} : REF_TO T{next}; END_TYPE\n", "TYPE T{n} : REF_TO INT; END_TYPE\n"),
    ("FUNCTION_BLOCK T{n} VAR a : T{next}; END_VAR a(); END_FUNCTION_BLOCK\n", "FUNCTION_BLOCK T{n} END_FUNCTION_BLOCK\n"),
))  # fmt: skip
def test_types_are_in_one_another_up_to_a_depth(link: str, last: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(size_limits, "DEEPEST_TYPE", 30)
    inner_first = "".join(_chain(link, last).splitlines(keepends=True)[:-31:-1])
    program = "PROGRAM Main VAR x : T{}; END_VAR ; END_PROGRAM"
    assert compile_text(inner_first + program.format(LENGTH - 28)).image is not None, "29, and the program's instance"
    deeper = link.format(n=LENGTH - 30, next=LENGTH - 29)
    assert [each.code for each in compile_text(inner_first + deeper + program.format(LENGTH)).errors] == ["S0106"]
