"""What compiling costs, and what it leaves behind in the process: limits as they were, no garbage that piles up."""

from __future__ import annotations

import gc
import sys
import tracemalloc

import pytest

from fbvm.code.compiler import compile_text

TEXT = "PROGRAM Main\nVAR a : INT; END_VAR\na := a + 1;\nEND_PROGRAM\n"


def test_the_collector_and_the_limits_are_as_before() -> None:
    frames = sys.getrecursionlimit()
    assert compile_text(TEXT).image is not None
    assert gc.isenabled() and sys.getrecursionlimit() == frames


@pytest.mark.slow
def test_what_compilations_leave_is_collected_in_passing() -> None:
    counts = []
    for _ in range(4):
        for _ in range(8):
            compile_text(TEXT)
        counts.append(len(gc.get_objects()))
    assert counts[-1] < counts[0] + 20_000


def test_calls_that_mean_more_operators_than_an_expression_may_have_are_refused() -> None:
    inside, refused = "ADD(" + ", ".join(["a"] * 900) + ")", "the expression is more than 1000 operators deep"
    for meant in (f"ADD({inside}, {', '.join(['a'] * 200)})", f"ADD({', '.join(['a'] * 9000)})"):
        [error] = compile_text(TEXT.replace("a + 1", meant)).errors
        assert (error.code, error.message) == ("S0106", refused)
    assert compile_text(TEXT.replace("a + 1", inside)).image is not None


@pytest.mark.slow
def test_functions_that_call_the_next_twice_are_looked_at_once() -> None:
    text = "".join(f"FUNCTION F{n} : INT\nVAR_INPUT a : INT; END_VAR\nF{n} := F{n + 1}(a) + F{n + 1}(a);\nEND_FUNCTION\n"
                   for n in range(60))
    text += "FUNCTION F60 : INT\nVAR_INPUT a : INT; END_VAR\nF60 := a;\nEND_FUNCTION\nPROGRAM Main\nF0(1);\nEND_PROGRAM\n"
    assert [d.code for d in compile_text(text).diagnostics] == ["S0491"], "2 ** 60 ways through them"


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_heap")
def test_what_a_compilation_leaves_does_not_wait_for_the_collector() -> None:
    def left(statements: int) -> int:
        gc.collect()
        compile_text(TEXT.replace("a := a + 1;\n", "a := a + 1;\n" * statements))
        return gc.collect()

    left(1)  # what is made once
    assert min(left(400) for _ in range(3)) < left(1) + 100, "other threads leave garbage, too"


BIG = "ARRAY [0..2_000_000] OF LINT"
DOUBLED = {
    "structures": [f"TYPE S0 : STRUCT x : {BIG}; END_STRUCT END_TYPE",
                   *(f"TYPE S{n} : STRUCT a, b : S{n - 1}; END_STRUCT END_TYPE" for n in range(1, 60))],
    "blocks": [f"FUNCTION_BLOCK S0 VAR x : {BIG}; END_VAR END_FUNCTION_BLOCK",
               *(f"FUNCTION_BLOCK S{n} VAR a, b : S{n - 1}; END_VAR a(); b(); END_FUNCTION_BLOCK" for n in range(1, 60))],
    "globals": [f"TYPE S59 : {BIG}; END_TYPE VAR_GLOBAL", *(f"g{n} : S59;" for n in range(1000)), "END_VAR"],
    "arrays": ["TYPE S59 : INT; END_TYPE VAR_GLOBAL", *(f"g{n} : {BIG};" for n in range(1000)), "END_VAR"],
}


@pytest.mark.slow
@pytest.mark.parametrize("what", DOUBLED)
def test_what_no_memory_holds_is_refused_before_bytes_are_made_of_it(what: str) -> None:
    tracemalloc.start()
    try:
        made = compile_text("\n".join([*DOUBLED[what], "PROGRAM Main VAR s : S59; END_VAR END_PROGRAM"]), lint=False)
        assert tracemalloc.get_traced_memory()[1] < 400 << 20
    finally:
        tracemalloc.stop()
    assert made.image is None
    assert {diagnostic.code for diagnostic in made.diagnostics} == {"S0603"}


def _calls(text: str) -> int:
    """How many functions of Python are called to compile a text without an error."""
    calls = 0

    def count(frame: object, event: str, argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    sys.setprofile(count)
    try:
        made = compile_text(text)
    finally:
        sys.setprofile(None)
    assert made.image is not None
    return calls


@pytest.mark.slow
def test_instances_in_instances_are_looked_through_once_a_type() -> None:
    """Each of 16 blocks has two of the block before it: 65,536 instances, and 16 types."""
    blocks = ["FUNCTION_BLOCK S0 VAR x : BOOL; END_VAR END_FUNCTION_BLOCK"]
    blocks += [f"FUNCTION_BLOCK S{n} VAR a, b : S{n - 1}; END_VAR a(); b(); END_FUNCTION_BLOCK" for n in range(1, 17)]
    assert _calls("\n".join([*blocks, "PROGRAM Main VAR s : S16; END_VAR s(); END_PROGRAM"])) < 60_000


@pytest.mark.slow
def test_labels_are_compared_with_their_neighbours() -> None:
    def calls(labels: int) -> int:
        branches = "".join(f"{7 * n % labels * 3}, {7 * n % labels * 3 + 1}: n := {n};\n" for n in range(labels))
        return _calls(f"PROGRAM Main\nVAR i, n : DINT; END_VAR\nCASE i OF\n{branches}END_CASE\nEND_PROGRAM")

    assert calls(400) < 2.5 * calls(200)
