"""Programs made at random do the same on every engine and in a tree walker: a slice of what `st_programs.py` compares."""

from __future__ import annotations

import pytest
import st_oracle
import st_programs
from depth import times
from hand_image import operations_in
from st_kinds import Pou, Program, Variable
from st_programs import difference, made, report
from st_text import text_of

from fbvm.code.compiler import compile_text
from fbvm.code.operations import EXPRESSIONS, STATEMENTS

NEVER_MADE = {"bit_behind", "enum_text", "reverse", "count", "mark", "raise"}
"""Of bits of in-outs of type ANY, enumerations, byte order, counters, power and codes that a program raises, which TwinCAT alone
has: other tests compare engines on them, those of random code on `raise`."""


V0, V1 = ("name", "INT", "v0"), ("name", "INT", "v1")
BODY = (
    ("assign", 1, V1, ("literal", "INT", 7)),
    ("if", 2, ((("compare", "BOOL", ">", ("get", "INT", V1), ("literal", "INT", 3)), (
        ("assign", 3, V1, ("binary", "INT", "+", ("get", "INT", V1), ("literal", "INT", 1))),
        ("assign", 4, V0, ("binary", "INT", "MOD", ("unary", "INT", "-", ("get", "INT", V1)), ("literal", "INT", 3))),
    )),), ()),
    ("assign", 5, V1, ("literal", "INT", 0)),
)  # fmt: skip
VARIABLES = (Variable("VAR", "v0", "INT", "INT", 5), Variable("VAR", "v1", "INT", "INT"))
WITH_MOD = Program((), (Pou("PROGRAM", "Main", "", VARIABLES, BODY),))
"""Whose text without all that does not matter is a few lines."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(times(10, 100)))
def test_every_engine_and_the_tree_walker_agree(seed: int) -> None:
    assert report(seed) == ""


@pytest.mark.slow
def test_programs_have_what_the_language_has() -> None:
    made_operations: set[str] = set()
    for seed in range(120):
        dialect = {4: "rusty", 5: "codesys"}.get(seed % 6, "standard")  # some operations are other compilers' answers
        image = compile_text(text_of(made(seed))[0], dialect=dialect).image
        if image:
            for body in image.bodies:
                made_operations |= operations_in(body.code)
    assert made_operations >= {*EXPRESSIONS, *STATEMENTS} - NEVER_MADE


@pytest.mark.slow
def test_as_a_rule_programs_are_compiled_and_run_to_their_end() -> None:
    images = [compile_text(text_of(made(seed))[0]).image for seed in range(40)]
    assert sum(image is not None for image in images) > 30


@pytest.mark.slow
def test_a_difference_is_made_small_and_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the tree walker took MOD for a modulus that is never negative."""
    monkeypatch.setattr(st_programs, "BUILDS", {"python plain": st_programs.BUILDS["python plain"]})
    right = st_oracle.binary

    def wrong(kind: str, sign: str, a: int, b: int) -> object:
        return a % b if sign == "MOD" else right(kind, sign, a, b)

    monkeypatch.setattr(st_oracle, "binary", wrong)
    monkeypatch.setattr(st_programs, "made", lambda seed: WITH_MOD)
    assert report(7) == """\
seed 7: tree walker: Main.v0 is 2 where the PLC has -1, scan 0
PROGRAM Main
VAR
  v0 : INT;
END_VAR
  v0 := -INT#1 MOD INT#3;
END_PROGRAM
"""


def test_a_program_that_is_refused_is_no_agreement() -> None:
    program = made(1)
    broken = Program(program.structs, (*program.pous, program.pous[-1]))
    assert difference(broken).startswith("refused ")
