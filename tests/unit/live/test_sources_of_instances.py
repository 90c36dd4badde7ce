"""The program panel: which lines of which file are the source of an instance, and which single values stand on each."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import pytest
from rows import each_of

from fbvm.base.areas import AREAS
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.live.program import MOST_INSTANCES, MOST_ON_LINE, instances, source_of
from fbvm.watch.paths import UnknownPlace

FILE = "text.st"
BLOCK = "FUNCTION_BLOCK B\nVAR x : INT; END_VAR\nx := x + 1;\nEND_FUNCTION_BLOCK\n"


@cache
def image_of(text: str) -> Image:
    image = compile_text(text).image
    assert image is not None
    return image


def found(image: Image, texts: Mapping[str, str], instance: str) -> tuple[dict[str, Any], int]:
    """The source, and in how many steps it was found."""
    steps, count = source_of(image, AREAS, texts, instance), 1
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return ended.value, count
        count += 1


def source(text: str, instance: str = "Main") -> dict[str, Any]:
    image = image_of(text)
    return found(image, {FILE: text}, instance)[0]


@each_of("before, written, behind, instance", [
    # a line for each part, and all on one line
    ("", "PROGRAM Main\nVAR n : INT; END_VAR\nn := 1;\nEND_PROGRAM", "\n", "Main"),
    ("", "PROGRAM Main VAR n : INT; END_VAR n := 1; END_PROGRAM", "", "Main"),
    ("// one\n\n", "  program main var n : int; end_var\n\n n := 1;\n\n\n\n\n end_program // yes", "\n// two\n", "Main"),
    ("", "PROGRAM Main\nVAR n : INT; END_VAR\nEND_PROGRAM", "\n", "Main"),
    # between others
    ("FUNCTION F : INT F := 1;\nEND_FUNCTION\n", "PROGRAM Main\nVAR n : INT; END_VAR\nn := n + 1; END_PROGRAM", "", "Main"),
    (BLOCK, "PROGRAM Main\nVAR n : INT; b : B; END_VAR\nn := 1; END_PROGRAM", f"\n{BLOCK.replace(' B', ' C')}", "Main"),
    ("PROGRAM Main\nVAR b : B; END_VAR\nb();\nEND_PROGRAM\n", BLOCK.rstrip("\n"), "\n\n", "Main.b"),
    ("FUNCTION_BLOCK B2 VAR x : INT; END_VAR x := 1;\nEND_FUNCTION_BLOCK\n", BLOCK.rstrip("\n"),
     "\nPROGRAM Main VAR b : B; END_VAR b(); END_PROGRAM\n", "Main.b"),
    # what only looks like an end or a beginning
    ("", "PROGRAM Main\nVAR n : INT; END_VAR\nn := LEN('END_PROGRAM'); // END_PROGRAM\n(* END_PROGRAM *)\nEND_PROGRAM",
     "\n", "Main"),
    ("", "PROGRAM Main\nVAR Mainly : INT; END_VAR\nMainly := 1;\nEND_PROGRAM", "\n", "Main"),
    # methods stand in the text of their block
    ("", "FUNCTION_BLOCK B\nVAR x : INT; END_VAR\nMETHOD M : INT\nx := 2;\nEND_METHOD\nx := 1;\nEND_FUNCTION_BLOCK",
     "\nPROGRAM Main VAR b : B; END_VAR b(); b.M(); END_PROGRAM", "Main.b"),
])
def test_the_source_of_an_instance_is_its_lines_from_the_head_to_the_end(
        before: str, written: str, behind: str, instance: str) -> None:
    seen = source(before + written + behind, instance)
    assert "\n".join(line["text"] for line in seen["lines"]) == written
    assert (seen["first"], seen["drawn"]) == (before.count("\n") + 1, False)


@each_of("line, names", [
    ("n := m + n;", "Main.n Main.m"), ("N := n + main.M;", "Main.N main.M"),
    ("n := list[2] + list[n] + list[ 3 ] + list[0];", "Main.n Main.list[2] Main.list[3]"),
    ("n := p.x + p . y;", "Main.n Main.p.x Main.p.y"), ("p := q; t(IN := b);", "Main.b"), ("b := t.Q;", "Main.b Main.t.Q"),
    ("b := n = 1 // m", "Main.b Main.n"), ("b := 'm$'m' = \"m$\"m\" (* m *) AND b;", "Main.b"), ("n := shared;", "Main.n shared"),
    ("n := D5 + WORD_TO_INT(%IW0);", "Main.n D5"), ("", ""), ("END_VAR", ""), ("n := Missing.Name;", "Main.n"),
    ("n := v1 + v2 + v3 + v4 + v5 + v6 + v7 + v8 + v9;", "Main.n Main.v1 Main.v2 Main.v3 Main.v4 Main.v5 Main.v6 Main.v7"),
])
def test_each_line_names_the_single_values_on_it(line: str, names: str) -> None:
    image = image_of("""TYPE P : STRUCT x, y : INT; END_STRUCT; END_TYPE
VAR_GLOBAL shared : INT; END_VAR
PROGRAM Main
VAR n, m, v1, v2, v3, v4, v5, v6, v7, v8, v9 : INT; b : BOOL; list : ARRAY[1..3] OF INT; p, q : P; t : TON; END_VAR
n := 1;
END_PROGRAM""")
    text = f"\n\nPROGRAM Main\n\n{line}\nEND_PROGRAM"
    seen, _ = found(image, {FILE: text}, "Main")
    assert seen["lines"][2] == {"text": line, "names": names.split()} and len(names.split()) <= MOST_ON_LINE


def test_a_block_of_a_library_has_no_source_and_a_variable_is_no_instance() -> None:
    image = image_of("PROGRAM Main VAR t : TON; n : INT; END_VAR t(); n := 1; END_PROGRAM")
    assert found(image, {FILE: "PROGRAM Main"}, "main.T")[0] == {
        "file": "", "first": 1, "lines": [], "drawn": False, "pou": "TON"}
    assert found(image, {}, "Main")[0] == {"file": "", "first": 1, "lines": [], "drawn": False, "pou": "Main"}
    for name in ("Main.n", "D5", "D5..D7"):
        with pytest.raises(UnknownPlace, match=f"^{name} is no instance of a program or a function block$"):
            found(image, {}, name)


@pytest.mark.slow
def test_a_source_with_rungs_is_told_to_be_drawn() -> None:
    text = "PROGRAM Main\nVAR a : BOOL; b : B; END_VAR\nLADDER\nRUNG 1\nLD a\nOUT a\nEND_LADDER\nb();\nEND_PROGRAM\n" + BLOCK
    assert (source(text)["drawn"], source(text, "Main.b")["drawn"]) == (True, False)


def test_a_text_that_is_shorter_than_the_program_is_shown_to_its_end() -> None:
    image = image_of("PROGRAM Main\nVAR n : INT; END_VAR\nn := 1;\nn := 2;\nn := 3;\nn := 4;\nEND_PROGRAM")
    seen, _ = found(image, {FILE: "PROGRAM Main\nVAR END_VAR"}, "Main")
    assert (seen["first"], [line["text"] for line in seen["lines"]]) == (1, ["PROGRAM Main", "VAR END_VAR"])
    open_end, _ = found(image, {FILE: "PROGRAM Main\n" + "x\n" * 20}, "Main")
    assert len(open_end["lines"]) == 9, "three lines behind the last statement"
    headless, _ = found(image, {FILE: "x\n" * 9 + "PROGRAM Main"}, "Main")
    assert (headless["first"], len(headless["lines"])) == (1, 9)


@pytest.mark.slow
def test_instances_are_listed_where_their_bodies_are_and_up_to_a_bound() -> None:
    text = "PROGRAM Main VAR b : B; both : ARRAY[1..2] OF B; far : ARRAY[5..200] OF B; e : Empty; END_VAR b(); END_PROGRAM\n" \
           "FUNCTION_BLOCK Empty VAR inner : B; END_VAR END_FUNCTION_BLOCK\n" + BLOCK
    assert instances(image_of(text)) == [
        {"path": path, "pou": pou} for path, pou in (
            ("Main", "Main"), ("Main.b", "B"), ("Main.e", "Empty"), ("Main.both[1]", "B"), ("Main.both[2]", "B"),
            *((f"Main.far[{number}]", "B") for number in range(5, 105)), ("Main.e.inner", "B"))]
    names = ", ".join(f"a{number}" for number in range(MOST_INSTANCES // 100 + 1))
    many = image_of(f"PROGRAM Main VAR {names} : ARRAY[0..99] OF B; END_VAR a0[0](); END_PROGRAM\n{BLOCK}")
    assert len(instances(many)) == MOST_INSTANCES
