"""What the compiler does beside compiling: limits that it lifts and sets again, what it keeps of a program and what it cannot."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import LONG, compile_text, passes
from fbvm.code.pictures import st_rungs
from fbvm.code.store import encoding, object_code
from fbvm.syntax import tree
from fbvm.syntax.ladder.drawing.diagram import Undrawable

# --- limits -------------------------------------------------------------------------------------------------------------


@each_of("length, collects, frozen", [
    (LONG, True, ["freeze", "unfreeze"]), (LONG - 1, True, []), (LONG, False, []),
])  # fmt: skip
def test_only_what_a_long_text_leaves_is_made_old(length: int, collects: bool, frozen: list[str]) -> None:
    done: list[str] = []
    limit = sys.getrecursionlimit()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("freeze", "unfreeze"):
            patch.setattr(gc, name, lambda name=name: done.append(name))
        patch.setattr(gc, "get_freeze_count", lambda: 0)
        was = gc.isenabled()
        (gc.enable if collects else gc.disable)()
        try:
            with passes.deep([Source("a.st", " " * (length - 3)), Source("b.st", "   ")]):
                assert (gc.isenabled(), sys.getrecursionlimit()) == (False, max(limit, 20_000))
            assert gc.isenabled() is collects
        finally:
            (gc.enable if was else gc.disable)()
    assert (done, sys.getrecursionlimit()) == (frozen, limit)


def test_what_is_frozen_already_stays_so() -> None:
    done: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gc, "freeze", lambda: done.append("freeze"))
        patch.setattr(gc, "get_freeze_count", lambda: 1)
        with passes.deep([Source("a.st", " " * LONG)]):
            pass
    assert (done, gc.isenabled()) == ([], True)


def test_an_image_holds_plain_data_alone() -> None:
    assert encoding._plain(b"\xff\x00") == {"bytes": "\xff\x00"}
    with pytest.raises(TypeError, match="3j is no part of an image"):
        encoding._plain(3j)


# --- rungs --------------------------------------------------------------------------------------------------------------


@each_of("body, what", [("c := b.n > 0;", "this assignment"), ("IF c THEN c := FALSE; END_IF", "IF")])
def test_what_no_drawing_shows_is_named(body: str, what: str) -> None:
    def refuse(steps: object) -> None:
        raise Undrawable

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(st_rungs, "diagram", refuse)
        image = compile_text(f"PROGRAM Main VAR b : STRUCT n : INT; END_STRUCT; c : BOOL; END_VAR\n{body}\nEND_PROGRAM",
                             drawn=True, lint=False).image  # fmt: skip
    assert image is not None
    assert [(rung.steps, what in rung.comment) for rung in image.rungs] == [((), True)]


# --- object code ----------------------------------------------------------------------------------------------------------


def block() -> Any:
    """A block that no program has."""
    name = tree.Name(0, 1, "B")
    source = Source("B.st", "B")
    return SimpleNamespace(name="B", source=source, tree=SimpleNamespace(name=name), block=None, kind="FUNCTION_BLOCK", key="B")


PROGRAM = Callable[[Any], object]


@each_of("asked", cast(list[PROGRAM], [
    lambda program: program.candidates(block()), lambda program: list(program.references_in(None, b"")),
    lambda program: program.rungs, lambda program: program.number(block()), lambda program: program.frame(block()),
    lambda program: program.origin(SimpleNamespace(place="abs", owner=None, source=block().source, name="x")),
    lambda program: program.origin(SimpleNamespace(place="frame", owner=None, source=block().source, name="x")),
    lambda program: program.origin(SimpleNamespace(place="area", owner=None, source=block().source, name="x", location=None)),
]))  # fmt: skip
def test_what_no_symbol_says_is_lowered_with_its_program(asked: PROGRAM) -> None:
    checker: Any = SimpleNamespace(project=SimpleNamespace(globals={}, pous={}))
    with pytest.raises(object_code._NotRelocatable):
        asked(object_code._RelocatableProgram(checker))
